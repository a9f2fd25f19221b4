"""What mracad env tells."""

import json
import platform

import msgspec
import pytest

import mracad as library


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_versions_threads_and_caches(mracad):
    body = json.loads(mracad("env", "--json").out)
    assert body["mracad"] == library.__version__ and body["python"] == platform.python_version()
    assert body["packages"]["msgspec"] == msgspec.__version__ and body["kernel"].startswith("7.")
    assert body["threads"]["OPENBLAS_NUM_THREADS"] == "1"
    assert body["defaults"] == body["problems"] == []
    text = mracad("env").out
    for word in (library.__version__, body["kernel"], body["packages"]["click"], "OPENBLAS_NUM_THREADS 1"):
        assert word in text


def test_what_the_cache_of_documents_holds(mracad, here, monkeypatch):
    from mracad import cache

    assert json.loads(mracad("env", "--json").out)["caches"]["documents"] == "off"
    monkeypatch.setenv("MRACAD_CACHE", str(here / "cache"))
    assert json.loads(mracad("env", "--json").out)["caches"]["documents"] == f"0 of 0.0 kB in {here}/cache, writable"
    cache.keep("a" * 64, cache.sealed(b"x" * 1968))
    assert json.loads(mracad("env", "--json").out)["caches"]["documents"] == f"1 of 2.0 kB in {here}/cache, writable"
    monkeypatch.setenv("HOME", str(here))
    assert "in ~/cache, writable" in mracad("env").out and str(here) not in mracad("env").out


def test_a_cache_that_cannot_be_written_is_a_problem(mracad, here, monkeypatch):
    (here / "file").write_text("")
    monkeypatch.setenv("MRACAD_CACHE", str(here / "file" / "cache"))
    result = mracad("env")
    assert result.code == 1 and f"in {here}/file/cache, not writable" in result.out
    assert f"problem: the cache of documents cannot be written to {here}/file/cache: Not a directory; " in result.out


def test_defaults_with_their_places_and_what_is_wrong_with_them(mracad, here, monkeypatch):
    lines = ['keep = "as-is"', 'edges = "loose"', "[smooth]", 'scale = "5 apples"', "amount = 0.5", "[smoth]", "x = 1"]
    (here / "mracad.toml").write_text("\n".join(lines))
    monkeypatch.setenv("MRACAD_JOBS", "2")
    monkeypatch.setenv("MRACAD_COLOUR", "red")
    result = mracad("env", "--json")
    body = json.loads(result.out)
    found = {f"{d['command']} {d['option']}".strip(): (d["value"], d["from"]) for d in body["defaults"]}
    assert found == {
        "keep": ("as-is", "mracad.toml:1"),
        "edges": ("loose", "mracad.toml:2"),
        "smooth scale": ("5 apples", "mracad.toml:4"),
        "smooth amount": (0.5, "mracad.toml:5"),
        "smoth x": (1, "mracad.toml:7"),
        "jobs": ("2", "MRACAD_JOBS"),
        "colour": ("red", "MRACAD_COLOUR"),
    }
    wrong = {d["from"] for d in body["defaults"] if d["problem"]}
    assert wrong == {"mracad.toml:2", "mracad.toml:4", "mracad.toml:7", "MRACAD_COLOUR"} and result.code == 1
    assert len(body["problems"]) == 4
    text = mracad("env").out
    assert 'default: smooth scale = "5 apples" from mracad.toml:4' in text and text.count("\nproblem: ") == 4


def test_it_tells_of_a_file_that_cannot_be_read(mracad, here):
    (here / "mracad.toml").write_text("keep = \n")
    assert "problem: mracad.toml:1: Invalid value" in mracad("env").out


def test_a_default_for_all_commands_counts_where_it_fits(mracad, here):
    """info has no --keep as-is."""
    (here / "mracad.toml").write_text('keep = "as-is"\n')
    assert mracad("info", "none.step").code == 3
    (here / "mracad.toml").write_text('[info]\nkeep = "as-is"\n')
    assert mracad("info", "none.step").code == 2
