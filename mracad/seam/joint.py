"""The joint of a seam: how the derivatives of its two surfaces are related.

Let S and T be the surfaces of a seam, n the parameter across it and t that along it on S, φ the affine map to T's
parameters.  The joint of the input is

    G0   S = T∘φ,    G1   T_n = a S_n + b S_t,    G2   T_nn = a² S_nn + r S_n + s S_t   (a constant, b = 0)

with scalar functions of t: polynomials as simple as the input allows, or linear between knots.  With a, b, r, s kept,
these are linear conditions on a displacement; the errors of the input (gap, angle) then stay unchanged.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mracad.bspline.vectors import between, components
from mracad.model.brep import Model
from mracad.seam.border import SHARES, Border, jets, outward
from mracad.seam.cause import Cause, Still
from mracad.seam.law import NONE, Law, breaks, constant, polynomials
from mracad.seam.wishes import Wishes

Array = np.ndarray

SLIP = 1e-4
"""Largest distance along the seam between points of equal parameter, as a share of its length."""

EXACT, CLOSE = 1e-8, 2e-3
"""A joint's laws are exact if they miss the input by at most EXACT of |T_n|, and usable up to CLOSE: the angle
of the seam then grows by at most CLOSE of the angle by which the normal turns."""

FINE = 5e-4
"""The same for laws that are linear between knots, which cost only knots."""

_SHAPES = ((0, -1), (0, 0), (1, -1), (1, 1), (2, -1), (2, 2))

FEWEST = 4
"""Fewest pieces of a law that is linear between knots."""

_EVENLY = np.linspace(0.0, 1.0, 1025)


@dataclass(frozen=True, eq=False)
class Joint:
    """How smoothly two surfaces meet.

    Attributes
    ----------
    order : {0, 1, 2}
        Cross derivatives that the seam keeps.
    across, along : Law
        a and b.
    bend, shear : float
        r and s.
    missed : float
        Largest part of T_n within the tangent plane that a S_n + b S_t misses, relative.
    close, fit : bool
        Whether the gap and the angle of the input are to be closed instead of kept.
    smoother : Joint or None
        The joint of second order that exists, where only the first is kept.
    """

    order: int
    across: Law
    along: Law
    bend: float = 0.0
    shear: float = 0.0
    missed: float = 0.0
    close: bool = False
    fit: bool = False
    smoother: Joint | None = None

    @property
    def varying(self) -> bool:
        """Whether the conditions raise the degree, so that no smooth T of S's degree may satisfy them."""
        return self.order > 0 and (self.across.degree > 0 or self.along.degree >= 0)

    @property
    def pieces(self) -> int:
        """Number of spans along the seam that are fine enough for its laws."""
        return max(self.across.pieces, self.along.pieces) if self.order else 0

    def part(self, low: float, high: float) -> Joint:
        """The joint of the part between two fractions of the edge, rescaled to 0 … 1."""
        size = high - low
        across, along = self.across.part(low, high), self.along.part(low, high).over(size)
        smoother = self.smoother and self.smoother.part(low, high)
        return replace(self, across=across, along=along, shear=self.shear / size, smoother=smoother)


@dataclass(frozen=True, eq=False)
class Met:
    """How pairs of borders meet.

    Attributes
    ----------
    joints : list of Joint or Cause
        The joint of the highest order with a law, or the cause if there is none.
    gaps, angles : list of float
        Largest distance at equal fractions, mm, and angle between the outward normals.
    """

    joints: list[Joint | Cause]
    gaps: list[float]
    angles: list[float]


def met(model: Model, pairs: Sequence[tuple[Border, Border]], orders: Sequence[int], wishes: Wishes) -> Met:
    """How pairs of borders meet that may keep the given orders."""
    if not pairs:
        return Met([], [], [])
    sides = [[pair[k] for pair in pairs] for k in (0, 1)]
    (s, sn, st, snn), (t, tn, tt, tnn) = (jets(model, side, SHARES, 2) for side in sides)
    size = np.linalg.norm(st, axis=2)
    length = size.mean(axis=1)
    slip = np.abs(((s - t) * st).sum(axis=2) / np.maximum(size, 1e-12 * length[:, None])).max(axis=1)
    normals = outward(model, sides[0], sn, st), outward(model, sides[1], tn, tt)
    sizes = [np.linalg.norm(n, axis=2) for n in normals]
    least = np.min([each.min(axis=1) / np.maximum(each.max(axis=1), 1e-300) for each in sizes], axis=0)
    angles = between(*normals).max(axis=1)
    plain = Joint(0, constant(1.0), NONE, close=wishes.close_gaps)
    found: list[Joint | Cause] = [plain] * len(pairs)
    for k in np.flatnonzero(least < 1e-9).tolist():
        found[k] = Cause(Still.DEGENERATE)
    for k in np.flatnonzero(slip > SLIP * length).tolist():
        found[k] = Cause(Still.UNEVEN)
    smooth = np.array([k for k, order in enumerate(orders) if order and found[k] is plain], int)
    firm: dict[int, Joint] = {}
    for k, joint in zip(smooth.tolist(), _polynomials(sn[smooth], st[smooth], tn[smooth]), strict=True):
        joint = joint or _piecewise(model, pairs[k], wishes.pieces)
        if joint is not None:
            firm[k] = replace(joint, close=plain.close, fit=bool(angles[k] <= wishes.fit))
    even = [k for k, joint in firm.items() if not joint.varying]
    for k, bent in zip(even, _bent([firm[k] for k in even], *(x[even] for x in (sn, st, snn, tnn))), strict=True):
        if bent is not None:
            firm[k] = bent if orders[k] == 2 else replace(firm[k], smoother=bent)
    found = [firm.get(k, joint) for k, joint in enumerate(found)]
    gaps = np.linalg.norm(s - t, axis=2).max(axis=1)
    return Met(found, gaps.tolist(), angles.tolist())


def _polynomials(sn: Array, st: Array, tn: Array) -> list[Joint | None]:
    """Joints of first order whose laws are the simplest polynomials that are exact, or else close, where there are."""
    found: list[Joint | None] = [None] * len(sn)
    values, left = components(sn, st, tn), np.arange(len(sn))
    for limit in (EXACT, CLOSE):
        for degrees in _SHAPES:
            if not len(left):
                break
            laws = [polynomials(SHARES, values[left, :, k].T, degree) for k, degree in enumerate(degrees)]
            at = [np.polynomial.polynomial.polyval(SHARES, law) if len(law) else np.zeros(()) for law in laws]
            missed = _missed(sn[left], st[left], tn[left], (at[0], at[1]))
            those = missed <= limit
            for k in np.flatnonzero(those).tolist():
                found[left[k]] = Joint(1, Law(laws[0][:, k]), Law(laws[1][:, k]), missed=float(missed[k]))
            left = left[~those]
    return found


def _piecewise(model: Model, pair: tuple[Border, Border], most: int) -> Joint | None:
    """The joint of first order with a constant ratio across it, and a law along it of as few pieces as are close."""
    if not most:
        return None
    (_, sn, st), (_, tn, _) = ([x[0] for x in jets(model, [border], _EVENLY, 1)] for border in pair)
    across, along = components(sn, st, tn).T
    ratio, pieces = constant(float(across.mean())), FEWEST
    while pieces <= most:
        law, knots = Law(along, pieces), breaks(pieces)
        missed = float(_missed(sn, st, tn, (ratio.at(_EVENLY, knots), law.at(_EVENLY, knots))))
        if missed <= FINE:
            return Joint(1, ratio, law, missed=missed)
        pieces *= 2
    return None


def _missed(sn: Array, st: Array, tn: Array, laws: tuple[Array, Array]) -> Array:
    """Largest part of T_n within the tangent planes that a S_n + b S_t misses, relative, of each seam."""
    x = components(sn, st, tn)
    off = sn * (laws[0] - x[..., 0])[..., None] + st * (laws[1] - x[..., 1])[..., None]
    return np.asarray((np.linalg.norm(off, axis=-1) / np.linalg.norm(tn, axis=-1)).max(axis=-1))


def _bent(joints: Sequence[Joint], sn: Array, st: Array, snn: Array, tnn: Array) -> list[Joint | None]:
    """The joints with their second derivatives, where they have a law."""
    ratio = np.array([joint.across.values[0] for joint in joints])[:, None, None]
    laws = components(sn, st, tnn - ratio**2 * snn)
    scale = np.linalg.norm(tnn, axis=2).max(axis=1) + 1e-300
    fitted = np.zeros((2, len(joints)))
    for k, direction in enumerate((sn, st)):
        counts = np.abs(laws[..., k, None] * direction).max(axis=(1, 2)) > EXACT * scale
        fitted[k, counts] = laws[counts, :, k].mean(axis=1)
    off = sum(d * (laws[..., k] - fitted[k, :, None])[..., None] for k, d in enumerate((sn, st)))
    close = np.linalg.norm(off, axis=2).max(axis=1) <= CLOSE * scale
    both = zip(joints, close.tolist(), *fitted.tolist(), strict=True)
    return [replace(joint, order=2, bend=bend, shear=shear) if law else None for joint, law, bend, shear in both]
