"""Runs of equal and of consecutive numbers."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

Array = np.ndarray


def groups(values: Array) -> Iterator[slice]:
    """The stretches of equal values."""
    begins = np.flatnonzero(np.diff(values)) + 1
    ends = [*begins.tolist(), len(values)] if len(values) else []
    yield from (slice(a, b) for a, b in zip([0, *ends], ends, strict=False))


def runs(names: Array, first: Array, last: Array) -> tuple[Array, Array]:
    """Every whole number from ``first`` to before ``last`` of each, with its name."""
    lengths = last - first
    ends = np.cumsum(lengths)
    count = ends[-1] if len(ends) else 0
    steps = np.arange(count, dtype=np.int32) - np.repeat((ends - lengths).astype(np.int32), lengths)
    return np.repeat(names, lengths), np.repeat(first, lengths) + steps
