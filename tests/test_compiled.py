"""Machine code on disk: made once, loaded without a compiler, and made again where it is stale or damaged."""

import sys

import numpy as np
import pytest

from mracad import note
from mracad.compiled import Compiled


def doubled(count, pointers, scale):
    for i in range(count):
        pointers[1][i] = twice(pointers[0][i]) * scale


def twice(x):
    return inner(x) + x


def inner(x):
    return 1.0 * x


def made(arguments=(("int64",), ("float64*", "float64*"), ("float64",))):
    return Compiled(doubled, arguments, [twice], [inner])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with the machine code of a function, and of nothing else."""
    found = tmp_path_factory.mktemp("bytecode")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "pycache_prefix", str(found))
        assert not made().ready
        made().prepare()
    return found


def test_it_is_compiled_once(folder, monkeypatch):
    monkeypatch.setattr(sys, "pycache_prefix", str(folder))
    monkeypatch.setattr(Compiled, "_compiled", None)
    again, before, after = made(), np.arange(5.0), np.zeros(5)
    assert again.ready
    again(5, before.ctypes.data, after.ctypes.data, 1.5)
    assert after.tolist() == [0.0, 3.0, 6.0, 9.0, 12.0]


def test_what_is_stale_or_damaged_is_not_used(folder, monkeypatch):
    monkeypatch.setattr(sys, "pycache_prefix", str(folder))
    assert not made((("int64",), ("float32*", "float32*"), ("float64",))).ready
    (file,) = folder.rglob("*.o")
    data = file.read_bytes()
    for damaged in (data[:-1], data[:100] + b"?" + data[101:], b""):
        file.write_bytes(damaged)
        assert not made().ready
    file.write_bytes(data)
    assert made().ready


def test_it_is_in_the_users_cache_where_it_cannot_be_beside_its_module(folder, monkeypatch, tmp_path):
    (file,) = folder.rglob("*.o")
    code = file.read_bytes()[32:-32]
    (tmp_path / "file").write_bytes(b"")
    monkeypatch.setattr(sys, "pycache_prefix", str(tmp_path / "file"))
    monkeypatch.setenv("MRACAD_CACHE", str(tmp_path / "kept"))
    monkeypatch.setattr(Compiled, "_compiled", lambda self: code)
    assert not made().ready
    made().prepare()
    monkeypatch.setattr(Compiled, "_compiled", None)
    assert made().ready and len(list((tmp_path / "kept").iterdir())) == 1


@pytest.fixture
def stages():
    """The stages that are told meanwhile."""
    found = []

    def watcher(stage, subject):
        found.append(stage)

    note.watch(watcher)
    yield found
    note.unwatch(watcher)


def test_compiling_is_told_and_loading_is_not(folder, monkeypatch, tmp_path, stages):
    (file,) = folder.rglob("*.o")
    code = file.read_bytes()[32:-32]
    monkeypatch.setattr(Compiled, "_compiled", lambda self: code)
    monkeypatch.setattr(sys, "pycache_prefix", str(folder))
    made().prepare()
    assert stages == []
    monkeypatch.setattr(sys, "pycache_prefix", str(tmp_path))
    made().prepare()
    assert stages == [note.COMPILING]


def test_what_numba_compiles_is_told(stages):
    from numba import njit

    from mracad.bspline import sweeps

    assert sweeps.njit is njit
    njit("int64(int64)")(lambda x: x)
    assert stages and set(stages) == {note.COMPILING}
