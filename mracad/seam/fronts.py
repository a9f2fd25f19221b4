"""Cholesky factors of large nets by nested dissection: halves of a net are eliminated before what lies between them.

A band as wide as a net of n × n control points takes n³ numbers and n⁴ operations; the fronts of the halves, which are
dense and small, take n² log n and n³.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

Array = np.ndarray

LEAF = 150
"""Number of unknowns that are not divided further."""


@dataclass(frozen=True, eq=False)
class _Front:
    """Unknowns that are eliminated together.

    Attributes
    ----------
    own : slice
        In the order of elimination.
    later : ndarray (m,) of int
        Unknowns eliminated later on which they depend.
    square : ndarray (k, k)
        L of their own, in the lower triangle.
    below : ndarray (m, k)
        L of the later ones.
    """

    own: slice
    later: Array
    square: Array
    below: Array


class Fronts:
    """The factor of a symmetric positive definite matrix whose unknowns have places on a grid.

    Parameters
    ----------
    matrix : scipy.sparse.csr_array (n, n)
    places : ndarray (n, 2) of int
        Only unknowns with near places may depend on each other.

    Raises
    ------
    numpy.linalg.LinAlgError
        The matrix is not positive definite.
    """

    def __init__(self, matrix: Any, places: Array) -> None:
        row = np.repeat(np.arange(matrix.shape[0], dtype=np.int32), np.diff(matrix.indptr))
        apart = [int(np.abs(at[row] - at[matrix.indices]).max(initial=0)) for at in places.T.astype(np.int32)]
        parts = _dissected(np.arange(len(places)), places, apart)
        self._order = np.concatenate([own for own, _ in parts])
        self._fronts: list[_Front] = []
        self._factored(_upper(matrix, row, self._order), parts)

    def _factored(self, upper: Any, parts: list[tuple[Array, int]]) -> None:
        from scipy.linalg.blas import dsyrk, dtrsm
        from scipy.linalg.lapack import dpotrf

        n, end = upper.shape[0], 0
        local, marked = np.zeros(n, dtype=np.int32), np.zeros(n, dtype=bool)
        waiting: list[tuple[Array, Array]] = []
        for own, children in parts:
            begin, end = end, end + len(own)
            entries = slice(upper.indptr[begin], upper.indptr[end])
            column, given = upper.indices[entries], waiting[len(waiting) - children :]
            del waiting[len(waiting) - children :]
            for each in (column, *(later for later, _ in given)):
                marked[each] = True
            marked[begin:end] = False
            later = np.flatnonzero(marked[end:]) + end
            marked[later] = False
            count, rest = len(own), len(later)
            local[begin:end] = np.arange(count)
            local[later] = np.arange(count, count + rest)
            square, below, left = (
                np.zeros(shape, order="F") for shape in ((count, count), (rest, count), (rest, rest))
            )
            line, value, at = (
                np.repeat(np.arange(count), np.diff(upper.indptr[begin : end + 1])),
                upper.data[entries],
                local[column],
            )
            inside = at < count
            square[at[inside], line[inside]] = value[inside]
            below[at[~inside] - count, line[~inside]] = value[~inside]
            while given:
                _joined((square, below, left), local, *given.pop())
            square, failed = dpotrf(square, lower=1, clean=0, overwrite_a=1)
            if failed:
                raise np.linalg.LinAlgError("the matrix is not positive definite")
            if rest:
                below = dtrsm(1.0, square, below, side=1, lower=1, trans_a=1, overwrite_b=1)
                left = dsyrk(-1.0, below, beta=1.0, c=left, lower=1, overwrite_c=1)
            waiting.append((later, left))
            self._fronts.append(_Front(slice(begin, end), later, square, below))

    def __call__(self, right: Array) -> Array:
        """The solution for a right-hand side ``(n, k)``."""
        from scipy.linalg.blas import dtrsm

        x: Array = right[self._order]
        for each in self._fronts:
            done = dtrsm(1.0, each.square, x[each.own], lower=1)
            x[each.own] = done
            x[each.later] -= each.below @ done
        for each in reversed(self._fronts):
            x[each.own] = dtrsm(1.0, each.square, x[each.own] - each.below.T @ x[each.later], lower=1, trans_a=1)
        found = np.empty_like(right)
        found[self._order] = x
        return found


def _joined(front: tuple[Array, Array, Array], local: Array, later: Array, left: Array) -> None:
    """Add what a front left to the lower triangle of another one, in runs of neighbouring unknowns."""
    square, below, rest = front
    at, count = local[later], len(square)
    steps = np.flatnonzero((np.diff(at) != 1) | (at[1:] == count)) + 1
    runs = list(zip([0, *steps.tolist()], [*steps.tolist(), len(at)], strict=True))
    for low, high in runs if len(at) else ():
        row = int(at[low])
        for first, last in runs:
            if first > low:
                break
            column, part = int(at[first]), left[low:high, first:last]
            whole = square if row < count else below if column < count else rest
            row_in, column_in = row - count * (row >= count), column - count * (column >= count)
            whole[row_in : row_in + high - low, column_in : column_in + last - first] += part


def _dissected(those: Array, places: Array, apart: list[int]) -> list[tuple[Array, int]]:
    """Sets of unknowns in the order of elimination, each with the number of sets before it that it follows."""
    extent = np.ptp(places[those], axis=0)
    axis = int(extent[1] * (apart[0] + 1) > extent[0] * (apart[1] + 1))
    if len(those) <= LEAF or extent[axis] < 4 * apart[axis]:
        return [(those, 0)]
    at = places[those, axis]
    middle = (int(at.min()) + int(at.max()) + apart[axis]) // 2
    low, high = at < middle - apart[axis], at >= middle
    between = those[~low & ~high]
    return [*_dissected(those[low], places, apart), *_dissected(those[high], places, apart), (between, 2)]


def _upper(matrix: Any, row: Array, order: Array) -> Any:
    """The upper triangle of a matrix in another order."""
    from scipy.sparse import coo_array

    place = np.empty(len(order), dtype=np.int32)
    place[order] = np.arange(len(order), dtype=np.int32)
    row, column = place[row], place[matrix.indices]
    upper = column >= row
    return coo_array((matrix.data[upper], (row[upper], column[upper])), shape=matrix.shape).tocsr()
