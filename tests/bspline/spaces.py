"""Knot vectors of every kind, for tests."""

import numpy as np
from hypothesis import strategies as st

from mracad.bspline.knots import KnotVector

KINDS = ("clamped", "unclamped", "periodic")


def random_knots(degree: int, kind: str, spans: int, seed: int, most: int | None = None) -> KnotVector:
    """Uneven knots of random multiplicities up to ``most`` (default: the degree)."""
    rng = np.random.default_rng(seed)
    breaks = np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 1.0, spans))])
    mults = rng.integers(1, (most or degree) + 1, spans + 1)
    if kind == "periodic":
        mults[-1] = mults[0]
        return KnotVector.from_multiplicities(breaks, mults, degree, periodic=True)
    if kind == "clamped":
        mults[[0, -1]] = degree + 1
        return KnotVector.from_multiplicities(breaks, mults, degree)
    mults[[0, -1]] = 1
    before, after = (rng.uniform(0.1, 1.0, degree).cumsum() for _ in range(2))
    return KnotVector(np.concatenate([-before[::-1], np.repeat(breaks, mults), breaks[-1] + after]), degree)


@st.composite
def knot_vectors(draw, highest=9):
    """Any knot vector; interior multiplicities up to degree + 1."""
    degree = draw(st.integers(1, highest))
    kind = draw(st.sampled_from(KINDS))
    most = draw(st.integers(1, degree + 1)) if kind != "periodic" else None
    return random_knots(degree, kind, draw(st.integers(2, 12)), draw(st.integers(0, 10**6)), most)
