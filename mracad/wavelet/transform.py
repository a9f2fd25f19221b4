"""Analysis and synthesis of curves and nets on nested knots, exactly.

Coefficient order.  A *step* turns ``n`` control points into ``m`` coarse ones followed by ``n − m`` details.  A
*pyramid* holds the coarsest control points and its levels from the finest to the coarsest.  A level has the bands
``LH`` (coarse in u, detail in v), ``HL`` (detail in u, coarse in v) and ``HH``, without those of a direction that does
not change there; a curve, or a level where v does not change, has only ``HL``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, zip_longest

import numpy as np

from mracad.bspline.knots import Array, KnotVector
from mracad.errors import UsageError
from mracad.wavelet.step import EXACT, Chain, TwoScale, step


@dataclass(frozen=True, eq=False)
class LevelBands:
    """The detail that one level adds to the next coarser surface.

    Attributes
    ----------
    u, v : TwoScale or Chain or None
        The steps taken; None where a direction does not change.
    bands : dict
        ``"LH"``, ``"HL"``, ``"HH"``: details (see the module).
    residual : ndarray or None
        The rounding loss, in control points of the finer net, if it is more than 1e-13 of the whole net.
    """

    u: TwoScale | Chain | None
    v: TwoScale | Chain | None
    bands: dict[str, Array]
    residual: Array | None = None

    def scaled(self, gain: float) -> LevelBands:
        """The level with its details times ``gain``."""
        bands = {name: gain * band for name, band in self.bands.items()}
        return replace(self, bands=bands, residual=None if self.residual is None else gain * self.residual)

    def synthesise(self, coarse: Array) -> Array:
        """Control points of the finer net from those of the coarser one."""
        if self.u is not None and self.v is not None:
            poles = np.empty((self.u.fine.count, self.v.fine.count, *coarse.shape[2:]))
            low, high = poles[: len(coarse)], poles[len(coarse) :]
            self.v.synthesise(coarse, self.bands["LH"], 1, low)
            self.v.synthesise(self.bands["HL"], self.bands["HH"], 1, high)
            self.u.synthesise(low, high, 0, poles)
        elif self.u is not None:
            poles = self.u.synthesise(coarse, self.bands["HL"], 0)
        elif self.v is not None:
            poles = self.v.synthesise(coarse, self.bands["LH"], 1)
        if self.residual is not None:
            poles += self.residual
        return poles


@dataclass(frozen=True, eq=False)
class Pyramid:
    """A curve or net in wavelet space.

    Attributes
    ----------
    coarse : ndarray
        Control points of the coarsest net, centroid subtracted.
    levels : tuple of LevelBands
        From the finest to the coarsest.
    centroid : ndarray (k,)
    """

    coarse: Array
    levels: tuple[LevelBands, ...]
    centroid: Array

    def scaled(self, gains: Sequence[float]) -> Pyramid:
        """The pyramid with the details of each level (the finest first) times a gain."""
        if len(gains) != len(self.levels):
            raise UsageError(f"{len(gains)} gains for {len(self.levels)} levels")
        return replace(self, levels=tuple(level.scaled(g) for level, g in zip(self.levels, gains, strict=True)))


def decompose(poles: Array, ladder_u: Sequence[KnotVector], ladder_v: Sequence[KnotVector] | None = None) -> Pyramid:
    """Nonstandard decomposition of the control points of a net, or of a curve.

    Parameters
    ----------
    poles : ndarray (nu, nv, k), or (n, k) for a curve
    ladder_u, ladder_v : sequence of KnotVector
        Nested, from the net's own knots to the coarsest.  One level is one step in u and one in v; the shorter ladder
        ends early.

    Returns
    -------
    Pyramid

    Raises
    ------
    UsageError
        Ladders that do not fit the poles or are not nested.
    """
    poles = np.asarray(poles, dtype=float)
    ladders = [ladder_u] if ladder_v is None else [ladder_u, ladder_v]
    if poles.shape[:-1] != tuple(ladder[0].count for ladder in ladders):
        raise UsageError(f"control points of shape {poles.shape} do not fit the finest knots of the ladders")
    steps = [[step(b, a) for a, b in pairwise(ladder)] for ladder in ladders]
    flat = poles.reshape(-1, poles.shape[-1])
    centroid = np.full(len(flat), 1.0 / len(flat)) @ flat
    c = np.array(poles, order="C")
    _move(c, -centroid)
    pairs = [(pair[0], pair[1] if len(pair) > 1 else None) for pair in zip_longest(*steps)]
    c, levels = _analysed(c, pairs)
    return Pyramid(c, tuple(levels), centroid)


def reconstruct(pyramid: Pyramid, level: float = 0.0) -> Array:
    """The control points of a pyramid, without its finest ``level`` levels.

    ``level = k + t`` leaves out the ``k`` finest levels and a share ``t`` of the next one's details, which blends
    the two surfaces between which it lies: ``t f^j + (1 − t) f^{j+1}``.
    The result always has as many control points as the finest net.

    Raises
    ------
    UsageError
        ``level`` outside 0 … number of levels.
    """
    if not 0 <= level <= len(pyramid.levels):
        raise UsageError(f"level {level} is outside 0 … {len(pyramid.levels)}")
    poles = np.array(pyramid.coarse, order="C")
    for index in reversed(range(len(pyramid.levels))):
        gain = min(max(index + 1 - level, 0.0), 1.0)
        each = pyramid.levels[index]
        poles = (each if gain == 1.0 else each.scaled(gain)).synthesise(poles)
    _move(poles, pyramid.centroid)
    return poles


def _move(poles: Array, offset: Array) -> None:
    """Add ``offset`` to every control point of a contiguous array, by whole lines, which is faster."""
    lines = poles.reshape(len(poles), -1)
    lines += np.tile(offset, lines.shape[1] // len(offset))


def _analysed(
    c: Array, pairs: list[tuple[TwoScale | Chain | None, TwoScale | Chain | None]]
) -> tuple[Array, list[LevelBands]]:
    """Coarsest poles and levels.

    Unless all steps are exact, the rounding loss of a level is folded in once, and the rest is kept where it still
    matters.  The rest is taken on the way back up, against the actual reconstruction below, so that the large control
    points of an ill-conditioned coarse net cost nothing.
    """
    exact = all(each is None or each.exact for pair in pairs for each in pair)
    small = 0.0 if exact else EXACT * np.abs(c).max(initial=0)
    nets, levels = [], []
    for u, v in pairs:
        coarse, bands = _bands(c, u, v, overwrite=exact)
        level = LevelBands(u, v, bands)
        if not exact:
            nets.append(c)
            more, extra = _bands(c - level.synthesise(coarse), u, v)
            coarse = coarse + more
            level = replace(level, bands={name: band + extra[name] for name, band in bands.items()})
        levels.append(level)
        c = coarse
    poles = c
    for i in reversed(range(len(nets))):
        poles = levels[i].synthesise(poles)
        residual = nets[i] - poles
        if np.abs(residual).max(initial=0) > small:
            levels[i] = replace(levels[i], residual=residual)
            poles = poles + residual
    return c, levels


def _bands(
    c: Array, u: TwoScale | Chain | None, v: TwoScale | Chain | None, overwrite: bool = False
) -> tuple[Array, dict[str, Array]]:
    """Coarse control points and bands of one level."""
    bands = {}
    if u is not None:
        c, bands["HL"] = u.analyse(c, 0, overwrite)
    if v is not None:
        c, bands["LH"] = v.analyse(c, 1, overwrite)
        if u is not None:
            bands["HL"], bands["HH"] = v.analyse(bands["HL"], 1, overwrite)
    return c, bands
