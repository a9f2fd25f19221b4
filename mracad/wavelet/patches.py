"""Patches that meet along whole sides: which directions they share, and the knots of these."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mracad.bspline.curve import Curve, homogeneous
from mracad.bspline.knots import Array, KnotVector
from mracad.bspline.surface import Net
from mracad.errors import UsageError
from mracad.wavelet.lift import Form, Knots

SAME = 1e-9
"""Share of the size of all patches within which points are the same, and of a domain within which knots are."""

Direction = tuple[int, int]
"""A patch and one of its directions."""


@dataclass(frozen=True)
class _Side:
    """A side of a patch: the direction along it, and its curve."""

    along: Direction
    curve: Curve


class _Groups:
    """Directions that seams link, each with whether it runs backwards."""

    def __init__(self, every: Sequence[Direction]) -> None:
        self.of: dict[Direction, dict[Direction, bool]] = {each: {each: False} for each in every}

    def link(self, one: Direction, two: Direction, turned: bool) -> None:
        a, b = self.of[one], self.of[two]
        turned ^= a[one] ^ b[two]
        if a is b:
            if turned:
                raise UsageError(f"patches {one[0]} and {two[0]} close a band with a half twist: leave one out")
            return
        a |= {each: way ^ turned for each, way in b.items()}
        self.of |= dict.fromkeys(b, a)


def matched(patches: Sequence[tuple[Form, Array]]) -> Iterator[tuple[Form, Array, Knots]]:
    """Patches over the knots that they share along seams.

    Parameters
    ----------
    patches : sequence of (Form, ndarray)
        Forms, and their control points ``(nu, nv, k)`` or ``(n, k)``.

    Yields
    ------
    Form, ndarray
        The same patch over clamped ends and the knots of its neighbours; control points in its own order.
    Knots
        Those of the pyramid: equal for directions that seams link.
    """
    if len({len(form.knots) for form, _ in patches}) > 1 or len({poles.shape[-1] for _, poles in patches}) > 1:
        raise UsageError("patches must all be curves or all be surfaces, with the same number of coordinates")
    own = [[_clamped(knots) for knots in form.knots] for form, _ in patches]
    groups = _Groups([(i, axis) for i, each in enumerate(own) for axis in range(len(each))])
    if patches and len(own[0]) == 2:
        apart = SAME * max(float(np.ptp(poles, axis=(0, 1)).max()) for _, poles in patches)
        sides = [side for i, (form, poles) in enumerate(patches) for side in _sides(i, form, poles, own[i], apart)]
        for one, two, turned in _meeting(sides, apart):
            groups.link(one, two, turned)
    distinct = {id(group): group for group in groups.of.values()}
    shared = {key: _union([own[i][axis] for i, axis in g], list(g.values())) for key, g in distinct.items()}
    for i, (form, poles) in enumerate(patches):
        those = [(groups.of[i, axis], axis) for axis in range(len(own[i]))]
        back = tuple(group[i, axis] for group, axis in those)
        common = tuple(shared[id(group)] for group, _ in those)
        knots = tuple(_placed(*each) for each in zip(own[i], common, back, strict=True))
        fine = _over(form, poles, knots)
        yield replace(form, knots=knots, weights=fine.weights, turned=back), fine.poles, common


def _over(form: Form, poles: Array, knots: Knots) -> Curve | Net:
    if len(knots) == 1:
        return Curve(form.knots[0], poles, form.weights).over(knots[0])
    return Net(form.knots[0], form.knots[1], poles, form.weights).over(knots[0], knots[1])


def _clamped(knots: KnotVector) -> KnotVector:
    """The knots with ends that splines interpolate."""
    counts = knots.multiplicities.copy()
    if not knots.periodic:
        counts[[0, -1]] = knots.degree + 1
    return KnotVector.from_multiplicities(knots.breaks, counts, knots.degree, knots.periodic)


def _sides(i: int, form: Form, poles: Array, knots: Sequence[KnotVector], apart: float) -> Iterator[_Side]:
    net = _over(form, poles, tuple(knots))
    for across in (0, 1):
        for end in () if knots[across].periodic else (0, -1):
            poles = net.poles.take(end, across)
            if np.ptp(poles, axis=0).max() > apart:  # a point stays one, and runs no way
                weights = None if net.weights is None else net.weights.take(end, across)
                yield _Side((i, 1 - across), Curve(knots[1 - across], poles, weights))


def _meeting(sides: Sequence[_Side], apart: float) -> Iterator[tuple[Direction, Direction, bool]]:
    """Directions along sides that coincide, and whether they run against each other."""
    if not sides:
        return
    ends = np.array([side.curve.poles[[0, 0 if side.curve.knots.periodic else -1]] for side in sides])
    for i, one in enumerate(sides):
        for turned in (False, True):
            off = np.abs(ends[i + 1 :, :: -1 if turned else 1] - ends[i]).max(axis=(1, 2))
            for j in (i + 1 + np.flatnonzero(off <= apart)).tolist():
                if _same(one.curve, sides[j].curve, turned, apart):
                    yield one.along, sides[j].along, turned


def _same(one: Curve, two: Curve, turned: bool, apart: float) -> bool:
    """Whether curves coincide with proportional parameters."""
    if one.knots.periodic != two.knots.periodic or (one.knots.periodic and turned):
        return False
    union = _union([one.knots, two.knots], [False, turned])
    a, b = (c.over(_placed(c.knots, union, way)) for c, way in ((one, False), (two, turned)))
    points = [homogeneous(c.poles, None if c.weights is None else c.weights / c.weights[0]) for c in (a, b)]
    if points[0].shape != points[1].shape:
        return False
    return bool(np.abs(points[0] - points[1][:: -1 if turned else 1]).max() <= apart)


def _union(every: Sequence[KnotVector], turned: Sequence[bool]) -> KnotVector:
    """The knots of all vectors, of the highest degree, over the domain of the first."""
    degree = max(each.degree for each in every)
    first = every[0].elevated(degree)
    breaks, counts = first.breaks, first.multiplicities
    for each, back in zip(every[1:], turned[1:], strict=True):
        more = each.elevated(degree)
        share = (more.breaks - more.domain[0]) / more.period
        at = first.domain[0] + first.period * (1.0 - share[::-1] if back else share)
        near = np.abs(at[:, None] - breaks).argmin(axis=1)
        new = np.abs(breaks[near] - at) > SAME * first.period
        there = more.multiplicities[::-1] if back else more.multiplicities
        counts = counts.copy()
        np.maximum.at(counts, near[~new], there[~new])
        order = np.argsort(np.concatenate([breaks, at[new]]))
        breaks, counts = np.concatenate([breaks, at[new]])[order], np.concatenate([counts, there[new]])[order]
    return KnotVector.from_multiplicities(breaks, counts, degree, first.periodic)


def _placed(own: KnotVector, there: KnotVector, turned: bool) -> KnotVector:
    """Shared knots over the domain of a patch; those that equal its own up to rounding are replaced by them."""
    share = (there.breaks - there.domain[0]) / there.period
    at = own.domain[0] + own.period * (1.0 - share[::-1] if turned else share)
    near = own.breaks[np.abs(at[:, None] - own.breaks).argmin(axis=1)]
    at = np.where(np.abs(near - at) <= SAME * own.period, near, at)
    counts = there.multiplicities[::-1] if turned else there.multiplicities
    return KnotVector.from_multiplicities(at, counts, there.degree, own.periodic)
