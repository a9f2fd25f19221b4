"""Heightmaps: what comes back from the heights that they were made of, and files that are none."""

import pickle
import re
import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from mracad.edit.feature.source import made
from mracad.errors import Code, EditError, MracadError
from mracad.spec.sources import source

X, Y = np.meshgrid(np.linspace(-1, 1, 96), np.linspace(1, -1, 64))
HILL = np.exp(-(((X - 0.2) / 0.25) ** 2) - (((Y - 0.1) / 0.3) ** 2))
"""A hill right of and above the middle; row 0 is the top."""


def build(path, text, taper=None):
    text = f"{path},{text}"
    return made(source(text, "feature"), text, taper)


def along(feature, x, y):
    return feature.lookup(np.stack([np.ravel(x), np.ravel(y)], axis=1))


def heights(feature, width=96.0, shape=(64, 96)):
    """The heights of a feature at the pixels."""
    cell = width / shape[1]
    x = cell * (np.arange(shape[1]) - (shape[1] - 1) / 2)
    y = cell * (np.arange(shape[0]) - (shape[0] - 1) / 2)[::-1]
    return along(feature, *np.meshgrid(x, y))[:, 2].reshape(shape)


def saved(tmp_path, kind):
    """The hill as a file, and its height as an option."""
    path = tmp_path / f"hill.{kind.split()[0]}"
    if kind == "npy":
        np.save(path, 0.4 * HILL)
    elif kind == "csv":
        np.savetxt(path, 0.4 * HILL, delimiter=",", header="a hill")
    elif kind == "png 8":
        Image.fromarray(np.round(255 * HILL).astype(np.uint8)).save(path)
    elif kind == "tif F":
        Image.fromarray((7.0 * HILL + 3).astype(np.float32)).save(path)
    else:
        Image.fromarray(np.round(65535 * HILL).astype(np.uint16)).save(path)
    return path, "" if kind in ("npy", "csv") else ",height:0.4mm"


@pytest.mark.parametrize(
    ("kind", "most"),
    [("npy", 1e-3), ("csv", 1e-3), ("png 8", 2e-2), ("png 16", 1e-3), ("tif 16", 1e-3), ("tif F", 1e-3)],
)
def test_a_smooth_heightmap_comes_back(tmp_path, kind, most):
    path, height = saved(tmp_path, kind)
    feature = build(path, f"width:96mm{height}")
    error = heights(feature) - 0.4 * HILL
    assert np.sqrt(np.mean(error**2)) < most * 0.4
    assert feature.spacing > (3.0 if most < 1e-2 else 1.0)  # far coarser than its pixels of 1 mm
    assert np.abs(feature.table[..., :2]).max() == 0


def test_knots_are_as_close_as_the_detail_needs(tmp_path):
    shorter = HILL * (1 + 0.3 * np.cos(60 * X))
    np.save(tmp_path / "a.npy", HILL)
    np.save(tmp_path / "b.npy", shorter)
    coarse, fine = (build(tmp_path / name, "width:96mm") for name in ("a.npy", "b.npy"))
    assert fine.spacing < 0.5 * coarse.spacing
    assert np.sqrt(np.mean((heights(fine) - shorter) ** 2)) < 2e-3


@pytest.fixture(scope="module")
def logo(tmp_path_factory):
    """A disc of half the side with sharp edges, as an image of 1024 × 1024 pixels, and its levels."""
    path = tmp_path_factory.mktemp("logo") / "logo.png"
    x = np.linspace(-1, 1, 4096)
    levels = (np.hypot(*np.meshgrid(x, x)) < 0.5).reshape(1024, 4, 1024, 4).mean(axis=(1, 3))
    Image.fromarray(np.round(255 * levels).astype(np.uint8)).save(path)
    return path, levels


def test_a_logo_of_1024_pixels_keeps_its_edges_at_a_tenth_of_a_millimetre(logo):
    feature = build(logo[0], "width:30mm,height:0.4mm,spacing:0.1mm")
    found = heights(feature, 30.0, (1024, 1024))
    assert np.sqrt(np.mean((found - 0.4 * logo[1]) ** 2)) < 0.036 * 0.4  # a step rounded by 0.12 mm
    assert found.min() > -1e-3 * 0.4 and found.max() < 1.001 * 0.4  # nothing rings
    r = np.hypot(*np.meshgrid(*2 * [np.linspace(-15, 15, 1024)]))
    assert np.abs(found[r < 7.0] - 0.4).max() < 1e-4 and np.abs(found[r > 8.0]).max() < 1e-4


def test_notes_say_what_rounding_takes_how_to_save_points_and_how_large_it_is(logo):
    free, given = (build(logo[0], f"width:30mm,height:0.4mm{more}").notes for more in ("", ",spacing:0.1mm"))
    for notes in (free, given):
        assert any("edges are rounded" in note and "differs from the source by" in note for note in notes)
        assert notes[-1] == "it is 30 × 30 mm, 42.4 mm from corner to corner"
    text = " ".join(free)
    coarser = float(re.search(r"coarser spacing, such as spacing:(\S+)mm, makes files smaller", text)[1])
    apart = [build(logo[0], f"width:30mm,height:0.4mm{more}").spacing for more in ("", f",spacing:{coarser}mm")]
    assert apart[1] > 1.8 * apart[0] and "coarser" not in " ".join(given)


def test_a_soft_logo_of_1024_pixels_is_held_to_half_a_per_cent(tmp_path):
    r = np.hypot(*np.meshgrid(*2 * [np.linspace(-15, 15, 1024)]))
    levels = 0.5 - 0.5 * np.tanh((r - 7.5) / 0.4)
    Image.fromarray(np.round(65535 * levels).astype(np.uint16)).save(tmp_path / "soft.png")
    feature = build(tmp_path / "soft.png", "width:30mm,height:0.4mm,spacing:0.1mm")
    assert np.sqrt(np.mean((heights(feature, 30.0, (1024, 1024)) - 0.4 * levels) ** 2)) < 0.002 * 0.4


def test_the_level_of_the_border_is_the_face(tmp_path):
    Image.fromarray(np.round(255 * (1 - HILL)).astype(np.uint8)).save(tmp_path / "black.png")
    feature = build(tmp_path / "black.png", "width:96mm,height:0.4mm")
    assert "border" in feature.notes[0] and "100 %" in feature.notes[0]
    assert np.abs(heights(feature) + 0.4 * HILL).max() < 0.03


def test_heights_at_the_border_fade_out_inside_it(tmp_path):
    np.save(tmp_path / "waves.npy", 0.2 + 0.2 * np.cos(9 * X) * np.cos(9 * Y))
    feature = build(tmp_path / "waves.npy", "width:96mm", 8.0)
    assert any("fades out over 8 mm" in note for note in feature.notes)
    rim = along(feature, [48.0, -48.0, 0.0, 0.0], [0.0, 0.0, 32.0, -32.0])
    assert np.abs(rim[:, 2:]).max() < 0.01 and along(feature, [0.0], [0.0])[0, 3] == pytest.approx(1)
    assert np.abs(heights(feature)[16:-16, 16:-16] - np.load(tmp_path / "waves.npy")[16:-16, 16:-16]).max() < 0.01


@pytest.mark.parametrize("mode", ["RGB", "LA", "RGBA", "P", "1"])
def test_colours_count_by_luminance_and_what_is_clear_is_the_face(tmp_path, mode):
    square = np.zeros((64, 64), np.uint8)
    square[20:44, 20:44] = 255
    if mode in ("LA", "RGBA"):  # a black square on nothing
        image = Image.fromarray(np.stack([0 * square] * (len(mode) - 1) + [square], axis=-1), mode)
    else:
        image = Image.fromarray(np.stack([square] * 3, axis=-1)).convert(mode)
    image.save(tmp_path / "square.png")
    feature = build(tmp_path / "square.png", "width:64mm,height:1mm")
    found = along(feature, [0.0, 6.0, 25.0], [0.0, -6.0, 25.0])[:, 2]
    assert found == pytest.approx([1.0, 1.0, 0.0], abs=0.01)


def chunk(kind, data):
    body = kind + data
    return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))


def png(width, height, data=b""):
    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(data)) + chunk(b"IEND", b"")


def npy(text, data=b""):
    head = text.encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head + data


def array(values):
    import io

    stream = io.BytesIO()
    np.save(stream, np.array(values), allow_pickle=True)
    return stream.getvalue()


class Bad:
    """Something that must never be unpickled."""

    def __reduce__(self):
        return pytest.fail, ("unpickled",)


BAD = {
    "huge.png": (png(100_000, 100_000), "million"),
    "large.png": (png(9_000, 9_000), "million"),
    "short.png": (png(64, 64, b"\0" * 100), "damaged"),
    "text.png": (b"no image", "not a PNG"),
    "empty.tif": (b"", "not a PNG"),
    "cut.tif": (b"II*\0\x08\0\0\0\x05\0", "image"),
    "tiny.png": (png(2, 2, b"\0\0\0" * 2), "too few"),
    "black.png": (png(64, 64, b"\0" * 65 * 64), "nothing stands out"),
    "huge.npy": (npy("{'descr': '<f8', 'fortran_order': False, 'shape': (100000, 100000), }"), "not a numpy"),
    "pickled.npy": (array([[Bad()] * 8] * 8), "not a numpy"),
    "pickle.npy": (pickle.dumps(Bad()), "not a numpy"),
    "nan.npy": (array([[0.0, np.nan, 1.0, 0.0]] * 4), "row 1, column 2 is not a finite"),
    "inf.npy": (array([[0.0, 0.0, 1.0, np.inf]] * 4), "column 4"),
    "flat.npy": (array([0.0, 1.0, 2.0, 3.0]), "not a 2D array"),
    "complex.npy": (array([[0j] * 4] * 4), "not a 2D array"),
    "ragged.csv": (b"1,2,3,4\n1,2,3\n", "ragged.csv:2: 3 numbers"),
    "words.csv": (b"0,1,0,0\n0,1,x,0\n", "words.csv:2"),
    "nan.csv": (b"0,0,nan,0\n" * 4, "not a finite"),
    "empty.csv": (b"\n# nothing\n", "no numbers"),
    "binary.csv": (b"\xff\xfe\0\x80", "UTF-8"),
}


@pytest.mark.parametrize("name", [*BAD, "missing.png", "missing.npy", "missing.csv"])
def test_what_is_no_heightmap_is_refused_in_one_line(tmp_path, name):
    path = tmp_path / name
    content, said = BAD.get(name, (None, "cannot read"))
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(MracadError) as error:
        build(path, "width:30mm,height:0.4mm")
    assert said in str(error.value) and "\n" not in str(error.value)
    assert error.value.code in (Code.FILE, Code.CANNOT_EDIT) and isinstance(error.value, EditError) == (
        name == "black.png"
    )
    assert "nothing stands out" not in said or error.value.code == Code.CANNOT_EDIT


def test_a_spacing_that_no_table_can_hold_is_refused(logo):
    with pytest.raises(MracadError, match=r"spacing 0\.01 mm is not between"):
        build(logo[0], "width:30mm,height:0.4mm,spacing:0.01mm")
    with pytest.raises(MracadError, match="taper: 20 mm"):
        build(logo[0], "width:30mm,height:0.4mm", 20.0)
