"""Files in stores: those that put objects whole, and those that have to move them; paths of this machine stay paths."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from mracad.errors import FileError, UsageError
from mracad.output import put_all
from mracad.store import Url, location, read

fsspec = pytest.importorskip("fsspec")
from fsspec.implementations.memory import MemoryFileSystem  # noqa: E402


class Shed(MemoryFileSystem):
    """A file system that is no object store."""

    protocol = "shed"
    store: dict[str, Any] = {}  # noqa: RUF012
    pseudo_dirs = [""]  # noqa: RUF012
    stuck = False

    def mv(self, path1: str, path2: str, **how: Any) -> None:
        if self.stuck:
            raise OSError("the door is stuck")
        super().mv(path1, path2, **how)


@pytest.fixture
def memory() -> Iterator[dict[str, Any]]:
    """What is in memory, which is empty before and after."""
    MemoryFileSystem.store.clear()
    yield MemoryFileSystem.store
    MemoryFileSystem.store.clear()


def test_what_is_a_url_and_what_a_path(tmp_path):
    assert location("s3://bucket/in/a.step") == Url("s3://bucket/in/a.step")
    for path in ("a.step", "C:/a.step", "/in/a:b.step", "s3:/bucket"):
        assert location(path) == Path(path)
    assert location(f"file://{tmp_path}/a%20b.step") == tmp_path / "a b.step"
    assert location("a.step", Url("s3://bucket/out/")) == Url("s3://bucket/out/a.step")
    assert location("gs://other/a.step", tmp_path) == Url("gs://other/a.step")
    url = Url("https://host/in/a%20b.STEP?version=2")
    assert (url.name, url.stem, url.suffix) == ("a b.STEP", "a b", ".STEP")


def test_folders_and_patterns_are_listed_with_places(memory):
    for name in ("a.step", "b.stp", "deep/er/c.step"):
        Url(f"memory://in/{name}").write_bytes(name.encode())
    found = Url("memory://in").files()
    assert list(found) == ["a.step", "b.stp", "deep/er/c.step"]
    assert [read(str(url)) for url in found.values()] == [b"a.step", b"b.stp", b"deep/er/c.step"]
    assert list(Url("memory://in/*.step").files()) == ["a.step"]
    assert list(Url("memory://in/**/*.step").files()) == ["a.step", "deep/er/c.step"]
    assert Url("memory://in/deep").is_dir() and not Url("memory://in/a.step").is_dir()
    assert Url("memory://in/a.step").exists() and not Url("memory://in/z.step").exists()


def test_outputs_appear_whole_or_not_at_all(tmp_path):
    """A store that cannot move the second file keeps what it had, and no file beside it is written."""
    fsspec.register_implementation("shed", Shed, clobber=True)
    Shed.store.clear()
    put_all({"shed://out/a.step": b"first", str(tmp_path / "b.step"): b"first"})
    assert read("shed://out/a.step") == b"first" and (tmp_path / "b.step").read_bytes() == b"first"
    Shed.stuck = True
    with pytest.raises(FileError, match=r"cannot write 'shed://out/a\.step': the door is stuck"):
        put_all({str(tmp_path / "b.step"): b"second", "shed://out/a.step": b"second"})
    Shed.stuck = False
    assert [Path(name).name for name in Shed.store] == ["a.step"] and read("shed://out/a.step") == b"first"
    assert [path.name for path in tmp_path.iterdir()] == ["b.step"]
    assert (tmp_path / "b.step").read_bytes() == b"first"


def test_faults_are_told_in_one_line(memory):
    with pytest.raises(FileError, match=r"^cannot read 'memory://in/a\.step': there is no such file"):
        read("memory://in/a.step")
    with pytest.raises(UsageError, match=r"no store is called foo; give a path, or a URL such as s3://"):
        read("foo://in/a.step")
    with pytest.raises(UsageError, match=r"a package for sftp:// is not installed; .*paramiko"):
        read("sftp://in/a.step")
    with pytest.raises(FileError, match="for reading only; write to s3://"):
        Url("https://localhost/a.step").check()


def test_commands_read_and_write_urls(mracad, samples, memory, tmp_path):
    Url("memory://in/panel.step").write_bytes((samples / "panel.step").read_bytes())
    words = ("convert", "memory://in/panel.step", "-o", "memory://out/panel.brep")
    result = mracad(*words)
    assert result.code == 0 and "wrote panel.brep" in result.out, result.err
    assert mracad("convert", str(samples / "panel.step"), "-o", str(tmp_path / "panel.brep")).code == 0
    assert read("memory://out/panel.brep") == (tmp_path / "panel.brep").read_bytes()
    again = mracad(*words)
    assert again.code == 2 and again.err == "mracad: memory://out/panel.brep exists; give --overwrite to replace it\n"
    edit = (
        "offset",
        "memory://in/panel.step",
        "--distance",
        "1mm",
        "-o",
        "memory://out/b.step",
        "--depfile",
        str(tmp_path / "d"),
    )
    refused = mracad(*edit)
    assert refused.code == 2 and "depfile: make cannot see memory://in/panel.step" in refused.err
    assert mracad("man", "memory://man").code == 0 and Url("memory://man/mracad-smooth.1").exists()
    missing = mracad("info", "memory://in/other.step")
    assert missing.code == 3 and missing.err.count("\n") == 1 and "there is no such file" in missing.err
