"""Compiled code for :mod:`mracad.inspect.places`: what became of places, in one call."""

from __future__ import annotations

from typing import Any

from mracad.compiled import Compiled

FEW, MANY = 2_000, 10_000_000
"""Numbers of places above which it pays to load the compiled code, and to compile it."""


def _compare(tally: Any, before: Any, found: Any) -> None:
    """Figures of places after an edit, over those before.

    Parameters
    ----------
    tally : tuple
        Number of places, and their sums.
    before : tuple
        Areas; means of bending and of variation; the largest of these around each place, and those beyond the base.
    found : pointer
        Figures ``(8, places)``, of which those of angles and curvatures are left.
    """
    (n, sums), (area, means, most, around) = tally, before
    one, two = 0.0, 0.0
    for i in range(n):
        size, second = max(sums[n + i], 1e-300), n + i
        fell, lost = means[i] - sums[2 * n + i] / size, means[second] - sums[3 * n + i] / size
        if area[i] > 0.0:
            found[i] = max(sums[4 * n + i] / size / around[i] - 1.0, sums[5 * n + i] / size / around[second] - 1.0)
            found[second] = max(fell / most[i], lost / most[second])
        rise, more = max(-fell * area[i], 0.0), max(-lost * area[i], 0.0)
        found[6 * n + i], found[7 * n + i] = rise, more
        one += rise
        two += more
    one, two = max(one / n, 1e-300), max(two / n, 1e-300)
    for i in range(n):
        found[6 * n + i] /= one
        found[7 * n + i] /= two


_REAL = "float64*"
COMPARE = Compiled(_compare, (("int64", _REAL), (_REAL, _REAL, _REAL, _REAL), (_REAL,)), work=(FEW, MANY))
