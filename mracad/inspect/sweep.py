"""Compiled code for :mod:`mracad.inspect.tally`: from control points to figures of places at once.

A hundred points at a time are taken through all steps in a scratch memory that fits the processor's cache.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mracad.compiled import Compiled
from mracad.inspect.curvature import dot, figures

SUMS, TOPS = 6, 3
"""Numbers per place that are added up, and of which the largest counts."""

_WIDE = 128
"""Points that the compiled code processes at once."""


# Rows of the compiled code's scratch memory, _WIDE numbers each.
_JETS, _WEIGHTS, _BASE, _OLD, _WEIGHT, _COUNTS, _ROUNDING, _PLACE = 0, 30, 40, 45, 48, 49, 50, 51
_FORMS, _TOLD, SCRATCH = 52, 65, 74 * _WIDE


def told(seen: Any, base: Any, old: Any, rows: Any) -> Any:
    """What a point with a weight, marks and the rows of its forms adds to the sums of its place, and its figures of
    which the largest counts."""
    weight, counts, rounding = seen
    nx, ny, nz, density, _, _, largest, share, a, b, c, hu, hv = rows
    area = weight * density
    counted = area * counts
    da, db, dc, du, dv = a - base[0], b - base[1], c - base[2], hu - base[3], hv - base[4]
    off = np.float32(nx) - old[0], np.float32(ny) - old[1], np.float32(nz) - old[2]
    return (
        area,
        counted,
        (a * a + 2.0 * (b * b) + c * c) * counted,
        (hu * hu + hv * hv) * counted,
        (da * da + 2.0 * (db * db) + dc * dc) * counted,
        (du * du + dv * dv) * counted,
        largest * counts,
        (largest - rounding) * counts,
        np.sqrt(dot(off, off)) * (share * counts),
    )


def _sweep_points(lines: Any, sites: Any, marks: Any, found: Any, w: Any) -> None:
    """The figures of points, run by run, ``_WIDE`` at a time: added up if they are marked, or all of them; or how they
    move, if there are no derivatives.

    Parameters
    ----------
    lines : tuple
        What :meth:`Sites.along` returns, and its shape.
    sites : tuple
        Shape and array of control points along v; their taps; weights; runs, and their number.
    marks : tuple
        Whether there are marks; the number of points; and the arrays of :class:`Marks`.
    found : tuple
        Number of places, their sums and tops; first figure that is stored, the one after the last, and all of them.
    w : pointer
        Scratch memory.
    """
    rows, order, columns, taps, weight_u, weight_v, runs, count = sites
    marked, strip_u, strip_v = marks[0], marks[6], marks[7]
    run = row = column = left = fill = at = 0
    while run < count or left > 0:
        if left == 0:
            row, column, left = runs[3 * run], runs[3 * run + 1], runs[3 * run + 2]
            run += 1
        n = min(left, _WIDE - fill)
        _spread(lines, (rows, order, columns, taps), (row, column, n, fill), w)
        if marked:
            for i in range(n):
                w[_WEIGHT * _WIDE + fill + i] = weight_u[column + i] * weight_v[row]
                w[_PLACE * _WIDE + fill + i] = strip_u[column + i] + strip_v[row]
        fill, column, left = fill + n, column + n, left - n
        if fill == _WIDE or (run == count and left == 0):
            if lines[2] > 3:
                _divide(lines[1], w)
            if lines[1] > 1:
                _figure(w)
                _tell(marks, found, at, fill, w)
            else:
                _move(marks, found, at, fill, w)
            at, fill = at + fill, 0


def _spread(lines: Any, sites: Any, part: Any, w: Any) -> None:
    """Derivatives at some of the points of a row."""
    along, orders, size, curves, wide = lines
    rows, order, columns, taps = sites
    row, column, n, fill = part
    for r in range(orders):
        for s in range(orders - r):
            place = (r + s) * (r + s + 1) // 2 + s
            for k in range(size):
                to = (_JETS + 3 * place + k if k < 3 else _WEIGHTS + place) * _WIDE + fill
                start = (r * size + k) * curves
                for j in range(0, order, 4):
                    at = row * order + j
                    of = s * rows * order + at
                    a = (start + columns[at]) * wide + column
                    b = (start + columns[at + 1]) * wide + column
                    c = (start + columns[at + 2]) * wide + column
                    d = (start + columns[at + 3]) * wide + column
                    _add_four(along, (a, b, c, d), (taps[of], taps[of + 1], taps[of + 2], taps[of + 3]), (to, n, j), w)


def _add_four(along: Any, lines: Any, taps: Any, part: Any, w: Any) -> None:
    """The next four products of taps and control points, in place of the last sums or added to them."""
    (a, b, c, d), (ta, tb, tc, td), (to, n, j) = lines, taps, part
    if j == 0:
        for i in range(n):
            w[to + i] = ta * along[a + i] + tb * along[b + i] + tc * along[c + i] + td * along[d + i]
    else:
        for i in range(n):
            total = w[to + i] + ta * along[a + i] + tb * along[b + i]
            w[to + i] = total + tc * along[c + i] + td * along[d + i]


def _divide(orders: Any, w: Any) -> None:
    """Derivatives of A / w from those of A and w, as in :mod:`mracad.bspline.jets`."""
    for total in range(orders):
        for b in range(total + 1):
            to = total * (total + 1) // 2 + b
            for i in range(total - b + 1):
                for j in range(b + 1):
                    if i + j > 0:
                        _take(total, b, i, j, w)
            x = (_JETS + 3 * to) * _WIDE
            for p in range(_WIDE):
                inverse = 1.0 / w[_WEIGHTS * _WIDE + p]
                w[x + p] *= inverse
                w[x + _WIDE + p] *= inverse
                w[x + 2 * _WIDE + p] *= inverse


def _take(total: Any, b: Any, i: Any, j: Any, w: Any) -> None:
    """Take the product of derivatives (i, j) of w and (a - i, b - j) of A / w from that of A, a + b in total."""
    factor = float((1 if i in (0, total - b) else total - b) * (1 if j in (0, b) else b))
    rest = total - i - j
    x, y = (_JETS + 3 * (total * (total + 1) // 2 + b)) * _WIDE, (_JETS + 3 * (rest * (rest + 1) // 2 + b - j)) * _WIDE
    by = (_WEIGHTS + (i + j) * (i + j + 1) // 2 + j) * _WIDE
    for p in range(_WIDE):
        share = factor * w[by + p]
        w[x + p] -= share * w[y + p]
        w[x + _WIDE + p] -= share * w[y + _WIDE + p]
        w[x + 2 * _WIDE + p] -= share * w[y + 2 * _WIDE + p]


def _figure(w: Any) -> None:
    """Figures from derivatives."""
    for p in range(_WIDE):
        (
            w[52 * _WIDE + p], w[53 * _WIDE + p], w[54 * _WIDE + p], w[55 * _WIDE + p], w[56 * _WIDE + p],
            w[57 * _WIDE + p], w[58 * _WIDE + p], w[59 * _WIDE + p], w[60 * _WIDE + p], w[61 * _WIDE + p],
            w[62 * _WIDE + p], w[63 * _WIDE + p], w[64 * _WIDE + p],
        ) = figures(
            (w[3 * _WIDE + p], w[4 * _WIDE + p], w[5 * _WIDE + p]),
            (w[6 * _WIDE + p], w[7 * _WIDE + p], w[8 * _WIDE + p]),
            (
                (w[9 * _WIDE + p], w[10 * _WIDE + p], w[11 * _WIDE + p]),
                (w[12 * _WIDE + p], w[13 * _WIDE + p], w[14 * _WIDE + p]),
                (w[15 * _WIDE + p], w[16 * _WIDE + p], w[17 * _WIDE + p]),
            ),
            (
                (w[18 * _WIDE + p], w[19 * _WIDE + p], w[20 * _WIDE + p]),
                (w[21 * _WIDE + p], w[22 * _WIDE + p], w[23 * _WIDE + p]),
                (w[24 * _WIDE + p], w[25 * _WIDE + p], w[26 * _WIDE + p]),
                (w[27 * _WIDE + p], w[28 * _WIDE + p], w[29 * _WIDE + p]),
            ),
        )  # fmt: skip


def _tell(marks: Any, found: Any, at: Any, fill: Any, w: Any) -> None:
    """Add up, or store, the figures of the points from ``at`` on."""
    points, (places, sums, tops, first, last, every) = marks[1], found
    if marks[0]:
        _mark(marks, at, fill, w)
        for p in range(fill):
            place = int(w[_PLACE * _WIDE + p])
            for r in range(SUMS):
                sums[r * places + place] += w[(_TOLD + r) * _WIDE + p]
            for r in range(TOPS):
                tops[r * places + place] = max(tops[r * places + place], w[(_TOLD + SUMS + r) * _WIDE + p])
    else:
        for r in range(first, last):
            for i in range(fill):
                every[(r - first) * points + at + i] = w[(_FORMS + r) * _WIDE + i]


def _mark(marks: Any, at: Any, fill: Any, w: Any) -> None:
    """What is told by figures, and by the marks of points from ``at`` on."""
    points, counts, rounding, base, normals = marks[1], marks[2], marks[3], marks[4], marks[5]
    for i in range(fill):
        w[_COUNTS * _WIDE + i] = counts[at + i]
        w[_ROUNDING * _WIDE + i] = rounding[at + i]
    for r in range(5):
        for i in range(fill):
            w[(_BASE + r) * _WIDE + i] = base[r * points + at + i]
    for r in range(3):
        for i in range(fill):
            w[(_OLD + r) * _WIDE + i] = normals[r * points + at + i]
    for p in range(_WIDE):
        (
            w[65 * _WIDE + p], w[66 * _WIDE + p], w[67 * _WIDE + p], w[68 * _WIDE + p], w[69 * _WIDE + p],
            w[70 * _WIDE + p], w[71 * _WIDE + p], w[72 * _WIDE + p], w[73 * _WIDE + p],
        ) = told(
            (w[48 * _WIDE + p], w[49 * _WIDE + p], w[50 * _WIDE + p]),
            (w[40 * _WIDE + p], w[41 * _WIDE + p], w[42 * _WIDE + p], w[43 * _WIDE + p], w[44 * _WIDE + p]),
            (np.float32(w[45 * _WIDE + p]), np.float32(w[46 * _WIDE + p]), np.float32(w[47 * _WIDE + p])),
            (
                w[52 * _WIDE + p], w[53 * _WIDE + p], w[54 * _WIDE + p], w[55 * _WIDE + p], w[56 * _WIDE + p],
                w[57 * _WIDE + p], w[58 * _WIDE + p], w[59 * _WIDE + p], w[60 * _WIDE + p], w[61 * _WIDE + p],
                w[62 * _WIDE + p], w[63 * _WIDE + p], w[64 * _WIDE + p],
            ),
        )  # fmt: skip


def _move(marks: Any, found: Any, at: Any, fill: Any, w: Any) -> None:
    """The largest part of vectors, instead of points, along normals, and the square of the largest vector."""
    points, normals, tops = marks[1], marks[5], found[2]
    for p in range(fill):
        x, y, z = w[p], w[_WIDE + p], w[2 * _WIDE + p]
        at_x, at_y, at_z = at + p, points + at + p, 2 * points + at + p
        tops[0] = max(tops[0], abs(x * normals[at_x] + y * normals[at_y] + z * normals[at_z]))
        tops[1] = max(tops[1], x * x + y * y + z * z)


_REAL, _WHOLE = "float64*", "int64"
SWEEP = Compiled(
    _sweep_points,
    (
        (_REAL, _WHOLE, _WHOLE, _WHOLE, _WHOLE),
        (_WHOLE, _WHOLE, "int32*", _REAL, _REAL, _REAL, "int64*", _WHOLE),
        (_WHOLE, _WHOLE, "uint8*", "float32*", _REAL, "float32*", "int64*", "int64*"),
        (_WHOLE, _REAL, _REAL, _WHOLE, _WHOLE, _REAL),
        (_REAL,),
    ),
    (_spread, _add_four, _divide, _take, _figure, _tell, _mark, _move),
    (dot, figures, told),
)
