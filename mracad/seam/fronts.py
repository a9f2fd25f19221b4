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
        L of their own.
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
            count = len(own)
            local[begin:end] = np.arange(count)
            local[later] = np.arange(count, count + len(later))
            front = np.zeros((count + len(later), count + len(later)), order="F")
            line = np.repeat(np.arange(count), np.diff(upper.indptr[begin : end + 1]))
            front[local[column], line] = upper.data[entries]
            while given:
                rest, left = given.pop()
                at = local[rest]
                front.T[at[:, None], at] += left.T
            square, failed = dpotrf(front[:count, :count], lower=1, clean=1)
            if failed:
                raise np.linalg.LinAlgError("the matrix is not positive definite")
            below = dtrsm(1.0, square, front[count:, :count], side=1, lower=1, trans_a=1)
            if len(later):
                left = dsyrk(-1.0, below, beta=1.0, c=front[count:, count:], lower=1)
                waiting.append((later, left))
            else:
                waiting.append((later, np.zeros((0, 0))))
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
