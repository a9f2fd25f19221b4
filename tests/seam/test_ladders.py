"""Ladders that surfaces share along seams: what a level leaves, on both sides of every seam the same."""

import numpy as np
import pytest

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.seam.border import Border
from mracad.seam.joint import Joint
from mracad.seam.ladders import ladders
from mracad.seam.natural import Seam
from mracad.wavelet.ladder import arc_lengths, rungs_by_level

ACROSS = KnotVector.clamped([0, 1], 3)


def band(knots, left, length=1.0):
    """A flat net along y, with its knots along v, between x = left and left + 1; y grows by ``length`` a unit of v."""
    x, y = np.meshgrid(ACROSS.greville() + left, length * knots.greville(), indexing="ij")
    return Net(ACROSS, knots, np.stack([x, y, np.zeros(x.shape)], axis=-1))


def seam(a, b, one=(0.0, 1.0), two=(0.0, 1.0)):
    """A seam between u = 1 of one surface and u = 0 of another, from v to v on each."""
    return Seam(0, 0, Border(a, a, 0, 1.0, "left", *one), Border(b, b, 0, 0.0, "right", *two), Joint(0, 1, 0), 0.0, 0.0)


def uneven(spans, seed, degree=3):
    breaks = np.r_[0, np.cumsum(np.random.default_rng(seed).uniform(0.5, 1.5, spans))]
    return KnotVector.clamped(breaks / breaks[-1], degree)


def sharp(nets, creases=()):
    return {i: (frozenset(), frozenset(creases) if i == 0 else frozenset()) for i in nets}


@pytest.mark.parametrize("degree", [2, 3])
@pytest.mark.parametrize("double", [False, True])
def test_the_ladder_of_one_surface_is_its_own(degree, double):
    knots = uneven(13, 0, degree)
    if double:
        knots = knots.refined(knots.breaks[[3, 7]])
    nets = {0: band(knots, 0.0, 30.0)}
    found = ladders(nets, sharp(nets), ())[0, 1]
    rungs = rungs_by_level(knots, lengths=arc_lengths(nets[0], 1))
    assert [found.coarse((0, 1), level, knots) for level in range(len(rungs))] == rungs
    assert found.coarse((0, 1), 99, knots) == rungs[-1]


def test_a_level_of_a_finer_space_is_that_of_its_own_knots():
    knots = uneven(12, 1, 2)
    nets = {0: band(knots, 0.0, 30.0)}
    coarse = ladders(nets, sharp(nets), ())[0, 1].coarse((0, 1), 1, knots.elevated(4).refined([0.123]))
    assert coarse == rungs_by_level(knots, lengths=arc_lengths(nets[0], 1))[1]


def test_both_sides_of_seams_have_the_same_knots_whatever_their_orientation():
    """Three bands, the middle one reversed over 2 … 5, the third one with knots of its own."""
    one, two, three = uneven(16, 0), uneven(16, 1), uneven(20, 2)
    turned = KnotVector((5.0 - 3.0 * two.knots)[::-1], 3)
    nets = {0: band(one, 0, 60.0), 1: band(turned, 1, 20.0), 2: band(three, 2, 60.0)}
    seams = [seam(0, 1, two=(5.0, 2.0)), seam(1, 2, one=(5.0, 2.0))]
    every = np.unique(np.concatenate([one.breaks, two.breaks, three.breaks]))[1:-1]
    fine = {0: KnotVector.clamped([0, *every, 1], 3), 1: KnotVector.clamped([2, *(5 - 3 * every)[::-1], 5], 3)}
    fine[2] = fine[0]
    found = ladders(nets, sharp(nets), seams)
    for level in (1, 2):
        coarse = [found[i, 1].coarse((i, 1), level, fine[i]).breaks for i in range(3)]
        np.testing.assert_allclose((5.0 - coarse[1][::-1]) / 3.0, coarse[0], atol=1e-12)
        np.testing.assert_array_equal(coarse[2], coarse[0])
        # no more spans than they have on that level by themselves, on average
        most = (16 * 16 * 20) ** (1 / 3) / 2**level
        assert most / 2 <= len(coarse[0]) - 1 <= most


def test_a_surface_takes_of_a_longer_neighbour_what_lies_beside_it():
    """The second band runs along the upper half of the first one."""
    long, short = uneven(16, 3), uneven(8, 4)
    nets = {0: band(long, 0, 60.0), 1: band(short, 1, 30.0)}
    every = np.unique(np.concatenate([long.breaks, 0.5 + short.breaks / 2]))[1:-1]
    upper = every[every > 0.5]
    fine = {0: KnotVector.clamped([0, *every, 1], 3), 1: KnotVector.clamped([0, *(2 * upper - 1), 1], 3)}
    found = ladders(nets, sharp(nets), [seam(0, 1, one=(0.5, 1.0))])
    a, b = (found[i, 1].coarse((i, 1), 1, fine[i]).breaks for i in (0, 1))
    assert 0.5 in a and len(a) < 16
    np.testing.assert_allclose(b, 2 * a[a >= 0.5] - 1, atol=1e-12)


def test_a_crease_stays_on_every_level_of_the_surface_that_has_it():
    knots = uneven(16, 5)
    at = float(knots.breaks[5])
    creased = knots.refined([at, at])
    nets = {0: band(creased, 0, 60.0), 1: band(knots, 1, 60.0)}
    found = ladders(nets, sharp(nets, [at]), [seam(0, 1)])
    for level in (1, 2, 3, 9):
        own, other = (found[i, 1].coarse((i, 1), level, creased) for i in (0, 1))
        assert own.multiplicities[own.breaks == at] == 3
        assert other.multiplicities[other.breaks == at] == 1 and other.multiplicities[1:-1].max() == 1


def test_levels_of_other_degrees_are_those_of_the_lowest_that_all_hold():
    cubic = uneven(16, 6)
    quartic, own = cubic.elevated(4), uneven(16, 7, 4)
    for other, fine, degree in ((quartic, quartic, 3), (own, quartic.refined(own.breaks[1:-1]), 4)):
        nets = {0: band(cubic, 0, 60.0), 1: band(other, 1, 60.0)}
        found = ladders(nets, sharp(nets), [seam(0, 1)])
        one, two = (found[i, 1].coarse((i, 1), 2, fine) for i in (0, 1))
        assert one == two and one.degree == degree and 4 <= one.spans <= 5 and one.multiplicities[1:-1].max() == 1


def test_directions_that_contradict_each_other_keep_their_own_ladders():
    """Seams between two bands, of which the second one maps them elsewhere, change nothing."""
    one, two = uneven(16, 7), uneven(16, 8)
    nets = {0: band(one, 0, 60.0), 1: band(two, 1, 60.0)}
    joined, plain = [seam(0, 1)], ladders(nets, sharp(nets), [seam(0, 1)])
    twice = ladders(nets, sharp(nets), [*joined, seam(0, 1, two=(1.0, 0.0))])
    fine = KnotVector.clamped(np.unique(np.concatenate([one.breaks, two.breaks])), 3)
    assert twice[0, 1].coarse((0, 1), 2, fine) == plain[0, 1].coarse((0, 1), 2, fine)


@pytest.mark.parametrize("at", [0.0, 16.0])
def test_a_closing_line_that_is_a_crease_stays_on_every_level(at):
    """It is one line, at whichever end of the period it is told."""
    u = KnotVector.from_multiplicities(np.arange(17.0), [3, *[1] * 15, 3], 3, periodic=True)
    v = KnotVector.clamped(np.linspace(0.0, 4.0, 5), 3)
    turn = 2 * np.pi * np.arange(u.count)[:, None, None] / u.count
    points = np.concatenate([np.cos(turn), np.sin(turn), 0 * turn], axis=2) + v.greville()[None, :, None] * [0, 0, 1]
    ladder = ladders({0: Net(u, v, points)}, {0: (frozenset({at}), frozenset())}, ())[0, 0]
    for level in range(5):
        counts = ladder.coarse((0, 0), level, u).multiplicities
        assert counts[0] == counts[-1] == 3
