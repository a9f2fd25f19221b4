"""Compiled code for :mod:`mracad.seam.contact`: how much of a displacement contacts allow, in one call."""

from __future__ import annotations

from typing import Any

import numpy as np

from mracad.compiled import Compiled

FEW, MANY = 200_000, 1 << 30
"""Numbers of products above which it pays to load the compiled code, and to compile it."""


def _room(matrix: Any, delta: Any, limits: Any, room: Any) -> None:
    """The least share of a displacement that the conditions of each contact allow.

    Parameters
    ----------
    matrix : tuple
        Conditions: where the entries of each begin, columns, values, and number of conditions.
    delta : pointer
        ``(points, 3)``.
    limits : tuple
        Errors before ``(conditions, 3)``, those that are allowed, and the contact of each condition.
    room : pointer
        1 for each contact, or less at the end.
    """
    (begins, columns, values, count), (opened, most, owner) = matrix, limits
    for i in range(count):
        x, y, z = 0.0, 0.0, 0.0
        for k in range(begins[i], begins[i + 1]):
            at, value = 3 * columns[k], values[k]
            x += value * delta[at]
            y += value * delta[at + 1]
            z += value * delta[at + 2]
        a, b, c = opened[3 * i], opened[3 * i + 1], opened[3 * i + 2]
        x, y, z = a + x, b + y, c + z
        old, new = np.sqrt(a * a + b * b + c * c), np.sqrt(x * x + y * y + z * z)
        if new > most[i]:
            room[owner[i]] = min(room[owner[i]], (most[i] - old) / max(new - old, 1e-300))


_REAL, _PLACES = "float64*", "int32*"
ROOM = Compiled(
    _room,
    ((_PLACES, _PLACES, _REAL, "int64"), (_REAL,), (_REAL, _REAL, "int64*"), (_REAL,)),
    work=(FEW, MANY),
)
