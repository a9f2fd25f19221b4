"""Machine code on disk: made once, loaded without a compiler, and made again where it is stale or damaged."""

import os
import subprocess
import sys
from pathlib import Path
from threading import Thread

import numpy as np
import pytest

from mracad import flat, note, warm
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


def test_only_one_process_compiles_and_the_others_wait_for_it(folder, monkeypatch, tmp_path):
    fcntl = pytest.importorskip("fcntl")
    (file,) = folder.rglob("*.o")
    monkeypatch.setattr(sys, "pycache_prefix", str(tmp_path))
    monkeypatch.setattr(Compiled, "_compiled", None)
    waiting = made()
    assert not waiting.ready
    other = os.open(Path(__file__).parent, os.O_RDONLY)
    fcntl.flock(other, fcntl.LOCK_EX)
    thread = Thread(target=waiting.prepare)
    thread.start()
    thread.join(0.1)
    assert thread.is_alive()
    copy = tmp_path / file.relative_to(folder)
    copy.parent.mkdir(parents=True)
    copy.write_bytes(file.read_bytes())
    os.close(other)
    thread.join(10)
    assert waiting.ready and waiting._loaded


@pytest.mark.skipif(not flat.processor(), reason="code in one piece is for Linux on x86-64")
def test_the_compilers_library_is_not_loaded_for_code_in_one_piece(folder):
    code = f"""
import sys
import numpy as np
sys.pycache_prefix = {str(folder)!r}
from tests.test_compiled import made
before, after = np.arange(5.0), np.zeros(5)
made()(5, before.ctypes.data, after.ctypes.data, 1.5)
assert after.tolist() == [0.0, 3.0, 6.0, 9.0, 12.0]
assert "llvmlite" not in sys.modules
"""
    subprocess.run([sys.executable, "-c", code], cwd=Path(__file__).parent.parent, check=True)


def test_arrays_are_used_where_the_system_lets_no_new_code_run(folder, monkeypatch):
    def refused(code):
        raise PermissionError(13, "cannot run new code")

    monkeypatch.setattr(sys, "pycache_prefix", str(folder))
    monkeypatch.setattr(Compiled, "_load", lambda self, code: refused(code))
    sweep = made()
    assert sweep.ready and not sweep.allowed
    assert not sweep.pays(1)


@pytest.fixture(scope="module")
def outward():
    """A function that calls one of the system, so that its code cannot lie just anywhere."""

    def powers(count, pointer, exponent):
        for i in range(count):
            pointer[i] = pointer[i] ** exponent

    return Compiled(powers, (("int64",), ("float64*",), ("float64",)))


def test_code_that_calls_the_system_is_loaded_by_the_compilers_library(outward):
    code, numbers = outward._compiled(), np.arange(5.0)
    assert not flat.is_flat(code)
    outward._load(code)(5, numbers.ctypes.data, 3.0)
    assert numbers.tolist() == [0.0, 1.0, 8.0, 27.0, 64.0]


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


@pytest.mark.skipif(not flat.processor(), reason="code in one piece is for Linux on x86-64")
def test_all_code_is_in_one_piece():
    """Where the compiler makes a loop a call of the system's library, its own would be loaded: 45 MB and 50 ms."""
    assert [code for code in warm.CODE if not flat.is_flat(code._found or code._made())] == []
