"""Conditions that tie a few unknowns at a time, solved in advance.

Conditions and the unknowns that they tie fall into parts without common unknowns: along a seam whose joint is constant,
a few control points on both sides of it, and those around each corner.  The singular vectors of a part give its
displacements that meet the conditions, and the least one for any other goal.  Minima are then sought among the
displacements that meet all conditions: there are fewer of them, and no multipliers.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

Array = np.ndarray

MOST = 100
"""Largest number of unknowns or conditions of a part."""

RANK = 1e-12, 1e-3
"""Singular values, relative to the largest one of all, of conditions that are certainly implied by others, and of those
that certainly are not; between them parts are not solved in advance."""


@dataclass(frozen=True, eq=False)
class Eliminated:
    """The solution of conditions L x = r: x = P r + Z y, for any y.

    Attributes
    ----------
    basis : csr_array (unknowns, k)
        Z, whose columns are orthonormal.
    least : csr_array (unknowns, conditions)
        P, the pseudo-inverse of L.
    """

    basis: Any
    least: Any

    @classmethod
    def of(cls, rows: Any) -> Eliminated | None:
        """The solution of conditions, a ``scipy.sparse.csr_array`` (conditions, unknowns) without empty rows; None if
        they tie too many unknowns to each other, or nearly contradict each other."""
        from scipy.sparse import coo_array

        rows = rows.copy()
        rows.eliminate_zeros()
        basis, least, width = [], [], 0
        for unknowns, conditions, table in _parts(rows):
            if max(table.shape[1:]) > MOST:
                return None
            if not table.shape[1]:
                columns = width + np.arange(unknowns.size).reshape(unknowns.shape)
                basis.append((unknowns.ravel(), columns.ravel(), np.ones(unknowns.size)))
                width += columns.size
                continue
            left, size, right = np.linalg.svd(table)
            strong = size > RANK[1]
            if (size[~strong] > RANK[0]).any():
                return None
            for rank in np.unique(strong.sum(axis=1)).tolist():
                those = strong.sum(axis=1) == rank
                free = right[those, rank:]
                columns = width + np.arange(free.shape[0] * free.shape[1]).reshape(free.shape[:2])
                basis.append(_entries(unknowns[those], columns, free.swapaxes(1, 2)))
                width += columns.size
                inverse = right[those, :rank].swapaxes(1, 2) / size[those, None, :rank]
                inverse = inverse @ left[those, :, :rank].swapaxes(1, 2)
                least.append(_entries(unknowns[those], conditions[those], inverse))
        found = []
        for entries, count in ((basis, width), (least, rows.shape[0])):
            row, column, value = (np.concatenate(each) for each in zip(*entries, strict=True))
            found.append(coo_array((value, (row, column)), shape=(rows.shape[1], count)).tocsr())
        return cls(*found)


def _parts(rows: Any) -> Iterator[tuple[Array, Array, Array]]:
    """Parts without common unknowns: those of one size at once, the largest first.

    Yields
    ------
    unknowns : ndarray (parts, n) of int
    conditions : ndarray (parts, m) of int
    table : ndarray (parts, m, n)
    """
    from scipy.sparse.csgraph import connected_components

    count, label = connected_components(abs(rows.T) @ abs(rows), directed=False)
    row = np.repeat(np.arange(rows.shape[0]), np.diff(rows.indptr))
    owners = label, label[rows.indices[rows.indptr[:-1]]]
    sizes = np.stack([np.bincount(owner, minlength=count) for owner in owners])
    orders = [np.argsort(owner, kind="stable") for owner in owners]
    starts = np.cumsum(sizes, axis=1) - sizes
    places = [np.empty(len(owner), int) for owner in owners]
    for owner, order, start, place in zip(owners, orders, starts, places, strict=True):
        place[order] = np.arange(len(order)) - start[owner[order]]
    every, kind = np.unique(sizes, axis=1, return_inverse=True)
    number = np.empty(count, int)
    for which in np.argsort(-every.max(axis=0)).tolist():
        (n, m), those = every[:, which].tolist(), np.flatnonzero(kind.ravel() == which)
        number[those] = np.arange(len(those))
        each = zip(orders, starts, (n, m), strict=True)
        unknowns, conditions = (order[start[those, None] + np.arange(size)] for order, start, size in each)
        own = kind.ravel()[label[rows.indices]] == which
        table = np.zeros((len(those), m, n))
        table[number[label[rows.indices[own]]], places[1][row[own]], places[0][rows.indices[own]]] = rows.data[own]
        yield unknowns, conditions, table


def _entries(rows: Array, columns: Array, blocks: Array) -> tuple[Array, Array, Array]:
    """The entries of blocks ``(parts, n, m)`` of a matrix, in their rows ``(parts, n)`` and columns ``(parts, m)``."""
    row, column, value = (each.ravel() for each in np.broadcast_arrays(rows[:, :, None], columns[:, None, :], blocks))
    some = np.abs(value) > np.finfo(float).eps
    return row[some], column[some], value[some]
