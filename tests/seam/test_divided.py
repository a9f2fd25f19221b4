"""Large groups, solved by subspaces, against the same groups in one go."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.sparse import csr_array

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.model.cells import quadrature
from mracad.seam.divided import LEFT
from mracad.seam.energy import forms
from mracad.seam.solve import Effort, Problem, Soft, Space
from tests.edit.models import rotation
from tests.model.shapes import face

SIDE, SPANS, SIZE = 3, 24, 10.0
STIFFNESS = 0.35**4
KNOTS = KnotVector.clamped(np.linspace(0.0, 1.0, SPANS + 1), 3)


def patches(turn=None, noise=0.02, seed=0):
    """A square of patches of one rough sheet, with gaps of the size of the roughness, and their flat metrics."""
    rng, found = np.random.default_rng(seed), []
    x, y = np.meshgrid(KNOTS.greville(), KNOTS.greville(), indexing="ij")
    for i, j in np.ndindex(SIDE, SIDE):
        flat = SIZE * np.stack([x + i, y + j, 0 * x], axis=-1)
        rough = flat + noise * rng.standard_normal(flat.shape)
        found.append([Net(KNOTS, KNOTS, poles if turn is None else poles @ turn.T) for poles in (rough, flat)])
    return found


def seams():
    """Position and slope across all seams, as rows on the points of all patches."""
    n, rows = KNOTS.count, []
    at = np.arange(SIDE * SIDE * n * n).reshape(SIDE, SIDE, n, n)
    for axis in (0, 1):
        for a, b in pairwise(np.moveaxis(at, axis, 0)):
            for left, right in zip(a, b, strict=True):
                left, right = (np.moveaxis(side, axis, 0) for side in (left, right))
                for k in range(n):
                    rows.append({left[-1, k]: 1.0, right[0, k]: -1.0})
                    rows.append({left[-1, k]: 1.0, left[-2, k]: -1.0, right[1, k]: -1.0, right[0, k]: 1.0})
    entries = [(i, j, value) for i, row in enumerate(rows) for j, value in row.items()]
    i, j, value = zip(*entries, strict=True)
    return csr_array((value, (i, j)), shape=(len(rows), at.size))


DIVIDED, WHOLE = Effort(0), Effort(10**9)


def problem(effort, nets=None, held=True, rows=None, **more):
    """The patches as a problem."""
    spaces = {}
    for i, (net, metric) in enumerate(nets or patches()):
        free = np.ones(net.poles.shape[:2], bool)
        if held and i == 4:
            free[10:13, 11] = False
        if held and i < SIDE:
            free[:, :2] = False
        spaces[i] = Space(net, forms(net, metric, quadrature(net, [face()])), free, np.ones_like(free))
    return Problem(spaces, seams() if rows is None else rows, effort=effort, **more)


def both(call, left=1e-9, **more):
    """Displacements of a call on the divided problem and on the same in one go, which take other ways."""
    divided = problem(Effort(0, left), **more)
    found, wanted = call(divided), call(problem(WHOLE, **more))
    assert found.tobytes() != wanted.tobytes()
    return divided, found, wanted


def size(x):
    return float(np.abs(x).max())


@pytest.mark.parametrize("held", [False, True])
def test_filtered_is_that_of_the_whole_system(held):
    p, found, wanted = both(lambda p: p.filtered(STIFFNESS), held=held)
    assert size(wanted) > 1e-3
    assert size(found - wanted) < 1e-6 * size(wanted)
    assert size(p.rows @ found) < 1e-12 * size(found) and not found[~p.free].any()
    x = p.f + found
    assert np.trace(x.T @ (p.bending @ x)) < np.trace(p.f.T @ (p.bending @ p.f))


def test_patches_hardly_wider_than_strips_are_also_divided():
    """Strips along joints hold more than twice as many control points as there are."""
    _, found, wanted = both(lambda p: p.filtered(0.9**4))
    assert size(found - wanted) < 1e-6 * size(wanted)


def test_little_is_left_of_what_strips_make_good():
    _, found, wanted = both(lambda p: p.filtered(STIFFNESS), left=LEFT)
    assert size(found - wanted) < 1e-4 * size(wanted)


def test_nearest_is_that_of_the_whole_system():
    wanted = 0.1 * np.random.default_rng(3).standard_normal((SIDE**2 * KNOTS.count**2, 3))
    p, found, direct = both(lambda p: p.nearest(wanted))
    assert size(found - direct) < 1e-6 * size(direct)
    assert size(p.rows @ found) < 1e-12 * size(found) and not found[~p.free].any()


def test_what_obeys_already_is_not_made_to():
    """Rounding that is left of conditions is not taken for what is lacking."""
    p = problem(DIVIDED)
    obeys = p.nearest(0.1 * np.random.default_rng(3).standard_normal((SIDE**2 * KNOTS.count**2, 3)))
    assert 0 < size(p.rows @ obeys) < 1e-12 * size(obeys)
    assert p.nearest(obeys).tobytes() == p.settled(obeys).tobytes() == obeys.tobytes()


def test_rounding_that_thousands_of_conditions_leave_is_not_made_good():
    p = problem(DIVIDED)
    obeys = p.nearest(0.1 * np.random.default_rng(3).standard_normal((SIDE**2 * KNOTS.count**2, 3)))
    off = np.where(p.free[:, None], 1e-14 * size(obeys) * np.random.default_rng(5).uniform(-1, 1, obeys.shape), 0.0)
    assert 1e-14 * size(obeys) < size(p.rows @ (obeys + off)) < 2e-13 * size(obeys)
    assert p.nearest(obeys + off).tobytes() == (obeys + off).tobytes()
    more = obeys + 100 * off
    assert size(p.rows @ p.nearest(more)) < 0.1 * size(p.rows @ more)


def test_conditions_are_mended_by_what_is_asked():
    goal = seams() @ (0.01 * np.random.default_rng(2).standard_normal((SIDE**2 * KNOTS.count**2, 3)))
    p, found, direct = both(lambda p: p.filtered(STIFFNESS), goal=goal, held=False)
    assert size(found - direct) < 1e-5 * size(direct)
    assert size(p.rows @ found - goal) < 1e-12 * size(found)


def test_contacts_pull_surfaces_that_they_join():
    """Springs between points of two patches that no seam joins, and one between those of a patch."""
    n, rng = KNOTS.count**2, np.random.default_rng(4)
    ends = [(k * 30 + 200, 4 * n + k * 25 + 100) for k in range(8)] + [(50, 60)]
    springs = np.zeros((len(ends), SIDE**2 * n))
    for row, (a, b) in enumerate(ends):
        springs[row, [a, b]] = 1.0, -1.0
    soft, pull = csr_array(springs.T @ springs), springs.T @ rng.standard_normal((len(ends), 3))
    _, found, direct = both(lambda p: p.filtered(STIFFNESS), soft=Soft(soft, pull))
    assert size(found - direct) < 1e-5 * size(direct)
    assert size(found - both(lambda p: p.filtered(STIFFNESS))[1]) > 0.1 * size(found)


def test_the_filter_is_linear_and_commutes_with_rotation():
    turn = rotation([1, 2, -0.5], 0.7)
    plain, turned = (problem(DIVIDED, patches(how)).filtered(STIFFNESS) for how in (None, turn))
    assert size(turned - plain @ turn.T) < 1e-9
    again = problem(DIVIDED).filtered(STIFFNESS)
    assert again.tobytes() == plain.tobytes()


def test_strips_that_would_be_everything_are_solved_in_one_go():
    found, wanted = (problem(effort).filtered(10.0**4) for effort in (DIVIDED, WHOLE))
    assert found.tobytes() == wanted.tobytes()


def test_surfaces_that_nothing_joins_are_solved_by_themselves():
    p, found, _ = both(lambda p: p.filtered(STIFFNESS), rows=seams()[:0])
    alone = Problem({0: p.spaces[0]}).filtered(STIFFNESS)
    assert size(p.split(found)[0].reshape(-1, 3) - alone) < 1e-9 * size(alone)
