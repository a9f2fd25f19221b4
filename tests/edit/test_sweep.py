"""Sweeps: the kernel in closed form, points that are met, details that ride, seams, what is held, what is refused."""

import json
from dataclasses import replace

import numpy as np
import pytest
from mracad_cli.__main__ import main
from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere

from mracad.bspline.fit import interpolated
from mracad.bspline.surface import Net
from mracad.edit.led import led
from mracad.edit.sweep import sweep
from mracad.errors import EditError, UsageError
from mracad.inspect.seams import seams
from mracad.model.brep import Trim
from mracad.occ.files import write
from mracad.occ.step import read_step
from mracad.occ.view import view
from mracad.spec.select import scope
from mracad.spec.steps.shape import Sweep
from tests import zoo
from tests.edit import panels
from tests.edit.models import fitted, free_edge, segment, sheet
from tests.edit.test_equalize import even, graded, rational, swapped, uneven
from tests.occ import shapes


def swept(model, at, by, scale, **options):
    """The nets after a sweep of points ``(k, 3)`` by vectors ``(k, 3)``."""
    words = [tuple(",".join(map(repr, map(float, each))) for each in np.atleast_2d(xyz)) for xyz in (at, by)]
    edit = sweep(model, Sweep(at=words[0], by=words[1], scale=f"{scale}mm", **options))
    return [surface.net for surface in edit.displacement.applied(model).surfaces]


def kernel(r, scale):
    """x³ K₃(x) / 8, x = r/ℓ: the Fourier transform of 1 / (1 + (ℓ k)²)⁴, over its value at r = 0."""
    from scipy.special import kv

    x = np.maximum(np.asarray(r), 1e-9) * 2 * np.pi / scale
    return x**3 * kv(3, x) / 8


def flat(x, y):
    return 0.0 * x


def test_a_point_of_a_plane_moves_as_the_closed_form_says():
    model = sheet(fitted(even(40), even(40), flat, size=400.0))
    (net,) = swept(model, [200, 200, 0], [0, 0, 10], 80)
    r = np.linspace(0.0, 160.0, 33)
    found = net.evaluate(np.stack([0.5 + r / 400, np.full(33, 0.5)], axis=1))[:, 2]
    assert np.abs(found / 10 - kernel(r, 80.0)).max() < 0.004
    x, y, z = np.asarray(net.grid(np.linspace(0, 1, 81), np.linspace(0, 1, 81))).reshape(-1, 3).T
    assert np.abs(z[np.hypot(x - 200, y - 200) > 160]).max() <= 0.01 * 10 and z.min() > -0.001 * 10


@pytest.mark.parametrize("inside", [20.0, 40.0])
def test_a_corner_follows_and_does_not_swing(inside):
    """Nothing moves the other way, and hardly anything farther than the point."""
    model = sheet(fitted(even(40), even(40), flat, size=400.0))
    (net,) = swept(model, [inside, inside, 0], [0, 0, 10], 80)
    z = np.asarray(net.grid(np.linspace(0, 1, 81), np.linspace(0, 1, 81)))[..., 2]
    assert z.min() > -0.001 * 10 and z.max() < 1.3 * 10


NETS = {
    "uneven": lambda h: fitted(uneven(24, 0), uneven(24, 2), h),
    "graded": lambda h: fitted(even(30), even(24), h, u_of=graded),
    "swapped": lambda h: swapped(fitted(even(24), uneven(24, 0), h)),
    "degree 5": lambda h: fitted(even(16, 5), even(16, 5), h),
    "rational": lambda h: rational(fitted(even(24), even(24), h)),
    "one span": lambda h: fitted(even(1), even(1), h),
}


@pytest.mark.parametrize("name", NETS)
def test_parameters_do_not_matter(name):
    """One move on other knots, degrees, weights and parameters gives the same height everywhere."""
    wanted = swept(sheet(fitted(even(40), even(40), flat)), [40, 60, 0], [0, 0, 5], 40)[0]
    (net,) = swept(sheet(NETS[name](flat)), [40, 60, 0], [0, 0, 5], 40)
    x, y, z = np.asarray(net.grid(np.linspace(0, 1, 60), np.linspace(0, 1, 60))).reshape(-1, 3).T
    assert np.abs(z - wanted.evaluate(np.stack([x, y], axis=1) / 100)[:, 2]).max() < 0.02 * 5


def wavy(x, y):
    return 5 * np.sin(x / 40) + 0.2 * np.sin(2 * np.pi * x / 7) * np.cos(2 * np.pi * y / 9)


def test_points_get_exactly_where_they_should():
    net = fitted(even(50), even(50), wavy)
    model, uv = sheet(net), np.array([[0.3, 0.3], [0.7, 0.4], [0.5, 0.8], [0.52, 0.83]])
    at = net.evaluate(uv)
    by = np.array([[0, 0, 8], [2, -1, 5], [0, 0, 0], [0, 0.1, 0.3]], float)
    (after,) = swept(model, at, by, 50)
    assert np.abs(after.evaluate(uv) - at - by).max() <= 1e-6


def test_places_to_go_to_and_a_file_of_points(tmp_path):
    net = fitted(even(30), even(30), wavy)
    model, uv = sheet(net), np.array([[0.3, 0.3], [0.7, 0.6]])
    at, path = net.evaluate(uv), tmp_path / "points.csv"
    to = at + np.array([[0, 1, 3], [0, 0, -4]])
    path.write_text("x,y,z,dx,dy,dz\n" + ",".join(map(repr, map(float, [*at[1], 0, 0, -4]))))
    words = [",".join(map(repr, map(float, each))) for each in (at[0], to[0])]
    options = Sweep(at=(words[0], f"@{path}"), to=(words[1],), scale="40mm")
    after = sweep(model, options).displacement.applied(model).surfaces[0].net
    assert np.abs(after.evaluate(uv) - to).max() <= 1e-6


RADIUS, LENGTH = 60.0, 300.0


def tube(height):
    """Half a cylinder along y with a bump on it."""
    u, v = even(90), even(90)
    turn, y = np.meshgrid(np.pi * u.greville(), LENGTH * v.greville(), indexing="ij")
    bump = np.exp(-((RADIUS * (turn - np.pi / 2)) ** 2 + (y - 225.0) ** 2) / (2 * 5.0**2))
    radius = RADIUS + height * bump
    return Net(u, v, interpolated(u, v, np.stack([radius * np.cos(turn), y, radius * np.sin(turn)], axis=-1)))


def bent(points):
    """A bend by 30° over the length, about an axis along x."""
    x, y, z = points.T
    reach = LENGTH / np.radians(30)
    return np.stack([x, (reach - z) * np.sin(y / reach), reach - (reach - z) * np.cos(y / reach)], axis=1)


def test_a_bump_on_a_cylinder_keeps_its_height_and_its_angle():
    bare, bumpy = tube(0.0), tube(2.0)
    uv = np.array([[u, v] for v in np.linspace(0, 1, 7) for u in (0.05, 0.275, 0.5, 0.725, 0.95)])
    at = bare.evaluate(uv)
    assert np.abs(bumpy.evaluate(uv) - at).max() < 1e-4
    (plain,), (after,) = (swept(sheet(net), at, bent(at) - at, 120) for net in (bare, bumpy))
    top = np.array([[0.5, 0.75]])
    before, now = bumpy.evaluate(top) - bare.evaluate(top), after.evaluate(top) - plain.evaluate(top)
    was, normal = bare.normals(top), plain.normals(top)
    assert np.degrees(np.arccos((was * normal).sum())) > 20
    assert (now * normal).sum() == pytest.approx((before * was).sum(), rel=0.01)
    assert np.degrees(np.arccos(abs((now * normal).sum()) / np.linalg.norm(now))) < 0.9
    around = np.array([[0.5 + x / np.pi / RADIUS, 0.75 + y / LENGTH] for x in range(-8, 9, 2) for y in range(-8, 9, 2)])
    heights = [
        ((a.evaluate(around) - b.evaluate(around)) * b.normals(around)).sum(axis=1)
        for a, b in ((bumpy, bare), (after, plain))
    ]
    assert np.abs(heights[0] - heights[1]).max() < 0.01 * 2.0


def test_a_tube_thinner_than_the_scale_bends_and_its_poles_stay():
    """A point of a ball, closed along a seam: all of it moves but for the poles."""
    ball = view(shapes.document(zoo.nurbs(BRepPrimAPI_MakeSphere(20.0).Shape())))
    (net,) = swept(ball, [-20, 0, 0], [-3, 0, 0], 60)
    ends = net.grid(np.linspace(*net.u.domain, 9), np.array(net.v.domain))
    assert np.abs(np.abs(ends[..., 2]) - 20).max() < 1e-9 and np.abs(ends[..., :2]).max() < 1e-9
    x = np.asarray(net.grid(np.linspace(*net.u.domain, 41), np.array([0.5 * sum(net.v.domain)])))[:, 0, 0]
    assert x.min() == pytest.approx(-23, abs=1e-3) and x.max() < 20


def saved(tmp_path, turns="ux"):
    clean, _ = panels.whole(12, 0.0, patches=(2, 2))
    patches = panels.cut(clean, (2, 2))
    patches[1, 0] = panels.turned(patches[1, 0], turns)
    write(panels.document(patches), tmp_path / "in.step")
    return patches, clean


def test_seams_hold_in_the_file_where_four_patches_meet(tmp_path):
    patches, clean = saved(tmp_path)
    at = clean.evaluate([[100.0, 100.0]])[0]
    words = ["--at", ",".join(map(repr, map(float, at))), "--by", "1,0,12", "--scale", "90mm"]
    out, report = tmp_path / "out.step", tmp_path / "r.json"
    assert main(["sweep", str(tmp_path / "in.step"), "-o", str(out), *words, "--report", str(report)]) == 0
    model = view(read_step(out))
    assert max(seam.gap for seam in seams(model)) <= 1e-9
    assert max(seam.angle for seam in seams(model)) <= 1e-5
    for patch, surface in zip((patches[k] for k in sorted(patches)), model.surfaces, strict=True):
        corner = surface.net.evaluate([patch.place((100.0, 100.0))])[0]
        assert np.abs(corner - at - [1, 0, 12]).max() <= 1e-6
    assert json.loads(report.read_text())["valid"]["after"]["valid"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--at 50,50,Z --by 90,0,0 --scale 40mm", ["would fold"]),
        ("--at 50,50,Z --by 0,0,3 --at 1,2,300 --by 0,0,1 --at 5,5,-200 --by 0,0,1 --scale 40mm", ["2 (1,2,300) is 2"]),
        ("--at 50,50,Z --by 0,0,3 --scale 40mm --hold #1", ["is on #1, which is held"]),
        ("--at 50,50,Z --by 0,0,3 --scale 40mm --faces #2", ["is on #1, which is not selected"]),
        ("--at 50,50,Z --by 0,0,3 --scale 40mm --hold near:50,50,Z,radius:9", ["point 1 (50,50,", "is held"]),
        ("--at 50,50,Z --by 0,0,3 --at 50,50,Z --by 0,0,4 --scale 40mm", ["point 2", "cannot be met together"]),
    ],
)
def test_what_cannot_be_done_is_refused_in_a_line(words, said, tmp_path, capsys):
    _, clean = saved(tmp_path)
    z = repr(float(clean.evaluate([[50.0, 50.0]])[0, 2]))
    out = tmp_path / "out.step"
    assert main(["sweep", str(tmp_path / "in.step"), "-o", str(out), *words.replace("Z", z).split()]) == 4
    error = capsys.readouterr().err
    assert all(word in error for word in said) and error.count("\n") == 1 and not out.exists()
    assert ("point 3" in error) == ("-200" in words)


def test_what_is_held_stays():
    net = fitted(even(40), even(40), wavy)
    model = sheet(net)
    at = net.evaluate([[0.5, 0.5]])
    (frozen,) = swept(model, at, [0, 0, 6], 60, edges="frozen")
    (free,) = swept(model, at, [0, 0, 6], 60)
    rim = np.stack([np.linspace(0, 1, 40), np.zeros(40)], axis=1)
    assert np.abs(frozen.evaluate(rim) - net.evaluate(rim)).max() < 1e-9
    assert np.abs(free.evaluate(rim) - net.evaluate(rim)).max() > 0.1
    (around,) = swept(model, at, [0, 0, 6], 60, hold=("box:0,0,-99,30,100,99",))
    inside = np.array([[x, y] for x in np.linspace(0, 0.299, 20) for y in np.linspace(0, 1, 20)])
    assert np.abs(around.evaluate(inside) - net.evaluate(inside)).max() < 1e-9
    for after in (frozen, around):
        assert np.abs(after.evaluate([[0.5, 0.5]]) - at - [0, 0, 6]).max() <= 1e-6


def test_less_of_it_is_a_shorter_way():
    net = fitted(even(30), even(30), wavy)
    model, top = sheet(net), [[0.5, 0.5]]
    at = net.evaluate(top)
    (half,) = swept(model, at, [0, 0, 6], 60, amount=0.5)
    assert np.abs(half.evaluate(top) - at - [0, 0, 3]).max() <= 1e-6
    (bound,) = swept(model, at, [0, 0, 6], 60, max_deviation="2mm")
    way = (bound.evaluate(top) - at)[0]
    assert np.abs(way[:2]).max() < 1e-6 and 1.9 < way[2] < 2.3
    edit = sweep(model, Sweep(at=(",".join(map(str, at[0])),), by=("0,0,6",), scale="60mm", amount=0.0))
    assert not edit.displacement.offsets


@pytest.mark.parametrize(
    ("options", "what"),
    [
        ({}, "no point"),
        ({"at": ("1,2,3",)}, "no move is given"),
        ({"at": ("1,2,3",), "by": ("0,0,1",), "to": ("0,0,1",)}, "cannot be combined"),
        ({"at": ("1,2,3", "2,3,4"), "to": ("0,0,1",)}, "1 for 2 points"),
        ({"at": ("1,2,3",), "by": ("0,0",)}, "three numbers"),
        ({"at": ("here",), "by": ("0,0,1",)}, "not a place"),
        ({"at": ("1,2,3",), "by": ("0,0,1",), "scale": "0mm"}, "scale"),
    ],
)
def test_bad_words_are_refused(options, what):
    with pytest.raises(UsageError, match=what):
        Sweep(**{"scale": "10mm", **options})


def test_a_point_beside_what_stays_is_refused():
    net = fitted(even(30), even(30), wavy)
    with pytest.raises(EditError, match="is held, or too near"):
        swept(sheet(net), net.evaluate([[0.5, 0.002]]), [0, 0, 3], 60, edges="frozen")


def test_a_face_on_half_of_its_surface_turns_up_to_its_rim():
    """An aerofoil round its nose, of which a face has one side: what lies beyond the rim does not turn its details."""
    u, v = even(30), even(60, 8)
    along, turn = np.meshgrid(1000.0 * u.greville(), 2 * np.pi * v.greville(), indexing="ij")
    wing = Net(u, v, interpolated(u, v, np.stack([along, 30 * np.cos(turn), 4 * np.sin(turn)], axis=-1)))
    whole = sheet(wing)
    ends = [(0.0, 0.0), (1.0, 0.0), (1.0, 0.507), (0.0, 0.507)]
    trims = tuple(Trim(i, segment(ends[i], ends[(i + 1) % 4])) for i in range(4))
    edges = tuple(free_edge(i, wing, trim.curve) for i, trim in enumerate(trims))
    half = replace(whole, faces=(replace(whole.faces[0], trims=trims),), edges=edges)
    at = wing.evaluate([[0.5, 0.25]])
    (net,) = swept(half, at, [0, 0, 10], 240)
    moved = np.asarray(net.grid(np.linspace(0, 1, 101), np.linspace(0, 0.5, 201)))
    moved = moved - np.asarray(wing.grid(np.linspace(0, 1, 101), np.linspace(0, 0.5, 201)))
    assert np.linalg.norm(moved, axis=-1).max() <= 1.02 * 10


def test_regions_rotate_and_stretch():
    """Their points go where the motion takes them, what lies between does too, and far away nothing moves."""
    net = fitted(even(60), even(60), lambda x, y: 5 * np.sin(x / 80), size=300.0)
    model, middle = sheet(net), net.evaluate([[0.5, 0.5]])[0]
    normal = net.normals(np.array([[0.5, 0.5]]))[0]
    word = ",".join(map(repr, map(float, middle)))
    us = np.linspace(0, 1, 121)
    before = np.asarray(net.grid(us, us))
    away = np.linalg.norm(before - middle, axis=-1)

    def moved(**options):
        options = Sweep(at=(word,), radius="20mm", scale="50mm", **options)
        points = led(model, options, scope(model, options), 50.0)
        after = sweep(model, options).displacement.applied(model).surfaces[0].net
        got = after.evaluate(points.places[0])
        assert np.abs(got - net.evaluate(points.places[0]) - points.moves[0]).max() <= 1e-6
        far = np.linalg.norm(np.asarray(after.grid(us, us)) - before, axis=-1)[away > 20 + 2 * 50].max()
        assert far <= 0.01 * points.largest
        return net.evaluate(points.places[0]) - middle, got - middle, np.asarray(after.grid(us, us)), points.largest

    start, end, grid, largest = moved(rotate="normal,12")
    c, s = np.cos(np.radians(12)), np.sin(np.radians(12))
    wanted = c * start + s * np.cross(normal, start) + (1 - c) * (start @ normal)[:, None] * normal
    assert np.abs(end - wanted).max() <= 1e-6
    inside, off = away < 18, before - middle
    wanted = c * off + s * np.cross(normal, off) + (1 - c) * (off @ normal)[..., None] * normal
    assert np.linalg.norm(grid - middle - wanted, axis=-1)[inside].max() <= 0.01 * largest
    start, end, *_ = moved(stretch="1.1")
    assert np.abs(end - 1.1 * start).max() <= 1e-6
    start, end, *_ = moved(stretch="x,1.2", rotate=f"{middle[0] - 10},0,0,0,1,0,5", by=("0,0,3",))
    c, s = np.cos(np.radians(5)), np.sin(np.radians(5))
    pivot = np.array([-10.0, 0.0, -middle[2]])
    off = start * [1.2, 1, 1] - pivot
    turned = np.stack([c * off[:, 0] + s * off[:, 2], off[:, 1], c * off[:, 2] - s * off[:, 0]], axis=1)
    assert np.abs(end - (turned + pivot + [0, 0, 3])).max() <= 1e-6


def test_an_edge_moves_as_a_whole():
    net = fitted(even(40), even(40), lambda x, y: 5 * np.sin(x / 40))
    model, rim = sheet(net), np.stack([np.linspace(0, 1, 101), np.zeros(101)], axis=1)
    for by, way in (("0,1,3", [0, 1, 3]), ("2", 2 * net.normals(rim))):
        options = Sweep(at=("edge#1",), by=(by,), scale="40mm")
        points = led(model, options, scope(model, options), 40.0)
        after = sweep(model, options).displacement.applied(model).surfaces[0].net
        missed = after.evaluate(points.places[0]) - net.evaluate(points.places[0]) - points.moves[0]
        assert np.abs(missed).max() <= 1e-6 and len(missed) >= 25
        assert np.abs(after.evaluate(rim) - net.evaluate(rim) - way)[:, 2].max() <= 0.02 * points.largest
        far = np.stack([np.linspace(0, 1, 101), np.full(101, 0.9)], axis=1)
        assert np.abs(after.evaluate(far) - net.evaluate(far)).max() <= 0.01 * points.largest


@pytest.mark.parametrize(
    ("options", "what"),
    [
        ({"rotate": "z,10"}, "no region"),
        ({"stretch": "1.1"}, "no region"),
        ({"radius": "5mm"}, "no move"),
        ({"radius": "5mm", "rotate": "10"}, "no axis"),
        ({"radius": "5mm", "rotate": "0,0,0,10"}, "no axis"),
        ({"radius": "5mm", "rotate": "z,much"}, "not an angle"),
        ({"radius": "5mm", "stretch": "0"}, "no factor"),
        ({"at": ("edge#1",), "radius": "5mm", "by": ("1",)}, "no region"),
        ({"at": ("edge#x",), "by": ("1",)}, "not a place"),
        ({"by": ("1,2",)}, "three numbers"),
    ],
)
def test_bad_words_about_regions_are_refused(options, what):
    with pytest.raises(UsageError, match=what):
        Sweep(**{"scale": "10mm", "at": ("1,2,3",), **options})
