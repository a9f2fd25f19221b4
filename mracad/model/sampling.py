"""The law by which edges are sampled."""

from __future__ import annotations

import numpy as np

Array = np.ndarray

SAMPLES = 25
"""Samples of an edge in a model."""


def shares(count: int) -> Array:
    """Fractions of an edge at which it is sampled: Chebyshev points, close to the ends but never on them."""
    return 0.5 - 0.5 * np.cos(np.pi * (np.arange(count) + 0.5) / count)
