"""Levels: the projection on a rung of the ladder, under what rims and seams hold."""

import numpy as np
import pytest

from mracad.bspline.fit import through
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.edit.fair import faired
from mracad.edit.level import Coarser, level
from mracad.edit.result import Reason
from mracad.edit.target import sheets
from mracad.edit.tolerances import Tolerances
from mracad.inspect.seams import seams
from mracad.model.cells import quadrature
from mracad.occ.view import view
from mracad.seam.energy import forms
from mracad.seam.interface import Joints
from mracad.seam.solve import Problem, Space
from mracad.seam.wishes import Wishes
from mracad.spec.steps import Level
from mracad.wavelet.ladder import arc_lengths, rungs_by_level
from mracad.wavelet.project import projection
from tests.edit import halves, panels
from tests.edit.models import sheet
from tests.edit.test_fair import beside, rough
from tests.edit.test_seams import other_degrees, other_knots, other_senses, skewed

SPANS, NOISE = 16, 0.3

EVERY_EDGE = tuple(f"edge#{i}" for i in range(1, 5))


def rung(net, level):
    """The net projected on a whole level of its own ladders."""
    coarse = [rungs_by_level(k, lengths=arc_lengths(net, axis)) for axis, k in enumerate((net.u, net.v))]
    u, v = (rungs[min(level, len(rungs) - 1)] for rungs in coarse)
    return projection(v, net.v).apply(projection(u, net.u).apply(net.poles, 0), 1)


def wanted(net, level):
    """What a level wants of a surface of which nothing is held, and the surface in the space of that."""
    model = sheet(net)
    one = sheets(model, {0}, Coarser(level))[0]
    every = np.ones(one.net.poles.shape[:2], bool)
    problem = Problem({0: Space(one.net, forms(one.net, one.net, quadrature(one.net, model.faces)), every, every)})
    return Coarser(level).target(problem, {0: one}, Joints()).reshape(one.net.poles.shape), one


def nets():
    _, cubic = rough(spans=(24, 18))
    _, quintic = rough(spans=(12, 14))
    weights = 1 + 0.2 * np.random.default_rng(1).random(cubic.poles.shape[:2])
    squares = cubic.over(cubic.u.refined(cubic.u.breaks[[4, 9]]), cubic.v)
    return {
        "cubic": cubic,
        "rational": Net(cubic.u, cubic.v, cubic.poles, weights),
        "double knots": squares,
        "of degree 5": panels.elevated(panels.elevated(quintic, 0, 2), 1, 2),
    }


@pytest.mark.parametrize("name", nets())
@pytest.mark.parametrize("level", [1, 2])
def test_a_level_of_one_surface_is_the_projection_on_its_ladder(name, level):
    net = nets()[name]
    delta, _ = wanted(net, level)
    assert np.abs(delta).max() > 0.01
    np.testing.assert_allclose(net.poles + delta, rung(net, level), atol=1e-10)


def test_a_level_of_a_quadratic_surface_is_quadratic():
    _, cubic = rough(spans=(24, 18))
    u, v = (type(k)(k.knots[1:-1], 2) for k in (cubic.u, cubic.v))
    net = Net(u, v, cubic.poles[: u.count, : v.count])
    delta, one = wanted(net, 1)
    direct = Net(u, v, rung(net, 1)).over(one.net.u, one.net.v)
    assert one.net.u.degree == 3
    np.testing.assert_allclose(one.net.poles + delta, direct.poles, atol=1e-10)


def test_levels_are_projections():
    """A second time there is nothing left, and a coarse spline is what it was."""
    _, net = rough(spans=(24, 18))
    delta, _ = wanted(net, 2)
    model = sheet(Net(net.u, net.v, net.poles + delta))
    one = sheets(model, {0}, Coarser(2))[0]
    # ladders go by lengths only where knots cluster, so that both have the same
    assert sheets(sheet(net), {0}, Coarser(2))[0].detail > 0.1 and one.detail < 1e-10


def test_a_fraction_of_a_level_blends_two_of_them():
    _, net = rough(spans=(24, 18))
    low, high, between = (wanted(net, level)[0] for level in (1, 2, 1.25))
    assert np.abs(high - low).max() > 0.01
    np.testing.assert_allclose(between, 0.75 * low + 0.25 * high, atol=1e-10)
    np.testing.assert_allclose(wanted(net, 0.5)[0], 0.5 * low, atol=1e-10)
    assert not wanted(net, 0)[0].any()


def test_the_wavelength_of_a_level_is_that_of_its_coarse_knots():
    _, net = rough(spans=(24, 20))
    u, v = (float(arc_lengths(net, axis).sum()) for axis in (0, 1))
    found = [sheets(sheet(net), {0}, Coarser(level))[0].wavelength for level in (1, 2, 1.5)]
    assert found[0] == pytest.approx(np.sqrt(2) * min(u / 12, v / 10)) and found[2] == pytest.approx(sum(found[:2]) / 2)
    assert found[1] == pytest.approx(np.sqrt(2) * min(u / 6, v / 5))


def test_held_rims_make_it_the_nearest_surface_that_keeps_them():
    """Noise two wavelengths away from the rim: then no smoother way to the rim is needed."""
    middle = np.zeros((43, 35))
    middle[10:-10, 10:-10] = 1.0
    _, net = rough(spans=(40, 32), where=middle)
    model = sheet(net)
    result = faired(model, {0}, Coarser(1), Wishes(), Tolerances(1e-3), refine=False)
    moved = result.moved[0]
    assert moved.amount == 1.0
    one = sheets(model, {0}, Coarser(1))[0]
    mass = forms(net, one.metric, quadrature(net, model.faces)).mass.toarray()
    free = np.zeros(net.poles.shape[:2], bool)
    free[1:-1, 1:-1] = True
    free[np.ix_([1, -2], [1, -2])] = False
    free = np.flatnonzero(free)
    target = (rung(net, 1) - net.poles).reshape(-1, 3)
    dense = np.zeros_like(target)
    dense[free] = np.linalg.solve(mass[np.ix_(free, free)], (mass @ target)[free])
    assert np.abs(dense).max() > 0.05
    np.testing.assert_allclose(moved.offset.reshape(-1, 3), dense, atol=1e-6)


@pytest.mark.parametrize("options", [{"level": 2}, {"scale": "60mm"}])
def test_rims_that_stay_make_no_face_rougher_than_it_was_or_its_coarse_shape_is(options):
    """That is off at the rims, and a short step back to them would be rough: of all ways one is taken that is not."""
    knots = KnotVector.clamped(np.linspace(0.0, 60.0, 13), 3)
    x, y = np.meshgrid(knots.greville(), knots.greville(), indexing="ij")
    model = sheet(Net(knots, knots, np.stack([x, y, 4 * np.sin(x / 9) * np.cos(y / 11)], axis=-1)))
    free, held = (level(model, Level(**options, hold=hold)).outcomes[0] for hold in ((), EVERY_EDGE))
    (before, coarse), (_, after) = free.roughness, held.roughness
    assert free.moved > 0.1 and (held.status == "edited" or held.reason is Reason.ROUGHER)
    for figure in ("bending", "variation", "curvature"):
        assert getattr(after, figure) <= 1.005 * max(getattr(each, figure) for each in (before, coarse))


def figures(shape, keep, change=lambda patches: patches):
    """Error of the panel in patches over that of the unsplit one, level 2 of each: four coarse spans a patch."""
    clean, noisy = panels.whole(SPANS, NOISE, patches=shape)
    patches = panels.cut(noisy, shape)
    model = sheet(noisy)
    whole = faired(model, {0}, Coarser(2), Wishes(keep), Tolerances(1e-3)).displacement().applied(model).surfaces[0].net
    unsplit = panels.rms({k: p.net for k, p in panels.cut(whole, shape).items()}, patches, clean)
    patches = change(patches)
    model = view(panels.document(patches))
    result = faired(model, set(range(len(patches))), Coarser(2), Wishes(keep), Tolerances(1e-3))
    after = result.displacement().applied(model)
    coupled = panels.rms({k: after.surfaces[i].net for i, k in enumerate(sorted(patches))}, patches, clean)
    found = seams(after)
    assert len(result.joints.exact) == len(found) == 2 * shape[0] * shape[1] - sum(shape)
    assert max(each.gap for each in found) <= 1e-9 and max(each.angle for each in found) <= 1e-5
    if keep == "g2":
        assert max(each.bend for each in found) <= 1e-9
    print(f"{shape} patches, {keep}: unsplit {unsplit:.4f} mm, in patches {coupled / unsplit:.3f} of it")
    return coupled / unsplit


@pytest.mark.parametrize(("shape", "keep"), [((2, 3), "g1"), ((2, 3), "g2"), ((4, 4), "g1")])
def test_a_level_of_patches_is_a_level_of_the_surface_they_make(shape, keep):
    """Also where less is kept of seams than they have."""
    assert figures(shape, keep) <= 1.02


@pytest.mark.parametrize("change", [other_senses, other_degrees])
@pytest.mark.parametrize("keep", ["g1", "g2"])
def test_patches_that_differ_come_as_close(change, keep):
    assert figures((2, 3), keep, change) <= 1.02


@pytest.mark.parametrize("keep", ["g1", "g2"])
def test_patches_with_knots_of_their_own_come_close(keep):
    """Their level is one of all knots along a strip, no denser than those of the patches are on average."""
    assert figures((2, 3), keep, other_knots) <= 1.05


def test_a_joint_of_varying_ratio_does_not_lock():
    """T_u = −(1 + v / 2) S_u: patches come as close to the truth as where the ratio is constant."""
    grid = np.stack(np.meshgrid(np.linspace(0, 1, 60), np.linspace(0, 1, 60), indexing="ij"), -1).reshape(-1, 2)
    errors = []
    for skew in (0.5, 0.0):
        clean, noisy = skewed(0.0, skew), skewed(NOISE, skew)
        model = view(panels.pair(*noisy))
        result = faired(model, {0, 1}, Coarser(2), Wishes("g1"), Tolerances(1e-3))
        after = result.displacement().applied(model)
        (found,) = seams(after)
        assert len(result.joints.exact) == 1 and found.gap <= 1e-9 and found.angle <= 1e-5
        off = [s.net.evaluate(grid) - c.evaluate(grid) for s, c in zip(after.surfaces, clean, strict=True)]
        errors.append(np.sqrt(np.mean(np.concatenate(off) ** 2)))
    print(f"ratio that varies {errors[0]:.4f} mm, constant {errors[1]:.4f} mm")
    assert errors[0] <= 1.14 * errors[1]


def test_halves_that_meet_along_a_trim_curve_come_closer_together_than_alone():
    clean, left, right = halves.surfaces(0.2, (30, 60))
    model = view(halves.document(left, right))
    errors = []
    for hold in (frozenset(), frozenset(range(len(model.edges)))):
        result = faired(model, {0, 1}, Coarser(2), Wishes("g1", hold=hold), Tolerances(1e-3))
        after = result.displacement().applied(model)
        assert len(result.joints.loose) == (not hold)
        errors.append(beside([surface.net for surface in after.surfaces], clean))
    assert errors[0] < 0.95 * errors[1]


def test_a_coarse_shape_gets_no_control_points_that_it_does_not_need():
    """Joined patches with a rim that is held: their own suffice."""
    _, noisy = panels.whole(SPANS, NOISE, patches=(1, 2))
    model = view(panels.document(panels.cut(noisy, (1, 2))))
    edit = level(model, Level(level=1.0, hold=("edge#1",)))
    assert len(edit.faces("edited")) == 2 and not any(each.inserted for each in edit.outcomes)


def test_waves_of_patches_go_by_scale_whatever_their_knots():
    """Ripples of half the scale and less go, those of three scales stay, across the seam between different knots."""
    found = []
    for length in (12.0, 90.0):
        knots = [KnotVector.clamped(np.linspace(100.0 * k, 100.0 * (k + 1), n + 1), 3) for k, n in ((0, 50), (1, 64))]
        across = KnotVector.clamped(np.linspace(0.0, 100.0, 13), 3)
        patches = {}
        for k, u in enumerate(knots):
            x, y = np.meshgrid(u.greville(), across.greville(), indexing="ij")
            net = Net(u, across, np.zeros((u.count, across.count, 3)))
            wave = 0.1 * np.sin(2 * np.pi * x / length)
            frame = (100.0 * k, 100.0 * (k + 1)), (0.0, 100.0)
            patches[k, 0] = panels.Patch(net.with_poles(through(net, np.stack([x, y, wave], axis=-1))), "", frame)
        model = view(panels.document(patches))
        after = level(model, Level(scale="30mm")).displacement.applied(model)
        at = np.linspace(0.2, 0.8, 80)
        heights = [
            s.net.grid(*(k.domain[0] + at * k.period for k in (s.net.u, s.net.v)))[..., 2] for s in after.surfaces
        ]
        found.append(np.sqrt(2 * np.mean(np.square(heights))) / 0.1)
    assert found[0] <= 0.1 and 0.95 <= found[1] <= 1.05
