"""Compiled code for :mod:`mracad.bspline.rows`: banded products along an axis."""

from __future__ import annotations

from typing import Any

from mracad.compiled import Compiled

FEW, MANY = 200_000, 1 << 30
"""Numbers of products above which it pays to load the compiled code, and to compile it."""


def _band(matrix: Any, values: Any, found: Any) -> None:
    """A matrix of runs times an array along an axis, added up in the order of columns.

    Parameters
    ----------
    matrix : tuple
        First columns of rows, values ``(rows, width)``, and numbers of rows, of values in each and of columns.
    values : tuple
        ``(before, columns, after)``, with the first and the last of these numbers.
    found : pointer
        ``(before, rows, after)``.
    """
    (starts, taps, rows, width, columns), (c, before, after), to = matrix, values, 0
    for b in range(before):
        for i in range(rows):
            for k in range(width):
                tap, column = taps[i * width + k], starts[i] + k
                at = (b * columns + (column if 0 <= column < columns else column % columns)) * after
                if k == 0:
                    for j in range(after):
                        found[to + j] = tap * c[at + j]
                else:
                    for j in range(after):
                        found[to + j] += tap * c[at + j]
            to += after


_REAL, _WHOLE = "float64*", "int64"
BAND = Compiled(
    _band,
    (("int64*", _REAL, _WHOLE, _WHOLE, _WHOLE), (_REAL, _WHOLE, _WHOLE), (_REAL,)),
    work=(FEW, MANY),
)
