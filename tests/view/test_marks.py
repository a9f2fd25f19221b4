"""What edits did and where features are, in pixels; wipes; pictures that turn."""

import io

import numpy as np
import pytest
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from OCP.gp import gp_Pnt
from PIL import Image

from mracad.errors import UsageError
from mracad.job.look import snapshot
from mracad.spec.pictures import Picture
from mracad.view.colours import rgb
from mracad.view.picture import render
from mracad.view.rings import COLOUR, Ring
from mracad.view.treatment import EDGES, FACES, Told
from tests.occ import shapes


def image(data, mode="RGB"):
    return np.asarray(Image.open(io.BytesIO(data)).convert(mode)).astype(int)


def row_of_cubes(count):
    cubes = [BRepPrimAPI_MakeBox(gp_Pnt(10 * k, 0, 0), 10.0, 10.0, 10.0).Shape() for k in range(count)]
    return shapes.document(*cubes)


def test_faces_and_edges_have_the_colours_of_what_became_of_them():
    """The tops of seven cubes and the edges between them, seen from above."""
    document = row_of_cubes(7)
    model = snapshot(document)
    tops = [f.index for f in model.faces if f.box[0, 2] > 9]
    across = [edge.index for edge in model.edges if np.ptp(edge.points[:, 0]) < 1e-9 and edge.points[:, 2].min() > 9]
    between = sorted(across, key=lambda edge: model.edges[edge].points[0, 0])[1:11:2]
    told = Told(dict(zip(tops, FACES, strict=True)), dict(zip(between, EDGES, strict=True)), {"edited": "7 faces"})
    picture = image(render(document, Picture(show="treatment", view=("top",), size="900x160"), told=told).data)
    wide = 900 - (19 * 9)
    pixel = 70 / (0.9 * wide)
    at = [round(wide / 2 + (10 * k - 35) / pixel) for k in range(8)]
    for k, colour in enumerate(FACES.values()):
        assert picture[70, at[k] + 40] == pytest.approx(255 * rgb(colour), abs=1)
    for k, colour in enumerate(EDGES.values(), 1):
        line = picture[70, at[k] - 3 : at[k] + 4]
        assert np.abs(line - 255 * rgb(colour)).sum(axis=1).min() < 60, colour
    key = picture[:60, wide:].reshape(-1, 3)
    assert (np.abs(key - 255 * rgb(FACES["edited"])).max(axis=1) <= 1).sum() > 100


def test_a_ring_is_as_far_from_its_middle_as_it_says_and_on_its_side_alone():
    document = shapes.document(BRepPrimAPI_MakeBox(100, 100, 1).Shape())
    model = snapshot(document)
    top = next(f.index for f in model.faces if f.box[0, 2] > 0.5)
    rings = [Ring(top, (30.0, 30.0, 1.0), 15.0), Ring(top, (70.0, 60.0, 1.0), 20.0)]
    pixel = 100 / 270
    y, x = np.mgrid[:300, :300] + 0.5
    at = np.stack([(x - 150) * pixel + 50, (150 - y) * pixel + 50], axis=-1)
    for view, there in (("top", 1.0), ("bottom", 0.0)):
        options = Picture(show="features", view=(view,), size="300x300")
        picture = image(render(document, options, rings=rings).data)
        ground = np.median(picture[100:200, 100:200].reshape(-1, 3), axis=0)
        way = ground - 255 * COLOUR
        cover = (ground - picture) @ way / (way @ way)
        for ring in rings:
            off = (np.linalg.norm(at - ring.middle[:2], axis=-1) - ring.radius) / pixel
            own = np.where(np.abs(off) < 3, cover, 0.0)
            assert own.sum() * pixel == pytest.approx(there * 2 * np.pi * ring.radius * 2.2, rel=0.05, abs=5)
            assert not there or (own * off).sum() / own.sum() == pytest.approx(0.0, abs=0.1)


def test_a_ring_is_drawn_on_its_faces_alone():
    """The tops of two cubes side by side, of which it keeps to one."""
    document = row_of_cubes(2)
    tops = sorted((f for f in snapshot(document).faces if f.box[0, 2] > 9), key=lambda f: f.box[0, 0])
    x, y = tops[0].box[1, 0], tops[0].box[:, 1].mean()
    options = Picture(show="features", view=("top",), size="300x160")
    seen = []
    for on in (None, (tops[0].index,)):
        ring = Ring(tops[0].index, (x, y, 10.0), 3.0, on)
        picture = image(render(document, options, rings=[ring]).data)
        red = picture[..., 0] > picture[..., 1:].max(axis=-1) + 60
        seen.append([red[:, :148].sum(), red[:, 152:].sum()])
    (left, right), (own, other) = seen
    assert own == left > 50 and right > 50 and other == 0


def test_a_wipe_is_the_left_of_one_and_the_right_of_the_other():
    one, other = (shapes.document(BRepPrimAPI_MakeBox(size, size, 10.0).Shape()) for size in (10.0, 9.9))
    options = {"show": "isophotes", "view": ("1,-2,1.5",), "size": "300x200"}
    alone = image(render(one, Picture(**options)).data)
    wiped, same = (image(render(one, Picture(**options, wipe=True), before=each).data) for each in (other, one))
    assert (same[30:180, 152:] == alone[30:180, 152:]).all() and (same[30:180, :148] == alone[30:180, :148]).all()
    assert (wiped[:, 150] < 60).all(), "a line between"
    assert (wiped[30:180, 152:] == alone[30:180, 152:]).all()
    assert not (wiped[30:180, :148] == alone[30:180, :148]).all()


def test_what_pictures_need_is_asked_for():
    document = row_of_cubes(1)
    for words, says in (
        ({"show": "treatment"}, "what an edit did"),
        ({"wipe": True}, "no other model"),
        ({"comb": True}, "no section"),
        ({"show": "features", "before": "a.step"}, "of one model"),
        ({"section": ("w=3",)}, "not a plane"),
        ({"section": ("z=much",)}, "not a position"),
    ):
        with pytest.raises(UsageError, match=says):
            render(document, Picture(**words))


def widths(frames):
    """How wide the model is in each picture, pixels."""
    return [np.ptp(np.flatnonzero((frame[:75] < 250).any(axis=(0, 2)))) + 1 for frame in frames]


def test_a_model_turns_about_its_middle_at_one_scale():
    document = shapes.document(BRepPrimAPI_MakeBox(30, 20, 10).Shape())
    data = [render(document, Picture(view=("front",), size="100x100"), format="gif").data for _ in range(2)]
    assert data[0] == data[1]
    film = Image.open(io.BytesIO(data[0]))
    frames = []
    for k in range(film.n_frames):
        film.seek(k)
        frames.append(np.asarray(film.convert("RGB")).astype(int))
    assert len(frames) == 36
    angle = np.radians(10.0) * np.arange(36)
    expected = 30 * np.abs(np.cos(angle)) + 20 * np.abs(np.sin(angle))
    assert widths(frames) == pytest.approx(expected * 90 / np.hypot(30, 20), abs=4)


def test_a_map_has_one_scale_while_it_turns():
    """A plate that bends on one side alone: what is seen from there sets the range of every picture."""
    x, y = np.meshgrid(np.linspace(-20, 20, 9), np.linspace(-20, 20, 9), indexing="ij")
    document = shapes.document(shapes.face_on(shapes.bspline(np.stack([x, 0.02 * x**2 + 0 * y, y], axis=-1))))
    still = render(document, Picture(view=("right",), size="60x40", show="curvature"))
    turned = render(document, Picture(view=("right",), size="60x40", show="curvature"), format="gif")
    assert turned.highest > still.highest and turned.highest == pytest.approx(0.04, rel=0.05)


def test_an_mp4_is_what_a_player_reads(tmp_path):
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    data = render(row_of_cubes(2), Picture(size="101x81"), format="mp4").data
    (tmp_path / "a.mp4").write_bytes(data)
    reader = ffmpeg.read_frames(str(tmp_path / "a.mp4"))
    told = next(reader)
    assert told["size"] == (100, 80) and told["fps"] == 12 and sum(1 for _ in reader) == 36
