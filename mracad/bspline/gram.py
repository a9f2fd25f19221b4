"""Gram matrices of B-spline bases."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from mracad.bspline.basis import gauss, local_values
from mracad.bspline.knots import Array, KnotVector
from mracad.bspline.rows import Rows
from mracad.errors import UsageError
from mracad.memo import kept

if TYPE_CHECKING:
    import scipy.sparse


class Gram:
    """A symmetric banded (cyclic where periodic) matrix.

    Attributes
    ----------
    bands : ndarray (d + 1, n)
        ``bands[k, i]`` is added at row ``i``, column ``i + k`` (modulo ``n`` where periodic) and its mirror image.
    """

    def __init__(self, bands: Array, periodic: bool = False) -> None:
        self.bands, self.periodic = bands, periodic

    @property
    def shape(self) -> tuple[int, int]:
        return self.bands.shape[1], self.bands.shape[1]

    @cached_property
    def rows(self) -> Rows:
        """The full matrix by rows."""
        d, n = self.bands.shape[0] - 1, self.bands.shape[1]
        if self.periodic:
            values = np.empty((n, 2 * d + 1))
            for reach, band in enumerate(self.bands):
                values[:, d - reach], values[:, d + reach] = np.roll(band, reach), band
            return Rows(np.arange(n) - d, values, n, periodic=True)
        k, i = np.nonzero(self.bands)
        value, mirrored = self.bands[k, i], k > 0
        row, column = np.concatenate([i, (i + k)[mirrored]]), np.concatenate([i + k, i[mirrored]])
        return Rows.from_coo(row, column, np.concatenate([value, value[mirrored]]), (n, n))

    def diagonal(self) -> Array:
        """Diagonal of the matrix, ``(n,)``."""
        n = self.bands.shape[1]
        folded = self.bands[n::n].sum(axis=0) if self.periodic else 0.0
        return np.asarray(self.bands[0] + 2 * folded)

    def apply(self, c: Array, axis: int = 0) -> Array:
        """The matrix times ``c`` along ``axis``."""
        return self.rows.apply(c, axis)

    def toarray(self) -> Array:
        """The dense matrix."""
        return self.rows.toarray()

    def tocsr(self) -> scipy.sparse.csr_array:
        """The matrix as a ``scipy.sparse.csr_array``."""
        return self.rows.tocsr()


def gram(kv: KnotVector, derivative: int = 0, weights: Array | None = None) -> Gram:
    """Gram matrix of the basis, or of its derivatives.

    ``G_ij = ∫ N_i^(k) N_j^(k) w dt`` over the domain, ``k`` the derivative, by Gauss–Legendre quadrature with ``d + 1``
    points per span (exact).

    Parameters
    ----------
    kv : KnotVector
    derivative : int
    weights : array_like (spans,), optional
        Factor ``w`` on each span between neighbouring breaks, positive.

    Returns
    -------
    Gram
        In parameter units: its entries scale with ``length ** (1 - 2 k)``.
    """
    return _remembered(kv, derivative) if weights is None else _computed(kv, derivative, checked_weights(kv, weights))


@kept(512)
def _remembered(kv: KnotVector, derivative: int) -> Gram:
    """Cached, because surfaces often share their knots."""
    return _computed(kv, derivative, np.ones(kv.spans))


def _computed(kv: KnotVector, derivative: int, weights: Array) -> Gram:
    span, offset, quadrature = gauss(kv, kv.degree + 1)
    quadrature = quadrature * weights[:, None]
    points = quadrature.shape[1]
    values = local_values(kv, np.repeat(span, points), offset.ravel(), derivative).reshape(-1, *quadrature.shape)
    local = np.matmul((values * quadrature).transpose(1, 0, 2), values.transpose(1, 2, 0))
    return assembled(span - kv.degree, local, kv.count, kv.periodic)


def checked_weights(kv: KnotVector, weights: Array) -> Array:
    """The weights as an array with one positive entry per span."""
    weights = np.asarray(weights, dtype=float)
    if weights.shape != (kv.spans,):
        raise UsageError(f"{weights.size} weights for {kv.spans} spans")
    if not (np.isfinite(weights).all() and (weights > 0).all()):
        raise UsageError("a weight is not positive")
    return weights


def assembled(first: Array, local: Array, count: int, periodic: bool) -> Gram:
    """Sum of symmetric local matrices ``(s, w, w)``, each on rows and columns ``first …``, all ``first`` distinct."""
    width = local.shape[1]
    bands = np.zeros((width, count))
    for a in range(width):
        for b in range(a, width):
            bands[b - a, (first + a) % count] += local[:, a, b]
    return Gram(bands, periodic)
