"""Conditions along trim curves against closed forms and finite differences."""

import numpy as np
import pytest

from mracad.bspline.basis import basis
from mracad.bspline.curve import Curve
from mracad.bspline.fit import interpolated
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.compiled import Compiled
from mracad.seam.contact import MORE, Contact, rows
from mracad.seam.trace import Trace
from tests.model.shapes import graph, plane, segment

INF = float("inf")
HALF = np.sqrt(0.5)


def only(found, order):
    """Limits by which just one order counts."""
    return np.where(found.order == order, 1.0, INF)


def field(net, function):
    points = net.grid(net.u.greville(), net.v.greville())
    return interpolated(net.u, net.v, function(points[..., 0], points[..., 1])[..., None]).reshape(-1, 1)


@pytest.mark.parametrize(
    ("function", "squares"),
    [
        (lambda x, y: 1 + 0 * x, (1.0, 0.0, 0.0)),
        (lambda x, y: x, (1 / 3, 1.0, 0.0)),
        (lambda x, y: x - y, (0.0, 2.0, 0.0)),
        (lambda x, y: x**2, (1 / 5, 4 / 3, 1.0)),
        (lambda x, y: (x - y) ** 2, (0.0, 0.0, 16.0)),
    ],
)
def test_squares_along_the_diagonal_of_a_plane(function, squares):
    """Means over the diagonal of δ², |∇δ|² and (D_c² δ)², c = (1, −1) / √2."""
    net = plane(5)
    found = rows({0: net}, [Contact(Trace(0, 0, segment((0, 0), (1, 1))), None, 2)])
    delta = field(net, function)
    for order, mean in enumerate(squares):
        value = (delta.T @ found.form(only(found, order)) @ delta).item()
        assert value == pytest.approx(mean * np.sqrt(2), rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("degree", [3, 9, 22])
def test_no_wave_that_a_piece_can_hold_hides_between_the_conditions(degree):
    """Legendre polynomials of the surface's own degree along the trace: one vanishes wherever so many are asked."""
    knots = KnotVector.clamped([0.0, 1.0], degree)
    points = np.stack(np.meshgrid(knots.greville(), knots.greville(), [0.0], indexing="ij"), axis=-1)[:, :, 0]
    net = Net(knots, knots, points)
    found = rows({0: net}, [Contact(Trace(0, 0, segment((0.5, 0), (0.5, 1))), None, 0)])
    for k in range(1, degree + 1):
        delta = field(net, lambda x, y, k=k: np.polynomial.legendre.Legendre.basis(k, [0, 1])(y))
        assert np.abs(found.matrix @ delta).max() > 0.2
        assert (delta.T @ found.form(np.ones(len(found.order))) @ delta).item() == pytest.approx(
            1 / (2 * k + 1), rel=1e-4
        )


def wavy():
    """A curve through the unit square."""
    points = np.array([[0.1, 0.2], [0.4, 0.7], [0.6, 0.1], [0.9, 0.8]])
    return Curve(KnotVector.clamped([0, 1], 3), points)


def test_rows_on_a_curved_surface_against_finite_differences():
    net = graph(lambda x, y: 0.3 * np.sin(3 * x) * np.cos(2 * y), 16, 5)
    net = Net(net.u, net.v, net.poles, np.random.default_rng(2).uniform(0.8, 1.2, net.poles.shape[:2]))
    delta = np.sin(net.poles @ [4.0, 3.0, 2.0]).reshape(-1, 1)
    moved = Net(net.u, net.v, delta.reshape(net.u.count, net.v.count, 1), net.weights)
    found = rows({0: net}, [Contact(Trace(0, 0, wavy()), None, 2)])
    node, weight = np.polynomial.legendre.leggauss(12)
    share = ((np.arange(200)[:, None] + (node + 1) / 2) / 200).ravel()
    weight = np.tile(weight / 400, 200)
    uv, way = wavy().evaluate(share, 1)
    _, su, sv = net.evaluate(uv, 1)
    tangent = su * way[:, :1] + sv * way[:, 1:]
    conormal = np.cross(np.cross(su, sv), tangent)
    conormal /= np.linalg.norm(conormal, axis=1, keepdims=True)
    c = np.array([np.linalg.lstsq(np.stack([p, q], axis=1), r)[0] for p, q, r in zip(su, sv, conormal, strict=True)])
    h = 1e-4
    values = [moved.evaluate(uv + k * h * c)[:, 0] for k in (-1, 0, 1)]
    speed = np.linalg.norm(tangent, axis=1)
    along = [moved.evaluate(uv + k * h * way / speed[:, None])[:, 0] for k in (-1, 1)]
    slope = np.hypot(values[2] - values[0], along[1] - along[0]) / (2 * h)
    length = (weight * speed).sum()
    for order, each in enumerate((values[1], slope, (values[2] - 2 * values[1] + values[0]) / h**2)):
        value = (delta.T @ found.form(only(found, order)) @ delta).item()
        assert value == pytest.approx(length * (each**2 * weight).sum(), rel=1e-3), order


def test_rows_are_the_derivatives_at_their_places():
    """On a straight trace of even speed the rows' places are known: Gauss points between knot lines."""
    net = graph(lambda x, y: 0.2 * np.sin(2 * x + y), 3, 5)
    start, stop = np.array([0.2, 0.1]), np.array([0.2, 0.9])
    found = rows({0: net}, [Contact(Trace(0, 0, segment(start, stop)), None, 2)])
    breaks = np.r_[0, (np.array([1 / 3, 2 / 3]) - 0.1) / 0.8, 1]
    node = np.polynomial.legendre.leggauss(5 + MORE)[0]
    share = (breaks[:-1, None] + np.diff(breaks)[:, None] * (node + 1) / 2).ravel()
    uv = start + share[:, None] * (stop - start)
    delta = np.random.default_rng(1).standard_normal((net.u.count * net.v.count, 3))
    moved = Net(net.u, net.v, delta.reshape(net.poles.shape))
    _, su, sv = net.evaluate(uv, 1)
    e, f, g = ((p * q).sum(axis=1) for p, q in ((su, su), (su, sv), (sv, sv)))
    c = np.stack([np.ones_like(e), -f / g], axis=1) / np.sqrt(e - f * f / g)[:, None]  # across, of length 1
    h = 1e-4
    values = [moved.evaluate(uv + k * h * c) for k in (-1, 0, 1)]
    t = (stop - start) / np.linalg.norm(sv, axis=1)[:, None] / 0.8
    along = [moved.evaluate(uv + k * h * t) for k in (-1, 1)]
    bent = (values[2] - 2 * values[1] + values[0]) / h**2
    expected = values[1], (values[2] - values[0]) / (2 * h), bent, (along[1] - along[0]) / (2 * h)
    for each, own, near in zip(expected, np.split(found.matrix @ delta, 4), (1e-12, 1e-4, 1e-4, 1e-4), strict=True):
        sign = 1.0 if (own * each).sum() > 0 else -1.0
        assert np.abs(own - sign * each).max() < near * max(1.0, np.abs(each).max())
    assert np.array_equal(found.order, np.repeat([0, 1, 2, 1], len(share)))
    assert (found.owner == 0).all()


def sheared(degrees=(6, 3), spans=4):
    """The height field of the first side over x = u + u² / 5 − y / 4, y = v; and its space."""
    u, v = (KnotVector.clamped(np.linspace(0, 1, spans + 1), d) for d in degrees)
    s, t = np.meshgrid(u.greville(), v.greville(), indexing="ij")
    x, y = 0.2 + s / 2 + s**2 / 5 - t / 4, t
    return Net(u, v, interpolated(u, v, np.stack([x, y, height(x, y)], axis=-1)))


def height(x, y):
    return 0.5 * x**2 - 0.3 * x * y + 0.2 * y**2


def test_fields_that_are_smooth_across_two_surfaces_obey_up_to_the_second_order():
    one = graph(height, 3, 3)
    other = sheared((6, 6))
    path = segment((0.2, 0.1), (0.6, 0.9))  # of the second surface
    points = other.evaluate(path.evaluate(np.linspace(0, 1, 5))[0])[:, :2]
    knots = KnotVector.clamped([0, 1], 4)
    first, local = basis(knots, np.linspace(0, 1, 5))
    assert not first.any()
    own = Curve(knots, np.linalg.solve(local, points))
    contact = Contact(Trace(0, 0, own), Trace(1, 1, path), 2)
    nets = {0: one, 1: other}
    found = rows(nets, [contact])
    assert contact.surfaces == {0, 1}
    for function in (lambda x, y: 1 + 2 * x - y, lambda x, y: x**2 * y - x * y**2, lambda x, y: x**3):
        delta = np.concatenate([field(net, function) for net in nets.values()])
        assert np.abs(found.matrix @ delta).max() < 1e-9
    count = one.u.count * one.v.count
    lone = np.concatenate([field(one, lambda x, y: 1 + x), 0 * field(other, lambda x, y: x)])
    off = [np.abs((found.matrix @ lone)[found.order == k]).max() for k in range(3)]
    assert off[0] > 1 and off[1] > 0.1 and found.matrix[:, count:].nnz > 0


def contact_of(close=False):
    return Contact(Trace(0, 0, segment((0, 0), (1, 1))), None, 2, close=close)


def test_weights_are_inverse_squares_and_pull_where_wanted():
    net = plane(3)
    found = rows({0: net}, [contact_of()])
    limits = np.array([0.1, 0.2, 0.3])[found.order]
    form = found.form(limits)
    assert np.abs(found.form(2 * limits) - form / 4).max() < 1e-12 * np.abs(form).max()
    delta = np.random.default_rng(0).standard_normal((net.u.count * net.v.count, 3))
    pull = found.pull(found.matrix @ delta, limits)
    assert np.abs(pull - form @ delta).max() < 1e-9 * np.abs(pull).max()


def test_the_form_is_the_square_of_conditions_with_different_numbers_of_control_points():
    contacts = [
        contact_of(),
        Contact(Trace(0, 0, segment((0.1, 0.9), (0.8, 0))), Trace(1, 1, segment((0, 0), (1, 1))), 1),
    ]
    found = rows({0: plane(3), 1: plane(5)}, contacts)
    assert len(set(np.diff(found.matrix.indptr).tolist())) == 2
    limits = np.random.default_rng(0).uniform(0.1, 1.0, len(found.order))
    dense = found.matrix.toarray() * (np.sqrt(found.width) / limits)[:, None]
    assert np.abs(found.form(limits).toarray() - dense.T @ dense).max() < 1e-12 * (dense**2).sum(axis=0).max()


def test_contacts_may_lack_what_they_lacked_and_a_little_more():
    net = plane(3)
    found = rows({0: net}, [contact_of()])
    lacked = np.abs(np.random.default_rng(0).standard_normal(len(found.order)))
    opened = lacked[:, None] * np.array([0.6, 0.0, -0.8])
    limits = found.limits(opened, np.array([[0.1, 0.2, 0.3]]))
    assert limits[found.order == 0] == pytest.approx(lacked[found.order == 0] + 0.1)
    for order, more in ((1, 0.2), (2, 0.3)):
        assert limits[found.order == order] == pytest.approx(lacked[found.order == order].max() + more)


@pytest.mark.parametrize("used", [False, True])
def test_room_is_what_leaves_every_contact_within_its_limits(used, monkeypatch):
    monkeypatch.setattr(Compiled, "pays", lambda self, work: used)
    net = plane(3)
    found = rows({0: net, 1: net}, [contact_of(), Contact(Trace(1, 1, segment((0, 0.5), (1, 0.5))), None, 1)])
    n = net.u.count * net.v.count
    rng = np.random.default_rng(3)
    opened = 0.01 * rng.standard_normal((len(found.order), 3))
    limits = found.limits(opened, np.tile([0.01, 1e-3, 1.0], (2, 1)))
    delta = rng.standard_normal((2 * n, 3))
    for amount in found.room(delta, opened, limits)[found.owner]:
        assert 0 < amount < 1
    room = found.room(delta, opened, limits)
    monkeypatch.setattr(Compiled, "pays", lambda self, work: not used)
    np.testing.assert_array_equal(found.room(delta, opened, limits), room)
    off = np.linalg.norm(opened + room[found.owner, None] * (found.matrix @ delta), axis=1)
    assert (off <= limits * (1 + 1e-9)).all()
    still = np.zeros_like(delta)
    still[:n, 2] = 1e-4
    assert found.room(still, 0 * opened, found.limits(0 * opened, np.tile([0.01, 1e-3, 1.0], (2, 1)))) == pytest.approx(
        [1.0, 1.0]
    )
    straight = found.room(100 * still, 0 * opened, found.limits(0 * opened, np.tile([4e-3, 1e-3, 1.0], (2, 1))))
    assert straight == pytest.approx([0.4, 1.0])
    assert rows({0: net}, []).room(delta[:n], opened[:0], limits[:0]).size == 0


def test_only_what_is_asked_has_rows():
    net = plane(3)
    trace = Trace(0, 0, segment((0, 0), (1, 1)))
    whole, rest = (rows({0: net}, [Contact(trace, None, 2, since=since)]) for since in (0, 2))
    assert set(rest.order) == {2} and np.array_equal(rest.matrix.toarray(), whole.matrix.toarray()[whole.order == 2])
