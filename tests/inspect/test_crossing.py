"""Triangles that cross and sides that do not pair up."""

import numpy as np

from mracad.inspect.crossing import crossings, near, unpaired


def found(one, other):
    pairs, where = crossings(np.array([one, other], float), np.array([[0, 1]]))
    return pairs.tolist(), where


FLAT = [(0, 0, 0), (4, 0, 0), (0, 4, 0)]


def test_triangles_that_pierce_each_other():
    pairs, where = found(FLAT, [(1, 1, -1), (1, 1, 1), (1, 9, 1)])
    assert pairs == [[0, 1]]
    np.testing.assert_allclose(where[0, :2], [1, 1], atol=2)
    assert abs(where[0, 2]) < 1e-12


def test_what_touches_or_is_apart_does_not_cross():
    assert found(FLAT, [(1, 1, 0), (1, 1, 1), (2, 1, 1)])[0] == []
    assert found(FLAT, [(9, 9, -1), (9, 9, 1), (9, 8, 1)])[0] == []


def test_a_soup_of_triangles_against_one_by_one():
    rng = np.random.default_rng(2)
    middles = rng.uniform(0, 2.5, (60, 1, 3))
    spots = middles + rng.uniform(-0.6, 0.6, (60, 3, 3))
    pairs, _ = crossings(spots, near(spots.min(axis=1), spots.max(axis=1)))
    wanted = {(i, j) for i in range(60) for j in range(i) if _cross(spots[i], spots[j])}
    assert {(max(p), min(p)) for p in pairs.tolist()} == wanted and len(wanted) > 10


def _cross(one, other):
    """Whether a side of one passes through the other, by signed volumes."""

    def volume(a, b, c, d):
        return np.linalg.det(np.array([b - a, c - a, d - a]))

    def pierced(p, q, t):
        if volume(*t, p) * volume(*t, q) >= 0:
            return False
        signs = [volume(p, q, t[k], t[(k + 1) % 3]) > 0 for k in range(3)]
        return all(signs) or not any(signs)

    sides = [(t[k], t[(k + 1) % 3], s) for t, s in ((one, other), (other, one)) for k in range(3)]
    return any(pierced(*each) for each in sides)


def test_boxes_that_meet():
    rng = np.random.default_rng(5)
    low = rng.uniform(0, 9, (301, 3))
    high = low + rng.uniform(0, 1, (301, 1)) ** 9 * rng.uniform(0, 9, (301, 3))
    meet = ((low[:, None] <= high) & (low <= high[:, None])).all(axis=2)
    pairs = near(low, high).tolist()
    assert sorted(pairs) == [list(pair) for pair in zip(*np.nonzero(np.triu(meet, 1)), strict=True)]
    assert len(near(low[:1], high[:1])) == len(near(low[:0], high[:0])) == 0


def test_sides_of_a_closed_body_pair_up():
    body = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    sides = body[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    assert len(unpaired(sides)) == 0
    assert sorted(map(tuple, unpaired(sides[3:]).tolist())) == [(0, 1), (1, 2), (2, 0)]
    assert len(unpaired(np.concatenate([sides, sides[:3]]))) >= 3  # a face twice
