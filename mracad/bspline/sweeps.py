"""Compiled sweeps along one axis of large arrays: banded products and triangular solves.

Blocks of lines are gathered into a buffer that stays in the processor's cache, swept, and scattered.  Imported only for
large arrays, because the compiler costs half a second to import.
"""

from __future__ import annotations

import numpy as np
from numba import njit, types

from mracad.bspline.knots import Array
from mracad.bspline.rows import Rows

_LINES = 48
_UNROLL = 4
# One signature a kernel, for arrays of any layout: each is compiled once, and kept on disk.
_LINES_IN = types.Array(types.float64, 3, "A", readonly=True)
_LINES_OUT = types.float64[:, :, :]
_TAPS = types.Array(types.float64, 2, "C", readonly=True)
_REAL = types.Array(types.float64, 1, "C", readonly=True)
_INDEX = types.Array(types.int64, 1, "C", readonly=True)


def apply(start: Array, values: Array, c: Array, axis: int) -> Array:
    """The matrix with runs ``values`` from columns ``start`` times ``c`` along ``axis``."""
    c3 = _three(c, axis)
    out = np.empty((c3.shape[0], len(start), c3.shape[2]))
    _product(c3, c3[:, :0], np.arange(c3.shape[1]), start, *_padded(values), np.arange(len(start)), out)
    return out.reshape((*c.shape[:axis], len(start), *c.shape[axis + 1 :]))


def combine(matrix: Rows, columns: Array, rows: Array, coarse: Array, detail: Array, axis: int, out: Array) -> None:
    """``out[rows] = A x[columns]`` along ``axis``, with ``x`` the coarse values followed by the details.

    ``out`` may be the array of which ``coarse`` and ``detail`` are the two parts.
    """
    first, second, place = _three(coarse, axis), _three(detail, axis), np.argsort(columns)
    _product(first, second, place, matrix.start, *_padded(matrix.values), np.argsort(rows), _three(out, axis))


def solve(
    lower: Rows, upper: Rows, inverse: Array, rows: Array, columns: Array, b: Array, axis: int, out: Array
) -> None:
    """``L U out[columns] = b[rows]`` along ``axis``; the triangles come without their diagonals.

    ``out`` may be ``b``.
    """
    low, below = _window(lower, before=True)
    high, above = _window(upper, before=False)
    place, target = np.argsort(rows), np.argsort(columns)
    _solve(_three(b, axis), place, target, -low, below, -high, above, inverse, _three(out, axis))


def scatter(start: Array, values: Array, columns: int, c: Array, axis: int) -> Array:
    """The transpose of the matrix with runs ``values`` from columns ``start`` times ``c`` along ``axis``."""
    c3 = _three(c, axis)
    out = np.empty((c3.shape[0], columns, c3.shape[2]))
    _scatter(c3, start, values, out)
    return out.reshape((*c.shape[:axis], columns, *c.shape[axis + 1 :]))


def _three(c: Array, axis: int) -> Array:
    """A view as (before, along, after); ``axis`` is not negative.

    The axes of ``before``, and those of ``after``, must lie in memory as one, as in any part along one axis.
    """
    before, along = int(np.prod(c.shape[:axis])), c.shape[axis]
    return c.reshape(before, along, -1)


def _padded(values: Array) -> tuple[Array, Array]:
    """Runs as wide as a multiple of the unrolling, and how far each has to be followed."""
    taps = np.pad(values, ((0, 0), (0, -values.shape[1] % _UNROLL)))
    length = taps.shape[1] - np.argmax(taps[:, ::-1] != 0, axis=1)
    return taps, -(-length // _UNROLL) * _UNROLL


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
def _gather(c, a0, a1, b0, b1, place, buffer):
    """Lines ``[a0:a1, :, b0:b1]`` into the rows ``place`` of the buffer."""
    width = b1 - b0
    for i in range(place.size):
        for a in range(a0, a1):
            at = (a - a0) * width
            for b in range(width):
                buffer[place[i], at + b] = c[a, i, b0 + b]


@njit(cache=True)
def _spread(buffer, place, a0, a1, b0, b1, out):
    """Rows ``place`` of the buffer to lines ``[a0:a1, :, b0:b1]``."""
    width = b1 - b0
    for i in range(place.size):
        for a in range(a0, a1):
            at = (a - a0) * width
            for b in range(width):
                out[a, i, b0 + b] = buffer[place[i], at + b]


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


@njit(types.void(_LINES_IN, _INDEX, _TAPS, _LINES_OUT), cache=True)
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
            _gather(c, a0, a1, b0, b1, identity, x)
            y[:] = 0.0
            for i in range(along):
                for k in range(reach):
                    tap = taps[i, k]
                    if tap != 0.0:
                        row = y[head[i] + k]
                        for j in range(_LINES):
                            row[j] += tap * x[i, j]
            _spread(y, targets, a0, a1, b0, b1, out)


@njit(types.void(_LINES_IN, _INDEX, _INDEX, _TAPS, _INDEX, _TAPS, _INDEX, _REAL, _LINES_OUT), cache=True)
def _solve(b, place, target, low, below, high_taps, above, inverse, out):
    before, along, after = b.shape
    lead, tail = low.shape[1], high_taps.shape[1]
    high, wide = _blocks(before, after)
    x = np.zeros((lead + along + tail, _LINES))
    for a0 in range(0, before, high):
        a1 = min(a0 + high, before)
        for b0 in range(0, after, wide):
            b1 = min(b0 + wide, after)
            _gather(b, a0, a1, b0, b1, place + lead, x)
            for i in range(along):
                for k in range(below[i], lead, _UNROLL):
                    _axpy4(x[lead + i], low[i], k, x, i + k)
            for i in range(along - 1, -1, -1):
                y = x[lead + i]
                for k in range(0, above[i], _UNROLL):
                    _axpy4(y, high_taps[i], k, x, lead + i + 1 + k)
                for j in range(_LINES):
                    y[j] *= inverse[i]
            _spread(x, target + lead, a0, a1, b0, b1, out)


@njit(types.void(_LINES_IN, _LINES_IN, _INDEX, _INDEX, _TAPS, _INDEX, _INDEX, _LINES_OUT), cache=True)
def _product(first, second, place, head, taps, reach, target, out):
    before, _, after = out.shape
    m, rows = first.shape[1], head.size
    high, wide = _blocks(before, after)
    x = np.zeros((place.size + taps.shape[1], _LINES))
    y = np.zeros((rows, _LINES))
    for a0 in range(0, before, high):
        a1 = min(a0 + high, before)
        for b0 in range(0, after, wide):
            b1 = min(b0 + wide, after)
            _gather(first, a0, a1, b0, b1, place[:m], x)
            _gather(second, a0, a1, b0, b1, place[m:], x)
            for i in range(rows):
                y[i] = 0.0
                for k in range(0, reach[i], _UNROLL):
                    _axpy4(y[i], taps[i], k, x, head[i] + k)
            _spread(y, target, a0, a1, b0, b1, out)
