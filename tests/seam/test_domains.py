"""Groups of many surfaces, solved domain by domain, against the same groups as a whole."""

from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from scipy.sparse import csr_array

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.edit import pose
from mracad.edit.smooth import smooth
from mracad.model.cells import quadrature
from mracad.occ.view import view
from mracad.seam.domains import Partitioned, problem
from mracad.seam.energy import forms
from mracad.seam.guided import Guides
from mracad.seam.solve import Effort, Problem, Soft, Space
from mracad.spec.steps import Smooth
from tests.edit import panels
from tests.model.shapes import face

ROW, SIZE, STIFFNESS = 12, 10.0, 0.35**4
KNOTS = KnotVector.clamped(np.linspace(0.0, 1.0, 11), 3)
COUNT = KNOTS.count**2
SMALL, LARGE = Effort(0, 1e-9, 3 * COUNT), Effort(0, 1e-9)
"""Three surfaces a domain, and all at once."""


def spaces():
    """A row of patches of one rough sheet; the first one is held at its side, the sixth one inside."""
    rng, found = np.random.default_rng(0), {}
    x, y = np.meshgrid(KNOTS.greville(), KNOTS.greville(), indexing="ij")
    for i in range(ROW):
        flat = SIZE * np.stack([x + i, y, 0 * x], axis=-1)
        net = Net(KNOTS, KNOTS, flat + 0.02 * rng.standard_normal(flat.shape))
        free = np.ones(net.poles.shape[:2], bool)
        free[:2] = i > 0
        free[5:7, 6] = i != 5
        found[i] = Space(net, forms(net, Net(KNOTS, KNOTS, flat), quadrature(net, [face()])), free, np.ones_like(free))
    return found


def seams():
    """Position and slope between neighbours."""
    n, entries, row = KNOTS.count, [], 0
    at = np.arange(ROW * COUNT).reshape(ROW, n, n)
    for a, b in pairwise(at):
        for k in range(n):
            entries += [(row, a[-1, k], 1.0), (row, b[0, k], -1.0), (row + 1, a[-1, k], 1.0), (row + 1, a[-2, k], -1.0)]
            entries += [(row + 1, b[1, k], -1.0), (row + 1, b[0, k], 1.0)]
            row += 2
    i, j, value = zip(*entries, strict=True)
    return csr_array((value, (i, j)), shape=(row, at.size))


def size(x):
    return float(np.abs(x).max())


WANTED = 0.1 * np.random.default_rng(3).standard_normal((ROW * COUNT, 3))
CALLS = {
    "filtered": lambda p: p.filtered(STIFFNESS),
    "unheld": lambda p: p.filtered(STIFFNESS, p.seen),
    "sharp": lambda p: p.filtered(STIFFNESS / 9, of=WANTED, order=4),
    "faired": lambda p: p.faired(STIFFNESS),
    "nearest": lambda p: p.nearest(WANTED),
    "smoothly": lambda p: p.nearest(WANTED, STIFFNESS, beyond=True),
    "settled": lambda p: p.settled(np.where(p.free[:, None], WANTED, 0.0), STIFFNESS),
}


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_what_is_left_out_hardly_counts_and_conditions_are_met(call):
    domains, whole = (problem(spaces(), seams(), effort=effort) for effort in (SMALL, LARGE))
    assert isinstance(domains, Partitioned) and not isinstance(whole, Partitioned)
    found, wanted = call(domains), call(whole)
    assert 0 < size(found - wanted) < 3e-4 * size(wanted)
    assert size(domains.rows @ found) < 1e-12 * size(found)


def test_no_domain_is_solved_with_more_than_its_surroundings(monkeypatch):
    counts, domain = [], Partitioned._domain

    def counted(*args):
        at = domain(*args)
        counts.append((at.own.sum() // COUNT, len(at.points) // COUNT))
        return at

    monkeypatch.setattr(Partitioned, "_domain", counted)
    problem(spaces(), seams(), effort=SMALL).nearest(WANTED, STIFFNESS)
    own, around = zip(*counts, strict=True)
    assert own == (3, 3, 3, 3) and around == (4, 5, 5, 4)


def test_displacements_are_corrected_only_near_what_is_in_their_way(monkeypatch):
    near, whole = (problem(spaces(), seams(), effort=Effort(direct, 1e-9)) for direct in (0, 10**9))
    target = whole.filtered(STIFFNESS, whole.seen)
    held = []
    factored = Problem._factored
    monkeypatch.setattr(Problem, "_factored", lambda p, a, free, soft: held.append(free) or factored(p, a, free, soft))
    for stiffness in (0.0, STIFFNESS):
        found, wanted = near.nearest(target, stiffness), whole.nearest(target, stiffness)
        assert size(wanted - target) > 0.01 * size(target)
        assert 0 < size(found - wanted) < 1e-3 * size(wanted - target)
        assert size(near.rows @ found) < 1e-12 * size(found) and not found[~near.free].any()
    count = near.free.sum()
    assert [int(each.sum()) < count / 2 for each in held] == [True, False] * 2
    assert near.settled(found, STIFFNESS).tobytes() == found.tobytes() and len(held) == 4


def test_held_control_points_stay():
    p = problem(spaces(), seams(), effort=SMALL)
    assert not p.filtered(STIFFNESS)[~p.free].any() and not p.nearest(WANTED)[~p.free].any()


def test_conditions_between_domains_are_mended_by_what_is_asked():
    goal = seams() @ (0.1 * WANTED)
    domains, whole = (problem(spaces(), seams(), goal, effort=effort) for effort in (SMALL, LARGE))
    found, wanted = domains.filtered(STIFFNESS), whole.filtered(STIFFNESS)
    assert 0 < size(found - wanted) < 3e-4 * size(wanted)
    assert size(domains.rows @ found - goal) < 1e-12 * size(found)


def test_contacts_pull_across_domains():
    """Springs from every patch to its neighbour, which no seam joins."""
    ends = [(i * COUNT + 100 + k, (i + 1) * COUNT + 30 + k) for i in range(ROW - 1) for k in range(8)]
    springs = np.zeros((len(ends), ROW * COUNT))
    for row, (a, b) in enumerate(ends):
        springs[row, [a, b]] = 1.0, -1.0
    pull = springs.T @ np.random.default_rng(4).standard_normal((len(ends), 3))
    soft, none = Soft(csr_array(springs.T @ springs), pull), csr_array((0, ROW * COUNT))
    domains, whole = (problem(spaces(), none, None, soft, effort) for effort in (SMALL, LARGE))
    found, wanted = domains.filtered(STIFFNESS), whole.filtered(STIFFNESS)
    assert 0 < size(found - wanted) < 3e-4 * size(wanted)
    assert size(wanted - problem(spaces(), none, effort=LARGE).filtered(STIFFNESS)) > 0.1 * size(wanted)


def test_a_filter_as_long_as_the_part_is_solved_as_a_whole():
    domains, whole = (problem(spaces(), seams(), effort=effort) for effort in (SMALL, LARGE))
    assert domains.filtered(SIZE**4).tobytes() == whole.filtered(SIZE**4).tobytes()


def test_edges_that_slide_keep_a_problem_whole():
    guides = Guides(csr_array((1, ROW * COUNT)), np.eye(3)[:1], np.ones(1), np.zeros(1))
    assert type(problem(spaces(), seams(), effort=SMALL, guides=guides)) is Problem


def test_an_edit_of_a_panel_is_the_same_domain_by_domain(monkeypatch):
    _, net = panels.whole(9, 0.05, patches=(8, 1))
    model = view(panels.document(panels.cut(net, (8, 1))))
    whole = smooth(model, Smooth(scale="40mm"))
    monkeypatch.setattr(pose, "problem", partial(problem, effort=Effort(0, domain=400)))
    parts = smooth(model, Smooth(scale="40mm"))
    assert parts.displacement.offsets.keys() == whole.displacement.offsets.keys() != set()
    for i, offset in whole.displacement.offsets.items():
        assert 0 < size(parts.displacement.offsets[i].poles - offset.poles) < 1e-3 * size(offset.poles)
