"""The solver against dense linear algebra."""

import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.sparse import csr_array

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.edit.trial import Gains
from mracad.model.cells import quadrature
from mracad.seam.energy import forms
from mracad.seam.solve import Constrained, Problem, Soft, Space
from tests.edit.models import rotation
from tests.model.shapes import face, plane

STIFFNESS = 0.05**4


@pytest.mark.parametrize("seed", range(8))
def test_constrained_is_the_minimum_under_the_conditions(seed):
    rng = np.random.default_rng(seed)
    n, m = 40, 6 + seed
    root = rng.standard_normal((n, n)) * (rng.random((n, n)) < 0.2) + np.diag(rng.uniform(0.5, 2, n))
    form = root.T @ root
    rows = rng.standard_normal((m, n)) * (rng.random((m, n)) < 0.3)
    rows = np.concatenate([rows, rows[:2], rows[:1] + rows[1:2], np.zeros((1, n))])  # some depend on others
    free = rng.random(n) < 0.8
    goal = rows[:, free] @ rng.standard_normal((free.sum(), 3))
    right = rng.standard_normal((n, 3))
    start = rng.standard_normal((n, 3)) * free[:, None]
    solver = Constrained(csr_array(form), csr_array(rows), free)
    a, b = form[np.ix_(free, free)], rows[:, free]
    kkt = np.block([[a, b.T], [b, np.zeros((len(b), len(b)))]])
    for found, owed in (
        (solver(right, goal=goal), goal),
        (solver(right), 0 * goal),
        (solver(right, start, goal), goal - rows @ start),
    ):
        dense = np.linalg.lstsq(kkt, np.concatenate([right[free], owed[:, :]]), rcond=1e-12)[0][: free.sum()]
        assert not found[~free].any()
        assert np.abs(rows @ found - owed).max() < 1e-12 * max(1.0, np.abs(found).max())
        assert np.abs(found[free] - dense).max() < 1e-6 * np.abs(dense).max()
    settled = solver.settled(start)
    assert np.abs(rows @ settled).max() < 1e-12 and not settled[~free].any()


def rough(seed=0, spans=7):
    net = plane(spans)
    return Net(net.u, net.v, net.poles + 0.02 * np.random.default_rng(seed).standard_normal(net.poles.shape))


def problem(net, turn=None, trend=None, held=True, rows=True, **soft):
    """A sheet with two sides held and its middle row tied to the one beside it."""
    metric = plane(net.u.spans)
    if turn is not None:
        net, metric = (Net(x.u, x.v, x.poles @ turn.T) for x in (net, metric))
    free = np.ones(net.poles.shape[:2], bool)
    if held:
        free[:2], free[:, -1] = False, False
    seen = np.ones_like(free)
    space = Space(net, forms(net, metric, quadrature(net, [face()])), free, seen, trend)
    tie = None
    if rows:
        tie = np.zeros((net.v.count, *free.shape))
        tie[range(net.v.count), 5, range(net.v.count)] = 1.0
        tie[range(net.v.count), 6, range(net.v.count)] = -2.0
        tie = csr_array(tie.reshape(net.v.count, -1))
    return Problem({0: space}, tie, **soft)


def admissible(p):
    """A basis of the displacements that vanish where they must and obey the conditions, as columns."""
    inside = np.eye(len(p.free))[:, p.free]
    return inside @ null_space(p.rows.toarray() @ inside) if p.rows.shape[0] else inside


@pytest.mark.parametrize("held", [False, True])
@pytest.mark.parametrize("rows", [False, True])
def test_filtered_is_the_complex_filter(held, rows):
    p = problem(rough(), held=held, rows=rows)
    z = admissible(p)
    mass, bend = (z.T @ form.tocsr().toarray() @ z for form in (p.mass, p.bending))
    pulled = z.T @ (STIFFNESS * (p.bending @ p.f))
    dense = -z @ np.linalg.solve(mass + 1j * STIFFNESS * bend, 1j * pulled).real
    found = p.filtered(STIFFNESS)
    assert np.abs(dense).max() > 5e-3
    assert np.abs(found - dense).max() < 2e-4 * np.abs(dense).max()
    assert np.abs(p.rows @ found).max(initial=0.0) < 1e-12
    assert not found[~p.free].any()


def test_faired_is_the_plain_filter():
    p = problem(rough())
    z = admissible(p)
    form = z.T @ (p.mass.tocsr() + STIFFNESS * p.bending.tocsr()).toarray() @ z
    dense = -z @ np.linalg.solve(form, z.T @ (STIFFNESS * (p.bending @ p.f)))
    assert np.abs(p.faired(STIFFNESS) - dense).max() < 1e-6 * np.abs(dense).max()


def test_waves_are_kept_by_the_gain():
    """On a closed strip sines are as good as eigenvectors: gain 1 / (1 + (2πℓ/Λ)⁸)."""
    u = KnotVector.from_multiplicities(np.linspace(0, 1, 65), [1] * 65, 3, periodic=True)
    v = KnotVector.clamped([0, 0.2], 3)
    t = 2 * np.pi * (np.arange(64) - 1) / 64
    flat = np.zeros((64, v.count, 3))
    flat[..., 0], flat[..., 1] = np.cos(t)[:, None] / (2 * np.pi), np.sin(t)[:, None] / (2 * np.pi)
    flat[..., 2] = v.greville()
    ring = Net(u, v, flat)
    for waves in (2, 4, 6, 9):
        poles = flat.copy()
        poles[..., 2] += 1e-3 * np.cos(waves * t)[:, None]
        net = Net(u, v, poles)
        points = np.ones(poles.shape[:2], bool)
        p = Problem({0: Space(net, forms(net, ring, quadrature(net, [face()])), points, points)})
        size = 0.2
        delta = p.filtered((size / (2 * np.pi)) ** 4).reshape(poles.shape)[..., 2]
        gain = 1 + delta[0].mean() / (1e-3 * np.cos(waves * t[0]))
        assert gain == pytest.approx(1 / (1 + (size * waves) ** 8), abs=3e-3)


def test_the_bending_never_grows():
    for seed in range(3):
        p = problem(rough(seed))
        x = p.f + p.filtered(STIFFNESS)
        assert np.trace(x.T @ (p.bending @ x)) < np.trace(p.f.T @ (p.bending @ p.f))


def test_nearest_is_nearest_and_leaves_what_is_admissible():
    p, rng = problem(rough()), np.random.default_rng(4)
    z, wanted = admissible(p), rng.standard_normal((len(p.free), 3))
    found = p.nearest(wanted)
    assert np.abs(z.T @ (p.mass @ (found - wanted))).max() < 1e-8 * np.abs(p.mass @ wanted).max()
    assert np.abs(p.rows @ found).max() < 1e-12 and not found[~p.free].any()
    good = z @ rng.standard_normal((z.shape[1], 3))
    assert np.abs(p.nearest(good) - good).max() < 1e-9 * np.abs(good).max()


def test_conditions_are_mended_by_what_is_asked():
    goal = 0.01 * np.random.default_rng(2).standard_normal((rough().v.count, 3))
    goal[-1] = 0.0  # held on both sides of the condition
    p = problem(rough(), goal=goal)
    for found in (p.filtered(STIFFNESS), p.nearest(np.zeros((len(p.free), 3)))):
        assert np.abs(p.rows @ found - goal).max() < 1e-12


def test_contacts_pull_by_their_weight():
    plain, rng = problem(rough()), np.random.default_rng(5)
    n = len(plain.free)
    pulled = 0.1 * rng.standard_normal((4, n))
    soft, pull = csr_array(pulled.T @ pulled), pulled.T @ rng.standard_normal((4, 3))
    p = problem(rough(), soft=Soft(soft, pull))
    z, wanted = admissible(p), rng.standard_normal((n, 3))
    dense = z @ np.linalg.solve(z.T @ (p.mass.tocsr() + soft).toarray() @ z, z.T @ (p.mass @ wanted + pull))
    assert np.abs(p.nearest(wanted) - dense).max() < 1e-6 * np.abs(dense).max()
    assert p.rimmed and plain.rimmed and not problem(rough(), held=False).rimmed


def test_the_filter_is_linear_and_commutes_with_rotation():
    one, two = rough(1), rough(2)
    both = Net(one.u, one.v, 0.5 * one.poles + 2.0 * two.poles)
    deltas = [problem(net).filtered(STIFFNESS) for net in (one, two, both)]
    assert np.abs(0.5 * deltas[0] + 2.0 * deltas[1] - deltas[2]).max() < 1e-9
    turn = rotation([1, 2, -0.5], 0.7)
    assert np.abs(problem(one, turn).filtered(STIFFNESS) - deltas[0] @ turn.T).max() < 1e-9


@pytest.mark.parametrize("rows", [False, True])
def test_rotation_commutes_where_the_length_is_many_spans(rows):
    spans, turn = 24, rotation([1, 2, -0.5], 0.7)
    plain, turned = (problem(rough(1, spans), how, rows=rows).filtered((20 / spans) ** 4) for how in (None, turn))
    assert np.abs(plain).max() > 0.1 and np.abs(turned - plain @ turn.T).max() < 1e-9


def test_a_trend_keeps_its_bending():
    net = rough()
    p = problem(net, trend=net.poles)
    assert not p.filtered(STIFFNESS).any()
    flat = problem(net, trend=plane(7).poles)
    assert np.abs(flat.filtered(STIFFNESS) - problem(net).filtered(STIFFNESS)).max() < 1e-9


def test_displacements_fade_beside_what_is_held():
    net = rough()
    away = np.linspace(0.0, 1.0, net.u.count)[:, None] * np.ones(net.v.count)
    points = np.ones(away.shape, bool)
    form = forms(net, net, quadrature(net, [face()]))
    p = Problem({0: Space(net, form, points, points, away=away), 1: Space(net, form, points, points)})
    fade = np.split(p.fading(0.5).ravel(), 2)
    assert (fade[1] == 1.0).all()
    first = fade[0].reshape(away.shape)[:, 0]
    assert first[0] == 0.0 and (first[away[:, 0] >= 0.5] == 1.0).all() and (np.diff(first) >= 0).all()
    assert p.split(np.ones((2 * away.size, 3)))[1].shape == net.poles.shape


@pytest.mark.parametrize("rows", [False, True])
def test_what_is_added_to_a_wanted_displacement_is_as_smooth_as_asked(rows):
    p = problem(rough(), rows=rows)
    wanted = np.random.default_rng(4).standard_normal(p.f.shape)
    basis = admissible(p)
    for stiffness in (0.0, STIFFNESS):
        form = (p.mass.tocsr() + stiffness * (p.bending.tocsr() + p.creases.tocsr())).toarray()
        nearest = basis @ np.linalg.solve(basis.T @ form @ basis, basis.T @ form @ wanted)
        assert np.abs(p.nearest(wanted, stiffness) - nearest).max() < 1e-7 * np.abs(nearest).max()


def test_gains_are_what_comes_nearer():
    spaces = dict(enumerate(problem(rough(seed), rows=False).spaces[0] for seed in (0, 1)))
    p = Problem(spaces)
    rng = np.random.default_rng(2)
    delta, target = (rng.standard_normal(p.f.shape) for _ in range(2))
    amounts, half = (0.3, 0.8), len(p.f) // 2
    for k, gain in enumerate(Gains(*p.products(delta, target)).of(np.array(amounts))):
        part = slice(k * half, (k + 1) * half)
        mass = spaces[k].forms.mass
        left, before = target[part] - amounts[k] * delta[part], target[part]
        assert gain == pytest.approx((before * (mass @ before)).sum() - (left * (mass @ left)).sum())


@pytest.mark.parametrize("seed", range(3))
def test_contacts_that_weigh_much_and_nearly_repeat_conditions_are_borne(seed):
    """Passes of a solve that rounding spoils would make what they miss ever larger."""
    rng = np.random.default_rng(seed)
    n, m = 200, 60
    rows = np.zeros((m, n))
    for row in rows:
        row[rng.choice(n, 8, replace=False)] = rng.standard_normal(8)
    contacts = rows[::2] * (1 + 1e-6 * rng.standard_normal((m // 2, n)))
    form = np.diag(rng.uniform(1e-6, 1, n)) + 1e9 * contacts.T @ contacts
    right = rng.standard_normal((n, 1))
    nearest = null_space(rows)
    wanted = nearest @ np.linalg.solve(nearest.T @ form @ nearest, nearest.T @ right)
    found = Constrained(csr_array(form), csr_array(rows), np.ones(n, bool))(right)
    size = np.abs(wanted).max()
    assert np.abs(rows @ found).max() <= 1e-8 * size and np.abs(found).max() <= 2 * size
