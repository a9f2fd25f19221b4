"""Lengths that differ by direction and place, for energies of second derivatives.

With ℓ the length of an energy of second derivatives H (:mod:`mracad.seam.energy`), its part at a point becomes
|R H R|², R symmetric: for a wave of wavevector k, |R k|⁴ instead of |k|⁴.

- R = r_t t tᵀ + r_n n nᵀ, t the direction of the lines along which one parameter grows, n normal to them: other lengths
  r_t ℓ along these lines and r_n ℓ across them.
- R⁻⁴ + (ℓ |S| / θ)⁴ instead of R⁻⁴ (powers of matrices), S the shape operator: where the surface bends with a radius
  r, no length is more than about θ r in that direction, so that rounds keep their shape.

S must not be the curvature of the waves to be removed.  The surface is examined without waves shorter than w, w / 2,
w / 4 …; the first of these that hardly turns within w / 2π shows the shape at a point.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import numpy as np

from mracad.bspline.jets import jets
from mracad.bspline.surface import Net
from mracad.compiled import pointer
from mracad.memo import kept
from mracad.seam.points import CURVE, LOOK, curved, shaped
from mracad.wavelet.project import at_scale

Array = np.ndarray

THETA = 0.3
"""Largest turn of the normal within a length, radians."""

HALVINGS = 6
"""How often the wavelength is halved at most to find the shape."""


class Looks:
    """Lengths (mm), from long to short, and a surface without waves shorter than 2π times each.

    They are taken when needed, because the first is mostly enough.

    Parameters
    ----------
    net : Net
    wavelengths : (float, float)
        The longest, along u and v, mm.
    creases : pair of set of float
    """

    def __init__(
        self, net: Net, wavelengths: tuple[float, float], creases: tuple[AbstractSet[float], AbstractSet[float]]
    ) -> None:
        self.net, self.wavelengths, self.creases = net, wavelengths, creases
        self._taken: list[tuple[float, Net]] = []

    def __iter__(self) -> Iterator[tuple[float, Net]]:
        shortest = min(self.wavelengths)
        for halving in range(HALVINGS + 1):
            if halving == len(self._taken):
                now = tuple(w / 2**halving if w == shortest else w for w in self.wavelengths)
                seen = at_scale(self.net, (now[0], now[1]), self.creases)
                self._taken.append((shortest / 2**halving / (2 * np.pi), seen))
            yield self._taken[halving]
            if self._taken[halving][1].poles is self.net.poles:
                break


@dataclass(frozen=True, eq=False)
class Limit:
    """The shape of a surface, which limits lengths.

    Attributes
    ----------
    length : float
        ℓ, mm.
    looks : iterable of (float, Net)
        Lengths (mm), from long to short, and the surface without waves shorter than 2π times each.
    """

    length: float
    looks: Iterable[tuple[float, Net]]

    @classmethod
    def of(
        cls, net: Net, wavelengths: tuple[float, float], creases: tuple[AbstractSet[float], AbstractSet[float]]
    ) -> Limit:
        """The limit for a surface from which waves shorter than ``wavelengths`` along u and v (mm) will be removed."""
        return cls(max(wavelengths) / (2 * np.pi), Looks(net, wavelengths, creases))

    def finer(self, net: Net, lengths: tuple[float, float]) -> tuple[Array, Array]:
        """By how much lengths along u and v (mm) exceed 2 θ r in each span, r the smallest radius, where ℓ exceeds half
        of θ r; elsewhere 1."""
        us, vs = (((knots.breaks[:-1] + knots.breaks[1:]) / 2)[:, None] for knots in (net.u, net.v))
        frame = orthonormal(net, us, vs)
        a, b, c = self.shape(us, vs, frame)
        skew = frame[1] / frame[0]
        along_v = (c - 2 * skew * b + skew * skew * a) / (1 + skew * skew)
        bent = np.abs(a).max(axis=0), np.abs(along_v).max(axis=1)
        one, other = (
            np.where(2 * self.length * each > THETA, np.maximum(size * each / (2 * THETA), 1.0), 1.0)
            for size, each in zip(lengths, bent, strict=True)
        )
        return one, other

    @property
    def scale(self) -> float:
        """ℓ / θ, mm."""
        return self.length / THETA

    def shape(self, u: Array, v: Array, frame: Array) -> Array:
        """The shape operator, components 11, 12 and 22 ``(3, qv, qu)``, in the frame p, q and r ``(3, qv, qu)``: p ∂_u
        and q ∂_u + r ∂_v are orthonormal."""
        frame, found, left = np.ascontiguousarray(frame), np.empty(frame.shape), np.ones(frame.shape[1:], bool)
        count = np.empty(1, int)
        for length, net in self.looks:
            most = THETA / max(length, 1e-300)
            forms = _bent(net, (u.tobytes(), v.tobytes()), (u.shape, v.shape))
            if LOOK.pays(left.size):
                several = pointer(found), pointer(left), pointer(count)
                LOOK(pointer(frame), pointer(forms), left.size, most, *several)
            else:
                *now, size = shaped(frame, forms)
                np.copyto(found, now, where=left)
                left &= size > most
                count[0] = np.count_nonzero(left)
            if not count[0]:
                break
        return found


@dataclass(frozen=True, eq=False)
class Stretch:
    """Lengths by direction and place, over those of the energy alone.

    Attributes
    ----------
    lengths : (float, float)
        Along u and along v.
    lead : int
        The axis along whose parameter lines its length counts; the other length counts across them.
    limit : Limit, optional
        Further limit by curvature.
    """

    lengths: tuple[float, float] = (1.0, 1.0)
    lead: int = 0
    limit: Limit | None = None

    @property
    def even(self) -> bool:
        """Whether all directions are equal."""
        return self.lengths == (1.0, 1.0)

    @property
    def plain(self) -> bool:
        """Whether all directions and places are equal."""
        return self.even and self.limit is None

    def times(self, length: float) -> tuple[float, float]:
        """A length along u and along v, multiplied by those of the directions."""
        return self.lengths[0] * length, self.lengths[1] * length


EVEN = Stretch()


def orthonormal(net: Net, us: Array, vs: Array) -> Array:
    """p, q and r at pairs of parameters, ``(3, qv, qu)``: p ∂_u and q ∂_u + r ∂_v are orthonormal on a surface."""
    xu, xv = (net.tangents(us.ravel(), vs.ravel(), axis) for axis in (0, 1))
    e, f, g = ((a * b).sum(axis=-1).T for a, b in ((xu, xu), (xu, xv), (xv, xv)))
    e = np.maximum(e, 1e-300)
    rest = np.sqrt(np.maximum(g - f * f / e, 1e-12 * g + 1e-300))
    return np.stack([1 / np.sqrt(e), -f / e / rest, 1 / rest])


@kept(8)
def _bent(net: Net, places: tuple[bytes, bytes], shapes: tuple[tuple[int, ...], tuple[int, ...]]) -> Array:
    """The second fundamental form at pairs of parameters, ``(3, qv, qu)``; kept, because it is needed in different
    metrics."""
    at_u, at_v = (np.frombuffer(at).reshape(shape) for at, shape in zip(places, shapes, strict=True))
    every = np.ones((at_u.size, at_v.size), bool)
    jet = np.ascontiguousarray(jets(net, at_u, at_v, every, net.poles.mean(axis=(0, 1)), 2))
    found = np.empty((3, at_v.size, at_u.size))
    if CURVE.pays(jet.shape[2]):
        CURVE(pointer(jet), jet.shape[2], pointer(found))
    else:
        found.reshape(3, -1)[:] = curved(jet[1], jet[2], jet[3:])
    return found
