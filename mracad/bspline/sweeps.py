"""Compiled sweeps along one axis of large arrays: banded products and triangular solves.

Blocks of lines are gathered into a buffer that stays in the processor's cache, swept, and scattered.  Imported only for
large arrays, because the compiler costs half a second to import.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from mracad.bspline.knots import Array
from mracad.bspline.rows import Rows

_LINES = 48
_UNROLL = 4


def apply(start: Array, values: Array, c: Array, axis: int) -> Array:
    """The matrix with runs ``values`` from columns ``start`` times ``c`` along ``axis``."""
    c3 = _three(c, axis)
    out = np.empty((c3.shape[0], len(start), c3.shape[2]))
    head, taps = _padded(start, values)
    _apply(c3, head, taps, out)
    return out.reshape((*c.shape[:axis], len(start), *c.shape[axis + 1 :]))


def solve(lower: Rows, upper: Rows, inverse: Array, rows: Array, columns: Array, b: Array, axis: int) -> Array:
    """``x`` with ``L U x[columns] = b[rows]`` along ``axis``; the triangles come without their diagonals."""
    b3 = _three(b, axis)
    out = np.empty(b3.shape)
    low, below = _window(lower, before=True)
    high, above = _window(upper, before=False)
    _solve(b3, rows, columns, -low, below, -high, above, inverse, out)
    return out.reshape(b.shape)


def combine(matrix: Rows, columns: Array, rows: Array, coarse: Array, detail: Array, axis: int) -> Array:
    """``c[rows] = A x[columns]`` along ``axis``, with ``x`` the coarse values followed by the details."""
    first, second = _three(coarse, axis), _three(detail, axis)
    out = np.empty((first.shape[0], len(rows), first.shape[2]))
    head, taps = _padded(matrix.start, matrix.values)
    _combine(first, second, columns, rows, head, taps, out)
    return out.reshape((*coarse.shape[:axis], len(rows), *coarse.shape[axis + 1 :]))


def scatter(start: Array, values: Array, columns: int, c: Array, axis: int) -> Array:
    """The transpose of the matrix with runs ``values`` from columns ``start`` times ``c`` along ``axis``."""
    c3 = _three(c, axis)
    out = np.empty((c3.shape[0], columns, c3.shape[2]))
    head, taps = _padded(start, values)
    _scatter(c3, head, taps, out)
    return out.reshape((*c.shape[:axis], columns, *c.shape[axis + 1 :]))


def _three(c: Array, axis: int) -> Array:
    """The array as (before, along, after); ``axis`` is not negative."""
    before, along = int(np.prod(c.shape[:axis])), c.shape[axis]
    return c.reshape(before, along, -1)


def _padded(start: Array, values: Array) -> tuple[Array, Array]:
    """Runs as wide as a multiple of the unrolling."""
    return start, np.ascontiguousarray(np.pad(values, ((0, 0), (0, -values.shape[1] % _UNROLL))))


def _window(triangle: Rows, before: bool) -> tuple[Array, Array]:
    """Strict triangle as taps on the ``w`` rows just before (or after) each row, and where its taps begin (or end).

    The taps of row ``i`` multiply rows ``i − w … i − 1``, or ``i + 1 … i + w``.
    """
    row, column, value = triangle.coo()
    distance = row - column if before else column - row
    width = -(-max(int(distance.max(initial=1)), 1) // _UNROLL) * _UNROLL
    taps = np.zeros((len(triangle.start), width))
    taps[row, width - distance if before else distance - 1] = value
    reach = np.zeros(len(triangle.start), dtype=np.int64)
    np.maximum.at(reach, row, distance)
    reach = -(-reach // _UNROLL) * _UNROLL
    return taps, width - reach if before else reach


@njit(cache=True)
def _gather(c, a0, a1, b0, b1, order, pad, buffer):
    """Lines ``[a0:a1, :, b0:b1]`` into rows ``pad …`` of the buffer, in the given order."""
    width = b1 - b0
    for i in range(order.size):
        for a in range(a0, a1):
            at = (a - a0) * width
            for b in range(width):
                buffer[pad + i, at + b] = c[a, order[i], b0 + b]


@njit(cache=True)
def _spread(buffer, pad, a0, a1, b0, b1, order, out):
    """Rows ``pad …`` of the buffer to lines ``[a0:a1, order, b0:b1]``."""
    width = b1 - b0
    for i in range(order.size):
        for a in range(a0, a1):
            at = (a - a0) * width
            for b in range(width):
                out[a, order[i], b0 + b] = buffer[pad + i, at + b]


@njit(cache=True, fastmath={"contract", "nsz"})
def _axpy4(y, w, k, x, r):
    """``y += Σ w[k + s] x[r + s]`` over four rows."""
    w0, w1, w2, w3 = w[k], w[k + 1], w[k + 2], w[k + 3]
    x0, x1, x2, x3 = x[r], x[r + 1], x[r + 2], x[r + 3]
    for j in range(_LINES):
        y[j] += w0 * x0[j] + w1 * x1[j] + w2 * x2[j] + w3 * x3[j]


@njit(cache=True)
def _blocks(before, after):
    """Sizes of the blocks of lines."""
    width = min(after, _LINES)
    return max(_LINES // width, 1), width


@njit(cache=True)
def _apply(c, head, taps, out):
    before, along, after = c.shape
    rows, reach = taps.shape
    high, wide = _blocks(before, after)
    x = np.zeros((along + reach, _LINES))
    y = np.zeros((rows, _LINES))
    identity, targets = np.arange(along), np.arange(rows)
    for a0 in range(0, before, high):
        a1 = min(a0 + high, before)
        for b0 in range(0, after, wide):
            b1 = min(b0 + wide, after)
            _gather(c, a0, a1, b0, b1, identity, 0, x)
            for i in range(rows):
                y[i] = 0.0
                for k in range(0, reach, _UNROLL):
                    _axpy4(y[i], taps[i], k, x, head[i] + k)
            _spread(y, 0, a0, a1, b0, b1, targets, out)


@njit(cache=True)
def _scatter(c, head, taps, out):
    before, along, after = c.shape
    columns, reach = out.shape[1], taps.shape[1]
    high, wide = _blocks(before, after)
    x = np.zeros((along, _LINES))
    y = np.zeros((columns + reach, _LINES))
    identity, targets = np.arange(along), np.arange(columns)
    for a0 in range(0, before, high):
        a1 = min(a0 + high, before)
        for b0 in range(0, after, wide):
            b1 = min(b0 + wide, after)
            _gather(c, a0, a1, b0, b1, identity, 0, x)
            y[:] = 0.0
            for i in range(along):
                for k in range(reach):
                    tap = taps[i, k]
                    if tap != 0.0:
                        row = y[head[i] + k]
                        for j in range(_LINES):
                            row[j] += tap * x[i, j]
            _spread(y, 0, a0, a1, b0, b1, targets, out)


@njit(cache=True)
def _solve(b, rows, columns, low, below, high_taps, above, inverse, out):
    before, along, after = b.shape
    lead, tail = low.shape[1], high_taps.shape[1]
    high, wide = _blocks(before, after)
    x = np.zeros((lead + along + tail, _LINES))
    for a0 in range(0, before, high):
        a1 = min(a0 + high, before)
        for b0 in range(0, after, wide):
            b1 = min(b0 + wide, after)
            _gather(b, a0, a1, b0, b1, rows, lead, x)
            for i in range(along):
                for k in range(below[i], lead, _UNROLL):
                    _axpy4(x[lead + i], low[i], k, x, i + k)
            for i in range(along - 1, -1, -1):
                y = x[lead + i]
                for k in range(0, above[i], _UNROLL):
                    _axpy4(y, high_taps[i], k, x, lead + i + 1 + k)
                for j in range(_LINES):
                    y[j] *= inverse[i]
            _spread(x, lead, a0, a1, b0, b1, columns, out)


@njit(cache=True)
def _combine(coarse, detail, columns, rows, head, taps, out):
    before, along, after = out.shape
    reach = taps.shape[1]
    high, wide = _blocks(before, after)
    x = np.zeros((along + reach, _LINES))
    y = np.zeros((along, _LINES))
    m = coarse.shape[1]
    place = np.empty(along, np.int64)
    place[columns] = np.arange(along)
    for a0 in range(0, before, high):
        a1 = min(a0 + high, before)
        for b0 in range(0, after, wide):
            b1 = min(b0 + wide, after)
            width = b1 - b0
            for j in range(along):
                for a in range(a0, a1):
                    at = (a - a0) * width
                    for b in range(width):
                        x[place[j], at + b] = coarse[a, j, b0 + b] if j < m else detail[a, j - m, b0 + b]
            for i in range(along):
                y[i] = 0.0
                for k in range(0, reach, _UNROLL):
                    _axpy4(y[i], taps[i], k, x, head[i] + k)
            _spread(y, 0, a0, a1, b0, b1, rows, out)
