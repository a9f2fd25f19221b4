"""Features through the command line: closed forms of a bump on grounds of known geometry, read back from the file."""

import json

import numpy as np
import pytest
from mracad_cli.__main__ import main
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

from mracad.bspline.closest import feet
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.edit.feature.edits import repeat
from mracad.edit.feature.extract import feature_of
from mracad.edit.feature.score import Copy, lumpy, refuse
from mracad.errors import Code, EditError
from mracad.inspect.seams import seams
from mracad.job.look import snapshot
from mracad.occ.step import read_step, write_step
from mracad.occ.view import view
from mracad.spec.steps import Repeat, Single
from samples.models import geometry
from samples.models.panel import sewn
from samples.models.splines import split
from tests.conftest import CORPUS
from tests.edit import panels
from tests.edit.feature import grounds
from tests.edit.feature.grounds import HEIGHT, SIGMA, bump
from tests.edit.models import fitted
from tests.occ import shapes

FEATURE = "near:50,50,0,radius:20"


def model(path):
    return view(read_step(path))


def run(*arguments, code=0):
    assert main([str(a) for a in arguments]) == code


def repeated(source, target, *arguments, feature=FEATURE, use="repeat"):
    """Models before and after, and the report."""
    report = target.with_suffix(".json")
    run(use, source, "-o", target, "--report", report, "--feature", feature, *arguments)
    body = json.loads(report.read_text())
    assert body["valid"]["after"]["valid"]
    return model(source), model(target), body


def word(point):
    return ",".join(repr(float(x)) for x in point)


def square(net, count=300):
    return np.stack(np.meshgrid(*(np.linspace(*k.domain, count) for k in (net.u, net.v)), indexing="ij"), -1).reshape(
        -1, 2
    )


@pytest.fixture(scope="module")
def plane(tmp_path_factory):
    return grounds.save(tmp_path_factory.mktemp("plane") / "plane.step", grounds.plane(180.0))


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    return grounds.save(tmp_path_factory.mktemp("small") / "small.step", grounds.plane(100.0, (25.0, 25.0)))


@pytest.fixture(scope="module")
def feature(plane, tmp_path_factory):
    path = tmp_path_factory.mktemp("feature") / "bump.feature"
    run("feature", "extract", plane, "-o", path, "--feature", FEATURE)
    return path


def test_copies_whole_spans_away_are_exact(plane, tmp_path):
    """Twelve places, windows apart or overlapping: the sum of the source's own offsets, moved."""
    ways = [(x, y) for x in (0, 51, 98) for y in (0, 50, 99, 101)]
    places = [word((50 + x, 50 + y, 0)) for x, y in ways if x or y] + [word((77, 66, 0))]
    before, after, report = repeated(plane, tmp_path / "out.step", *(w for p in places for w in ("--at", p)))
    own = feature_of(before, Single(feature=FEATURE), {0}, FEATURE).origin.offsets[0]
    expected = np.zeros_like(own)
    for x, y in [*(w for w in ways if any(w)), (27, 16)]:
        i, j, _ = (slice(a.min(), a.max() + 1) for a in np.nonzero(own))
        expected[i.start + x : i.stop + x, j.start + y : j.stop + y] += own[i, j]
    off = after.surfaces[0].net.poles - before.surfaces[0].net.poles - expected
    print(f"12 exact copies: off by {np.abs(off).max():.1e} mm")
    assert len(report["copies"]) == 12 and all(c["exact"] for c in report["copies"])
    assert np.abs(off).max() <= 1e-9
    assert report["control_points"]["before"] == report["control_points"]["after"]


@pytest.mark.parametrize("height", ["0", "1.4"])
def test_a_place_beside_the_knots_is_moved_exactly_too(height):
    """The point that names the feature may lie off it: its place is on the ground below."""
    from tests.edit.models import sheet

    flat = sheet(grounds.plane(100.0, (30.3, 31.7)))
    edit = repeat(flat, Repeat(feature=f"near:30.3,31.7,{height},radius:18", at=("68.3,66.7,0",)))
    assert [copy.exact for copy in edit.copies] == [True]


def test_copies_anywhere_match_the_closed_form(feature, tmp_path):
    """On planes, a cylinder and a sphere of other knots and degrees, turned, at arbitrary places."""
    radius = 40.0
    middle = [(110.3, 71.7), (140.1, 140.6), (60.2, 152.3)]
    turned = grounds.uneven(origin=(0, 0, 500), degrees=(3, 2), seed=4)
    sheets = [
        grounds.uneven(),
        Net(turned.v, turned.u, turned.poles.swapaxes(0, 1)[:, ::-1]),
        grounds.cylinder(radius, 120, (300, 0, 0)),
        grounds.sphere(radius, (300, 300, 0)),
    ]
    source = grounds.save(tmp_path / "in.step", *sheets)
    a, t, p = 0.8, 0.9, 0.8
    on_cylinder = np.array([300 + radius * np.sin(a), 60, radius * np.cos(a)])
    way = np.array([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])
    on_sphere = np.array([300, 300, 0]) + radius * way
    lines = [f"{x},{y},{z},{33 * i}" for z in (0, 500) for i, (x, y) in enumerate(middle)]
    lines += [word(on_cylinder) + ",20", word(on_sphere) + ",70"]
    (tmp_path / "places.csv").write_text("x,y,z,rotate\n" + "\n".join(lines) + "\n")
    place = f"@{tmp_path}/places.csv"
    before, after, report = repeated(source, tmp_path / "out.step", "--at", place, feature=feature)
    nets = [(b.net, s.net) for b, s in zip(before.surfaces, after.surfaces, strict=True)]
    points = [(b.evaluate(square(b)), s.evaluate(square(b))) for b, s in nets]
    for k, up in ((0, 1.0), (1, 1.0)):
        old, new = points[k]
        wanted = sum(bump(np.hypot(old[:, 0] - x, old[:, 1] - y)) for x, y in middle)
        off = np.abs(new - old - up * wanted[:, None] * [0, 0, 1]).max() / HEIGHT
        print(f"plane {k + 1}, {nets[k][0].poles.shape[:2]} to {nets[k][1].poles.shape[:2]} poles: off by {off:.1e}")
        assert off <= 1e-3
    old, new = points[2]
    angle = np.arctan2(old[:, 0] - 300, old[:, 2])
    normal = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    far = np.hypot(radius * (angle - a), old[:, 1] - 60)
    check_curved("cylinder", new - old, normal, far)
    old, new = points[3]
    normal = (old - [300, 300, 0]) / radius
    check_curved("sphere", new - old, normal, radius * np.arccos(np.clip(normal @ way, -1, 1)))
    assert max(c["deviation"] for c in report["copies"]) <= 1e-3 * HEIGHT
    # knots only where copies lie: nowhere finer than the source, nothing where there is no copy
    assert report["control_points"]["after"] < 40_000


def check_curved(name, delta, normal, far):
    """The bump along the normals at geodesic distances: everywhere, and its height and size."""
    along = (delta * normal).sum(axis=1)
    off = np.linalg.norm(delta - bump(far)[:, None] * normal, axis=1).max() / HEIGHT
    # the distance at which half the height is left, from points near it
    near = np.abs(along - HEIGHT / 2) < 0.1
    size = np.sqrt(2 * np.log(HEIGHT / along[near]))
    sigma = np.median(far[near] / size)
    top = along.max() / bump(far[along.argmax()])
    print(f"{name}: off by {off:.1e} of the height, height {top:.4f}, size {sigma / SIGMA:.4f}")
    assert off <= 1e-2 and abs(top - 1) <= 1e-2 and abs(sigma / SIGMA - 1) <= 1e-2


@pytest.mark.parametrize(("source", "target"), [("cylinder 30", "cone 40"), ("sphere 60", "cylinder 30")])
def test_a_feature_of_curved_ground_is_the_same_elsewhere(source, target, tmp_path):
    """From four sewn patches with a corner under the feature, on ground whose sag exceeds it."""
    whole = grounds.above(source, lambda a, b: bump(np.hypot(a, b), sigma=3.0), half=30.0, spans=120)
    strips = split(whole.u.knots, whole.poles, 3, [1.0])
    rows = [[(u, v, n.swapaxes(0, 1)) for v, n in split(whole.v.knots, s.swapaxes(0, 1), 3, [-2.0])] for u, s in strips]
    bare = grounds.above(target, lambda a, b: 0 * a, half=30.0, spans=40)
    far = np.array([0.0, 300.0, 0.0])
    other = shapes.face_on(geometry.surface(bare.poles + far, bare.u.knots, bare.v.knots, (3, 3)))
    path = shapes.save(shapes.compound(sewn(rows), other), tmp_path / "in.step")
    zero = np.zeros(1)
    top = [np.stack(grounds.GROUNDS[name](zero, zero, zero), axis=1)[0] for name in (source, target)]
    _, after, report = repeated(
        path, tmp_path / "out.step", "--at", word(top[1] + far), feature=f"near:{word(top[0])},radius:15"
    )
    a, b = np.random.default_rng(0).uniform(-10, 10, (2, 500))
    wanted = np.stack(grounds.GROUNDS[target](a, b, bump(_geodesic(target, a, b), sigma=3.0)), axis=1) + far
    _, apart = feet(after.surfaces[4].net, wanted, np.stack([a, b], axis=1))
    (copy,) = report["copies"]
    print(f"{source} to {target}: off by {apart.max() / HEIGHT:.1e} of the height, base {copy['base']:.1e} mm")
    assert apart.max() <= 1e-3 * HEIGHT
    assert 0 < copy["base"] <= 1e-3 * HEIGHT


def _geodesic(name, a, b):
    """Distance on a ground from where a = b = 0; cylinders and cones unroll."""
    if not name.startswith("cone"):
        return np.hypot(a, b)
    slant = 40.0 * np.hypot(1, 0.3) / 0.3
    angle = b / 40.0 * 0.3 / np.hypot(1, 0.3)
    return np.sqrt((slant + a) ** 2 + slant**2 - 2 * slant * (slant + a) * np.cos(angle))


def test_places_off_the_faces_are_named_at_once_or_left_out(feature, plane, tmp_path, capsys):
    grid = ("repeat", plane, "-o", tmp_path / "out.step", "--feature", feature, "--at", "120,120,0")
    words = ("--grid", "3x2,50,40", "--at", "300,20,0")
    run(*grid, *words, code=Code.CANNOT_EDIT)
    said = capsys.readouterr().err
    assert "place 3,1 of the grid (220,120,0) is 40 mm away from the faces to edit; place 3,2 of the grid" in said
    assert "place 2 (300,20,0) is 120 mm away" in said and said.count("\n") == 1
    assert "place 1,1" not in said and not (tmp_path / "out.step").exists()
    run(*grid, *words, "--skip-off", "--clip", "--report", tmp_path / "r.json")
    body = json.loads((tmp_path / "r.json").read_text())
    assert {c["place"] for c in body["copies"]} == {f"place {i},{j} of the grid" for i in (1, 2) for j in (1, 2)}
    assert body["notes"][0].startswith("3 of 7 places left out: place 3,1 of the grid")
    run(*grid[:-1], "300,20,0", "--skip-off", "--overwrite", code=Code.CANNOT_EDIT)


def test_motion_leaves_a_clean_surface(plane, tmp_path):
    _, after, report = repeated(plane, tmp_path / "out.step", "--to", "120.4,130.7,0", "--rotate", 40, use="move")
    net = after.surfaces[0].net
    points = net.evaluate(square(net, 500))
    wanted = bump(np.hypot(points[:, 0] - 120.4, points[:, 1] - 130.7))
    source = np.hypot(points[:, 0] - 50, points[:, 1] - 50) < 30
    print(f"left at the source: {np.abs(points[source, 2]).max() / HEIGHT:.1e} of the height")
    assert np.abs(points[source, 2]).max() <= 1e-3 * HEIGHT
    assert np.abs(points[:, 2] - wanted).max() <= 1e-3 * HEIGHT
    assert len(report["copies"]) == 1


def test_motion_on_a_cylinder(tmp_path):
    """A bump along the normals of a rational cylinder: clean where it was, the same where it is."""
    radius = 40.0
    bare = grounds.cylinder(radius, 130)

    def normal(points):
        angle = np.arctan2(points[..., 0], points[..., 2])
        return np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=-1)

    def apart(points, angle=0.75, y=40.0):
        return np.hypot(radius * (np.arctan2(points[..., 0], points[..., 2]) - angle), points[..., 1] - y)

    source = grounds.save(tmp_path / "in.step", grounds.bumped(bare, 1.0, apart, normal))
    places = [word((radius * np.sin(a), y, radius * np.cos(a))) for a, y in ((0.75, 40.0), (0.8, 90.3))]
    window = f"near:{places[0]},radius:18"
    _, after, _ = repeated(
        source, tmp_path / "out.step", "--taper", "3mm", "--to", places[1], feature=window, use="move"
    )
    uv = square(bare, 400)
    old, new = bare.evaluate(uv), after.surfaces[0].net.evaluate(uv)
    off = np.linalg.norm(new - old - bump(apart(old, 0.8, 90.3))[:, None] * normal(old), axis=1) / HEIGHT
    left = off[apart(old) < 25].max()
    print(f"left on the cylinder: {left:.1e} of the height; the copy is off by {off.max():.1e}")
    assert left <= 5e-3 and off.max() <= 1e-2


@pytest.mark.parametrize("radius", [3, 4, 5])
def test_surroundings_tell_the_ground(radius):
    """Off the plane under a bump by the radius of the window in σ (METHOD: 3 %, 1.2e-3, 1.5e-5 of the height)."""
    from tests.edit.models import sheet

    flat = sheet(grounds.plane(120.0, (60.0, 60.0)))
    window = f"near:60,60,0,radius:{0.8 * radius * SIGMA}"
    found = feature_of(flat, Single(feature=window, taper=f"{0.2 * radius * SIGMA}mm"), {0}, window)
    net = flat.surfaces[0].net
    left = Net(net.u, net.v, net.poles - found.origin.offsets[0])
    points = left.evaluate(square(left))
    inside = np.hypot(points[:, 0] - 60, points[:, 1] - 60) < 0.75 * radius * SIGMA
    off = np.abs(points[inside, 2]).max() / HEIGHT
    print(f"{radius}σ: {off:.1e}")
    assert off <= {3: 5e-2, 4: 2e-3, 5: 2e-5}[radius]


def holds(before, after):
    """Largest gap and growth of the angle of any seam, mm and degrees."""
    old, new = seams(before), seams(after)
    assert old
    gap, angle = max(m.gap for m in new), max(n.angle - o.angle for o, n in zip(old, new, strict=True))
    print(f"gap {gap:.1e} mm, angle grown by {angle:.1e}°")
    return gap, angle


@pytest.mark.parametrize("turns", [("", "", ""), ("x", "", "")])
@pytest.mark.parametrize("place", [(0.0, 0.0), (4.0, 22.0)])
def test_copies_over_a_corner_of_three_patches(feature, tmp_path, turns, place):
    write_step(grounds.rhombi(turns=turns), tmp_path / "in.step")
    before, after, _ = repeated(tmp_path / "in.step", tmp_path / "out.step", "--at", word((*place, 0)), feature=feature)
    gap, angle = holds(before, after)
    assert gap <= 1e-7 and angle <= 0.01
    for one, two in zip(before.surfaces, after.surfaces, strict=True):
        old, new = (s.net.evaluate(square(one.net)) for s in (one, two))
        wanted = bump(np.hypot(old[:, 0] - place[0], old[:, 1] - place[1]))
        assert np.abs(new - old - wanted[:, None] * [0, 0, 1]).max() <= 1e-3 * HEIGHT


def test_copies_over_seams_of_a_curved_panel(feature, tmp_path):
    """Over a seam and a corner of patches that differ in knots, degree and sense; the rest of the panel stays."""
    clean, _ = panels.whole(40, 0.0, patches=(2, 3))
    patches = panels.cut(clean, (2, 3))
    patches[1, 0] = panels.turned(patches[1, 0], "ux")
    patches[0, 1] = panels.refined(patches[0, 1], np.array([11.3, 47.1, 88.8]), np.array([122.2, 147.7]))
    patches[1, 1] = panels.replace(patches[1, 1], net=panels.elevated(panels.elevated(patches[1, 1].net, 0), 1))
    write_step(panels.document(patches), tmp_path / "in.step")
    places = [(100.0, 50.0), (101.3, 97.2), (100.0, 200.0)]
    words = [w for x, y in places for w in ("--at", word((x, y, panels.truth(x, y))))]
    before, after, report = repeated(tmp_path / "in.step", tmp_path / "out.step", *words, feature=feature)
    gap, angle = holds(before, after)
    assert gap <= 1e-7 and angle <= 0.01
    assert max(c["deviation"] for c in report["copies"]) <= 1e-3 * HEIGHT
    assert [len(c["faces"]) for c in report["copies"]] == [2, 4, 4]


def test_what_a_net_grew_by_is_told(feature, tmp_path, capsys):
    """By face, and how many control points move: whole knot lines are inserted."""
    k = KnotVector.clamped(np.linspace(0.0, 1.0, 5), 3)
    x, y = np.meshgrid(120 * k.greville(), 120 * k.greville(), indexing="ij")
    source = grounds.save(tmp_path / "flat.step", Net(k, k, np.stack([x, y, 0 * x], axis=-1)))
    capsys.readouterr()
    _, _, body = repeated(source, tmp_path / "out.step", "--at", "60,60,0", feature=feature)
    text = capsys.readouterr().out
    (face,), points = body["faces"], body["control_points"]
    assert points["before"] == 49 and face["points"] == points["after"] == 49 + face["added"]
    assert 100 < face["moving"] < face["points"]
    words = f"control points: {points['after']} (were 49: {face['added']} more on #1, by whole knot lines; "
    assert f"{words}{face['moving']} of these faces' move)" in text
    assert "take" not in text
    _, _, body = repeated(source, tmp_path / "cut.step", "--at", "0,60,0", "--clip", feature=feature)
    (copy,) = body["copies"]
    assert 0.5 < copy["taken"] < 0.6
    assert f"edges and holes take {100 * copy['taken']:.2g} % of their volume" in capsys.readouterr().out


def test_copies_on_an_analytic_cylinder(feature, tmp_path):
    """The face is converted; a copy lies over the edge where it closes."""
    radius = 40.0
    source = shapes.save(BRepPrimAPI_MakeCylinder(radius, 100.0).Shape(), tmp_path / "in.step")
    _, after, _ = repeated(
        source, tmp_path / "out.step", "--faces", "type:cylinder", "--at", "40,0,48", feature=feature
    )
    net = next(s.net for s in after.surfaces)
    points = net.evaluate(square(net, 400))
    angle = np.arctan2(points[:, 1], points[:, 0])
    height = np.hypot(points[:, 0], points[:, 1]) - radius
    off = np.abs(height - bump(np.hypot(radius * angle, points[:, 2] - 48))).max() / HEIGHT
    print(f"analytic cylinder: off by {off:.1e} of the height")
    assert off <= 1e-2


def hole(path):
    face = shapes.face_on(geometry.surface(*_flat()))
    tool = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(60, 60, -5), gp_Dir(0, 0, 1)), 6.0, 10.0).Shape()
    return shapes.save(BRepAlgoAPI_Cut(face, tool).Shape(), path)


def _flat():
    k = KnotVector.clamped(np.linspace(0.0, 120.0, 61), 3)
    net = fitted(k, k, lambda x, y: 0 * x, u_of=lambda t: t, v_of=lambda t: t)
    return net.poles, k.knots, k.knots


def test_holes_and_edges_refuse_copies_or_take_their_part(feature, tmp_path, capsys):
    source, target = hole(tmp_path / "in.step"), tmp_path / "out.step"
    run("repeat", source, "-o", target, "--feature", feature, "--at", "66,60,0", code=4)
    message = capsys.readouterr().err
    assert "place 1 (66,60,0)" in message and "--clip" in message and not target.exists()
    before, after, report = repeated(source, target, "--at", "70,60,0", "--clip", feature=feature)
    (copy,) = report["copies"]
    assert 0.3 * HEIGHT < copy["lost"] < HEIGHT
    old, new = before.surfaces[0].net, after.surfaces[0].net
    angle = np.linspace(0, 2 * np.pi, 200)
    rim = np.stack([60 + 6 * np.cos(angle), 60 + 6 * np.sin(angle)], axis=1)
    assert np.abs(new.evaluate(rim) - old.evaluate(rim)).max() <= 1e-13  # the rounding of knots inserted


ERRORS = [
    (["--at", "60,50,60"], 4, "place 1 (60,50,60) is 60 mm away from the faces"),
    (["--at", "110,50,0"], 4, "place 1 (110,50,0) is 10 mm away from the faces"),
    (["--at", "#1@500,2"], 4, "place 1 (#1@500,2) is outside the face"),
    (["--at", "#4@1,2"], 2, "place 1 (#4@1,2): '#4'"),
    (["--at", "1,2"], 2, "at: '1,2' is not a place"),
    (["--at", "95,50,0"], 4, "place 1 (95,50,0): edges or holes"),
    (["--at", "60,60,0", "--feature", "near:25,25,0,radius:60"], 4, "larger than its face"),
    (["--at", "60,60,0", "--feature", "#1@20:120,20:50"], 4, "outside the face"),
    (["--at", "60,60,0", "--feature", "near:70,70,0,radius:10"], 4, "nothing stands out"),
    (["--at", "@bad.csv"], 3, "bad.csv:3: '30,forty,0'"),
    (["--at", "@none.csv"], 3, "none.csv"),
    (["--at", "1,1,1", "--feature", "none.feature"], 3, "none.feature"),
    ([], 2, "no place is given"),
    (["--grid", "3by3,1,1"], 2, "grid: '3by3,1,1'"),
    (["--along", "edge#9,3"], 2, "edge#1 to edge#4"),
]


@pytest.mark.parametrize(("arguments", "code", "words"), ERRORS)
def test_errors_name_the_place(small, tmp_path, monkeypatch, capsys, arguments, code, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.csv").write_text("x,y,z\n60,60,0\n30,forty,0\n")
    extra = [] if "--feature" in arguments else ["--feature", "near:25,25,0,radius:17"]
    run("repeat", small, "-o", "out.step", *extra, *arguments, code=code)
    message = capsys.readouterr().err.strip()
    assert words in message and message.count("\n") == 0
    assert not (tmp_path / "out.step").exists()


def lopsided(path):
    """A plane with a large and a small bump beside it: a feature that shows turns and mirrors."""
    k = KnotVector.clamped(np.linspace(0.0, 160.0, 161), 3)
    shape = lambda x, y: bump(np.hypot(x - 40, y - 40)) + bump(np.hypot(x - 48, y - 44), 0.6, 2.5)  # noqa: E731
    return grounds.save(path, fitted(k, k, shape, u_of=lambda t: t, v_of=lambda t: t))


def test_copies_are_turned_mirrored_and_scaled(tmp_path):
    source = lopsided(tmp_path / "in.step")
    window = "near:40,40,0,radius:22"
    settings = ["--rotate", 90, "--mirror", "--size", 0.8, "--height", -0.5]
    before, after, _ = repeated(source, tmp_path / "out.step", "--at", "110.3,100.2,0", *settings, feature=window)
    net = before.surfaces[0].net
    old, new = (m.surfaces[0].net.evaluate(square(net, 400)) for m in (before, after))
    x, y = (old[:, 0] - 110.3) / 0.8, (old[:, 1] - 100.2) / 0.8
    x, y = y, x  # turned back by 90° and mirrored at x
    wanted = -0.5 * (bump(np.hypot(x, y)) + bump(np.hypot(x - 8, y - 4), 0.6, 2.5))
    assert np.abs(new - old - wanted[:, None] * [0, 0, 1]).max() <= 2e-3 * HEIGHT


def test_overlapping_copies(small, tmp_path):
    places = ["--at", "60,60,0", "--at", "66.5,60,0"]
    found = {}
    for rule in ("add", "max", "replace"):
        before, after, _ = repeated(
            small, tmp_path / f"{rule}.step", *places, "--overlap", rule, feature="near:25,25,0,radius:17"
        )
        old, new = (m.surfaces[0].net for m in (before, after))
        points = old.evaluate(square(old, 400))
        found[rule] = (new.evaluate(square(old, 400)) - points)[:, 2]
    one, two = (bump(np.hypot(points[:, 0] - x, points[:, 1] - 60)) for x in (60, 66.5))
    assert np.abs(found["add"] - one - two).max() <= 1e-3 * HEIGHT
    assert np.abs(found["max"] - np.maximum(one, two)).max() <= 0.05 * HEIGHT  # a crease that knots of 1 mm round off
    core = np.hypot(points[:, 0] - 66.5, points[:, 1] - 60) < 16
    assert np.abs(found["replace"] - two)[core].max() <= 1e-3 * HEIGHT
    assert found["replace"].max() < 1.01 * HEIGHT < found["add"].max()


def test_patterns(small):
    """A grid and a polar pattern that begin at the feature, one along an edge, and places moved at random."""
    ground = model(small)

    def at(**options):
        edit = repeat(ground, Repeat(feature="near:25,25,0,radius:14", taper="4mm", **options))
        return np.array([copy.at for copy in edit.copies])

    grid = at(grid="3x2,25,50")
    wanted = [(25 + 25 * i, 25 + 50 * j, 0) for i in range(3) for j in range(2) if i or j]
    assert np.abs(grid - wanted).max() < 1e-5
    polar = at(polar="4,50,50,0,0,0,1")
    assert np.abs(polar - [(75, 25, 0), (75, 75, 0), (25, 75, 0)]).max() < 1e-5
    along = at(along="edge#1,3,20", size=0.8)
    edge = ground.edges[0]
    apart = (along - edge.points[12]) @ np.cross(edge.tangents[12], [0, 0, 1])
    assert len(along) == 3 and np.abs(np.abs(apart) - 20).max() < 1e-3
    assert np.abs(np.linalg.norm(np.diff(along, axis=0), axis=1) - 100 / 3).max() < 0.05
    first, again = (at(at=("50,50,0",), jitter="3mm", spin=90.0, seed=5) for _ in range(2))
    assert (first == again).all() and 0 < np.linalg.norm(first - [50, 50, 0]) <= 3
    other = at(at=("50,50,0",), jitter="3mm", seed=6)
    assert np.linalg.norm(first - other) > 1e-3


def test_features_are_found(plane, capsys):
    run("feature", "list", plane, "--json")
    (found,) = json.loads(capsys.readouterr().out)["features"]
    assert np.abs(np.array(found["place"]) - [50, 50, HEIGHT]).max() < 1
    assert 0.8 * HEIGHT < found["height"] < 1.1 * HEIGHT and 2 * SIGMA < found["size"] < 6 * SIGMA


def test_transfer_of_a_feature_between_units(small, tmp_path):
    k = KnotVector.clamped(np.linspace(0.0, 120.0, 61), 3)
    flat = shapes.face_on(geometry.surface(fitted(k, k, lambda x, y: 0 * x, size=1.0).poles, k.knots, k.knots))
    inch = shapes.save(flat, tmp_path / "inch.step", "INCH")
    target = tmp_path / "out.step"
    run("transfer", small, inch, "-o", target, "--from", "near:25,25,0,radius:17", "--to", "61.2,58.3,0")
    old, new = model(inch).surfaces[0].net, model(target).surfaces[0].net
    points, moved = old.evaluate(square(old)), new.evaluate(square(old))
    wanted = bump(np.hypot(points[:, 0] - 61.2, points[:, 1] - 58.3))
    assert np.abs(moved - points - wanted[:, None] * [0, 0, 1]).max() <= 1e-3 * HEIGHT


def test_transfer_of_the_character_of_a_face(tmp_path):
    """A texture on a cylinder, at the same lengths along it; a face's own detail is itself."""
    k = KnotVector.clamped(np.linspace(0.0, 80.0, 81), 3)
    ripple = lambda x, y: 0.2 * np.sin(2 * np.pi * x / 8) * np.cos(2 * np.pi * y / 9)  # noqa: E731
    texture = grounds.save(tmp_path / "texture.step", fitted(k, k, ripple, u_of=lambda t: t, v_of=lambda t: t))
    bare = grounds.save(tmp_path / "bare.step", grounds.cylinder(40.0, 70))
    target = tmp_path / "out.step"
    band = ["--band", "0mm:20mm"]
    run("transfer", texture, bare, "-o", target, "--from", "#1", "--to", "#1", *band, "--mode", "replace")
    old, new = model(bare).surfaces[0].net, model(target).surfaces[0].net
    points = old.evaluate(square(old))
    delta = new.evaluate(square(old)) - points
    angle = np.arctan2(points[:, 0], points[:, 2])
    height = delta[:, 0] * np.sin(angle) + delta[:, 2] * np.cos(angle)
    x, y = 40 * angle, points[:, 1]
    middle = (x > 15) & (x < 50) & (y > 15) & (y < 55)
    off = np.abs(height - ripple(x, y))[middle].max() / 0.2
    print(f"texture on a cylinder: off by {off:.1e} of its height")
    assert off <= 2e-2
    same = tmp_path / "same.step"
    run("transfer", texture, texture, "-o", same, "--from", "#1", "--to", "#1", *band, "--blend", "0.4")
    one, two = model(texture).surfaces[0].net, model(same).surfaces[0].net
    assert np.abs(one.poles - two.poles).max() <= 1e-12


@pytest.mark.skipif(CORPUS is None, reason="MRACAD_CORPUS does not name a folder of STEP models")
def test_samples_that_coincide_along_a_seam_count_once():
    """Else the plate through them has no solution."""
    model = view(read_step(CORPUS / "engine_nacelle_openshell_tigl.step"))
    window = "near:2188.86,-382.397,-287.284,radius:300"
    edit = repeat(model, Repeat(feature=window, at=("1948.27,-466.698,-330.851",)))
    assert edit.faces("edited")


@pytest.mark.skipif(CORPUS is None, reason="MRACAD_CORPUS does not name a folder of STEP models")
@pytest.mark.parametrize(("size", "short"), [(1.0, False), (5.0, True)])
def test_a_copy_larger_than_its_ground_allows_is_refused(size, short):
    """Whatever may be taken from it where it meets edges that stay."""
    model = view(read_step(CORPUS / "engine_nacelle_openshell_tigl.step"))
    feature, place = "near:2188.86,-382.397,-287.284,radius:300", "1948.27,-466.698,-330.851"
    options = Repeat(feature=feature, at=(place,), size=size, clip=True)
    if not short:
        assert 0 < repeat(model, options).copies[0].short < 0.05 * 8.8
        return
    with pytest.raises(EditError, match=f"place 1 .{place}.: the faces there cannot hold the copy") as caught:
        repeat(model, options)
    assert caught.value.code == Code.CANNOT_EDIT


def test_copies_that_are_off_by_a_fifth_of_their_height_are_named():
    def copy(name, short, height):
        return Copy(name, (0.0, 0.0, 0.0), (4,), 9.0, 9.0, 9.0, short, False, height)

    good = [copy("one", 0.14, 3.0), copy("two", 0.29, 6.0)]
    refuse(good, clip=True)
    assert lumpy(good) == ()
    bad = [copy("one", 0.59, 3.0), copy("two", 0.84, 6.0), *good]
    refuse(bad, clip=True)
    (note,) = lumpy(bad)
    assert note.startswith("2 of 4 copies deviate by more than 5 %") and note.endswith("one (0,0,0) by 20 %")
    with pytest.raises(EditError, match=r"two \(0,0,0\): .* cannot hold the copy: .* by 21 % .* .#5.") as caught:
        refuse([copy("one", 0.59, 3.0), copy("two", 1.26, 6.0)], clip=True)
    assert caught.value.code == Code.CANNOT_EDIT
    with pytest.raises(EditError, match=r"two \(0,0,0\): .* no better: four \(0,0,0\); one \(0,0,0\);") as caught:
        refuse(
            [copy(name, short, 6.0) for name, short in zip(("one", "two", "four"), (0, 1.3, 1.3), strict=True)], False
        )
    assert [list(some) for some in caught.value.bad.values()] == [[1, 2], [0]]


@pytest.mark.parametrize("angle", [0.0, 1.0])
def test_a_surface_that_stands_in_two_places_is_edited_from_either(angle):
    """Places and windows mean the face they lie on, whichever of the two it is."""
    from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
    from OCP.TopLoc import TopLoc_Location

    from tests.cli.declared import heights
    from tests.occ import shapes

    x, y = np.meshgrid(np.linspace(0, 10, 16), np.linspace(0, 10, 16), indexing="ij")
    face = shapes.face_on(shapes.bspline(np.stack([x, y, heights(x, y)], axis=-1)))
    there, turn = gp_Trsf(), gp_Trsf()
    there.SetTranslation(gp_Vec(30, 0, 0))
    turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), angle)
    both = shapes.compound(face, face.Moved(TopLoc_Location(there.Multiplied(turn))))
    model = snapshot(shapes.document(both))
    assert len(model.surfaces) == 1

    def at(number, *point):
        return ",".join(repr(float(c)) for c in (model.faces[number].frame @ [*point, 1.0])[:3])

    found = [
        repeat(model, Repeat(feature=f"near:{at(i, 5, 5, 0.3)},radius:1.5", at=(at(j, 5, 7.5, 0.0),)))
        for i in (0, 1)
        for j in (0, 1)
    ]
    first = found[0].displacement.offsets[0]
    assert np.abs(first.poles).max() > 0.1
    for edit in found[1:]:
        assert np.abs(edit.displacement.offsets[0].poles - first.poles).max() < 1e-9


def test_a_copy_stands_out_of_the_face_that_it_is_on():
    """Two faces on one surface, the second turned over: its outside is below."""
    net = grounds.plane(120.0, (30.0, 30.0))
    surface = geometry.surface(net.poles, net.u.knots, net.v.knots, (3, 3))
    faces = shapes.face_on(surface, 0.0, 60.0, 0.0, 120.0), shapes.face_on(surface, 60.0, 120.0, 0.0, 120.0).Reversed()
    for number, order in enumerate((faces, faces[::-1])):
        before = view(shapes.document(shapes.compound(*order)))
        assert len(before.surfaces) == 1 and [face.reversed for face in before.faces] == [number == 1, number == 0]
        change = repeat(before, Repeat(feature="near:30,30,0,radius:18", at=("90,40,0", "30,85,0")))
        points = net.evaluate(uv := square(net))
        moved = change.displacement.applied(before).surfaces[0].net.evaluate(uv) - points
        wanted = bump(np.hypot(points[:, 0] - 30, points[:, 1] - 85)) - bump(
            np.hypot(points[:, 0] - 90, points[:, 1] - 40)
        )
        assert np.abs(moved - wanted[:, None] * [0, 0, 1]).max() <= 1e-3 * HEIGHT
