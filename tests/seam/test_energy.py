"""Mass and bending of displacements against closed forms."""

import numpy as np
import pytest

from mracad import memo
from mracad.bspline.crease import crease_lines
from mracad.bspline.fit import interpolated, through
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.compiled import Compiled
from mracad.model.cells import quadrature
from mracad.seam.energy import forms, slopes
from mracad.seam.kinks import KINK_WEIGHT
from mracad.seam.stretch import Limit, Stretch
from tests.edit.models import rotation
from tests.model.shapes import circle, cylinder, face, graph, plane, rectangle, sphere, torus


def of(net, curves=(), creases=((), ())):
    return forms(net, net, quadrature(net, [face(curves)]), creases)


def fitted(net, function):
    """Coefficients of a function of x and y in the space of a net."""
    points = net.grid(net.u.greville(), net.v.greville())
    return interpolated(net.u, net.v, function(points[..., 0], points[..., 1])[..., None]).ravel()


def sped(degree=6, spans=5):
    """The unit square, x = 0.6 u + 0.4 u² and y = v + u / 4 v."""
    net = plane(spans, degree)
    u, v = np.meshgrid(net.u.greville(), net.v.greville(), indexing="ij")
    points = np.stack([0.6 * u + 0.4 * u**2, v * (1 + u / 4), 0 * u], axis=-1)
    return Net(net.u, net.v, interpolated(net.u, net.v, points))


def weighted(net):
    """The same plane under weights that vary along u."""
    u, _ = np.meshgrid(net.u.greville(), net.v.greville(), indexing="ij")
    values = np.asarray(net.grid(net.u.greville(), net.v.greville()))
    bare = Net(net.u, net.v, net.poles, 1.0 + 0.2 * u)
    return bare.with_poles(through(bare, values))


def fitted_over(net, function):
    """The same with the weights of the net."""
    points = np.asarray(net.grid(net.u.greville(), net.v.greville()))
    return through(net, function(points[..., 0], points[..., 1])[..., None]).ravel()


@pytest.mark.parametrize(
    ("net", "curves", "area", "near"),
    [
        (plane(5, size=2.0, height=3.0), (), 6.0, 1e-13),
        (plane(8), rectangle(0.1, 0.2, 0.6, 0.9), 0.35, 1e-13),
        (plane(40), [circle((0.5, 0.5), 0.3)], np.pi * 0.09, 5e-3),
        (cylinder(2.0, 3.0), (), 12 * np.pi, 1e-2),
        (sphere(2.0), (), 16 * np.pi, 2e-2),
    ],
)
def test_masses_sum_to_the_area(net, curves, area, near):
    assert of(net, curves).mass.sum() == pytest.approx(area, rel=near)


def test_what_does_not_reach_into_a_face_has_no_mass():
    net = plane(10)
    mass = of(net, rectangle(0.0, 0.0, 0.3, 1.0)).mass.toarray()
    reaching = np.repeat(net.u.knots[: net.u.count] < 0.3 - 1e-12, net.v.count)
    assert (mass.diagonal() > 0).tolist() == reaching.tolist()
    assert not mass[~reaching].any() and not mass[:, ~reaching].any()


CURVED = (
    (lambda x, y: x**2, 4.0),
    (lambda x, y: y**2, 4.0),
    (lambda x, y: x * y, 2.0),
    (lambda x, y: 1 + 2 * x - 3 * y, 0.0),
)


@pytest.mark.parametrize(("function", "density"), CURVED)
@pytest.mark.parametrize("net", [plane(4), sped()], ids=["even", "uneven"])
def test_bending_is_that_of_the_plane_whatever_the_parameters(net, function, density):
    found, c = of(net), fitted(net, function)
    assert c @ found.bending @ c == pytest.approx(density * found.mass.sum(), rel=1e-9, abs=1e-9)


SLOPED = (
    (lambda x, y: 1 + 2 * x - 3 * y, lambda x, y: 13.0 + 0 * x),
    (lambda x, y: x * y, lambda x, y: x**2 + y**2),
)


@pytest.mark.parametrize(("function", "density"), SLOPED)
@pytest.mark.parametrize("net", [plane(4), sped(), weighted(plane(6))], ids=["even", "uneven", "rational"])
def test_slopes_are_those_of_the_plane_whatever_the_parameters_and_weights(net, function, density):
    rule = quadrature(net, [face(())])
    found, c = slopes(net, net, rule), fitted_over(net, function)
    x, y, _ = np.moveaxis(np.asarray(net.grid(rule.u.ravel(), rule.v.ravel())), 2, 0)
    su, sv = (net.tangents(rule.u.ravel(), rule.v.ravel(), axis) for axis in (0, 1))
    area = np.abs(su[..., 0] * sv[..., 1] - su[..., 1] * sv[..., 0])
    wanted = (density(x, y) * area * rule.weights).sum()
    assert c @ found @ c == pytest.approx(wanted, rel=1e-6)


def test_bending_does_not_change_with_rotation_and_scales_with_the_square_of_length():
    net = torus()
    plain = of(net)
    turned = of(Net(net.u, net.v, net.poles @ rotation([1, -2, 0.5], 1.1).T + [5.0, 6.0, 7.0], net.weights))
    large = of(Net(net.u, net.v, 10 * net.poles, net.weights))
    for name, power in (("mass", 2), ("bending", -2)):
        form = getattr(plain, name)
        size = np.abs(form).max()
        assert np.abs(form - getattr(turned, name)).max() < 1e-11 * size
        assert np.abs(form - getattr(large, name) / 10.0**power).max() < 1e-11 * size


def test_bending_on_a_rational_cylinder():
    radius, length = 2.0, 3.0
    rough = cylinder(radius, length)
    net = rough.refined((np.arange(32) + 0.5) / 32, [])
    found = of(net)
    height = net.poles[..., 2].ravel()
    assert height @ found.bending @ height < 1e-12 * np.abs(found.bending).max()
    ring = net.poles[..., 0].ravel()  # R cos θ
    assert ring @ found.bending @ ring == pytest.approx(np.pi * length / radius, rel=1e-3)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_tent_over_a_knot_line_of_full_multiplicity_is_a_kink(axis):
    net, slope, height = plane(4, size=2.0, height=3.0), 0.1, (3.0, 2.0)[axis]
    at = (1.0, 1.5)[axis]
    extra = [[at, at], []][:: 1 - 2 * axis]
    net = net.refined(*extra)
    c = slope * np.abs((net.poles[..., axis] - at).ravel())
    step = (0.5, 0.75)[axis]
    energy = KINK_WEIGHT * (2 * slope) ** 2 * height / step
    found = of(net)
    assert c @ found.bending @ c == pytest.approx(energy, rel=1e-10)
    assert not found.creases.nnz
    apart = of(net, creases=[[at], ()][:: 1 - 2 * axis])
    assert c @ apart.creases @ c == pytest.approx(energy, rel=1e-10)
    assert abs(c @ apart.bending @ c) < 1e-10 * energy


def test_a_kink_counts_only_where_the_line_lies_on_a_face():
    net = plane(4).refined([0.5, 0.5], [])
    c = np.abs(net.poles[..., 0] - 0.5).ravel()
    whole = c @ of(net).bending @ c
    half = of(net, rectangle(0.0, 0.0, 1.0, 0.5)).bending
    assert c @ half @ c == pytest.approx(whole / 2, rel=1e-10)
    aside = of(net, rectangle(0.0, 0.0, 0.4, 1.0)).bending
    assert abs(c @ aside @ c) < 1e-10 * whole


def test_a_kink_where_a_period_ends_is_one_like_the_others():
    """A cylinder of four cubic quarters: nothing tells its closing line from the other three lines."""
    net = cylinder()
    net = net.over(net.u.elevated(3), net.v.elevated(3))
    c = np.random.default_rng(6).standard_normal((net.u.count, net.v.count))
    for bent in (False, True):
        creases = [net.u.full, ()] if bent else ((), ())
        found = of(net, creases=creases)
        one, other = (x.ravel() for x in (c, np.roll(c, net.u.count // 4, axis=0)))
        for form in (found.bending, found.creases):
            assert one @ form @ one == pytest.approx(other @ form @ other, rel=1e-9)
        assert bool(found.creases.nnz) is bent


def test_a_crease_where_a_period_ends_is_one():
    net = cylinder()
    net = net.over(net.u.elevated(3), net.v)
    every = np.ones(net.poles.shape[:2], bool)
    assert not crease_lines(net, 0, every)
    poles = net.poles.copy()
    poles[0] *= 1.1
    assert crease_lines(Net(net.u, net.v, poles, net.weights), 0, every) == {1.0}


def weighted():
    net = graph(lambda x, y: 0.2 * np.sin(3 * x) * y, 5, 3)
    return Net(net.u, net.v, net.poles, np.random.default_rng(1).uniform(0.6, 1.5, net.poles.shape[:2]))


@pytest.mark.parametrize(
    "net", [weighted(), torus(), plane(3, 2), sphere()], ids=["rational", "periodic", "plane", "pole"]
)
def test_forms_are_symmetric_and_positive_semidefinite(net):
    for form in (of(net).mass, of(net).bending):
        dense = form.toarray()
        assert np.abs(dense - dense.T).max() <= 1e-12 * np.abs(dense).max()
        values = np.linalg.eigvalsh(dense)
        assert values[0] > -1e-10 * values[-1] and values[-1] > 0
    ones = np.ones(net.u.count * net.v.count)
    assert np.abs(of(net).bending @ ones).max() < 1e-9 * np.abs(of(net).bending).max()


def test_pieces_of_one_span_add_up():
    """A face much smaller than the spans is integrated over several pieces of the same functions."""
    net = Net(u := KnotVector.clamped([0, 1], 3), u, plane(1).poles)
    found = of(net, rectangle(0.41, 0.42, 0.45, 0.43))
    assert found.mass.sum() == pytest.approx(4e-4, rel=1e-10)
    c = fitted(net, lambda x, y: x**2)
    assert c @ found.bending @ c == pytest.approx(4 * 4e-4, rel=1e-9)


@pytest.mark.parametrize("net", [sphere(2.0), cylinder(2.0, 3.0), plane(8)])
@pytest.mark.parametrize("lead", [0, 1])
def test_compiled_code_and_arrays_give_the_same_bits(net, lead, monkeypatch):
    rule, found = quadrature(net, [face(rectangle(0.1, 0.2, 0.6, 0.9))]), []
    for used in (True, False):
        monkeypatch.setattr(Compiled, "pays", lambda self, work, used=used: used)
        memo.clear()
        limit = Limit.of(net, (1.5, 1.5), (frozenset(), frozenset()))
        form = forms(net, net, rule, ((), ()), Stretch((1.0, 0.3), lead, limit))
        found.append(np.concatenate([form.mass.data, form.bending.data]))
    np.testing.assert_array_equal(*found)
