"""Documents from the cache: the same to the last bit, and never another file's."""

import shutil
from dataclasses import fields

import pytest

from mracad import cache, memo
from mracad.errors import FileError
from mracad.occ.document import Document
from mracad.occ.files import read, write
from mracad.occ.step import read_step
from tests.conftest import SAMPLES


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.setenv("MRACAD_CACHE", str(tmp_path / "kept in ü"))


@pytest.fixture
def reads(monkeypatch):
    """How often the kernel has read a file."""
    memo.clear()
    done = []
    monkeypatch.setattr("mracad.occ.step.read_step", lambda *given: done.append(1) or read_step(*given))
    return done


def written(document, path):
    write(document, path)
    return path.read_bytes()


def test_a_second_read_gives_the_same_document_and_bytes(refined_file, reads, tmp_path, monkeypatch):
    monkeypatch.setenv("MRACAD_CACHE", "off")
    without = read(refined_file)
    monkeypatch.setenv("MRACAD_CACHE", str(tmp_path / "kept in ü"))
    first, second = read(refined_file), read(refined_file)
    assert len(reads) == 2 and cache.size()[0] == 1
    for each in (first, second):
        for field in fields(Document)[1:]:
            assert getattr(each, field.name) == getattr(without, field.name), field.name
    expected = written(without, tmp_path / "out.step")
    assert written(first, tmp_path / "out.step") == expected
    assert written(second, tmp_path / "out.step") == expected


def test_without_a_cache_an_input_is_healed_once_until_the_next_file(reads, tmp_path, monkeypatch):
    monkeypatch.setenv("MRACAD_CACHE", "off")
    first, second = (written(read(SAMPLES / "trimmed.step"), tmp_path / "out.step") for _ in range(2))
    assert first == second and len(reads) == 1
    memo.clear()
    assert written(read(SAMPLES / "trimmed.step"), tmp_path / "out.step") == first and len(reads) == 2
    assert not cache.size()[0]


def test_names_colours_and_instances_come_from_the_cache(reads, tmp_path):
    raw, cached = read_step(SAMPLES / "assembly.step"), [read(SAMPLES / "assembly.step") for _ in range(2)][1]
    assert len(reads) == 1
    for one, other in zip(raw.parts, cached.parts, strict=True):
        assert (one.product, one.colour, one.face_colours) == (other.product, other.colour, other.face_colours)
        assert len(one.placements) == len(other.placements)


def test_what_was_asked_for_is_part_of_the_key(reads, tmp_path):
    read(SAMPLES / "panel.step")
    assert read(SAMPLES / "panel.step", "in").units != read(SAMPLES / "panel.step").units
    shutil.copy(SAMPLES / "panel.step", tmp_path / "other.step")
    assert read(tmp_path / "other.step").name == "other.step"
    assert len(reads) == 3


def test_an_entry_that_the_kernel_cannot_open_is_read_anew(reads):
    read(SAMPLES / "panel.step")
    entry = next(cache.folder().iterdir())
    entry.write_bytes(cache.sealed(entry.read_bytes()[:20000] + bytes(300)))
    assert read(SAMPLES / "panel.step").faces
    assert len(reads) == 2
    assert read(SAMPLES / "panel.step").faces
    assert len(reads) == 2


def test_bad_files_are_not_kept(tmp_path):
    (tmp_path / "bad.step").write_bytes((SAMPLES / "panel.step").read_bytes()[:5000])
    with pytest.raises(FileError):
        read(tmp_path / "bad.step")
    assert cache.size() == (0, 0)
