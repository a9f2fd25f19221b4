"""Compiled sweeps along one axis of large arrays: banded products and triangular solves.

Blocks of lines are gathered into a buffer, one row for each place along the axis, swept, and scattered.  Lines that lie
side by side in memory are taken by the hundred, which memory likes best; others have to be transposed, and a buffer of
few of them stays in the processor's cache.  Imported only for large arrays, because the compiler costs half a second to
import.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit, types
from numba.core import event

from mracad.bspline.knots import Array
from mracad.bspline.rows import Rows
from mracad.note import COMPILING, doing


class _Compiling(event.Listener):  # type: ignore[misc]
    """Notes that the compiler works, which it does only where its cache on disk has nothing."""

    def on_start(self, event: event.Event) -> None:
        doing(COMPILING)

    def on_end(self, event: event.Event) -> None:
        pass


event.register("numba:compile", _Compiling())

_WIDE, _NARROW = 256, 48
_UNROLL = 6
# One signature per kernel, so that each is compiled once and cached on disk.  Lines come as flat memory and its layout:
# sizes (before, along, after) and the steps of the first two; a band as its taps, and where those of each row end.
_REAL = types.Array(types.float64, 1, "C", readonly=True)
_INDEX = types.Array(types.int64, 1, "C", readonly=True)
_TAPS = types.Array(types.float64, 2, "C", readonly=True)
_BAND = types.Tuple((_TAPS, _INDEX))
_LAYOUT = types.UniTuple(types.int64, 5)
_IN = types.Tuple((_REAL, _LAYOUT))
_OUT = types.Tuple((types.float64[::1], _LAYOUT))
_TERM = types.Tuple((_IN, _INDEX, _INDEX, _BAND))

_Lines = tuple[Array, tuple[int, ...]]


_Term = tuple[_Lines, Array, Array, tuple[Array, Array]]


def apply(matrix: Rows, c: Array, axis: int) -> Array:
    """The matrix times ``c`` along ``axis``."""
    out = np.empty((*c.shape[:axis], len(matrix.start), *c.shape[axis + 1 :]))
    nothing = Rows(np.zeros_like(matrix.start), np.zeros((len(matrix.start), 1)), 0)
    parts = (matrix, c), (nothing, c[(slice(None),) * axis + (slice(0),)])
    orders = np.arange(matrix.columns), np.arange(0), np.arange(len(matrix.start))
    add(parts, orders, axis, out)
    return out


def scatter(matrix: Rows, c: Array, axis: int) -> Array:
    """The transposed matrix times ``c`` along ``axis``."""
    out = np.empty((*c.shape[:axis], matrix.columns, *c.shape[axis + 1 :]))
    _scatter(_lines(c, axis), matrix.start, matrix.values, _lines(out, axis))
    return out


def add(
    parts: tuple[tuple[Rows, Array], tuple[Rows, Array]], orders: tuple[Array, Array, Array], axis: int, out: Array
) -> None:
    """``out[rows] = A x[a] + B y[b]`` along ``axis``, for the parts (A, x) and (B, y) and the orders a, b and rows.

    ``out`` may be the array of which ``x`` and ``y`` are parts.
    """
    terms = [_term(*part, order, axis) for part, order in zip(parts, orders, strict=False)]
    _product(terms[0], terms[1], orders[2], _target(out, axis))


@dataclass(frozen=True, eq=False)
class Triangles:
    """A matrix as ``A[rows][:, columns] = L U``.

    Attributes
    ----------
    order : pair of ndarray (n,) of int
        Rows and columns.
    lower, upper : pair of ndarray (n, w) and ndarray (n,)
        Strict D⁻¹ L D and D⁻¹ U, D the diagonal of U, negated, as taps on the ``w`` rows just before (or after) each
        row, and where they begin (or end).
    inverse : ndarray (n,)
        1 / D.
    """

    order: tuple[Array, Array]
    lower: tuple[Array, Array]
    upper: tuple[Array, Array]
    inverse: Array

    @classmethod
    def of(cls, order: tuple[Array, Array], lower: Rows, upper: Rows, inverse: Array) -> Triangles:
        """From strict triangles."""
        return cls(order, _window(lower, inverse, 1.0 / inverse), _window(upper, inverse), inverse)

    def solve(self, b: Array, axis: int, out: Array) -> None:
        """``A out = b`` along ``axis``; ``out`` may be ``b``."""
        _solve(_lines(b, axis), self.order, self.lower, self.upper, self.inverse, _target(out, axis))


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


def _term(matrix: Rows, c: Array, order: Array, axis: int) -> _Term:
    """Lines, where each of their places goes, and the matrix on places in that order: where each run begins, its taps,
    padded to a multiple of the unrolling, and how many of them are used."""
    taps = np.pad(matrix.values, ((0, 0), (0, -matrix.values.shape[1] % _UNROLL)))
    used = np.where(taps.any(axis=1), taps.shape[1] - np.argmax(taps[:, ::-1] != 0, axis=1), 0)
    return _lines(c, axis), np.argsort(order), matrix.start, (taps, used)


def _window(triangle: Rows, left: Array, right: Array | None = None) -> tuple[Array, Array]:
    """The lower triangle times diagonal matrices from both sides, or the upper one from the left; see
    :class:`Triangles`."""
    row, column, value = triangle.coo()
    before = right is not None
    value = value * left[row] * (1.0 if right is None else right[column])
    distance = row - column if before else column - row
    width = -(-max(int(distance.max(initial=1)), 1) // _UNROLL) * _UNROLL
    taps = np.zeros((len(triangle.start), width))
    taps[row, width - distance if before else distance - 1] = -value
    reach = np.zeros(len(triangle.start), dtype=np.int64)
    np.maximum.at(reach, row, distance)
    reach = -(-reach // _UNROLL) * _UNROLL
    return taps, width - reach if before else reach


@njit(cache=True)
def _shape(layout: Any) -> Any:
    """Numbers of lines before and after the axis in a block, and in all."""
    wide = min(layout[2], _WIDE)
    high = 1 if layout[2] >= _NARROW else min(layout[0], _NARROW // wide)
    return high, wide, high * wide


@njit(cache=True)
def _buffer(rows: Any, n: Any) -> Any:
    """Rows of zeros, which begin with a line of the processor's cache if ``n`` is a multiple of 8."""
    flat = np.zeros(rows * n + 7)
    begin = (-(flat.ctypes.data // 8)) % 8
    return flat[begin : begin + rows * n]


@njit(cache=True)
def _read(lines: Any, block: Any, i: Any, factor: Any, row: Any) -> None:
    """Place ``i`` of the lines ``[a0:a0 + high, :, b0:b0 + wide]``, times a factor, into a row."""
    (flat, layout), (a0, high, b0, wide) = lines, block
    at, step = a0 * layout[3] + i * layout[4] + b0, layout[3]
    if high == 1:
        source = flat[at : at + wide]
        for j in range(wide):
            row[j] = factor * source[j]
    elif wide == 3 and high == _NARROW // 3:  # a number that the compiler knows
        for a in range(_NARROW // 3):
            row[3 * a], row[3 * a + 1], row[3 * a + 2] = factor * flat[at], factor * flat[at + 1], factor * flat[at + 2]
            at += step
    else:
        for a in range(high):
            for b in range(wide):
                row[wide * a + b] = factor * flat[at + b]
            at += step


@njit(cache=True)
def _write(row: Any, lines: Any, block: Any, i: Any) -> None:
    """A row to place ``i`` of the lines ``[a0:a0 + high, :, b0:b0 + wide]``."""
    (flat, layout), (a0, high, b0, wide) = lines, block
    at, step = a0 * layout[3] + i * layout[4] + b0, layout[3]
    if high == 1:
        target = flat[at : at + wide]
        for j in range(wide):
            target[j] = row[j]
    elif wide == 3 and high == _NARROW // 3:  # a number that the compiler knows
        for a in range(_NARROW // 3):
            flat[at], flat[at + 1], flat[at + 2] = row[3 * a], row[3 * a + 1], row[3 * a + 2]
            at += step
    else:
        for a in range(high):
            for b in range(wide):
                flat[at + b] = row[wide * a + b]
            at += step


@njit(cache=True, fastmath={"contract", "nsz"})
def _add3(y: Any, w: Any, k: Any, x: Any, at: Any) -> None:
    """``y += Σ w[k + s] x[at + s]`` over three rows of a buffer as long as ``y``."""
    n = y.size
    x0, x1, x2 = x[at : at + n], x[at + n : at + 2 * n], x[at + 2 * n : at + 3 * n]
    w0, w1, w2 = w[k], w[k + 1], w[k + 2]
    for j in range(n):
        y[j] += w0 * x0[j] + w1 * x1[j] + w2 * x2[j]


@njit(cache=True, fastmath={"contract", "nsz"})
def _add6(y: Any, w: Any, k: Any, x: Any, at: Any) -> None:
    """The same over six rows."""
    n = y.size
    x0, x1, x2 = x[at : at + n], x[at + n : at + 2 * n], x[at + 2 * n : at + 3 * n]
    x3, x4, x5 = x[at + 3 * n : at + 4 * n], x[at + 4 * n : at + 5 * n], x[at + 5 * n : at + 6 * n]
    w0, w1, w2, w3, w4, w5 = w[k], w[k + 1], w[k + 2], w[k + 3], w[k + 4], w[k + 5]
    for j in range(n):
        y[j] += (w0 * x0[j] + w1 * x1[j] + w2 * x2[j]) + (w3 * x3[j] + w4 * x4[j] + w5 * x5[j])


@njit(types.void(_IN, _INDEX, _TAPS, _OUT), cache=True, fastmath={"contract", "nsz"})
def _scatter(c: Any, head: Any, taps: Any, out: Any) -> None:
    before, along, after = c[1][:3]
    columns, reach = out[1][1], taps.shape[1]
    high, wide, n = _shape(c[1])
    row, y = _buffer(1, n), _buffer(columns + reach, n)
    for a0 in range(0, before, high):
        for b0 in range(0, after, wide):
            block = a0, min(high, before - a0), b0, min(wide, after - b0)
            y[:] = 0.0
            for i in range(along):
                _read(c, block, i, 1.0, row)
                for k in range(reach):
                    tap = taps[i, k]
                    if tap != 0.0:
                        each = y[(head[i] + k) * n : (head[i] + k + 1) * n]
                        for j in range(n):
                            each[j] += tap * row[j]
            for i in range(columns):
                _write(y[i * n : (i + 1) * n], out, block, i)


@njit(types.void(_IN, types.UniTuple(_INDEX, 2), _BAND, _BAND, _REAL, _OUT), cache=True)
def _solve(b: Any, order: Any, lower: Any, upper: Any, inverse: Any, out: Any) -> None:
    before, along, after = b[1][:3]
    (source, target), (low, below), (up, above) = order, lower, upper
    lead = low.shape[1]
    high, wide, n = _shape(b[1])
    x = _buffer(lead + along + up.shape[1], n)
    for a0 in range(0, before, high):
        for b0 in range(0, after, wide):
            block = a0, min(high, before - a0), b0, min(wide, after - b0)
            for i in range(along):
                y = x[(lead + i) * n : (lead + i + 1) * n]
                _read(b, block, source[i], inverse[i], y)
                for k in range(below[i], lead, _UNROLL):
                    _add6(y, low[i], k, x, (i + k) * n)
            for i in range(along - 1, -1, -1):
                y = x[(lead + i) * n : (lead + i + 1) * n]
                for k in range(0, above[i], _UNROLL):
                    _add6(y, up[i], k, x, (lead + i + 1 + k) * n)
                _write(y, out, block, target[i])


@njit(cache=True)
def _fill(x: Any, n: Any, term: Any, block: Any) -> None:
    """All lines of a block into the rows of a buffer."""
    lines, place = term[0], term[1]
    for i in range(place.size):
        _read(lines, block, i, 1.0, x[place[i] * n : (place[i] + 1) * n])


@njit(types.void(_TERM, _TERM, _INDEX, _OUT), cache=True)
def _product(first: Any, second: Any, target: Any, out: Any) -> None:
    before, _, after = out[1][:3]
    high, wide, n = _shape(out[1])
    x, y = _buffer(first[1].size + _UNROLL, n), _buffer(second[1].size + _UNROLL, n)
    row = _buffer(1, n)
    for a0 in range(0, before, high):
        for b0 in range(0, after, wide):
            block = a0, min(high, before - a0), b0, min(wide, after - b0)
            _fill(x, n, first, block)
            _fill(y, n, second, block)
            for i in range(target.size):
                row[:] = 0.0
                for k in range(0, first[3][1][i], 3):
                    _add3(row, first[3][0][i], k, x, (first[2][i] + k) * n)
                for k in range(0, second[3][1][i], _UNROLL):
                    _add6(row, second[3][0][i], k, y, (second[2][i] + k) * n)
                _write(row, out, block, target[i])
