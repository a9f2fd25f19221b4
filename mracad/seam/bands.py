"""Symmetric sparse matrices as narrow bands, as LAPACK keeps them: products and factors at the speed of memory."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from mracad.memo import kept

Array = np.ndarray

WIDEST = 50.0
"""Largest bandwidth, over the fourth root of the number of unknowns, for which a band is faster than nested
dissection."""

BROAD = 400
"""Smallest bandwidth for which the fronts of a net are faster than a band."""

SPARSE = 3.0
"""Width of a band, over the mean number of entries in a row, above which sparse products are faster."""

FEW, MOST = 500, 4
"""Number of unknowns up to which a band of all of them is also factored for some, and times how many of these."""


REMEMBERED = 50_000
"""Number of entries of a matrix up to which the order of its unknowns is kept for others with the same entries."""


class Bands:
    """Symmetric matrices over the same unknowns, in one order in which they are narrow bands.

    Parameters
    ----------
    matrices : sequence of scipy.sparse.csr_array (n, n)
        The first one tells the order.
    places : ndarray (n, 2) of int, optional
        Places of the unknowns on a net: only near ones depend on each other.
    """

    def __init__(self, matrices: Sequence[Any], places: Array | None = None) -> None:
        self.matrices, self._places = matrices, places
        self._entries: dict[int, tuple[Array, Array, Array]] = {}

    @property
    def size(self) -> int:
        """n."""
        return int(self.matrices[0].shape[0])

    @cached_property
    def points(self) -> Array:
        """The unknowns with entries, in that order."""
        there = np.zeros(self.size, bool)
        for matrix in self.matrices:
            there |= np.diff(matrix.indptr) > 0
        first = self.matrices[0]
        pattern = first.indptr, first.indices, np.flatnonzero(there)
        if self._places is None or first.nnz > REMEMBERED:
            return _ordered(*pattern, self._places)
        return np.asarray(_known(_ordered, *pattern, self._places))

    @cached_property
    def width(self) -> int:
        """The bandwidth."""
        for matrix in self.matrices:
            if id(matrix.indices) not in self._entries:
                known = self._places is not None and matrix.nnz <= REMEMBERED
                pattern = matrix.indptr, matrix.indices, self.points
                self._entries[id(matrix.indices)] = _known(_lower, *pattern) if known else _lower(*pattern)
        width = max(int(below.max(initial=0)) for _, _, below in self._entries.values())
        if width > WIDEST * len(self.points) ** 0.25:
            self._entries.clear()
        return width

    @cached_property
    def narrow(self) -> bool:
        """Whether factors are faster as bands than otherwise."""
        return bool(self.width <= WIDEST * len(self.points) ** 0.25)

    def holds(self, free: Array) -> bool:
        """Whether bands of all unknowns are also the fastest for some."""
        most = FEW + MOST * np.count_nonzero(free)
        return bool(0 < len(self.points) <= most and self.width < BROAD and self.narrow)

    @cached_property
    def dense(self) -> bool:
        """Whether products are faster as bands than otherwise."""
        return bool(self.narrow and (self.width + 1) * len(self.points) <= SPARSE * self.matrices[0].nnz)

    @cached_property
    def lower(self) -> list[Array | None]:
        """The lower halves of the matrices, ``(points, width + 1)``, a column in every row; None if empty."""
        shape, found = (len(self.points), self.width + 1), []
        for matrix in self.matrices:
            lower, column, below = self._entries[id(matrix.indices)]
            band = np.zeros(shape) if matrix.nnz else None
            if band is not None:
                band[column, below] = matrix.data[lower]
            found.append(band)
        self._entries.clear()
        return found

    def times(self, number: int, x: Array) -> Array:
        """The product of a matrix with ``(n, k)``."""
        from scipy.linalg.blas import dsbmv

        lower = self.lower[number] if self.dense else None
        if lower is None:
            return np.asarray(self.matrices[number] @ x)
        found, parts = np.zeros(x.shape), x.take(self.points, axis=0).T
        found[self.points] = np.array([dsbmv(self.width, 1.0, lower.T, part, lower=1) for part in parts]).T
        return found

    def sum(self, weights: Sequence[float]) -> Array:
        """The lower half of a sum of the matrices with factors; the first one is not zero."""
        total = np.zeros((len(self.points), self.width + 1))
        for weight, lower in zip(weights, self.lower, strict=True):
            if weight and lower is not None:
                total += lower if weight == 1.0 else weight * lower
        return total


class Blocks:
    """A block-diagonal matrix, with one of the matrices in the bands of every surface.

    Products with several surfaces are sparse: bands would be no faster, and take more memory than the forms.
    """

    def __init__(self, bands: Sequence[Bands], number: int) -> None:
        self.bands, self.number = bands, number

    def __matmul__(self, x: Array) -> Array:
        if len(self.bands) == 1:
            return self.bands[0].times(self.number, x)
        parts = np.split(x, np.cumsum([each.size for each in self.bands])[:-1])
        return np.concatenate([each.matrices[self.number] @ part for each, part in zip(self.bands, parts, strict=True)])

    def diagonal(self) -> Array:
        """The diagonal, ``(points,)``."""
        return np.concatenate([each.matrices[self.number].diagonal() for each in self.bands])

    def tocsr(self) -> Any:
        """The whole matrix."""
        return whole([each.matrices[self.number] for each in self.bands])


def whole(parts: Sequence[Any]) -> Any:
    """A block-diagonal matrix of square parts, all ``scipy.sparse.csr_array``."""
    from scipy.sparse import csr_array

    if len(parts) == 1:
        return parts[0]
    begins, filled = (
        np.cumsum([0, *each]) for each in ([part.shape[0] for part in parts], [part.nnz for part in parts])
    )
    kind = np.int32 if filled[-1] < np.iinfo(np.int32).max else np.int64
    indices = np.concatenate([part.indices.astype(kind) + kind(at) for part, at in zip(parts, begins, strict=False)])
    ends = [part.indptr[1:].astype(kind) + kind(at) for part, at in zip(parts, filled, strict=False)]
    pointers = np.concatenate([np.zeros(1, kind), *ends])
    return csr_array((np.concatenate([part.data for part in parts]), indices, pointers), shape=(begins[-1],) * 2)


class Cholesky:
    """The factor of a symmetric positive definite matrix.

    Parameters
    ----------
    bands : Bands
        The order of its unknowns.
    lower : ndarray (points, width + 1)
        Its lower half, which is overwritten.

    Raises
    ------
    numpy.linalg.LinAlgError
        The matrix is not positive definite.
    """

    def __init__(self, bands: Bands, lower: Array) -> None:
        from scipy.linalg.lapack import dpbtrf

        self._points = bands.points
        self._band, failed = dpbtrf(lower.T, lower=1, overwrite_ab=1)
        if failed:
            raise np.linalg.LinAlgError("the matrix is not positive definite")

    def __call__(self, right: Array) -> Array:
        """The solution for a right-hand side ``(n, k)``."""
        from scipy.linalg.lapack import dpbtrs

        found = np.zeros(right.shape)
        found[self._points] = dpbtrs(self._band, right.take(self._points, axis=0), lower=1)[0]
        return found


def _known(function: Callable[..., Any], *arrays: Array) -> Any:
    """A function of arrays of whole numbers, kept for equal ones."""
    return _remembered(function, tuple((each.astype(int, copy=False).tobytes(), each.shape) for each in arrays))


@kept(64)
def _remembered(function: Callable[..., Any], arrays: tuple[tuple[bytes, tuple[int, ...]], ...]) -> Any:
    """Cached, because surfaces often have equal knots."""
    return function(*(np.frombuffer(data, int).reshape(shape) for data, shape in arrays))


def _ordered(indptr: Array, indices: Array, points: Array, places: Array | None) -> Array:
    """Unknowns in the order with the narrowest band: along one side of a net, from both ends if it is closed, or as
    given or by Cuthill and McKee."""
    if places is None:
        from scipy.sparse import csr_array
        from scipy.sparse.csgraph import reverse_cuthill_mckee

        n = len(indptr) - 1
        there = _places(points, n) >= 0
        order = reverse_cuthill_mckee(csr_array((np.ones(len(indices)), indices, indptr), (n, n)), symmetric_mode=True)
        return _narrowest(slice(None), indptr, indices, [points, order[there[order]]])
    own = places[points]
    folded = np.minimum(2 * own, 2 * (own.max(axis=0, initial=0) - own) + 1)
    keys = [(own[:, 1 - axis], along[:, axis]) for along in (own, folded) for axis in (0, 1)]
    starts = indptr[points]
    ends = np.concatenate([starts, indptr[points + 1] - 1])[np.tile(np.diff(indptr)[points] > 0, 2)]
    return _narrowest(ends, indptr, indices, [points[np.lexsort(key)] for key in keys])


def _narrowest(some: Any, indptr: Array, indices: Array, orders: Sequence[Array]) -> Array:
    """The order with the narrowest band, judged by some entries: those at the ends of rows tell enough on a net."""
    n = len(indptr) - 1
    row = np.repeat(np.arange(n, dtype=np.int32), np.diff(indptr))[some]
    column = indices[some]
    places = [_places(order, n) for order in orders]
    return orders[int(np.argmin([np.abs(place[row] - place[column]).max(initial=0) for place in places]))]


def _lower(indptr: Array, indices: Array, points: Array) -> tuple[Array, Array, Array]:
    """Which entries of a matrix are in its lower half in an order of unknowns, their columns and how far below the
    diagonal they are."""
    place = _places(points, len(indptr) - 1)
    column = place[indices]
    below = np.repeat(place, np.diff(indptr)) - column
    lower = below >= 0
    return lower, column[lower], below[lower]


def _places(order: Array, size: int) -> Array:
    place = np.full(size, -1, np.int32)
    place[order] = np.arange(len(order), dtype=np.int32)
    return place
