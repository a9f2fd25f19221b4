"""The sampling of edges."""

from __future__ import annotations

import numpy as np

Array = np.ndarray

SAMPLES = 25
"""Samples of an edge in a model."""


def shares(count: int) -> Array:
    """Fractions of an edge at which it is sampled: Chebyshev points, close to the ends but never on them."""
    return 0.5 - 0.5 * np.cos(np.pi * (np.arange(count) + 0.5) / count)


def hermite(values: Array, slopes: Array, segment: Array, s: Array) -> Array:
    """Cubic Hermite interpolation of samples ``(…, k, 3)`` at fractions ``s`` (q, 1) of segments (q,), ``(…, q, 3)``.

    Slopes are per step.
    """
    p, q, m, n = (x[..., segment + i, :] for x in (values, slopes) for i in (0, 1))
    return np.asarray(
        (1 + 2 * s) * (1 - s) ** 2 * p + s * (1 - s) ** 2 * m + s * s * (3 - 2 * s) * q + s * s * (s - 1) * n
    )


def between(samples: int) -> tuple[Array, Array]:
    """Segments and fractions that put eight points on each segment of a sampled curve, both ends included."""
    at = np.linspace(0, samples - 1, 8 * (samples - 1) + 1)
    segment = np.minimum(at.astype(int), samples - 2)
    return segment, (at - segment)[:, None]


def slopes(points: Array, tangents: Array) -> Array:
    """Derivatives ``(…, k, 3)`` of sampled curves per sample step."""
    return np.asarray(tangents * np.linalg.norm(np.gradient(points, axis=-2), axis=-1, keepdims=True))


def length(points: Array) -> float:
    """Length of a polygon, ``(k, 3)``."""
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
