"""The joint of a seam: how the derivatives of its two surfaces are related.

Let S and T be the surfaces of a seam, n the parameter across it and t that along it on S, φ the affine map to T's
parameters.  The joint of the input is

    G0   S = T∘φ,    G1   T_n = a S_n + b S_t,    G2   T_nn = a² S_nn + r S_n + s S_t   (a constant, b = 0)

with scalar functions of t: polynomials as simple as the input allows, or linear between knots.  With a, b, r, s kept,
these are linear conditions on a displacement; the errors of the input (gap, angle) then stay unchanged.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mracad.bspline.vectors import between, components
from mracad.model.brep import Model
from mracad.seam.border import SHARES, Border, Jet, jets, outward
from mracad.seam.cause import Cause, Still
from mracad.seam.law import NONE, Law, breaks, constant, polynomial
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


def joint_of(
    model: Model, borders: tuple[Border, Border], found: tuple[Jet, Jet], order: int, wishes: Wishes
) -> Joint | Cause:
    """The joint between two borders, of the highest order with a law; the cause if there is none."""
    (a, b), ((s, sn, st, snn), (t, tn, tt, tnn)) = borders, found
    length = np.linalg.norm(st, axis=1).mean()
    slip = np.abs(((s - t) * st).sum(axis=1) / np.maximum(np.linalg.norm(st, axis=1), 1e-12 * length)).max()
    if slip > SLIP * length:
        return Cause(Still.UNEVEN)
    normals = outward(model, a, sn, st), outward(model, b, tn, tt)
    sizes = [np.linalg.norm(n, axis=1) for n in normals]
    if min(size.min() / max(size.max(), 1e-300) for size in sizes) < 1e-9:
        return Cause(Still.DEGENERATE)
    plain = Joint(0, constant(1.0), NONE, close=wishes.close_gaps)
    if order == 0:
        return plain
    joint = _polynomial(sn, st, tn)
    if joint is None and wishes.pieces:
        (_, sn, st), (_, tn, _) = (jets(model, each, _EVENLY, 1) for each in borders)
        joint = _piecewise(sn, st, tn, wishes.pieces)
    if joint is None:
        return plain
    joint = replace(joint, close=plain.close, fit=bool(between(*normals).max() <= wishes.fit))
    bent = joint if joint.varying else _bent(joint, sn, st, snn, tnn)
    return bent if order == 2 or bent is joint else replace(joint, smoother=bent)


def _polynomial(sn: Array, st: Array, tn: Array) -> Joint | None:
    """The joint of first order whose laws are the simplest polynomials that are exact, or else close."""
    values = components(sn, st, tn).T
    for limit in (EXACT, CLOSE):
        for degrees in _SHAPES:
            across, along = (polynomial(SHARES, x, degree) for x, degree in zip(values, degrees, strict=True))
            missed = _missed(sn, st, tn, (across.at(SHARES, SHARES), along.at(SHARES, SHARES)))
            if missed <= limit:
                return Joint(1, across, along, missed=missed)
    return None


def _piecewise(sn: Array, st: Array, tn: Array, most: int) -> Joint | None:
    """The joint of first order with a constant ratio across it, and a law along it of as few pieces as are close."""
    across, along = components(sn, st, tn).T
    ratio, pieces = constant(float(across.mean())), FEWEST
    while pieces <= most:
        law, knots = Law(along, pieces), breaks(pieces)
        missed = _missed(sn, st, tn, (ratio.at(_EVENLY, knots), law.at(_EVENLY, knots)))
        if missed <= FINE:
            return Joint(1, ratio, law, missed=missed)
        pieces *= 2
    return None


def _missed(sn: Array, st: Array, tn: Array, laws: tuple[Array, Array]) -> float:
    """Largest part of T_n within the tangent plane that a S_n + b S_t misses, relative."""
    across, along = (law - x for law, x in zip(laws, components(sn, st, tn).T, strict=True))
    off = sn * across[:, None] + st * along[:, None]
    return float((np.linalg.norm(off, axis=1) / np.linalg.norm(tn, axis=1)).max())


def _bent(joint: Joint, sn: Array, st: Array, snn: Array, tnn: Array) -> Joint:
    """The joint with its second derivatives, if they have a law."""
    bend, shear = components(sn, st, tnn - joint.across.values[0] ** 2 * snn).T
    scale = np.linalg.norm(tnn, axis=1).max() + 1e-300
    fitted = [
        float(x.mean()) if np.abs(x[:, None] * d).max() > EXACT * scale else 0.0 for x, d in ((bend, sn), (shear, st))
    ]
    off = sn * (bend - fitted[0])[:, None] + st * (shear - fitted[1])[:, None]
    if np.linalg.norm(off, axis=1).max() > CLOSE * scale:
        return joint
    return replace(joint, order=2, bend=fitted[0], shear=fitted[1])
