"""Roughness by closed forms, its invariances, and what counts as worse."""

from dataclasses import astuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.compiled import Compiled
from mracad.inspect.curvature import BENT, FORMS, Forms, shapes
from mracad.inspect.ramp import STEEP
from mracad.inspect.roughness import Change, Growth, Rougher, Roughness, worse
from mracad.inspect.survey import POINTS, RIPPLE, surveys
from tests.inspect.ramps import changes
from tests.model.shapes import circle, cylinder, face, graph, plane, rectangle, roof, sphere, torus


def survey(net, faces=None, points=8):
    return surveys([(net, faces or [face()])], points)[0]


def rough(net, faces=None, points=8):
    return survey(net, faces, points).roughness


def change(before, after, faces=None, points=POINTS):
    seen = surveys([(before.over(after.u, after.v), faces or [face()])], points)
    return changes(seen, [after])[0]


def kinds(before, after, faces=None, allowed=Growth()):  # noqa: B008
    return {each.what for each in worse(change(before, after, faces), allowed)}


def moved(net, poles):
    return Net(net.u, net.v, poles, net.weights)


def test_a_plane_has_none():
    found = rough(plane(7))
    assert found.area == pytest.approx(1, abs=1e-13)
    assert max(found.bending, found.curvature) < 1e-12 and found.variation < 1e-9 and found.kink == 0


@pytest.mark.parametrize("radius", [2.0, 300.0])
def test_a_sphere(radius):
    """κ₁ = κ₂ = 1/R: bending 8π, no variation; its poles are degenerate."""
    found = rough(sphere(radius), points=10)
    assert found.area == pytest.approx(4 * np.pi * radius**2, rel=1e-9)
    assert found.bending == pytest.approx(8 * np.pi, rel=1e-9)
    assert found.curvature == pytest.approx(1 / radius, rel=1e-7)
    assert found.variation < 1e-12 / radius**2
    assert found.kink < 1e-5


@pytest.mark.parametrize("size", [0.0, 1e-300, 1e-120, 1e-60])
def test_what_rounding_leaves_of_a_pole_is_no_curvature(size):
    """S_u as good as nothing at right angles to S_v: powers of it would be no numbers, which nothing compares with."""
    jet = np.random.default_rng(0).standard_normal((10, 3, 1))
    jet[1, :, 0], jet[2, :, 0] = (size, 0, 0), (0, 1, 0)
    found = Forms(shapes([jet], FORMS))
    assert not found.regular.any() and not found.largest.any() and not shapes([jet], BENT).any()


@pytest.mark.parametrize(("degree", "rational"), [(2, False), (3, True), (5, True)])
def test_many_points_have_the_same_figures_as_few(degree, rational, monkeypatch):
    """What is compiled for many rounds as what is not: no verdict depends on what a process has done before."""
    random = np.random.default_rng(1)
    u, v = (KnotVector.clamped(np.arange(spans + 1.0), degree) for spans in (9, 7))
    poles = random.standard_normal((u.count, v.count, 3))
    poles[1] = poles[2] = poles[1, 0]
    before = Net(u, v, poles, random.uniform(0.5, 1.5, poles.shape[:2]) if rational else None)
    holed = face([*rectangle(1.0, 0.0, 9.0, 7.0), circle((4.5, 3.5), 1.7)])
    found = []
    for used in (False, True):
        monkeypatch.setattr(Compiled, "pays", lambda self, work, used=used: used)
        (seen,) = surveys([(before, [holed])], singular=3.0, reaches=[(2.0, 2.0)])
        now = moved(before, poles * [1.0, 1.0, 1.2])
        told = seen.sight.tally(seen.sight.along(now), seen.marks)
        added, *motion = seen.sight.added(now, seen.marks)
        places = seen.places.compared(told, told.tops[2], told.tops[2], ()).figures
        found.append([seen.marks.counts, seen.marks.normals, seen.sharp, told.sums, told.tops, added, motion, places])
    assert 0 < found[0][0].sum() < len(found[0][0]) and len(seen.sight.runs) > len(seen.rule.v.ravel())
    for one, other in zip(*found, strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_cylinder():
    found = rough(cylinder(2.0, 3.0), points=10)
    assert found.bending == pytest.approx(2 * np.pi * 3 / 2, rel=1e-10)
    assert found.curvature == pytest.approx(0.5, rel=1e-9) and found.variation < 1e-20 and found.kink < 1e-5


def test_a_torus():
    """κ₁ = 1/r, κ₂ = cos v / (R + r cos v), H = (κ₁ + κ₂) / 2, integrated along the tube."""
    ring, tube = 5.0, 2.0
    found = rough(torus(ring, tube), points=12)
    v = np.linspace(0, 2 * np.pi, 2000, endpoint=False)
    away = ring + tube * np.cos(v)
    belt = 2 * np.pi * away * tube * (2 * np.pi / len(v))
    slope = -0.5 * ring * np.sin(v) / away**2 / tube
    assert found.area == pytest.approx(4 * np.pi**2 * ring * tube, rel=1e-9)
    assert found.bending == pytest.approx((belt * (1 / tube**2 + (np.cos(v) / away) ** 2)).sum(), rel=1e-8)
    assert found.variation == pytest.approx((belt * slope**2).sum(), rel=1e-7)
    assert found.curvature == pytest.approx(0.5, rel=1e-9)


@pytest.mark.parametrize("spans", [40, 80])
def test_a_ripple_of_small_slope(spans):
    """z = a sin kx: ½ a² k⁴ and ⅛ a² k⁶ a unit of area, a k²."""
    a, k = 1e-4, 4 * np.pi
    found = rough(graph(lambda x, y: a * np.sin(k * x) + 0 * y, spans))
    assert found.bending == pytest.approx(a**2 * k**4 / 2, rel=1e-3)
    assert found.variation == pytest.approx(a**2 * k**6 / 8, rel=2e-3)
    assert found.curvature == pytest.approx(a * k**2, rel=1e-3)


def test_the_largest_curvature_stands_on_a_knot():
    """Second derivatives of cubics are linear between knots: a survey takes points that see their peaks."""
    net = plane(9)
    poles = net.poles.copy()
    poles[..., 2] += np.random.default_rng(8).normal(0, 1e-4, poles.shape[:2])
    own, dense = (rough(moved(net, poles), points=points).curvature for points in (POINTS, 60))
    assert own == pytest.approx(dense, rel=1e-3)


def test_only_the_inside_of_the_trims_counts():
    """A bump beside a disc."""
    net = graph(lambda x, y: 0.01 * np.exp(-((x - 0.85) ** 2 + (y - 0.85) ** 2) / 2e-3), 40)
    disc = face([circle((0.35, 0.35), 0.3)])
    assert rough(net).curvature > 5
    assert rough(net, [disc]).curvature < 1e-3
    assert rough(net, [disc]).area == pytest.approx(np.pi * 0.09, rel=2e-3)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_figures_do_not_depend_on_place_direction_or_parameters(seed):
    rng = np.random.default_rng(seed)
    knots = KnotVector.clamped(np.append(np.cumsum(rng.uniform(0.5, 2, 6)) - 0.5, 13), 4)
    net = Net(
        knots, knots, rng.normal(0, 0.3, (knots.count, knots.count, 3)), rng.uniform(0.7, 1.4, (knots.count,) * 2)
    )
    net.poles[..., :2] += np.stack(np.meshgrid(knots.greville(), knots.greville(), indexing="ij"), axis=-1)
    wanted = rough(net)
    turned = moved(
        net, Rotation.from_rotvec(rng.normal(0, 1, 3)).apply(net.poles.reshape(-1, 3)).reshape(net.poles.shape)
    )
    stretched = KnotVector(3.7 * knots.knots - 20, 4)
    swapped = Net(knots, knots, net.poles.swapaxes(0, 1), net.weights.T)
    backwards = Net(KnotVector(-knots.knots[::-1], 4), knots, net.poles[::-1], net.weights[::-1])
    for other in (moved(turned, turned.poles + 50), Net(stretched, knots, net.poles, net.weights), swapped, backwards):
        assert astuple(rough(other)) == pytest.approx(astuple(wanted), rel=1e-7)


def test_scaling_laws():
    """Lengths times c: bending stays, variation falls by c², curvature by c."""
    net, c = graph(lambda x, y: 0.1 * np.sin(5 * x) * y, 9), 7.0
    one, other = rough(net), rough(moved(net, c * net.poles))
    assert other.area == pytest.approx(c**2 * one.area)
    assert other.bending == pytest.approx(one.bending)
    assert other.variation == pytest.approx(one.variation / c**2)
    assert other.curvature == pytest.approx(one.curvature / c)


def test_finer_knots_and_higher_degrees_change_nothing():
    net = graph(lambda x, y: 0.1 * np.sin(5 * x) * y, 6)
    fine = net.refined(np.linspace(0.03, 0.97, 7), [0.11, 0.5, 0.77])
    found = change(net, fine)
    assert not worse(found, Growth()) and found.motion < 1e-14 and found.turn < 1e-4
    assert found.after.bending == pytest.approx(found.before.bending, rel=1e-9)


@pytest.mark.parametrize("gap", [0.0, 3e-8])
@pytest.mark.parametrize("degrees", [0.5, 30.0])
def test_the_angle_across_a_knot_line(gap, degrees):
    found = rough(roof(np.radians(degrees), gap))
    assert found.kink == pytest.approx(degrees, rel=1e-5)
    beside = face(rectangle(1.1, 0.2, 1.9, 1.8))
    assert rough(roof(np.radians(degrees), gap), [beside]).kink == 0


def test_the_angle_across_the_seam_of_a_periodic_surface():
    net = cylinder(2.0, 3.0)
    poles = net.poles.copy()
    poles[1, :, 0] += 0.3
    found = rough(moved(net, poles)).kink
    assert found == pytest.approx(np.degrees(np.arctan2(0.3, 2)), rel=1e-6)


def test_a_new_kink_beside_a_crease():
    """The crease stays what it was, another knot line opens by a degree."""
    knots = KnotVector.from_multiplicities([0, 1, 2, 3], [4, 3, 3, 4], 3)
    v = KnotVector.clamped([0, 1], 2)
    x, y = np.meshgrid(knots.greville(), v.greville(), indexing="ij")

    def folded(second):
        rise = np.tan(np.radians(25)) * np.maximum(x - 1, 0) + np.where(x > 2, second * (x - 2), 0)
        return Net(knots, v, np.stack([x, y, rise], axis=-1))

    found = change(folded(0), folded(-0.02))
    assert found.before.kink == pytest.approx(25) and found.after.kink == pytest.approx(25)
    assert found.opened == pytest.approx(
        np.degrees(np.arctan(np.tan(np.radians(25))) - np.arctan(np.tan(np.radians(25)) - 0.02))
    )
    assert Rougher.KINK in {each.what for each in worse(found, Growth(1e9, 1e9, 1e9, kink=0.5))}
    assert not worse(found, Growth(1e9, 1e9, 1e9, kink=1.5))


def test_a_face_that_folds():
    net = plane(8)
    poles = net.poles.copy()
    poles[5, 5, 0] -= 0.6
    assert change(net, moved(net, poles)).turn == pytest.approx(180)
    assert Rougher.FOLD in kinds(net, moved(net, poles))
    steep = net.poles.copy()
    steep[..., 2] = np.tan(np.radians(29)) * steep[..., 0]
    assert kinds(net, moved(net, steep)) == set()
    steep[..., 2] = np.tan(np.radians(31)) * steep[..., 0]
    assert kinds(net, moved(net, steep)) == {Rougher.FOLD}
    assert kinds(net, moved(net, steep), allowed=Growth(fold=35)) == set()


def test_normals_may_turn_into_what_others_were_within_a_span_where_noise_goes():
    """Slopes of 45°, between which the surface is level within a span; the other way round there is no such place."""
    net = plane(12)
    poles = net.poles.copy()
    poles[..., 2] = 0.15 * (-1.0) ** np.arange(poles.shape[0])[:, None]
    rippled = moved(net, poles)
    assert change(rippled, net).turn <= STEEP and change(net, rippled).turn > 40
    assert kinds(rippled, net) == set() and Rougher.FOLD in kinds(net, rippled)
    poles[3:, :, 2] = 0.0
    assert change(moved(net, poles), net).turn > 30  # a single ripple is shape


def test_motion_and_deviation_along_the_normal():
    net = plane(6)
    found = change(net, moved(net, net.poles + np.array([0.3, 0, 0.4])))
    assert found.deviation == pytest.approx(0.4) and found.motion == pytest.approx(0.5) and found.turn < 1e-9


@pytest.mark.parametrize("what", ["bending", "variation", "curvature"])
def test_growth_beyond_what_is_allowed(what):
    noise = Roughness()
    old = Roughness(1.0, 2.0, 3.0, 4.0)
    new = Roughness(
        1.0,
        **{
            each: getattr(old, each) * (1.05 if each == what else 1.0) for each in ("bending", "variation", "curvature")
        },
    )
    assert [each.what.name.lower() for each in worse(Change(old, new, noise), Growth())] == [what]
    assert worse(Change(old, new, noise), Growth(**{what: 0.06})) == ()
    assert worse(Change(old, old, noise), Growth()) == ()


@pytest.mark.parametrize("net", [plane(8), cylinder(2.0, 3.0), graph(lambda x, y: 0.05 * x * y, 8)])
def test_ripples_that_the_kernel_cannot_see_count_for_nothing(net):
    """White noise of the control points: below the ripple never worse, well above it always."""
    rng = np.random.default_rng(5)
    noise = rng.normal(0, 1, net.poles.shape)
    assert kinds(net, moved(net, net.poles + 1e-3 * RIPPLE * noise), allowed=Growth(1e-6, 1e-6, 1e-6)) == set()
    assert kinds(net, moved(net, net.poles + 1e3 * RIPPLE * noise)) >= {Rougher.BENDING, Rougher.VARIATION}


def test_spans_of_a_few_nanometres_do_not_drown_the_rest():
    """Figures of a plane with near-duplicate knots, moved and turned: rounding alone; a real ripple is seen."""
    knots = KnotVector(np.sort([0.0] * 4 + [20.0, 20.0 + 3e-6, 40.0, 60.0] + [80.0] * 4), 3)
    x, y = np.meshgrid(knots.greville(), knots.greville(), indexing="ij")
    flat = Net(
        knots,
        knots,
        Rotation.from_rotvec([1, 2, 3]).apply(np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3)).reshape(*x.shape, 3),
    )
    shaken = moved(flat, flat.poles * (1 + np.random.default_rng(2).uniform(-1, 1, flat.poles.shape) * 2e-16))
    assert kinds(flat, shaken) == set() == kinds(shaken, flat)
    poles = flat.poles.copy()
    poles[5, 5] += 0.01
    assert kinds(flat, moved(flat, poles)) >= {Rougher.BENDING, Rougher.VARIATION, Rougher.CURVATURE}


def test_many_surfaces_at_once_are_as_each_by_itself():
    nets = [plane(3), sphere(), graph(lambda x, y: 0.1 * x * x * y, 70), roof(0.3), torus(), cylinder()]
    disc = face([circle((0.5, 0.5), 0.3)])
    faces = [[disc], [face()], [disc], [face()], [face()], [face()]]
    later = [moved(net, net.poles * [1, 1.1, 1]) for net in nets]
    together = changes(surveys(list(zip(nets, faces, strict=True))), later)
    for net, new, each, found in zip(nets, later, faces, together, strict=True):
        assert found == change(net, new, each)


def cone(spans, lift=0.0):
    """A sharp cone as a net that closes on a pole at u = 0, its rows from the fourth on lifted."""
    around = np.linspace(0, np.pi / 2, spans + 3)
    out = np.linspace(0, 1, spans + 3)
    u = v = KnotVector.clamped(np.arange(spans + 1.0), 3)
    height = -out + lift * np.maximum(out - out[3], 0) ** 2
    poles = np.stack(
        [np.outer(out, np.cos(around)), np.outer(out, np.sin(around)), np.outer(height, around * 0 + 1)], 2
    )
    return Net(u, v, poles)


def test_singular_points_count_only_where_they_change():
    before = cone(12)

    def found(after):
        (survey,) = surveys([(before.over(after.u, after.v), [face()])], singular=10.0)
        (each,) = changes([survey], [after])
        return each

    away = found(cone(12, lift=1.0))
    assert away.before.curvature <= 10.0 and away.unsettled < 5e-3
    assert Rougher.SINGULAR not in {each.what for each in worse(away, Growth())}
    scaled = found(moved(before, before.poles * [1.0, 1.0, 1.3]))
    assert Rougher.SINGULAR in {each.what for each in worse(scaled, Growth())}
