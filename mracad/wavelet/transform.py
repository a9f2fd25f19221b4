"""Analysis and synthesis of curves and nets on nested knots, exactly.

A *step* turns ``n`` control points into ``m`` coarse ones followed by ``n − m`` details; a level of a pyramid
(:mod:`mracad.wavelet.pyramid`) is a step in u and one in v.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise, zip_longest

import numpy as np

from mracad.bspline.knots import Array, KnotVector
from mracad.bspline.rows import LARGE
from mracad.errors import UsageError
from mracad.wavelet.pyramid import LevelBands, Pyramid
from mracad.wavelet.step import EXACT, Chain, TwoScale, step


def decompose(
    poles: Array, ladder_u: Sequence[KnotVector], ladder_v: Sequence[KnotVector] | None = None, *, pinned: int = 0
) -> Pyramid:
    """Nonstandard decomposition of the control points of a net, or of a curve.

    Parameters
    ----------
    poles : ndarray (nu, nv, k), or (n, k) for a curve
    ladder_u, ladder_v : sequence of KnotVector
        Nested, from the net's own knots to the coarsest.  One level is one step in u and one in v; the shorter ladder
        ends early.
    pinned : int
        Number of derivatives, the value included, that all levels share at each end of a direction that is not
        periodic; it must be clamped.

    Returns
    -------
    Pyramid

    Raises
    ------
    UsageError
        Ladders that do not fit the poles or are not nested.

    Examples
    --------
    >>> import numpy as np
    >>> from mracad.bspline.knots import KnotVector
    >>> from mracad.wavelet import decompose, reconstruct, rungs_by_level
    >>> u, v = KnotVector.clamped([0, 1, 3, 4, 9], 3), KnotVector.clamped([0, 2, 3], 2)
    >>> pyramid = decompose(np.arange(84.0).reshape(7, 4, 3) ** 2, rungs_by_level(u), rungs_by_level(v))
    >>> [{name: band.shape for name, band in level.bands.items()} for level in pyramid.levels]
    [{'HL': (2, 3, 3), 'LH': (5, 1, 3), 'HH': (2, 1, 3)}, {'HL': (1, 3, 3)}]
    >>> bool(np.allclose(reconstruct(pyramid), np.arange(84.0).reshape(7, 4, 3) ** 2))
    True
    """
    poles = np.asarray(poles, dtype=float)
    ladders = [ladder_u] if ladder_v is None else [ladder_u, ladder_v]
    if poles.shape[:-1] != tuple(ladder[0].count for ladder in ladders):
        raise UsageError(f"control points of shape {poles.shape} do not fit the finest knots of the ladders")
    steps = [[step(b, a, 0 if a.periodic else pinned) for a, b in pairwise(ladder)] for ladder in ladders]
    lines = poles.reshape(len(poles), -1)
    centroid = (np.ones(len(lines)) @ lines).reshape(-1, poles.shape[-1]).sum(axis=0) * (poles.shape[-1] / poles.size)
    c = _moved(poles, -centroid, np.empty(poles.shape))
    pairs = [(pair[0], pair[1] if len(pair) > 1 else None) for pair in zip_longest(*steps)]
    c, levels = _analysed(c, pairs)
    return Pyramid(c, tuple(levels), centroid, tuple(tuple(ladder) for ladder in ladders))


def reconstruct(pyramid: Pyramid, level: float = 0.0) -> Array:
    """The control points of a pyramid, without its finest ``level`` levels.

    ``level = k + t`` leaves out the ``k`` finest levels and a share ``t`` of the next one's details, which blends
    the two surfaces between which it lies: ``t f^j + (1 − t) f^{j+1}``.
    Parameters
    ----------
    pyramid : Pyramid
    level : float

    Returns
    -------
    ndarray (nu, nv, k), or (n, k) for a curve
        Over the finest knots, whatever the level.

    Raises
    ------
    UsageError
        ``level`` outside 0 … number of levels.

    Examples
    --------
    >>> import numpy as np
    >>> from mracad.bspline.knots import KnotVector
    >>> from mracad.wavelet import decompose, reconstruct, rungs_by_level
    >>> pyramid = decompose(np.eye(7), rungs_by_level(KnotVector.clamped([0, 1, 3, 4, 9], 3)))
    >>> half = (reconstruct(pyramid, 1) + reconstruct(pyramid, 2)) / 2
    >>> bool(np.allclose(reconstruct(pyramid, 1.5), half))
    True
    """
    if not 0 <= level <= len(pyramid.levels):
        raise UsageError(f"level {level} is outside 0 … {len(pyramid.levels)}")
    poles = np.array(pyramid.coarse, order="C")
    compiled = poles.shape[-1] * math.prod(ladder[0].count for ladder in pyramid.ladders) >= LARGE
    for index in reversed(range(len(pyramid.levels))):
        gain = min(max(index + 1 - level, 0.0), 1.0)
        each = pyramid.levels[index]
        poles = (each if gain == 1.0 else each.scaled(gain)).synthesise(poles, compiled)
    return _moved(poles, pyramid.centroid, poles)


def _moved(poles: Array, offset: Array, out: Array) -> Array:
    """Every control point plus ``offset``, in a contiguous array, by whole lines, which is faster."""
    lines = poles.reshape(len(poles), -1)
    np.add(lines, np.tile(offset, lines.shape[1] // len(offset)), out=out.reshape(lines.shape))
    return out


def _analysed(
    c: Array, pairs: list[tuple[TwoScale | Chain | None, TwoScale | Chain | None]]
) -> tuple[Array, list[LevelBands]]:
    """Coarsest poles and levels.

    Unless all steps are exact, the rounding loss of a level is folded in once, and the rest is kept where it still
    matters.  The rest is taken on the way back up, against the actual reconstruction below, so that the large control
    points of an ill-conditioned coarse net cost nothing.
    """
    exact = all(each is None or each.exact for pair in pairs for each in pair)
    compiled = c.size >= LARGE
    small = 0.0 if exact else EXACT * np.abs(c).max(initial=0)
    nets, levels = [], []
    for u, v in pairs:
        coarse, bands = _bands(c, u, v, overwrite=exact, compiled=compiled)
        level = LevelBands(u, v, bands)
        if not exact:
            nets.append(c)
            more, extra = _bands(c - level.synthesise(coarse, compiled), u, v, compiled=compiled)
            coarse = coarse + more
            level = replace(level, bands={name: band + extra[name] for name, band in bands.items()})
        levels.append(level)
        c = coarse
    poles = c
    for i in reversed(range(len(nets))):
        poles = levels[i].synthesise(poles, compiled)
        residual = nets[i] - poles
        if np.abs(residual).max(initial=0) > small:
            levels[i] = replace(levels[i], residual=residual)
            poles = poles + residual
    return c, levels


def _bands(
    c: Array, u: TwoScale | Chain | None, v: TwoScale | Chain | None, overwrite: bool = False, compiled: bool = False
) -> tuple[Array, dict[str, Array]]:
    """Coarse control points and bands of one level."""
    bands = {}
    if u is not None:
        c, bands["HL"] = u.analyse(c, 0, overwrite, compiled)
    if v is not None:
        c, bands["LH"] = v.analyse(c, 1, overwrite, compiled)
        if u is not None:
            bands["HL"], bands["HH"] = v.analyse(bands["HL"], 1, overwrite, compiled)
    return c, bands
