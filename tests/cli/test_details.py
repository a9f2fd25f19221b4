"""``mracad level --details`` and ``mracad compose`` on files: the input comes back; files that are none are refused."""

import io
import json
import os
import struct
import zipfile

import numpy as np
import pytest

import mracad as api
from mracad.edit import mra as details


@pytest.fixture(scope="module")
def apart(small, tmp_path_factory):
    """A folder with a model, its coarse one, and the details."""
    from mracad_cli.__main__ import main

    place = tmp_path_factory.mktemp("details")
    (place / "sheet.step").write_bytes(small[0].read_bytes())
    words = ["--scale", "4mm", "-o", str(place / "coarse.step"), "--details", str(place / "sheet.mra")]
    assert main(["level", str(place / "sheet.step"), *words]) == 0
    return place


def off(one, two):
    """The largest distance of the surfaces of two files, as a share of the size of each."""
    both = [api.snapshot(api.read(path)).surfaces for path in (one, two)]
    found = []
    for a, b in zip(*both, strict=True):
        p, q = (s.net.grid(*(np.linspace(*k.domain, 40) for k in (a.net.u, a.net.v))) for s in (a, b))
        found.append(np.abs(p - q).max() / np.ptp(a.net.poles, axis=(0, 1)).max())
    return max(found)


def test_the_input_comes_back_from_files(mracad, apart, tmp_path):
    result = mracad("compose", apart / "coarse.step", apart / "sheet.mra", "-o", tmp_path / "a.step")
    assert result.code == 0 and "note: details of 2 surfaces: 2 added as they were" in result.out
    assert off(apart / "sheet.step", apart / "coarse.step") > 1e-4
    assert off(apart / "sheet.step", tmp_path / "a.step") <= 1e-14
    assert mracad("compare", apart / "sheet.step", tmp_path / "a.step", "--max-deviation", "1e-9mm").code == 0


def test_every_real_face_comes_back(mracad, refined_file, tmp_path):
    if refined_file.stat().st_size > 500_000:
        pytest.skip("more than 500 kB")
    words = ["-o", tmp_path / "coarse.step", "--details", tmp_path / "a.mra", "--level", "1"]
    assert mracad("level", refined_file, *words).code == 0
    assert mracad("compose", tmp_path / "coarse.step", tmp_path / "a.mra", "-o", tmp_path / "a.step").code == 0
    assert off(refined_file, tmp_path / "a.step") <= 1e-12


def test_steps_of_a_recipe(mracad, apart, tmp_path):
    """A recipe smooths the coarse shape under the details; the file of details counts as needed."""
    path = tmp_path / "recipe.toml"
    path.write_text(
        '[[step]]\nuse = "level"\nscale = "4mm"\n[[step]]\nuse = "compose"\n'
        f'details = "{os.path.relpath(apart / "sheet.mra", tmp_path)}"\n'
    )
    words = [path, apart / "sheet.step", "-o", tmp_path / "a.step", "--depfile", tmp_path / "a.d"]
    result = mracad("run", *words)
    assert result.code == 0, result.err
    assert off(apart / "sheet.step", tmp_path / "a.step") <= 1e-14
    assert "sheet.mra" in (tmp_path / "a.d").read_text()


def test_nothing_is_written_for_a_wrong_ending_or_without_a_place(mracad, apart, tmp_path):
    for words in (
        ["--scale", "4mm", "--details", tmp_path / "a.zip"],
        ["--scale", "4mm", "--level", "2", "--details", tmp_path / "a.mra"],
        ["--details", tmp_path / "a.mra"],
        ["--scale", "4mm", "--details", tmp_path / "a.step"],
    ):
        result = mracad("level", apart / "sheet.step", "-o", tmp_path / "a.step", *words)
        assert result.code == 2 and result.err.count("mracad: ") == 1 and not list(tmp_path.iterdir())
    for words in (["--dry-run"], []):
        given = [*words, *([] if words else ["-o", tmp_path / "a.step"]), "--details", tmp_path / "a.mra"]
        assert mracad("level", apart / "sheet.step", "--scale", "4mm", *given).code == 0
        assert (tmp_path / "a.mra").exists() == (not words)
    again = mracad("level", apart / "sheet.step", "--scale", "4mm", "-o", tmp_path / "b.step", *given[-2:])
    assert again.code == 2 and "exists" in again.err and not (tmp_path / "b.step").exists()


def repacked(path, change):
    """The bytes of a file with its parts changed."""
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in change(parts).items():
            archive.writestr(name, data)
    return stream.getvalue()


def told(change):
    """A change of the header."""

    def changed(parts):
        header = json.loads(parts["header.json"])
        change(header)
        return {**parts, "header.json": json.dumps(header).encode()}

    return changed


def array(name, values):
    """Another array in place of one."""

    def changed(parts):
        stream = io.BytesIO()
        np.lib.format.write_array(stream, np.asarray(values), allow_pickle=True)
        return {**parts, name: stream.getvalue()}

    return changed


def claimed(name, shape):
    """An array whose header claims a shape that it does not have."""

    def changed(parts):
        text = str({"descr": "<f8", "fortran_order": False, "shape": shape}).encode()
        text += b" " * (63 - (len(text) + 10) % 64) + b"\n"
        return {**parts, name: b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + bytes(64)}

    return changed


def bomb(parts):
    return {**parts, "0/d0.npy": bytes(1 << 27)}


DAMAGED = {
    "no format": told(lambda h: h.pop("format")),
    "another format": told(lambda h: h.update(format="mracad details 9")),
    "inches": told(lambda h: h.update(unit="in")),
    "an unknown key": told(lambda h: h.update(more=1)),
    "a degree of 99": told(lambda h: h["surfaces"][0].update(degrees=[99, 3])),
    "no level": told(lambda h: h["surfaces"][0].update(levels=0)),
    "too many levels": told(lambda h: h["surfaces"][0].update(levels=30)),
    "another degree": told(lambda h: h["surfaces"][0].update(degrees=[3, 2])),
    "a wavelength of nothing": told(lambda h: h["surfaces"][0].update(wavelength=0)),
    "a header that is no JSON": lambda parts: {**parts, "header.json": b"{"},
    "no header": lambda parts: {k: v for k, v in parts.items() if k != "header.json"},
    "no points": lambda parts: {k: v for k, v in parts.items() if k != "0/points.npy"},
    "pickles": array("0/points.npy", np.array([{"a": 1}], dtype=object)),
    "whole numbers": array("0/points.npy", np.zeros((18, 18, 3), int)),
    "another shape": array("0/points.npy", np.zeros((7, 7, 3))),
    "a number that is not finite": array("0/u0.npy", [0.0, np.nan, 1.0]),
    "knots that fall": array("0/u0.npy", np.linspace(1, 0, 20)),
    "knots that are not nested": array("0/u1.npy", [0, 0, 0, 0, 0.123, 1, 1, 1, 1.0]),
    "weights that are not positive": array("0/weights.npy", -np.ones((18, 18))),
    "a shape that is not there": claimed("0/d0.npy", (10**9, 10**9, 3)),
    "an array that is none": lambda parts: {**parts, "0/d0.npy": b"no array"},
    "a bomb": bomb,
}


@pytest.mark.parametrize("name", DAMAGED)
def test_a_damaged_file_is_refused_in_one_line(name, mracad, apart, tmp_path):
    (tmp_path / "bad.mra").write_bytes(repacked(apart / "sheet.mra", DAMAGED[name]))
    result = mracad("compose", apart / "coarse.step", tmp_path / "bad.mra", "-o", tmp_path / "a.step")
    assert result.code == 3 and result.err.count("\n") == 1 and "bad.mra" in result.err, result.err
    assert not (tmp_path / "a.step").exists()


@pytest.mark.parametrize("cut", [0, 10, 2000, -5, -60])
def test_a_file_that_is_cut_off_is_refused(cut, mracad, apart, tmp_path):
    (tmp_path / "bad.mra").write_bytes((apart / "sheet.mra").read_bytes()[:cut])
    result = mracad("compose", apart / "coarse.step", tmp_path / "bad.mra", "-o", tmp_path / "a.step")
    assert result.code == 3 and result.err.count("\n") == 1, result.err


def test_bytes_at_random_never_do_more_than_fail(apart, tmp_path):
    """Whatever byte is wrong, it is read or refused with a FileError."""
    data, rng = bytearray((apart / "sheet.mra").read_bytes()), np.random.default_rng(0)
    for _ in range(150):
        bad = bytearray(data)
        for place in rng.integers(0, len(bad), 3):
            bad[place] = rng.integers(0, 256)
        (tmp_path / "bad.mra").write_bytes(bad)
        try:
            details.load(tmp_path / "bad.mra")
        except api.MracadError as error:
            assert int(error.code) == 3, error


def test_a_bomb_costs_no_memory(apart, tmp_path):
    import tracemalloc

    (tmp_path / "bad.mra").write_bytes(repacked(apart / "sheet.mra", bomb))
    tracemalloc.start()
    with pytest.raises(api.MracadError):
        details.load(tmp_path / "bad.mra")
    assert tracemalloc.get_traced_memory()[1] < 5e6
    tracemalloc.stop()


def test_a_missing_file_and_a_model_are_no_details(mracad, apart, tmp_path):
    for path in (tmp_path / "none.mra", tmp_path, apart / "sheet.step"):
        result = mracad("compose", apart / "coarse.step", path, "-o", tmp_path / "a.step")
        assert result.code == 3 and result.err.count("mracad: ") == 1 and not (tmp_path / "a.step").exists()
