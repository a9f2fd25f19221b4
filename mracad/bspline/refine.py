"""Refinement matrices: a coarse B-spline basis written in a finer one (Oslo algorithm)."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from mracad.bspline.basis import local_values
from mracad.bspline.knots import KnotVector
from mracad.bspline.rows import Rows
from mracad.errors import UsageError


def is_nested(coarse: KnotVector, fine: KnotVector) -> bool:
    """Whether every spline of ``coarse`` is one of ``fine``: same degree and domain, no knot less often."""
    if (coarse.degree, coarse.periodic, coarse.domain) != (fine.degree, fine.periodic, fine.domain):
        return False
    place = np.minimum(np.searchsorted(fine.breaks, coarse.breaks), fine.spans)
    enough = fine.multiplicities[place] >= coarse.multiplicities
    if not coarse.periodic:
        enough[[0, -1]] = True
    return bool((fine.breaks[place] == coarse.breaks).all() and enough.all())


@lru_cache(maxsize=256)
def refinement(coarse: KnotVector, fine: KnotVector) -> Rows:
    """The matrix P that takes poles over ``coarse`` to the poles of the same spline over ``fine``.

    ``P[i, j]`` is the blossom of coarse function ``j`` at ``t_{i+1}, …, t_{i+d}`` on a piece where fine function ``i``
    lives.  The arguments enter the recursion in an order in which every term is non-negative, so entries are exact to
    rounding, non-negative, and rows sum to 1.  The ends may differ: a clamped vector refines an unclamped one.

    Returns
    -------
    Rows (n, m)

    Raises
    ------
    UsageError
        The knots are not nested.

    Notes
    -----
    Cohen, Lyche, Riesenfeld 1980; Goldman and Lyche, *Knot Insertion and Deletion Algorithms*, 1993.
    """
    if not is_nested(coarse, fine):
        raise UsageError("knot vectors are not nested")
    d = fine.degree
    row = np.arange(fine.count)[:, None]
    # Piece max(i, d): first the arguments up to it, from the right to the left, then those beyond, left to right.
    piece = np.maximum(row, d)
    step = np.arange(1, d + 1)
    argument = np.where(step <= piece - row, piece - step + 1, row + step)
    span, _ = coarse.locate(fine.knots[piece[:, 0]])
    offsets = fine.knots[argument].T - coarse.knots[span]
    values = local_values(coarse, span, offsets)
    return Rows(span - d, np.ascontiguousarray(values.T), coarse.count, coarse.periodic)
