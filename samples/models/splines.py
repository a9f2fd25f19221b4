"""Knots and nets, and cutting them: plain numbers."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np


def settle(values: np.ndarray, bits: int = 7) -> np.ndarray:
    """Round to multiples of ``2**-bits``, because the last bits of a sine differ between machines."""
    return np.round(np.asarray(values) * 2.0**bits) / 2.0**bits


def breaks(
    rng: np.random.Generator, start: float, stop: float, spans: int, spread: float = 3.0, bits: int = 7
) -> np.ndarray:
    """Return ``spans + 1`` break points whose neighbouring spacings differ by up to `spread`.

    The inner ones are multiples of ``3 * 2**-bits``, so that a mean of three has a short decimal fraction.
    """
    steps = rng.uniform(1.0, spread, spans)
    inner = start + (stop - start) * np.cumsum(steps)[:-1] / steps.sum()
    return np.concatenate(([start], 3.0 * settle(inner / 3.0, bits), [stop]))


def clamped(points: np.ndarray, degree: int, double: Sequence[int] = ()) -> np.ndarray:
    """Return the full clamped knot vector on `points`, the inner points with index in `double` twice."""
    counts = np.ones(len(points), int)
    counts[list(double)] = 2
    counts[[0, -1]] = degree + 1
    return np.repeat(points, counts)


def greville(knots: np.ndarray, degree: int) -> np.ndarray:
    """Return the parameter each pole belongs to: the mean of `degree` successive knots."""
    return sum(knots[k : len(knots) - degree - 1 + k] for k in range(1, degree + 1)) / degree


def insert(knots: np.ndarray, poles: np.ndarray, degree: int, value: float) -> tuple[np.ndarray, np.ndarray]:
    """Insert one knot into a clamped net along axis 0 (Boehm), exact up to the arithmetic."""
    span = int(np.searchsorted(knots, value, side="right")) - 1
    new = np.empty((len(poles) + 1, *poles.shape[1:]))
    new[: span - degree + 1] = poles[: span - degree + 1]
    new[span + 1 :] = poles[span:]
    for i in range(span - degree + 1, span + 1):
        share = (value - knots[i]) / (knots[i + degree] - knots[i])
        new[i] = share * poles[i] + (1.0 - share) * poles[i - 1]
    return np.insert(knots, span + 1, value), new


def split(
    knots: np.ndarray, poles: np.ndarray, degree: int, at: Sequence[float]
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Cut a net along axis 0 at the given inner knots into clamped nets, each with its full knot vector."""
    for value in at:
        for _ in range(degree - np.count_nonzero(knots == value)):
            knots, poles = insert(knots, poles, degree, value)
    pieces = []
    ends = [knots[0], *at, knots[-1]]
    for low, high in pairwise(ends):
        inner = knots[(knots > low) & (knots < high)]
        first = int(np.searchsorted(knots, low, side="right")) - degree - 1
        own = np.concatenate(([low] * (degree + 1), inner, [high] * (degree + 1)))
        pieces.append((own, poles[first : first + len(own) - degree - 1]))
    return pieces
