"""Compiled code for :mod:`mracad.seam.integrals`: products of functions into stencils, and their mirror images."""

from __future__ import annotations

from typing import Any

from mracad.compiled import Compiled

FEW, MANY = 1 << 20, 1 << 32
"""Numbers of products above which it pays to load the compiled code, and to compile it."""


def _place(cells: Any, sizes: Any, along: Any, found: Any) -> None:
    """Add the products of functions of pieces to stencils.

    Parameters
    ----------
    cells : pointer
        ``(pieces, groups, lines, points, d + 1, d + 1, width)``.
    sizes : tuple
        Numbers of pieces, groups, lines and points; width.
    along : tuple
        First function of each piece, number of functions, and d.
    found : pointer
        ``(lines, groups, points, functions, 2 d + 1, width)``.
    """
    pieces, groups, lines, points, width = sizes
    firsts, count, d = along
    at, size = 0, (d + 1) * width
    for t in range(pieces):
        for g in range(groups):
            for line in range(lines):
                for h in range(points):
                    start = ((line * groups + g) * points + h) * count
                    for a in range(d + 1):
                        row = firsts[t] + a
                        to = ((start + (row if row < count else row % count)) * (2 * d + 1) + d - a) * width
                        for i in range(size):
                            found[to + i] += cells[at + i]
                        at += size


def _mirror(half: Any, sizes: Any, form: Any) -> None:
    """Add half a form ``(nu, 2p + 1, nv, 2q + 1)`` and its mirror image to a form ``(nu, nv, 2p + 1, 2q + 1)``."""
    count_u, wide_u, count_v, wide_v = sizes
    at = 0
    for i in range(count_u):
        for j in range(count_v):
            for k in range(wide_u):
                own = ((i * wide_u + k) * count_v + j) * wide_v
                other = (((i + k - wide_u // 2) % count_u) * wide_u + wide_u - 1 - k) * count_v
                for m in range(wide_v):
                    column = j + m - wide_v // 2
                    if column < 0 or column >= count_v:
                        column %= count_v
                    form[at] += half[own + m] + half[(other + column) * wide_v + wide_v - 1 - m]
                    at += 1


_REAL, _WHOLE = "float64*", "int64"
PLACE = Compiled(
    _place,
    ((_REAL,), (_WHOLE, _WHOLE, _WHOLE, _WHOLE, _WHOLE), ("int64*", _WHOLE, _WHOLE), (_REAL,)),
    work=(FEW, MANY),
)
MIRROR = Compiled(_mirror, ((_REAL,), (_WHOLE, _WHOLE, _WHOLE, _WHOLE), (_REAL,)), work=(FEW, MANY))
