"""Compiled sweeps along one axis of large arrays: banded products and triangular solves.

Blocks of lines are gathered into a buffer that stays in the processor's cache, swept, and scattered.  Imported only for
large arrays, because the compiler costs half a second to import.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, types

from mracad.bspline.knots import Array
from mracad.bspline.rows import Rows

_LINES = 48
_UNROLL = 4
# One signature per kernel, so that each is compiled once and cached on disk.  Lines come as flat memory and its layout:
# sizes (before, along, after) and the steps of the first two; a band as its taps, and where each row of them begins or
# ends.
_REAL = types.Array(types.float64, 1, "C", readonly=True)
_INDEX = types.Array(types.int64, 1, "C", readonly=True)
_TAPS = types.Array(types.float64, 2, "C", readonly=True)
_BAND = types.Tuple((_TAPS, _INDEX))
_LAYOUT = types.UniTuple(types.int64, 5)
_IN = types.Tuple((_REAL, _LAYOUT))
_OUT = types.Tuple((types.float64[::1], _LAYOUT))

_Lines = tuple[Array, tuple[int, ...]]


def apply(start: Array, values: Array, c: Array, axis: int) -> Array:
    """The matrix with runs ``values`` from columns ``start`` times ``c`` along ``axis``."""
    out = np.empty((*c.shape[:axis], len(start), *c.shape[axis + 1 :]))
    place, target = np.arange(c.shape[axis]), np.arange(len(start))
    nothing = _lines(c[(slice(None),) * axis + (slice(0),)], axis)
    _product(_lines(c, axis), nothing, place, start, _padded(values), target, _lines(out, axis))
    return out


def scatter(start: Array, values: Array, columns: int, c: Array, axis: int) -> Array:
    """The transpose of the matrix with runs ``values`` from columns ``start`` times ``c`` along ``axis``."""
    out = np.empty((*c.shape[:axis], columns, *c.shape[axis + 1 :]))
    _scatter(_lines(c, axis), start, values, _lines(out, axis))
    return out


def combine(matrix: Rows, columns: Array, rows: Array, coarse: Array, detail: Array, axis: int, out: Array) -> None:
    """``out[rows] = A x[columns]`` along ``axis``, with ``x`` the coarse values followed by the details.

    ``out`` may be the array whose two parts are ``coarse`` and ``detail``.
    """
    first, second, place = _lines(coarse, axis), _lines(detail, axis), np.argsort(columns)
    _product(first, second, place, matrix.start, _padded(matrix.values), np.argsort(rows), _target(out, axis))


def solve(triangles: tuple[Rows, Rows, Array, Array], columns: Array, b: Array, axis: int, out: Array) -> None:
    """``L U out[columns] = b[rows]`` along ``axis``; ``out`` may be ``b``.

    The triangles come as strict L and U, one over the diagonal of U, and ``rows``.
    """
    lower, upper, inverse, rows = triangles
    order = np.argsort(rows), np.argsort(columns)
    bands = _window(lower, before=True), _window(upper, before=False)
    _solve(_lines(b, axis), order, *bands, inverse, _target(out, axis))


def _lines(c: Array, axis: int) -> _Lines:
    """Memory of the array from its first value on, and its layout; ``axis`` is not negative.

    The axes before ``axis`` must be contiguous in memory, and those after it dense, as in any slice of an array along
    one axis; other arrays are copied.
    """
    lines = c.reshape(int(np.prod(c.shape[:axis])), c.shape[axis], int(np.prod(c.shape[axis + 1 :])))
    steps = [step // c.itemsize for step in lines.strides]
    if lines.size and (steps[2] != 1 or min(steps) < 0):
        lines = np.ascontiguousarray(lines)
        steps = [step // c.itemsize for step in lines.strides]
    extent = sum((n - 1) * step for n, step in zip(lines.shape, steps, strict=True)) + 1 if lines.size else 0
    return np.lib.stride_tricks.as_strided(lines, (extent,), (c.itemsize,)), (*lines.shape, steps[0], steps[1])


def _target(out: Array, axis: int) -> _Lines:
    """Memory and layout of an array to be written to, which must not be copied."""
    flat, layout = _lines(out, axis)
    if not np.may_share_memory(flat, out):
        raise ValueError("results cannot be written to an array of this layout")
    return flat, layout


def _padded(values: Array) -> tuple[Array, Array]:
    """Runs padded to a multiple of the unrolling, and the used length of each."""
    taps = np.pad(values, ((0, 0), (0, -values.shape[1] % _UNROLL)))
    length = taps.shape[1] - np.argmax(taps[:, ::-1] != 0, axis=1)
    return taps, -(-length // _UNROLL) * _UNROLL


def _window(triangle: Rows, before: bool) -> tuple[Array, Array]:
    """A strict triangle, negated, as taps on the ``w`` rows just before (or after) each row, and where they begin (or
    end).

    The taps of row ``i`` multiply rows ``i − w … i − 1``, or ``i + 1 … i + w``.
    """
    row, column, value = triangle.coo()
    distance = row - column if before else column - row
    width = -(-max(int(distance.max(initial=1)), 1) // _UNROLL) * _UNROLL
    taps = np.zeros((len(triangle.start), width))
    taps[row, width - distance if before else distance - 1] = -value
    reach = np.zeros(len(triangle.start), dtype=np.int64)
    np.maximum.at(reach, row, distance)
    reach = -(-reach // _UNROLL) * _UNROLL
    return taps, width - reach if before else reach


@njit(cache=True)
def _gather(lines: Any, block: Any, place: Any, buffer: Any) -> None:
    """Lines ``[a0:a1, :, b0:b1]`` into the rows ``place`` of the buffer."""
    (flat, layout), (a0, a1, b0, b1) = lines, block
    width = b1 - b0
    for i in range(place.size):
        row = buffer[place[i]]
        for a in range(a0, a1):
            source, at = a * layout[3] + i * layout[4] + b0, (a - a0) * width
            for b in range(width):
                row[at + b] = flat[source + b]


@njit(cache=True)
def _spread(buffer: Any, place: Any, block: Any, lines: Any) -> None:
    """Rows ``place`` of the buffer to lines ``[a0:a1, :, b0:b1]``."""
    (flat, layout), (a0, a1, b0, b1) = lines, block
    width = b1 - b0
    for i in range(place.size):
        row = buffer[place[i]]
        for a in range(a0, a1):
            target, at = a * layout[3] + i * layout[4] + b0, (a - a0) * width
            for b in range(width):
                flat[target + b] = row[at + b]


@njit(cache=True, fastmath={"contract", "nsz"})
def _axpy4(y: Any, w: Any, k: Any, x: Any, r: Any) -> None:
    """``y += Σ w[k + s] x[r + s]`` over four rows."""
    w0, w1, w2, w3 = w[k], w[k + 1], w[k + 2], w[k + 3]
    x0, x1, x2, x3 = x[r], x[r + 1], x[r + 2], x[r + 3]
    for j in range(_LINES):
        y[j] += w0 * x0[j] + w1 * x1[j] + w2 * x2[j] + w3 * x3[j]


@njit(cache=True)
def _blocks(layout: Any) -> Any:
    """Sizes of the blocks of lines."""
    width = min(layout[2], _LINES)
    return max(_LINES // width, 1), width


@njit(types.void(_IN, _INDEX, _TAPS, _OUT), cache=True)
def _scatter(c: Any, head: Any, taps: Any, out: Any) -> None:
    before, along, after = c[1][:3]
    columns, reach = out[1][1], taps.shape[1]
    high, wide = _blocks(c[1])
    x = np.zeros((along, _LINES))
    y = np.zeros((columns + reach, _LINES))
    identity, targets = np.arange(along), np.arange(columns)
    for a0 in range(0, before, high):
        a1 = min(a0 + high, before)
        for b0 in range(0, after, wide):
            b1 = min(b0 + wide, after)
            block = a0, a1, b0, b1
            _gather(c, block, identity, x)
            y[:] = 0.0
            for i in range(along):
                for k in range(reach):
                    tap = taps[i, k]
                    if tap != 0.0:
                        row = y[head[i] + k]
                        for j in range(_LINES):
                            row[j] += tap * x[i, j]
            _spread(y, targets, block, out)


@njit(types.void(_IN, types.UniTuple(_INDEX, 2), _BAND, _BAND, _REAL, _OUT), cache=True)
def _solve(b: Any, order: Any, lower: Any, upper: Any, inverse: Any, out: Any) -> None:
    before, along, after = b[1][:3]
    (place, target), (low, below), (high_taps, above) = order, lower, upper
    lead, tail = low.shape[1], high_taps.shape[1]
    high, wide = _blocks(b[1])
    x = np.zeros((lead + along + tail, _LINES))
    for a0 in range(0, before, high):
        a1 = min(a0 + high, before)
        for b0 in range(0, after, wide):
            b1 = min(b0 + wide, after)
            block = a0, a1, b0, b1
            _gather(b, block, place + lead, x)
            for i in range(along):
                for k in range(below[i], lead, _UNROLL):
                    _axpy4(x[lead + i], low[i], k, x, i + k)
            for i in range(along - 1, -1, -1):
                y = x[lead + i]
                for k in range(0, above[i], _UNROLL):
                    _axpy4(y, high_taps[i], k, x, lead + i + 1 + k)
                for j in range(_LINES):
                    y[j] *= inverse[i]
            _spread(x, target + lead, block, out)


@njit(types.void(_IN, _IN, _INDEX, _INDEX, _BAND, _INDEX, _OUT), cache=True)
def _product(first: Any, second: Any, place: Any, head: Any, band: Any, target: Any, out: Any) -> None:
    (before, _, after), (taps, reach) = out[1][:3], band
    m, rows = first[1][1], head.size
    high, wide = _blocks(out[1])
    x = np.zeros((place.size + taps.shape[1], _LINES))
    y = np.zeros((rows, _LINES))
    for a0 in range(0, before, high):
        a1 = min(a0 + high, before)
        for b0 in range(0, after, wide):
            b1 = min(b0 + wide, after)
            block = a0, a1, b0, b1
            _gather(first, block, place[:m], x)
            _gather(second, block, place[m:], x)
            for i in range(rows):
                y[i] = 0.0
                for k in range(0, reach[i], _UNROLL):
                    _axpy4(y[i], taps[i], k, x, head[i] + k)
            _spread(y, target, block, out)
