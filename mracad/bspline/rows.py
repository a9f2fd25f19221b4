"""Banded matrices stored by rows."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from mracad.bspline.band import BAND
from mracad.bspline.knots import Array
from mracad.compiled import pointer
from mracad.errors import UsageError

if TYPE_CHECKING:
    import scipy.sparse

LARGE = 200_000
"""Number of values above which compiled sweeps are worth importing their compiler."""


class Rows:
    """A matrix whose rows are each one run of columns.

    Parameters
    ----------
    start : ndarray (r,) of int
        First column of each row's run.
    values : ndarray (r, w)
        The runs, padded with zeros where shorter.
    columns : int
        Number of columns.
    periodic : bool
        Whether columns are counted modulo ``columns``; a run may then be longer than the matrix is wide.
    """

    def __init__(self, start: Array, values: Array, columns: int, periodic: bool = False) -> None:
        self.start, self.values, self.columns, self.periodic = start, values, columns, periodic
        start.setflags(write=False)
        values.setflags(write=False)

    @classmethod
    def from_coo(cls, row: Array, column: Array, value: Array, shape: tuple[int, int]) -> Rows:
        """The matrix with the given entries, each position at most once."""
        first, last = np.full(shape[0], shape[1]), np.full(shape[0], -1)
        np.minimum.at(first, row, column)
        np.maximum.at(last, row, column)
        width = max(int((last - first).max(initial=0)) + 1, 1)
        first = np.clip(np.minimum(first, shape[1] - width), 0, None)
        values = np.zeros((shape[0], width))
        values[row, column - first[row]] = value
        return cls(first, values, shape[1])

    @property
    def shape(self) -> tuple[int, int]:
        return len(self.start), self.columns

    @cached_property
    def index(self) -> Array:
        """Column of every stored value, ``(r, w)``."""
        index = self.start[:, None] + np.arange(self.values.shape[1])
        return index % self.columns if self.periodic else index

    def coo(self) -> tuple[Array, Array, Array]:
        """Row, column and value of every entry that is not zero, duplicates summed."""
        if self.periodic and self.values.shape[1] > self.columns:
            dense = self.toarray()
            row, column = np.nonzero(dense)
            return row, column, dense[row, column]
        row, place = np.nonzero(self.values)
        return row, self.index[row, place], self.values[row, place]

    def apply(self, c: Array, axis: int = 0) -> Array:
        """The matrix times ``c`` along ``axis``."""
        c = np.asarray(c, dtype=float)
        if c.shape[axis] != self.columns:
            raise UsageError(f"{c.shape[axis]} values along axis {axis} for a matrix with {self.columns} columns")
        if c.size >= LARGE and not self.periodic:
            from mracad.bspline import sweeps

            return sweeps.apply(self, c, axis % c.ndim)
        axis %= c.ndim
        before, after = math.prod(c.shape[:axis]), math.prod(c.shape[axis + 1 :])
        rows, width = self.values.shape
        flat, found = np.ascontiguousarray(c).reshape(before, self.columns, after), np.zeros((before, rows, after))
        if BAND.pays(found.size * width):
            BAND(*map(pointer, self._flat), rows, width, self.columns, pointer(flat), before, after, pointer(found))
        else:
            for tap, column in zip(self.values.T, self.index.T, strict=True):
                found += tap[:, None] * flat[:, column]
        return found.reshape(*c.shape[:axis], rows, *c.shape[axis + 1 :])

    @cached_property
    def _flat(self) -> tuple[Array, Array]:
        """The runs as compiled code wants them."""
        return np.ascontiguousarray(self.start, np.int64), np.ascontiguousarray(self.values)

    def apply_transposed(self, c: Array, axis: int = 0) -> Array:
        """The transposed matrix times ``c`` along ``axis``."""
        c = np.asarray(c, dtype=float)
        if c.shape[axis] != len(self.start):
            raise UsageError(f"{c.shape[axis]} values along axis {axis} for a matrix with {len(self.start)} rows")
        if c.size >= LARGE and not self.periodic:
            from mracad.bspline import sweeps

            return sweeps.scatter(self, c, axis % c.ndim)
        moved = np.moveaxis(c, axis, 0)
        flat = moved.reshape(len(self.start), -1)
        order, first = self._groups
        out = np.zeros((self.columns, flat.shape[1]))
        for column, value in zip(self.index[order[first]].T, self.values.T, strict=True):
            out[column] += np.add.reduceat((value[:, None] * flat)[order], first)
        return np.moveaxis(out.reshape(-1, *moved.shape[1:]), 0, axis)

    def dot(self, other: Rows) -> Rows:
        """The product of this matrix and another, both with runs that move from row to row."""
        place = self.start[:, None] + np.arange(self.values.shape[1])
        turn, row = np.divmod(place, len(other.start))
        begin = other.start[row] + turn * other.columns
        first = begin.min(axis=1)
        width = other.values.shape[1]
        values = np.zeros((len(first), int((begin.max(axis=1) - first).max(initial=0)) + width))
        if not self.periodic:
            first = np.minimum(first, other.columns - values.shape[1])
        each = np.arange(len(first))[:, None]
        for k in range(place.shape[1]):
            run = (begin[:, k] - first)[:, None] + np.arange(width)
            values[each, run] += self.values[:, k, None] * other.values[row[:, k]]
        return Rows(first, values, other.columns, self.periodic)

    @cached_property
    def _groups(self) -> tuple[Array, Array]:
        """Rows sorted by their first column (modulo the columns), and the positions where a new first column begins."""
        key = self.index[:, 0]
        order = np.argsort(key, kind="stable")
        return order, np.flatnonzero(np.diff(key[order], prepend=-1))

    def toarray(self) -> Array:
        """The dense matrix."""
        dense = np.zeros(self.shape)
        np.add.at(dense, (np.arange(len(self.start))[:, None], self.index), self.values)
        return dense

    def tocsr(self) -> scipy.sparse.csr_array:
        """The matrix as a ``scipy.sparse.csr_array``."""
        from scipy.sparse import csr_array

        row, column, value = self.coo()
        return csr_array((value, (row, column)), shape=self.shape)
