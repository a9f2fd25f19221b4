"""What edits did and where features are, in pixels; wipes; pictures that turn."""

import io
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from OCP.gp import gp_Pnt
from PIL import Image

from mracad.errors import UsageError
from mracad.job.look import snapshot
from mracad.job.treated import told as told_of
from mracad.seam.cause import Cause, Still
from mracad.seam.natural import Treatment
from mracad.spec.pictures import Picture
from mracad.spec.steps import Smooth
from mracad.view.colours import rgb
from mracad.view.fit import OUTLINE
from mracad.view.legend import Pen
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
    """The tops of ten cubes and the edges between them, seen from above."""
    document = row_of_cubes(10)
    model = snapshot(document)
    tops = [f.index for f in model.faces if f.box[0, 2] > 9]
    across = [edge.index for edge in model.edges if np.ptp(edge.points[:, 0]) < 1e-9 and edge.points[:, 2].min() > 9]
    between = sorted(across, key=lambda edge: model.edges[edge].points[0, 0])[1:19:2]
    told = Told(dict(zip(tops, FACES, strict=False)), dict(zip(between, EDGES, strict=True)), {"edited": "7 faces"})
    picture = image(render(document, Picture(show="treatment", view=("top",), size="900x160"), told=told).data)
    wide = 900 - (19 * 9)
    pixel = 100 / (0.9 * wide)
    at = [round(wide / 2 + (10 * k - 50) / pixel) for k in range(11)]
    for k, colour in enumerate(FACES.values()):
        assert picture[76, at[k] + 30] == pytest.approx(255 * rgb(colour), abs=1)
    for k, colour in enumerate(EDGES.values(), 1):
        line = picture[76, at[k] - 3 : at[k] + 4]
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


@pytest.fixture
def captions(monkeypatch):
    """What is written on panels."""
    found = []
    monkeypatch.setattr(Pen, "caption", lambda pen, corner, wide, text: found.append(text))
    return found


@pytest.mark.parametrize(
    ("names", "told", "expected"),
    [
        (("a.step", "a.step"), None, ["a.step, before", "a.step, after"]),
        (("b.step", "a.step"), None, ["b.step", "a.step"]),
        (("b.step", "a.step"), Told({}, {}, {}), ["b.step", "a.step, after"]),
    ],
)
def test_two_models_have_names_that_tell_them_apart(captions, names, told, expected):
    before, after = (replace(row_of_cubes(1), name=name) for name in names)
    render(after, Picture(size="60x40"), before=before, told=told)
    assert captions == expected


def test_captions_stay_in_their_part_of_a_sheet():
    sheet = Image.new("RGB", (400, 300), "white")
    Pen.on(sheet).caption((0, 0), 90, "a_model_with_a_rather_long_name.step, before  iso")
    dark = (np.asarray(sheet).min(axis=2) < 200).nonzero()
    assert 60 < dark[1].max() < 90 and dark[0].max() > 20, "in lines"


def test_faces_to_fit_in_are_outlined_and_a_view_that_shows_them_is_named():
    document = shapes.document(BRepPrimAPI_MakeBox(30, 20, 10).Shape())
    back = next(f.index for f in snapshot(document).faces if f.box[0, 1] > 19)
    seen, hidden = (
        render(document, Picture(view=(view,), fit=(f"#{back + 1}",), size="300x200")) for view in ("back", "front")
    )
    assert seen.note == "" and hidden.note == f"fit: #{back + 1} is not seen from front; add --view=back"
    picture = image(seen.data)
    y, x = np.nonzero(np.abs(picture - 255 * np.array(OUTLINE.colour)).max(axis=2) < 30)
    assert [np.ptp(x), np.ptp(y)] == pytest.approx([270, 90], abs=4)


def test_faces_that_are_hidden_from_all_sides_are_said_to_be():
    inner, outer = BRepPrimAPI_MakeBox(gp_Pnt(4, 4, 4), 2, 2, 2).Shape(), BRepPrimAPI_MakeBox(10, 10, 10).Shape()
    found = render(shapes.document(outer, inner), Picture(fit=("#7",), size="90x60"))
    assert "others hide them from all sides" in found.note


def test_edges_beside_which_nothing_moved_are_told_from_those_that_stayed():
    reasons = [Still.IDLE] * 3 + [Still.FREE] * 4 + [Still.POLE] * 3 + [Still.SHARP] * 2 + [Still.HELD, Still.TRIMMED]
    edges = tuple(Treatment(k, (0, 1), "frozen", Cause(why)) for k, why in enumerate(reasons))
    edit = SimpleNamespace(outcomes=(), edges=(*edges, Treatment(20, (0, 1), "coupled")))
    found = told_of(SimpleNamespace(edit=edit), Smooth(scale="1mm"))
    assert [found.edges[k] for k in (0, 3, 7, 10, 12, 13, 20)] == [
        "idle", "stayed 1", "stayed 2", "stayed 3", "stayed", "stayed", "coupled",
    ]  # fmt: skip
    assert found.words["idle"] == "3 edges with no change on either side"
    assert found.words["stayed 1"] == "4 edges stayed: free edge"
    assert found.words["stayed"] == "2 edges stayed for other reasons"


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
    with pytest.raises(UsageError, match="in one view"):
        render(document, Picture(view=("iso,top",)), format="gif")


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
