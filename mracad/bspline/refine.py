"""Refinement matrices: a coarse B-spline basis written in a finer one, or one of higher degree (by blossoms)."""

from __future__ import annotations

import numpy as np

from mracad.bspline.basis import local_values
from mracad.bspline.knots import KnotVector
from mracad.bspline.rows import Rows
from mracad.errors import UsageError
from mracad.memo import kept


def is_nested(coarse: KnotVector, fine: KnotVector) -> bool:
    """Whether every spline of ``coarse`` is one of ``fine``: same domain, degree no lower, no knot smoother."""
    more = fine.degree - coarse.degree
    if more < 0 or (coarse.periodic, coarse.domain) != (fine.periodic, fine.domain):
        return False
    place = np.minimum(np.searchsorted(fine.breaks, coarse.breaks), fine.spans)
    enough = fine.multiplicities[place] >= coarse.multiplicities + more
    if not coarse.periodic:
        enough[[0, -1]] = True
    return bool((fine.breaks[place] == coarse.breaks).all() and enough.all())


@kept(256)
def refinement(coarse: KnotVector, fine: KnotVector) -> Rows:
    """The matrix P that takes control points over ``coarse`` to those of the same spline over ``fine``.

    ``P[i, j]`` is the blossom of coarse function ``j`` at ``t_{i+1}, …, t_{i+d}`` on a piece where fine function ``i``
    is non-zero.  The arguments enter the recursion in an order in which every term is non-negative, so entries are
    exact to rounding and non-negative, and rows sum to 1.  The ends may differ: a clamped vector refines an unclamped
    one.  If the degree is higher by one, the blossom is the mean of those with one argument left out; still higher
    degrees are reached step by step.

    Returns
    -------
    Rows (n, m)

    Raises
    ------
    UsageError
        The knots are not nested.

    Notes
    -----
    Cohen, Lyche, Riesenfeld 1980; Goldman and Lyche, *Knot Insertion and Deletion Algorithms*, 1993; Ramshaw,
    *Blossoms are polar forms*, 1989.
    """
    if not is_nested(coarse, fine):
        raise UsageError("knot vectors are not nested")
    d = fine.degree
    if d > coarse.degree + 1:
        between = coarse.elevated(d - 1)
        return refinement(between, fine).dot(refinement(coarse, between))
    row = np.arange(fine.count)[:, None]
    # Piece max(i, d): first the arguments up to it, from the right to the left, then those beyond, left to right.
    piece = np.maximum(row, d)
    step = np.arange(1, d + 1)
    argument = np.where(step <= piece - row, piece - step + 1, row + step)
    span, _ = coarse.locate(fine.knots[piece[:, 0]])
    offsets = fine.knots[argument].T - coarse.knots[span]
    if d > coarse.degree:
        values = np.mean([local_values(coarse, span, np.delete(offsets, k, axis=0)) for k in range(d)], axis=0)
    else:
        values = local_values(coarse, span, offsets)
    return Rows(span - coarse.degree, np.ascontiguousarray(values.T), coarse.count, coarse.periodic)
