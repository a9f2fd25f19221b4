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

from collections.abc import Callable, Iterable, Iterator, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import numpy as np

from mracad.bspline.jets import jets
from mracad.bspline.surface import Net
from mracad.memo import kept
from mracad.wavelet.project import at_scale

Array = np.ndarray
Form = tuple[Array, Array, Array]
"""Components 11, 12 and 22 of a symmetric form at points."""

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
        p, q, r = orthonormal(net, us, vs)
        a, b, c = self.shape(us, vs, (p, q, r))
        skew = q / p
        along_v = (c - 2 * skew * b + skew * skew * a) / (1 + skew * skew)
        bent = np.abs(a).max(axis=1), np.abs(along_v).max(axis=0)
        one, other = (
            np.where(2 * self.length * each > THETA, np.maximum(size * each / (2 * THETA), 1.0), 1.0)
            for size, each in zip(lengths, bent, strict=True)
        )
        return one, other

    def shape(self, u: Array, v: Array, frame: Form) -> Form:
        """The shape operator in the frame (p, q, r: p ∂_u and q ∂_u + r ∂_v are orthonormal), ``(qu, qv)`` each."""
        p, q, r = frame
        found: Form | None = None
        left = np.zeros(())
        for length, net in self.looks:
            a, b, c = _bent(net, (u.tobytes(), v.tobytes()), (u.shape, v.shape))
            across = q * a + r * b
            now = p * p * a, p * across, q * (across + r * b) + r * r * c
            mean, half = _halves(now)
            turns = (np.abs(mean) + half) * length > THETA
            if found is not None:
                turns &= left
                for old, new in zip(found, now, strict=True):
                    np.copyto(old, new, where=left)
            found, left = found or now, turns
            if not left.any():
                break
        assert found is not None
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

    def root(self, u: Array, v: Array, first: Form, frame: Form) -> Form:
        """R at pairs of parameters, in the frame, ``(qu, qv)`` each.

        Parameters
        ----------
        u, v : ndarray (pieces, points)
            Parameters; each piece lies in one knot span.
        first : tuple of ndarray (qu, qv)
            The first fundamental form.
        frame : tuple of ndarray (qu, qv)
            p, q and r: p ∂_u and q ∂_u + r ∂_v are orthonormal.
        """
        e, f, g = first
        along, across = self.lengths[:: 1 - 2 * self.lead]
        cos = f / np.sqrt(e * g) if self.lead else np.ones_like(e)
        square, both = cos * cos, cos * np.sqrt(1.0 - cos * cos)
        root = across + (along - across) * square, (along - across) * both, along + (across - along) * square
        if self.limit is None:
            return root
        bent = self.limit.shape(u, v, frame)
        scale = self.limit.length / THETA
        inverse = root if self.even else _power(root, lambda x: 1.0 / _fourth(x))
        limit = _power(bent, lambda x: _fourth(scale * x))
        a, b, c = (one + other for one, other in zip(inverse, limit, strict=True))
        least = max(self.lengths) ** -4.0  # rounding must not make a large sum smaller than its first term
        return _power((a, b, c), lambda x: 1.0 / np.sqrt(np.sqrt(np.maximum(x, least))))


EVEN = Stretch()


def orthonormal(net: Net, us: Array, vs: Array) -> Form:
    """p, q and r at pairs of parameters, ``(qu, qv)`` each: p ∂_u and q ∂_u + r ∂_v are orthonormal on a surface."""
    xu, xv = (net.tangents(us.ravel(), vs.ravel(), axis) for axis in (0, 1))
    e, f, g = ((a * b).sum(axis=-1) for a, b in ((xu, xu), (xu, xv), (xv, xv)))
    e = np.maximum(e, 1e-300)
    rest = np.sqrt(np.maximum(g - f * f / e, 1e-12 * g + 1e-300))
    return 1 / np.sqrt(e), -f / e / rest, 1 / rest


@kept(8)
def _bent(net: Net, places: tuple[bytes, bytes], shapes: tuple[tuple[int, ...], tuple[int, ...]]) -> Form:
    """The second fundamental form at pairs of parameters; kept, because it is needed in different metrics."""
    at_u, at_v = (np.frombuffer(at).reshape(shape) for at, shape in zip(places, shapes, strict=True))
    every = jets(net, at_u, at_v, np.ones((at_u.size, at_v.size), bool), net.poles.mean(axis=(0, 1)), 2)
    xu, xv, *second = every.reshape(6, 3, at_v.size, at_u.size)[1:]
    normal = xu[1] * xv[2] - xu[2] * xv[1], xu[2] * xv[0] - xu[0] * xv[2], xu[0] * xv[1] - xu[1] * xv[0]
    size = np.maximum(np.sqrt(_dot(normal, normal)), 1e-300)
    a, b, c = ((_dot(normal, each) / size).T for each in second)
    return a, b, c


def _halves(form: Form) -> tuple[Array, Array]:
    """Half the sum and half the difference of the eigenvalues of a form."""
    a, b, c = form
    return (a + c) / 2, np.hypot((a - c) / 2, b)


def _dot(a: Sequence[Array] | Array, b: Sequence[Array] | Array) -> Array:
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def _fourth(x: Array) -> Array:
    return np.asarray((x * x) * (x * x))


def _power(form: Form, of: Callable[[Array], Array]) -> Form:
    """A symmetric form with a function applied to its eigenvalues."""
    a, b, c = form
    mean, half = _halves(form)
    high, low = of(mean + half), of(mean - half)
    middle = (high + low) / 2
    slope = np.where(half > 0, (high - low) / np.maximum(2 * half, 1e-300), 0.0)
    return middle + slope * (a - mean), slope * b, middle + slope * (c - mean)
