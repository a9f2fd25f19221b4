"""Operations on arrays of vectors."""

from __future__ import annotations

import numpy as np

Array = np.ndarray


def cross(a: Array, b: Array) -> Array:
    """Cross products of vectors ``(…, 3)``: faster than numpy's, which handles axes in general."""
    return np.asarray(a.take(_NEXT, -1) * b.take(_LAST, -1) - a.take(_LAST, -1) * b.take(_NEXT, -1))


_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])


def unit(vectors: Array) -> Array:
    """Vectors ``(…, 3)`` of length 1; a vanishing one stays zero."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300))


def between(one: Array, two: Array) -> Array:
    """Angles between vectors ``(…, 3)``."""
    return np.asarray(np.arctan2(np.linalg.norm(cross(one, two), axis=-1), (one * two).sum(axis=-1)))


def components(one: Array, two: Array, vectors: Array) -> Array:
    """``(x, y)`` of the parts ``x one + y two`` of vectors ``(…, 3)`` in the planes of two directions, ``(…, 2)``."""
    e, f, g, p, q = (
        (x * y).sum(axis=-1) for x, y in ((one, one), (one, two), (two, two), (one, vectors), (two, vectors))
    )
    determinant = np.maximum(e * g - f * f, 1e-300)
    return np.asarray(np.stack([p * g - q * f, q * e - p * f], axis=-1) / determinant[..., None])


def across(vectors: Array, along: Array) -> Array:
    """The part of vectors ``(q, 3)`` across directions ``along``."""
    along = unit(along)
    return np.asarray(vectors - (vectors * along).sum(axis=1, keepdims=True) * along)
