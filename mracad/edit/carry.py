"""Details carried by the frames of surfaces.

On the surface from which they were taken, details stay as they were, to the bit.  On another surface, with R the
rotation from the tangent frame of their own surface to that of the new one at the same parameters,

    d' = d + spline through (R − I) d at the Greville points,

so that a rigid motion carries them exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from mracad.bspline.fit import through
from mracad.bspline.knots import KnotVector
from mracad.bspline.refine import is_nested
from mracad.bspline.surface import Net, pairs
from mracad.bspline.vectors import cross, unit

Array = np.ndarray
Way = Literal["added", "carried", "projected"]
"""Details are added as they were; turned with the surface, over knots that hold them; or over knots that do not."""

SAME = 1e-9
"""Share of a domain within which knots are equal, and share of the size of a surface within which points are equal."""


@dataclass(frozen=True, eq=False)
class Laid:
    """Details on a surface: control points of the displacement (mm), ``(nu, nv, 3)``, and how they were placed."""

    offset: Array
    way: Way


@dataclass(frozen=True, eq=False)
class Piece:
    """Details to be placed on a surface.

    Attributes
    ----------
    net, motion : Net
        The surface to which they belong, and the details over the same knots.
    wavelength : float
        Approximate length of their longest waves, mm.
    """

    net: Net
    motion: Net
    wavelength: float

    def placed(self, net: Net) -> Piece:
        """The details over the domain of a surface; knots that equal its own up to rounding are replaced by them."""
        u, v = _placed(self.net.u, net.u), _placed(self.net.v, net.v)
        if (u, v) == (self.net.u, self.net.v):
            return self
        own, motion = (Net(u, v, each.poles, each.weights) for each in (self.net, self.motion))
        return Piece(own, motion, self.wavelength)

    def over(self, net: Net) -> Net:
        """A surface over its own knots and those of the details."""
        return net.over(_union(net.u, self.net.u), _union(net.v, self.net.v))

    def belongs(self, net: Net) -> bool:
        """Whether a surface is the one to which the details belong, possibly with more knots."""
        if not _holds(self.net, net):
            return False
        off = np.abs(self.net.over(net.u, net.v).poles - net.poles).max()
        return bool(off <= SAME * np.ptp(net.poles, axis=(0, 1)).max())

    def laid(self, net: Net) -> Laid:
        """The details on a surface, over its knots."""
        if self.belongs(net):
            return Laid(self.motion.over(net.u, net.v).poles, "added")
        places = net.u.greville(), net.v.greville()
        values = np.asarray(self.motion.grid(*places))
        if _holds(self.net, net):
            before, plain = (each.over(net.u, net.v) for each in (self.net, self.motion))
            turned = np.einsum("ijab,ijb->ija", turns(before, net) - np.eye(3), values)
            return Laid(plain.poles + through(net, turned), "carried")
        return Laid(through(net, np.einsum("ijab,ijb->ija", turns(self.net, net), values)), "projected")


def _holds(net: Net, fine: Net) -> bool:
    """Whether the offsets of one surface can be those of another, with the same weights over more knots."""
    if not (is_nested(net.u, fine.u) and is_nested(net.v, fine.v)):
        return False
    one, two = net.over(fine.u, fine.v).weights, fine.weights
    if one is None or two is None:
        return one is two
    return bool(np.allclose(one / one[0, 0], two / two[0, 0], rtol=1e-12, atol=0.0))


def turns(before: Net, after: Net) -> Array:
    """The rotations from the tangent frames of one surface to those of another at the Greville points of the other,
    ``(nu, nv, 3, 3)``; in the tangent plane, the one that turns both tangents least.

    Where a surface has no normal, the rotation of the whole surface is taken.
    """
    places = after.u.greville(), after.v.greville()
    uv = pairs(*places)
    both = []
    for net in (before, after):
        tangents = [np.asarray(x).reshape(-1, 3) for x in net.grid(*places, 1)[1:]]
        normal = net.normals(uv, tangents=(tangents[0], tangents[1]))
        longer = np.where((tangents[0] ** 2).sum(1) >= (tangents[1] ** 2).sum(1), 0, 1)
        x = unit(np.where(longer[:, None] == 0, *tangents))
        x = unit(x - (x * normal).sum(axis=1, keepdims=True) * normal)
        frame = np.stack([x, cross(normal, x), normal], axis=1)
        flat = [np.einsum("qak,qk->qa", frame[:, :2], unit(tangent)) for tangent in tangents]
        both.append((frame, flat))
    (one, a), (two, b) = both
    sine = sum(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0] for p, q in zip(a, b, strict=True))
    cosine = sum((p * q).sum(axis=1) for p, q in zip(a, b, strict=True))
    angle = np.arctan2(sine, cosine)
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    spun = np.stack([c * two[:, 0] + s * two[:, 1], c * two[:, 1] - s * two[:, 0], two[:, 2]], axis=1)
    found = np.einsum("qka,qkb->qab", spun, one)
    lost = ~np.isfinite(found).all(axis=(1, 2))
    if lost.any():
        found[lost] = _turn(*(np.asarray(net.grid(*places)).reshape(-1, 3) for net in (before, after)))
    return np.asarray(found.reshape(after.u.count, after.v.count, 3, 3))


def _turn(before: Array, after: Array) -> Array:
    """The rotation that best maps points to others."""
    u, _, vt = np.linalg.svd((after - after.mean(axis=0)).T @ (before - before.mean(axis=0)))
    return np.asarray(u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt)) or 1.0]) @ vt)


def _union(own: KnotVector, other: KnotVector) -> KnotVector:
    """The knots of both vectors, of the higher degree."""
    degree = max(own.degree, other.degree)
    own, other = own.elevated(degree), other.elevated(degree)
    place = np.minimum(np.searchsorted(own.breaks, other.breaks), own.spans)
    there = np.where(own.breaks[place] == other.breaks, own.multiplicities[place], 0)
    inner = slice(0 if own.periodic and other.periodic else 1, -1)
    return own.refined(np.repeat(other.breaks[inner], np.maximum(other.multiplicities - there, 0)[inner]))


def _placed(own: KnotVector, there: KnotVector) -> KnotVector:
    """Knots mapped to the domain of others."""
    low, high = own.domain
    knots = there.domain[0] + (own.knots - low) * (there.period / (high - low))
    near = there.breaks[np.abs(knots[:, None] - there.breaks).argmin(axis=1)]
    return KnotVector(np.where(np.abs(near - knots) <= SAME * there.period, near, knots), own.degree, own.periodic)
