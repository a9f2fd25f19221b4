"""The cache on disk: where it is, what it keeps, and what it does with damage."""

import pytest

from mracad import cache


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.setenv("MRACAD_CACHE", str(tmp_path / "kept"))
    return tmp_path / "kept"


def test_an_entry_is_found_until_it_is_damaged(here):
    cache.keep("one", cache.sealed(b"content"))
    assert cache.find("one").read_bytes()[: -cache.SEAL] == b"content"
    assert cache.size() == (1, 7 + cache.SEAL)
    for damaged in (b"cOntent" + (here / "one").read_bytes()[7:], b"content", b""):
        (here / "one").write_bytes(damaged)
        assert cache.find("one") is None
        assert not (here / "one").exists()


def test_the_least_recently_used_entries_go_first(here, monkeypatch):
    monkeypatch.setattr("mracad.cache.BOUND", 1000)
    import os

    for number in range(4):
        cache.keep(str(number), cache.sealed(bytes(64)))
        os.utime(here / str(number), (number, number))
    assert cache.find("0")
    monkeypatch.setattr("mracad.cache.BOUND", 3 * (64 + cache.SEAL))
    cache.keep("small", cache.sealed(b""))
    assert sorted(path.name for path in here.iterdir()) == ["0", "3", "small"]
    cache.keep("large", cache.sealed(bytes(64)))
    assert cache.find("large") is None


def test_a_cache_that_cannot_be_written_does_no_harm(tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    monkeypatch.setenv("MRACAD_CACHE", str(tmp_path / "file"))
    cache.keep("one", cache.sealed(b"content"))
    assert cache.find("one") is None and cache.size() == (0, 0)


@pytest.mark.parametrize(
    ("variables", "expected"),
    [
        ({"MRACAD_CACHE": "off"}, None),
        ({"MRACAD_CACHE": "/there"}, "/there"),
        ({"CI": "true"}, None),
        ({"CI": "true", "MRACAD_CACHE": "/there"}, "/there"),
        ({"XDG_CACHE_HOME": "/mine"}, "/mine/mracad"),
    ],
)
def test_its_folder(variables, expected, monkeypatch):
    for name in ("MRACAD_CACHE", "CI", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    found = cache.folder()
    assert (found and found.as_posix()) == expected
