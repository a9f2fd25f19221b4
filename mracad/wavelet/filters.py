"""Minimally supported semi-orthogonal B-spline wavelets for any nested pair of knot vectors."""

from __future__ import annotations

import numpy as np

from mracad.bspline.gram import Gram, gram
from mracad.bspline.knots import Array, KnotVector
from mracad.bspline.refine import refinement
from mracad.bspline.rows import Rows
from mracad.errors import MracadError, UsageError
from mracad.memo import kept


class Columns:
    """A matrix whose columns are each one run of rows.

    Attributes
    ----------
    start : ndarray (c,) of int
        First row of each column's run.
    values : ndarray (c, w)
        The runs, padded with zeros where shorter.
    rows : int
        Number of rows.
    periodic : bool
        Whether rows are counted modulo ``rows``.
    """

    def __init__(self, start: Array, values: Array, rows: int, periodic: bool) -> None:
        self.transposed = Rows(start, values, rows, periodic)
        self.start, self.values, self.rows, self.periodic = start, values, rows, periodic

    @property
    def shape(self) -> tuple[int, int]:
        return self.rows, len(self.start)

    def coo(self) -> tuple[Array, Array, Array]:
        """Row, column and value of every entry that is not zero."""
        column, row, value = self.transposed.coo()
        return row, column, value

    def apply(self, c: Array, axis: int = 0) -> Array:
        """The matrix times ``c`` along ``axis``."""
        return self.transposed.apply_transposed(c, axis)

    def apply_transposed(self, c: Array, axis: int = 0) -> Array:
        """The transposed matrix times ``c`` along ``axis``."""
        return self.transposed.apply(c, axis)

    def toarray(self) -> Array:
        """The dense matrix."""
        return self.transposed.toarray().T


@kept(256)
def wavelets(coarse: KnotVector, fine: KnotVector, vanish: tuple[int, int] = (0, 0)) -> Columns:
    """A basis Q of the wavelets: fine splines orthogonal to all coarse ones, of minimal support.

    ``PᵀGQ = 0``; every column has ``qᵀGq = 1`` and a positive first coefficient; columns
    are sorted by their first row.

    Parameters
    ----------
    coarse, fine : KnotVector
        Nested, with any multiplicities.
    vanish : pair of int
        Work in the splines that vanish to this order at the start and at the end of the domain: so many functions
        are left out there in both spaces, and rows of Q count from the first remaining one.

    Returns
    -------
    Columns (n, n − m)
        n and m without the functions that ``vanish`` leaves out.

    Raises
    ------
    UsageError
        Knots not nested, or not enough functions for ``vanish``.

    Notes
    -----
    ``M = PᵀG`` is a totally positive staircase, so its structural rank tells which runs of columns are dependent; each
    minimal run gives one wavelet, the null vector of a small block.  Lyche, Mørken and Quak, *Theory and algorithms
    for non-uniform spline wavelets*; Kazinnik and Elber 1997.

    Examples
    --------
    >>> import numpy as np
    >>> from mracad.bspline.gram import gram
    >>> from mracad.bspline.knots import KnotVector
    >>> from mracad.bspline.refine import refinement
    >>> from mracad.wavelet import wavelets
    >>> fine, coarse = KnotVector.clamped([0, 1, 3, 4, 9], 3), KnotVector.clamped([0, 3, 9], 3)
    >>> q = wavelets(coarse, fine)
    >>> q.shape
    (7, 2)
    >>> bool(np.abs(refinement(coarse, fine).apply_transposed(gram(fine).apply(q.toarray()))).max() < 1e-12)
    True
    """
    start, end = vanish
    if min(vanish) < 0 or start + end >= coarse.count or (fine.periodic and any(vanish)):
        raise UsageError(f"these splines cannot vanish to orders {vanish} at their ends")
    p, g = refinement(coarse, fine), gram(fine)
    low, high = _staircase(coarse, fine, vanish)
    first, stop = _runs(low, high, fine.periodic)
    n = fine.count - start - end
    missing = fine.count - coarse.count
    if len(first) != missing or (fine.periodic and (stop - first).max(initial=0) + fine.degree > n):
        if not fine.periodic:
            raise MracadError(f"found {len(first)} wavelets instead of {missing}")
        return Columns(np.zeros(missing, dtype=int), _dense(p, g), n, False)
    width = int((stop - first).max(initial=1))
    begin = first if fine.periodic else np.minimum(first, n - width)
    values = np.zeros((missing, width))
    norm = np.sqrt(g.diagonal())
    moments = g.rows.dot(p)
    shapes = np.stack([stop - first, low[first], high[stop - 1]], axis=1)
    sizes = np.stack([shapes[:, 0], shapes[:, 2] - shapes[:, 1]], axis=1)
    for size in np.unique(sizes, axis=0):
        which = np.flatnonzero((sizes == size).all(axis=1))
        column = first[which, None] + start + np.arange(size[0])
        row = shapes[which, 1, None] + np.arange(size[1])
        scale = 1.0 / norm[column % fine.count]
        block = _blocks(moments, row, column) * scale[:, None, :]
        null = _null_vectors(block) * scale
        null /= np.sqrt(_energy(g, null, column))[:, None]
        values[which[:, None], (first - begin)[which, None] + np.arange(size[0])] = null
    return Columns(begin, values, n, fine.periodic)


def _staircase(coarse: KnotVector, fine: KnotVector, vanish: tuple[int, int]) -> tuple[Array, Array]:
    """First and one past the last coarse function that meets each fine function (periodic: unrolled, two turns)."""
    d = fine.degree
    if fine.periodic:
        t, tau = _turns(fine, 0, 2 * fine.count + d + 1), _turns(coarse, -coarse.count - d, 4 * coarse.count + 2 * d)
        offset, m = -coarse.count - d, 5 * coarse.count + d
    else:
        a, b = fine.domain
        t, tau = np.clip(fine.knots, a, b), np.clip(coarse.knots, a, b)
        offset, m = 0, coarse.count
    n = len(t) - d - 1
    low = np.searchsorted(tau[d + 1 :], t[:n], "right") + offset
    high = np.minimum(np.searchsorted(tau, t[d + 1 :], "left"), m) + offset
    if fine.periodic:
        return low, high
    start, end = vanish
    inside = slice(start, n - end)
    return np.clip(low[inside], start, m - end), np.clip(high[inside], start, m - end)


def _turns(kv: KnotVector, begin: int, end: int) -> Array:
    """Knots ``begin … end − 1`` of the periodic vector continued both ways."""
    seam = kv.degree + 1 - int(kv.multiplicities[0])
    turn, place = np.divmod(np.arange(begin, end) - seam, kv.count)
    values = np.repeat(kv.breaks[:-1], kv.multiplicities[:-1])[place] + turn * kv.period
    starts = place < kv.multiplicities[0]
    values[starts] = kv.breaks[0] + turn[starts] * kv.period
    return values


def _runs(low: Array, high: Array, periodic: bool) -> tuple[Array, Array]:
    """Minimal dependent runs of columns ``first … stop − 1`` of the staircase, by greedy matching of rows."""
    total = len(low)
    n = total // 2 if periodic else total
    stop = np.full(n + 1, total + 1)
    active = np.arange(n + 1 if periodic else n)
    rank = low[active] - 1
    column = active.copy()
    while active.size:
        rank = np.maximum(rank + 1, low[column])
        done = rank >= high[column]
        stop[active[done]] = column[done] + 1
        more = ~done & (column + 1 < total)
        active, rank, column = active[more], rank[more], column[more] + 1
    first = np.flatnonzero((stop[:-1] <= total) & (stop[:-1] < stop[1:]))
    return first, stop[first]


def _blocks(moments: Rows, row: Array, column: Array) -> Array:
    """Blocks of ``M = PᵀG`` out of its transpose ``moments``; rows and columns unrolled, ``(b, r)`` and ``(b, c)``."""
    turn, place = np.divmod(column, len(moments.start))
    offset = row[:, :, None] - (moments.start[place] + turn * moments.columns)[:, None, :]
    width = moments.values.shape[1]
    values = moments.values[place[:, None, :], np.clip(offset, 0, width - 1)]
    return np.where((offset >= 0) & (offset < width), values, 0.0)


def _null_vectors(blocks: Array) -> Array:
    """Unit null vector of each ``(c − 1, c)`` block, its first coefficient positive.

    The last column of the full QR of the transpose: orthogonal to the rows to rounding, however ill-conditioned.
    """
    vectors = np.linalg.qr(blocks.transpose(0, 2, 1), mode="complete")[0][:, :, -1]
    return vectors * np.where(vectors[:, :1] < 0, -1.0, 1.0)


def _energy(g: Gram, q: Array, column: Array) -> Array:
    """``qᵀGq`` of each row of ``q`` on the given (unrolled) columns."""
    total = np.zeros(len(q))
    length = q.shape[1]
    for k, band in enumerate(g.bands[:length]):
        pair = q[:, : length - k] * q[:, k:] * band[column[:, : length - k] % len(band)]
        total += (1 if k == 0 else 2) * pair.sum(axis=1)
    return total


def _dense(p: Rows, g: Gram) -> Array:
    """All wavelets as rows, if supports would wrap round a short loop: the null space of the whole ``PᵀG``."""
    scale = 1.0 / np.sqrt(g.diagonal())
    matrix = g.apply(p.toarray()).T * scale
    q = np.linalg.svd(matrix)[2][p.columns :] * scale
    q *= np.where(q[:, :1] < 0, -1.0, 1.0)
    return np.asarray(q / np.sqrt((q * g.apply(q, axis=1)).sum(axis=1))[:, None])
