"""Compiled code for :mod:`mracad.inspect.tally`: from control points to figures of places at once.

A hundred points at a time are taken through all steps in a scratch memory that fits the processor's cache.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mracad.compiled import Compiled
from mracad.inspect.curvature import dot, figures

SUMS, TOPS = 7, 3
"""Numbers per place that are added up, and of which the largest counts."""

NOISY = 2 * np.sin(np.radians(0.5))
"""If normals turn by more than a degree in the median, noise is being removed; as a chord."""

FEW, MANY = 10_000, 4_000_000
"""Numbers of points above which it pays to load the compiled code, and to compile it."""

_WIDE = 128
"""Points that the compiled code processes at once."""


# Rows of the compiled code's scratch memory, _WIDE numbers each.  Derivatives of equal order along u lie side by side.
_JETS, _WEIGHTS, _BASE, _OLD, _WEIGHT, _COUNTS, _ROUNDING, _PLACE = 0, 30, 60, 65, 68, 69, 70, 71
_FORMS, _TOLD, SCRATCH = 72, 85, 95 * _WIDE


def told(seen: Any, base: Any, old: Any, rows: Any) -> Any:
    """What a point with a weight, marks and the rows of its forms adds to the sums of its place, and its figures of
    which the largest counts."""
    weight, counts, rounding = seen
    nx, ny, nz, density, _, _, largest, share, a, b, c, hu, hv = rows
    area = weight * density
    counted = area * counts
    da, db, dc, du, dv = a - base[0], b - base[1], c - base[2], hu - base[3], hv - base[4]
    off = np.float32(nx) - old[0], np.float32(ny) - old[1], np.float32(nz) - old[2]
    chord, looked = np.sqrt(dot(off, off)), share * counts
    return (
        area,
        counted,
        (a * a + 2.0 * (b * b) + c * c) * counted,
        (hu * hu + hv * hv) * counted,
        (da * da + 2.0 * (db * db) + dc * dc) * counted,
        (du * du + dv * dv) * counted,
        looked * (2.0 * (chord > NOISY) - 1.0),
        largest * counts,
        (largest - rounding) * counts,
        chord * looked,
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
                _divide(w)
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
        for k in range(size):
            start, first = (r * size + k) * curves, r * (9 - r) // 2
            for j in range(0, order, 4):
                at = row * order + j
                a = (start + columns[at]) * wide + column
                b = (start + columns[at + 1]) * wide + column
                c = (start + columns[at + 2]) * wide + column
                d = (start + columns[at + 3]) * wide + column
                for s in range(0, orders - r, 2):
                    to = (_JETS + 3 * (first + s) + k if k < 3 else _WEIGHTS + 3 * (first + s)) * _WIDE + fill
                    of, next = s * rows * order + at, (s + 1) * rows * order + at
                    four = taps[of], taps[of + 1], taps[of + 2], taps[of + 3]
                    if s + 1 < orders - r:
                        eight = taps[next], taps[next + 1], taps[next + 2], taps[next + 3]
                        _add_eight(along, (a, b, c, d), (four, eight), (to, n, j), w)
                    else:
                        _add_four(along, (a, b, c, d), four, (to, n, j), w)


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


def _add_eight(along: Any, lines: Any, taps: Any, part: Any, w: Any) -> None:
    """The same for two derivatives."""
    (a, b, c, d), ((ta, tb, tc, td), (sa, sb, sc, sd)), (to, n, j) = lines, taps, part
    if j == 0:
        for i in range(n):
            pa, pb, pc, pd = along[a + i], along[b + i], along[c + i], along[d + i]
            w[to + i] = ta * pa + tb * pb + tc * pc + td * pd
            w[to + 3 * _WIDE + i] = sa * pa + sb * pb + sc * pc + sd * pd
    else:
        for i in range(n):
            pa, pb, pc, pd = along[a + i], along[b + i], along[c + i], along[d + i]
            w[to + i] = w[to + i] + ta * pa + tb * pb + tc * pc + td * pd
            w[to + 3 * _WIDE + i] = w[to + 3 * _WIDE + i] + sa * pa + sb * pb + sc * pc + sd * pd


def _divide(w: Any) -> None:
    """Derivatives of A / w from those of A and w."""
    for p in range(_WIDE):
        w[30 * _WIDE + p] = 1.0 / w[30 * _WIDE + p]
    for k in range(3):
        for p in range(_WIDE):
            at, to = k * _WIDE + p, 30 * _WIDE + p
            (
                w[at], w[12 * _WIDE + at], w[3 * _WIDE + at], w[21 * _WIDE + at], w[15 * _WIDE + at],
                w[6 * _WIDE + at], w[27 * _WIDE + at], w[24 * _WIDE + at], w[18 * _WIDE + at], w[9 * _WIDE + at],
            ) = quotient(
                (
                    w[at], w[12 * _WIDE + at], w[3 * _WIDE + at], w[21 * _WIDE + at], w[15 * _WIDE + at],
                    w[6 * _WIDE + at], w[27 * _WIDE + at], w[24 * _WIDE + at], w[18 * _WIDE + at], w[9 * _WIDE + at],
                ),
                (
                    w[to], w[12 * _WIDE + to], w[3 * _WIDE + to], w[21 * _WIDE + to], w[15 * _WIDE + to],
                    w[6 * _WIDE + to], w[27 * _WIDE + to], w[24 * _WIDE + to], w[18 * _WIDE + to], w[9 * _WIDE + to],
                ),
            )  # fmt: skip


def quotient(top: Any, w: Any) -> Any:
    """Derivatives of A / w from those of A and w, in the order of :mod:`mracad.bspline.jets` and as there; the first of
    those of w is 1 / w."""
    inverse = w[0]
    s = top[0] * inverse
    su = (top[1] - w[1] * s) * inverse
    sv = (top[2] - w[2] * s) * inverse
    suu = (top[3] - 2.0 * w[1] * su - w[3] * s) * inverse
    suv = (top[4] - w[2] * su - w[1] * sv - w[4] * s) * inverse
    svv = (top[5] - 2.0 * w[2] * sv - w[5] * s) * inverse
    suuu = (top[6] - 3.0 * w[1] * suu - 3.0 * w[3] * su - w[6] * s) * inverse
    suuv = (top[7] - w[2] * suu - 2.0 * w[1] * suv - 2.0 * w[4] * su - w[3] * sv - w[7] * s) * inverse
    suvv = (top[8] - 2.0 * w[2] * suv - w[5] * su - w[1] * svv - 2.0 * w[4] * sv - w[8] * s) * inverse
    svvv = (top[9] - 3.0 * w[2] * svv - 3.0 * w[5] * sv - w[9] * s) * inverse
    return s, su, sv, suu, suv, svv, suuu, suuv, suvv, svvv


def _figure(w: Any) -> None:
    """Figures from derivatives."""
    for p in range(_WIDE):
        (
            w[72 * _WIDE + p], w[73 * _WIDE + p], w[74 * _WIDE + p], w[75 * _WIDE + p], w[76 * _WIDE + p],
            w[77 * _WIDE + p], w[78 * _WIDE + p], w[79 * _WIDE + p], w[80 * _WIDE + p], w[81 * _WIDE + p],
            w[82 * _WIDE + p], w[83 * _WIDE + p], w[84 * _WIDE + p],
        ) = figures(
            (w[12 * _WIDE + p], w[13 * _WIDE + p], w[14 * _WIDE + p]),
            (w[3 * _WIDE + p], w[4 * _WIDE + p], w[5 * _WIDE + p]),
            (
                (w[21 * _WIDE + p], w[22 * _WIDE + p], w[23 * _WIDE + p]),
                (w[15 * _WIDE + p], w[16 * _WIDE + p], w[17 * _WIDE + p]),
                (w[6 * _WIDE + p], w[7 * _WIDE + p], w[8 * _WIDE + p]),
            ),
            (
                (w[27 * _WIDE + p], w[28 * _WIDE + p], w[29 * _WIDE + p]),
                (w[24 * _WIDE + p], w[25 * _WIDE + p], w[26 * _WIDE + p]),
                (w[18 * _WIDE + p], w[19 * _WIDE + p], w[20 * _WIDE + p]),
                (w[9 * _WIDE + p], w[10 * _WIDE + p], w[11 * _WIDE + p]),
            ),
        )  # fmt: skip


def _tell(marks: Any, found: Any, at: Any, fill: Any, w: Any) -> None:
    """Add up, or store, the figures of the points from ``at`` on."""
    points, first, last, every = marks[1], found[3], found[4], found[5]
    if marks[0]:
        _mark(marks, at, fill, w)
        begin = 0
        while begin < fill:
            place, end = w[_PLACE * _WIDE + begin], begin + 1
            while end < fill and w[_PLACE * _WIDE + end] == place:
                end += 1
            _sum(found, int(place), (begin, end), w)
            begin = end
    else:
        for r in range(first, last):
            for i in range(fill):
                every[(r - first) * points + at + i] = w[(_FORMS + r) * _WIDE + i]


def _sum(found: Any, place: Any, part: Any, w: Any) -> None:
    """Add up the figures of points of one place, one after another, and take the largest."""
    places, sums, tops = found[0], found[1], found[2]
    a, b, c, d = sums[place], sums[places + place], sums[2 * places + place], sums[3 * places + place]
    e, f, g = sums[4 * places + place], sums[5 * places + place], sums[6 * places + place]
    x, y, z = tops[place], tops[places + place], tops[2 * places + place]
    for p in range(part[0], part[1]):
        a += w[85 * _WIDE + p]
        b += w[86 * _WIDE + p]
        c += w[87 * _WIDE + p]
        d += w[88 * _WIDE + p]
        e += w[89 * _WIDE + p]
        f += w[90 * _WIDE + p]
        g += w[91 * _WIDE + p]
        x = max(x, w[92 * _WIDE + p])
        y = max(y, w[93 * _WIDE + p])
        z = max(z, w[94 * _WIDE + p])
    sums[place], sums[places + place], sums[2 * places + place], sums[3 * places + place] = a, b, c, d
    sums[4 * places + place], sums[5 * places + place], sums[6 * places + place] = e, f, g
    tops[place], tops[places + place], tops[2 * places + place] = x, y, z


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
            w[85 * _WIDE + p], w[86 * _WIDE + p], w[87 * _WIDE + p], w[88 * _WIDE + p], w[89 * _WIDE + p],
            w[90 * _WIDE + p], w[91 * _WIDE + p], w[92 * _WIDE + p], w[93 * _WIDE + p], w[94 * _WIDE + p],
        ) = told(
            (w[68 * _WIDE + p], w[69 * _WIDE + p], w[70 * _WIDE + p]),
            (w[60 * _WIDE + p], w[61 * _WIDE + p], w[62 * _WIDE + p], w[63 * _WIDE + p], w[64 * _WIDE + p]),
            (np.float32(w[65 * _WIDE + p]), np.float32(w[66 * _WIDE + p]), np.float32(w[67 * _WIDE + p])),
            (
                w[72 * _WIDE + p], w[73 * _WIDE + p], w[74 * _WIDE + p], w[75 * _WIDE + p], w[76 * _WIDE + p],
                w[77 * _WIDE + p], w[78 * _WIDE + p], w[79 * _WIDE + p], w[80 * _WIDE + p], w[81 * _WIDE + p],
                w[82 * _WIDE + p], w[83 * _WIDE + p], w[84 * _WIDE + p],
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
    (_spread, _add_four, _add_eight, _divide, _figure, _tell, _sum, _mark, _move),
    (dot, figures, quotient, told),
    (FEW, MANY),
)
