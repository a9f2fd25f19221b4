"""Pictures, measured in their pixels: colours, stripes, lines, outlines."""

import io
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder, BRepPrimAPI_MakeSphere
from OCP.Geom import Geom_OffsetSurface
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
from OCP.Quantity import Quantity_Color, Quantity_ColorRGBA, Quantity_TOC_sRGB
from OCP.XCAFDoc import XCAFDoc_ColorType, XCAFDoc_DocumentTool
from PIL import Image

from mracad.occ.facets import facets
from mracad.occ.files import read
from mracad.spec.pictures import VIEWS, Picture, Show
from mracad.view.camera import axes, fitted
from mracad.view.fields import map_of
from mracad.view.legend import Legend, strip
from mracad.view.picture import ANGLE, CHORD, render
from tests.occ import shapes


def pixels(document, **options):
    """A picture as numbers from 0 to 255, ``(height, width, 3)``."""
    others = {name: options.pop(name) for name in ("before", "reference") if name in options}
    drawn = render(document, Picture(**options), **others)
    return np.asarray(Image.open(io.BytesIO(drawn.data)).convert("RGB")).astype(float), drawn


def beside_bar(size):
    """Width of a panel beside a bar of colours."""
    return size[0] - strip(Legend(map_of(Show("deviation"), 1.0)), size)


@cache
def sphere(radius):
    return shapes.document(BRepPrimAPI_MakeSphere(radius).Shape())


def disc(size, radius, share):
    """The pixels within a share of a sphere's outline in the middle of a picture."""
    width, height = size
    y, x = np.mgrid[:height, :width] + 0.5
    pixel = 2 * radius / (0.9 * min(width, height))
    return np.hypot(x - width / 2, y - height / 2) * pixel < share * radius, pixel


@pytest.mark.parametrize(("what", "value"), [("max", 0.1), ("mean", 0.1), ("gauss", 0.01)])
def test_the_curvature_of_a_sphere_is_one_colour(what, value):
    picture, drawn = pixels(sphere(10.0), show=f"curvature:{what}", view=("0.3,-1,0.2",), size="300x200")
    assert (drawn.lowest, drawn.highest) == pytest.approx((value, value), rel=1e-5)
    wide = beside_bar((300, 200))
    inside, _ = disc((wide, 200), 10.0, 0.97)
    colours = picture[:, :wide][inside]
    assert np.ptp(colours, axis=0).max() <= 2.55
    strip = picture[:, wide:].reshape(-1, 3)
    assert np.abs(strip - np.median(colours, axis=0)).max(axis=1).min() <= 2.55, "it is a colour of the bar"


def test_an_outline_covers_pixels_by_their_share():
    picture, _ = pixels(sphere(10.0), show="curvature", view=("front",), size="376x300")
    assert beside_bar((376, 300)) == 300
    seen = picture[:, :300]
    ground, colour = 255.0, np.median(seen[140:160, 140:160].reshape(-1, 3), axis=0)
    share = ((ground - seen) / (ground - colour)).mean(axis=2)[:270]
    _, pixel = disc((300, 300), 10.0, 1.0)
    rows = np.arange(270) + 0.5 - 150
    chords = 2 * np.sqrt(np.maximum((10 / pixel) ** 2 - rows**2, 0))
    assert np.abs(share.sum(axis=1) - chords)[50:250].max() < 1.0
    assert share.sum() == pytest.approx(chords.sum(), rel=5e-3)


def test_the_deviation_of_an_offset_face_is_the_offset():
    x, y = np.meshgrid(np.linspace(0, 60, 8), np.linspace(0, 40, 7), indexing="ij")
    ground = shapes.bspline(np.stack([x, y, 4 * np.sin(x / 20) * np.cos(y / 15)], axis=-1))
    moved = BRepBuilderAPI_MakeFace(Geom_OffsetSurface(ground, 0.3), 1e-7).Face()
    reference = shapes.document(shapes.face_on(ground))
    for document, base, sign in ((shapes.document(moved), reference, 1), (reference, shapes.document(moved), -1)):
        _, drawn = pixels(document, show="deviation", reference=base, size="120x90")
        assert (drawn.lowest, drawn.highest) == pytest.approx((0.3 * sign, 0.3 * sign), rel=1e-4)
        assert drawn.unit == "mm"


def test_deviation_across_sewn_patches_is_that_of_the_whole(samples):
    panel, truth = (read(samples / name) for name in ("panel.step", "panel_clean.step"))
    _, drawn = pixels(panel, show="deviation", reference=truth, size="160x120")
    assert -0.1 < drawn.lowest < 0 < drawn.highest < 0.1, "noise of 0.02 mm, whichever patch is nearest"


@pytest.mark.parametrize(
    ("name", "view"),
    [
        ("bottle", "bottom"),
        ("assembly", "iso"),
        ("shell", "iso"),
        ("trimmed", "iso"),
        ("blade", "iso"),
        ("panel", "iso"),
    ],
)
def test_a_model_does_not_deviate_from_itself(samples, name, view):
    model = read(samples / f"{name}.step")
    _, drawn = pixels(model, show="deviation", reference=model, view=(view,), size="240x160")
    assert max(-drawn.lowest, drawn.highest) <= 1e-6


def light(picture):
    return picture.mean(axis=-1)


def crossings(line):
    """Where a row or column of a picture turns from dark to light or back, to parts of a pixel, and the direction."""
    high, low = line.max(), line.min()
    x = (line - 0.5 * (high + low)) / (high - low)
    at = np.flatnonzero(np.sign(x[1:]) != np.sign(x[:-1]))
    return at + 0.5 + x[at] / (x[at] - x[at + 1]), np.sign(x[at + 1])


@pytest.mark.parametrize("view", ["front", "0.6,-1,0.35"])
def test_zebra_stripes_on_a_cylinder_are_straight(view):
    rod = shapes.document(BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(), gp_Dir(1, 0, 0)), 10.0, 60.0).Shape())
    size = (600, 300)
    picture, _ = pixels(rod, show="zebra", view=(view,), size="600x300", stripes=12)
    camera = fitted(
        axes(view), np.concatenate([f.points for f in facets(rod, CHORD / 600, ANGLE).facets.values()]), size
    )
    angle = np.linspace(-np.pi, np.pi, 20001)
    normals = np.stack([0 * angle, np.cos(angle), np.sin(angle)], axis=1)
    phase = 12 / np.pi * np.arcsin(normals @ camera.axes[1])
    turns = np.flatnonzero((np.diff(np.floor(2 * phase)) != 0) & (normals[1:] @ camera.toward > 0.5))
    assert len(turns) > 5
    for turn in turns:
        start, end = camera.project(10 * normals[turn] + [[15.0, 0, 0], [45.0, 0, 0]])
        columns = np.arange(int(start[0]) + 1, int(end[0]))
        expected = np.interp(columns + 0.5, *np.array([start, end]).T[:2])
        off = [np.abs(crossings(light(picture[:, x]))[0] - y).min() for x, y in zip(columns, expected, strict=True)]
        assert max(off) < 0.35


def test_the_stripe_around_the_viewer_has_no_dot_in_it():
    picture, _ = pixels(sphere(10.0), show="isophotes", view=("front",), size="201x201", stripes=6)
    inside, _ = disc((201, 201), 10.0, 0.9 * np.sin(np.pi / 12))
    assert np.ptp(light(picture[inside])) < 3.0


PACE, RADIUS, STRIPES = 0.002, 500.0, 90


def joined(crease=0.0, bend=0.0, jerk=0.0):
    """z = −y²/2R + k x y on both sides of y = 0; beyond it also crease·y + bend·y²/2 + jerk·y³/6."""

    def patch(low, high):
        nodes = np.linspace(0, 1, 4)
        bernstein = np.stack([(1 - nodes) ** 3, 3 * nodes * (1 - nodes) ** 2, 3 * nodes**2 * (1 - nodes), nodes**3], 1)
        x, y = np.array([-50.0, 50.0])[:, None], (low + (high - low) * nodes)[None]
        z = -(y**2) / (2 * RADIUS) + PACE * x * y + (y > 0) * (crease * y + bend * y**2 / 2 + jerk * y**3 / 6)
        values = np.stack(np.broadcast_arrays(x, y, z), axis=-1)
        return shapes.face_on(shapes.bezier(np.linalg.solve(bernstein, values)))

    return shapes.document(shapes.compound(patch(-25.0, 0.0), patch(0.0, 25.0)))


def edges_of_stripes(document):
    """Per row (mm from the joint upwards), where stripes begin and end from the left (mm)."""
    picture, _ = pixels(document, show="zebra", view=("top",), size="1000x520", stripes=STRIPES)
    pixel = 100.0 / 900.0
    found = {}
    for row in range(60, 460):
        at, way = crossings(light(picture[row, 60:940]))
        found[(260 - row - 0.5) * pixel] = ((at + 60 - 500) * pixel, way)
    return found, pixel


def traced(found, side):
    """The beginnings of stripes on one side of the joint, followed from row to row: height and place of each."""
    rows = sorted((y for y in found if 0.3 < side * y < 6.0), key=abs)
    paths = [[(rows[0], start)] for start in found[rows[0]][0][found[rows[0]][1] > 0]]
    for y in rows[1:]:
        starts = found[y][0][found[y][1] > 0]
        for path in paths:
            if len(starts) and np.abs(starts - path[-1][1]).min() < 1.0:
                path.append((y, starts[np.abs(starts - path[-1][1]).argmin()]))
    full = [np.array(path).T for path in paths if len(path) == len(rows)]
    return [np.polyfit(y, x, 2)[::-1] for y, x in full]


def across(document):
    """Jumps (mm) and changes of slope of the edges of stripes across the joint."""
    found, pixel = edges_of_stripes(document)
    below, above = traced(found, -1), traced(found, 1)
    assert len(below) >= 3 and len(above) >= 3
    return below, above, pixel


def step(crease):
    """How far along x the normal turns as much as over a crease: k x = crease."""
    return crease / PACE


def test_a_crease_breaks_stripes_by_the_amount_computed():
    crease = np.tan(np.radians(0.5))
    below, above, pixel = across(joined(crease=crease))
    for place, *_ in below:
        moved = min((other[0] for other in above), key=lambda x: abs(x - place + step(crease)))
        if -35 < place < 35:
            assert moved - place == pytest.approx(-step(crease), abs=pixel)
    assert step(crease) > 30 * pixel


@pytest.mark.parametrize(("joint", "kinked"), [({"bend": 0.004}, True), ({"jerk": 0.0004}, False)])
def test_a_tangent_joint_kinks_stripes_and_a_smooth_one_does_not(joint, kinked):
    below, above, pixel = across(joined(**joint))
    for place, slope, _ in below:
        if not -35 < place < 35:
            continue
        other = min(above, key=lambda line: abs(line[0] - place))
        assert other[0] - place == pytest.approx(0.0, abs=pixel), "it does not break"
        assert slope == pytest.approx(1 / (RADIUS * PACE), abs=0.03)
        assert other[1] - slope == pytest.approx(-joint["bend"] / PACE if kinked else 0.0, abs=0.05)


def test_hidden_edges_are_hidden():
    document = shapes.document(BRepPrimAPI_MakeBox(30, 20, 10).Shape())
    view = "3,-2,1.5"
    picture, _ = pixels(document, view=(view,), size="400x300")
    corners = np.array([[x, y, z] for x in (0, 30) for y in (0, 20) for z in (0, 10)], float)
    camera = fitted(axes(view), corners, (400, 300))
    hidden, seen = [], []
    for i, a in enumerate(corners):
        for b in corners[i + 1 :]:
            if (a != b).sum() == 1:
                x, y = camera.project(0.6 * a + 0.4 * b)[:2].astype(int)
                back = sum(p == q == far for p, q, far in zip(a, b, (0, 20, 0), strict=True)) == 2
                around = light(picture[y - 5 : y + 6, x - 5 : x + 6])
                (hidden if back else seen).append(np.median(around) - around[4:7, 4:7].min())
    assert len(hidden) == 3 and len(seen) == 9
    assert min(seen) > 30 and max(hidden) < 5


def coloured(shape, colour, alpha=1.0):
    document = shapes.document(shape)
    tool = XCAFDoc_DocumentTool.ColorTool_s(document.xcaf.Main())
    rgba = Quantity_ColorRGBA(Quantity_Color(*colour, Quantity_TOC_sRGB), alpha)
    tool.SetColor(document.parts[0].label, rgba, XCAFDoc_ColorType.XCAFDoc_ColorSurf)
    document.changed()
    return document


def test_colours_are_those_of_the_document_and_transparent_faces_let_others_through():
    box = BRepPrimAPI_MakeBox(10, 10, 10).Shape()
    red, _ = pixels(coloured(box, (0.9, 0.1, 0.1)), view=("front",), size="100x100")
    glass, _ = pixels(coloured(box, (0.9, 0.1, 0.1), 0.3), view=("front",), size="100x100")
    r, g, _ = red[50, 50]
    assert r > 2.5 * g
    assert (glass[50, 50] > red[50, 50] + 20).all(), "the paper shows through"


def test_faces_have_numbers_and_colours_of_their_own():
    document = shapes.document(BRepPrimAPI_MakeBox(10, 10, 10).Shape())
    picture, _ = pixels(document, show="faces", size="300x300")
    colours, counts = np.unique(picture.reshape(-1, 3), axis=0, return_counts=True)
    large = colours[counts > 3000]
    assert len(large) == 4, "paper and three faces"
    assert (np.linalg.norm(large[:, None] - large, axis=2) + 1e3 * np.eye(4)).min() > 25


@pytest.mark.parametrize("view", VIEWS)
def test_views_look_from_where_they_say(view):
    right, up, toward = axes(view)
    assert toward @ VIEWS[view] == pytest.approx(np.linalg.norm(VIEWS[view]))
    np.testing.assert_allclose(np.cross(right, up), toward, atol=1e-12)
    assert up[2] > 0.5 or abs(toward[2]) == 1


def test_views_on_a_sheet_have_one_scale(samples):
    document = shapes.document(BRepPrimAPI_MakeBox(30, 20, 10).Shape())
    picture, _ = pixels(document, show="faces", view=("front,right", "top"), size="900x300")
    dark = light(picture) < 250
    wide = [np.flatnonzero(dark[40:260, left : left + 300].any(axis=0)) for left in (0, 300, 600)]
    assert [np.ptp(each) for each in wide] == pytest.approx([270, 180, 270], abs=4)


def test_fit_fills_the_picture_with_faces():
    small = BRepPrimAPI_MakeBox(gp_Pnt(50, 50, 50), 1, 1, 1).Shape()
    document = shapes.document(BRepPrimAPI_MakeBox(10, 10, 10).Shape(), small)
    picture, _ = pixels(document, view=("front",), fit=("#7", "#8"), size="200x200")
    assert (light(picture)[20:150, 20:180] < 250).mean() > 0.85, "of the cube"


def test_two_models_are_seen_from_the_same_place():
    bodies = [shapes.document(BRepPrimAPI_MakeBox(size, size, size).Shape()) for size in (10, 5)]
    picture, _ = pixels(bodies[1], before=bodies[0], view=("front",), size="400x200", show="faces")
    rows = [(light(picture)[20:180, half + 5 : half + 195] < 250).sum(axis=0).max() for half in (0, 200)]
    assert rows[0] == pytest.approx(2 * rows[1], abs=6)


@pytest.mark.parametrize("show", ["shaded", "isophotes"])
def test_the_same_bytes_again(show, samples):
    first, second = (render(read(samples / "blade.step"), Picture(show=show, size="200x150")).data for _ in range(2))
    assert first == second


@dataclass(frozen=True)
class Shaken:
    """A surface whose points and derivatives are rounded otherwise."""

    ground: object
    rng: object

    def jets(self, uv, order):
        return tuple(each * (1 + 1e-12 * self.rng.standard_normal(each.shape)) for each in self.ground.jets(uv, order))


def shaken(*asked):
    body, rng = facets(*asked), np.random.default_rng(1)
    found = {
        k: replace(f, points=f.points * (1 + 1e-12 * rng.standard_normal(f.points.shape)), ground=Shaken(f.ground, rng))
        for k, f in body.facets.items()
    }
    return replace(body, facets=found)


@pytest.mark.parametrize(("name", "show"), [("blade", "zebra"), ("assembly", "shaded"), ("trimmed", "curvature")])
def test_rounding_changes_no_pixel_by_more_than_one(name, show, samples, monkeypatch):
    document = read(samples / f"{name}.step")
    plain, _ = pixels(document, show=show, size="300x200")
    monkeypatch.setattr("mracad.view.picture.facets", shaken)
    assert np.abs(pixels(document, show=show, size="300x200")[0] - plain).max() <= 1
