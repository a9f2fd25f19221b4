"""Nested pairs of knot vectors of every kind, for tests."""

import numpy as np
from hypothesis import strategies as st

from mracad.bspline.knots import KnotVector
from tests.bspline.spaces import KINDS, random_knots


def random_pair(
    degree: int, kind: str, spans: int, seed: int, most: int | None = None
) -> tuple[KnotVector, KnotVector]:
    """(coarse, fine): the coarse one without about half of the fine one's interior knots, some of them in part."""
    fine = random_knots(degree, kind, spans, seed, most)
    rng = np.random.default_rng(seed + 1)
    mults = fine.multiplicities.copy()
    inner = slice(1, -1)
    less = rng.integers(0, mults[inner] + 1)
    mults[inner] = np.where(rng.random(len(less)) < 0.5, mults[inner], less)
    if (mults == fine.multiplicities).all():
        mults[1] = 0
    return fine.with_multiplicities(mults), fine


def uniform(degree: int, level: int) -> KnotVector:
    """Clamped knots ``i / 2^level``."""
    return KnotVector.clamped(np.arange(2**level + 1) / 2**level, degree)


@st.composite
def pairs(draw, highest=9):
    """Any nested pair; interior multiplicities up to degree + 1 (periodic: degree)."""
    degree = draw(st.integers(1, highest))
    kind = draw(st.sampled_from(KINDS))
    most = draw(st.integers(1, degree + (kind != "periodic")))
    return random_pair(degree, kind, draw(st.integers(4, 14)), draw(st.integers(0, 10**6)), most)
