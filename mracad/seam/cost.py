"""Which seams cost too much to be matched exactly."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.seam.border import Border
from mracad.seam.conditions import matched
from mracad.seam.natural import Seam

LARGE, GROWTH = 2_000_000, 20
"""Entries of the form of a surface with the knots of its neighbours, and how many times its own, that are too many."""


def costly(nets: Sequence[Net], seams: Sequence[Seam]) -> set[int]:
    """Edges of seams that cost too much to match exactly, as beside the walls that kernels make for offset faces: of
    degree 14, with a thousand control points."""
    around = defaultdict[int, list[tuple[Seam, Border, Border]]](list)
    for seam in seams:
        around[seam.a.surface].append((seam, seam.a, seam.b))
        around[seam.b.surface].append((seam, seam.b, seam.a))
    found: set[int] = set()
    for i, star in around.items():
        counts, degree = [nets[i].u.count, nets[i].v.count], 1
        for _, own, other in star:
            counts[1 - own.axis] += _along(nets, other).count
            degree = max(degree, *(_along(nets, each).degree for each in (own, other)))
        if math.prod(counts) * (2 * degree + 1) ** 2 < LARGE:
            continue
        both = {border.surface: nets[border.surface] for _, *borders in star for border in borders}
        if _entries(matched(both, [seam for seam, *_ in star])[i]) > max(LARGE, GROWTH * _entries(nets[i])):
            found |= {seam.edge for seam, own, other in star if _along(nets, other).count > _along(nets, own).count}
    return found


def _along(nets: Sequence[Net], border: Border) -> KnotVector:
    net = nets[border.surface]
    return (net.v, net.u)[border.axis]


def _entries(net: Net) -> int:
    """Number of entries of a quadratic form."""
    return math.prod(knots.count * (2 * knots.degree + 1) for knots in (net.u, net.v))
