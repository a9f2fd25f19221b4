"""The joint of a seam: how the derivatives of its two surfaces are related.

Let S and T be the surfaces of a seam, n the parameter across it and t that along it on S, φ the affine map to T's
parameters.  The joint of the input is

    G0   S = T∘φ,    G1   T_n = a S_n + b S_t,    G2   T_nn = a² S_nn + r S_n + s S_t   (a constant, b = 0)

with scalar functions of t that are polynomials as simple as the input allows.  With a, b, r, s kept, these are linear
conditions on a displacement; the errors of the input (gap, angle) then stay unchanged.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from mracad.bspline.vectors import between, components
from mracad.model.brep import Model
from mracad.seam.border import SHARES, Border, Jet, outward
from mracad.seam.cause import Cause, Still
from mracad.seam.wishes import Wishes

Array = np.ndarray

SLIP = 1e-4
"""Largest distance along the seam between points of equal parameter, as a share of its length."""

EXACT, CLOSE = 1e-8, 2e-3
"""A joint's polynomials are exact if they miss the input by at most EXACT of |T_n|, and usable up to CLOSE: the angle
of the seam then grows by at most CLOSE of the angle by which the normal turns."""

_SHAPES = ((0, -1), (0, 0), (1, -1), (1, 1), (2, -1), (2, 2))


@dataclass(frozen=True, eq=False)
class Joint:
    """How smoothly two surfaces meet: coefficients of polynomials in the fraction of the edge, lowest degree first.

    Attributes
    ----------
    order : {0, 1, 2}
        Cross derivatives that the seam keeps.
    across, along : ndarray
        a and b; b is empty where it vanishes.
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
    across: Array
    along: Array
    bend: float = 0.0
    shear: float = 0.0
    missed: float = 0.0
    close: bool = False
    fit: bool = False
    smoother: Joint | None = None

    @property
    def varying(self) -> bool:
        """Whether the conditions raise the degree, so that no smooth T of S's degree may satisfy them."""
        return self.order > 0 and (len(self.across) > 1 or len(self.along) > 0)

    def part(self, low: float, high: float) -> Joint:
        """The joint of the part between two fractions of the edge, rescaled to 0 … 1."""
        size = high - low
        across, along = (_composed(law, low, size) for law in (self.across, self.along))
        smoother = self.smoother and self.smoother.part(low, high)
        return replace(self, across=across, along=along / size, shear=self.shear / size, smoother=smoother)


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
    close = wishes.close_gaps
    if order == 0:
        return Joint(0, np.ones(1), np.empty(0), close=close)
    fit = bool(between(*normals).max() <= wishes.fit)
    across, along = components(sn, st, tn).T
    size = np.linalg.norm(tn, axis=1)
    for limit in (EXACT, CLOSE):
        for degree, shear in _SHAPES:
            p, q = _polynomial(across, degree), _polynomial(along, shear)
            off = sn * (across - _value(p))[:, None] + st * (along - _value(q))[:, None]
            missed = float((np.linalg.norm(off, axis=1) / size).max())
            if missed <= limit:
                joint = Joint(1, p, q, missed=missed, close=close, fit=fit)
                bent = _bent(joint, sn, st, snn, tnn)
                return bent if order == 2 or bent is joint else replace(joint, smoother=bent)
    return Joint(0, np.ones(1), np.empty(0), close=close)


def _bent(joint: Joint, sn: Array, st: Array, snn: Array, tnn: Array) -> Joint:
    """The joint with its second derivatives, if they have a law."""
    if joint.varying:
        return joint
    bend, shear = components(sn, st, tnn - joint.across[0] ** 2 * snn).T
    scale = np.linalg.norm(tnn, axis=1).max() + 1e-300
    fitted = [
        float(x.mean()) if np.abs(x[:, None] * d).max() > EXACT * scale else 0.0 for x, d in ((bend, sn), (shear, st))
    ]
    off = sn * (bend - fitted[0])[:, None] + st * (shear - fitted[1])[:, None]
    if np.linalg.norm(off, axis=1).max() > CLOSE * scale:
        return joint
    return replace(joint, order=2, bend=fitted[0], shear=fitted[1])


def _polynomial(values: Array, degree: int) -> Array:
    """Coefficients in the fraction of the edge that fit values at the samples; none for degree −1."""
    return np.polynomial.polynomial.polyfit(SHARES, values, degree) if degree >= 0 else np.empty(0)


def _composed(coefficients: Array, low: float, size: float) -> Array:
    """Coefficients of p(low + size x) from those of p(x)."""
    result = np.zeros(len(coefficients))
    for k in range(len(result)):
        result[k] = np.polynomial.polynomial.polyval(low, coefficients) * size**k / math.factorial(k)
        coefficients = np.polynomial.polynomial.polyder(coefficients)
    return result


def _value(coefficients: Array) -> Array:
    return np.polynomial.polynomial.polyval(SHARES, coefficients) if len(coefficients) else np.zeros_like(SHARES)
