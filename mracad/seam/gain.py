"""Functions of the operator C = (M + aK)⁻¹ M that give filters their gain.

With c = 1 / (1 + x) the eigenvalues of C, a filter of gain 1 / (1 + xⁿ) changes f by −(1 − C) p(C) f,

    p(c) = (1 − c)ⁿ⁻¹ / (cⁿ + (1 − c)ⁿ),

expanded in Chebyshev polynomials on [0, 1].  The poles of p, at (1 ± i) / 2 for n = 2 and (1 ± 0.41 i) / 2 for n = 4,
make the error fall by a factor of 2.4 or 1.5 with every term.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from math import comb

import numpy as np
from numpy.polynomial.chebyshev import chebvander

Array = np.ndarray

TERMS = {2: 8, 4: 22}
"""Degree of the expansion by n: errors of the gain of 1e-4."""


@cache
def _expansion(order: int) -> Array:
    """Chebyshev coefficients of p((t + 1) / 2), with the least error of (1 − c) p(c), which is the gain."""
    t = np.cos(np.pi * (np.arange(200) + 0.5) / 200)
    weighted = chebvander(t, TERMS[order]) * (1 - t)[:, None]
    powers = sum(comb(order, k) * t**k for k in range(0, order + 1, 2))
    return np.asarray(np.linalg.lstsq(weighted, (1 - t) ** order / powers, rcond=None)[0])


def applied(order: int, power: Callable[[Array], Array], first: Array) -> Array:
    """p(C) first, by Clenshaw's recursion, for the n of an order; ``power`` applies C."""
    expansion = _expansion(order)
    terms = len(expansion) - 1
    last, before = expansion[terms] * first, np.zeros_like(first)
    for k in range(terms - 1, -1, -1):
        now = power(last)
        now *= 2
        now -= last
        now *= 2 if k else 1
        now += expansion[k] * first
        now -= before
        last, before = now, last
    return np.asarray(last)
