"""What an edit should keep of seams, and what it should mend."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mracad.seam.hold import CONTINUITY
from mracad.spec.places import Zone

Array = np.ndarray

CREASE = np.radians(1.0)
"""A seam whose normals differ by more than this anywhere is a crease: it only keeps G0."""

BENT = 0.01
"""Jump of the curvature, as a share of the curvature, up to which a seam counts as continuous in curvature."""


@dataclass(frozen=True)
class Wishes:
    """What seams should keep, and what should be mended.

    Attributes
    ----------
    keep : {"g0", "g1", "g2", "as-is"}
        Continuity to keep; ``as-is``: what each seam has.
    fit : float
        Seams whose normals differ by up to this angle anywhere are made tangent.
    close_gaps : bool
    hold : frozenset of int
        Edges that must not move.
    zones : tuple of Zone
        Regions in which nothing may move.
    bend : float
        Jump of the curvature, 1/mm, that is allowed besides :data:`BENT` of the curvature itself.
    open : bool
        Whether free edges and poles move with their faces.
    free : bool
        Whether free edges move, but poles stay.
    corners : bool
        Whether the corners between two free edges that move also move.
    jumps : bool
        Whether jumps of curvature must not grow where seams keep what they have.
    slide : frozenset of int
        Edges that may slide along a neighbour that stays.
    pieces : int
        Largest number of pieces of a joint's law; 0 where laws must be polynomials.
    """

    keep: str = "g1"
    fit: float = 0.0
    close_gaps: bool = False
    hold: frozenset[int] = frozenset()
    zones: tuple[Zone, ...] = ()
    bend: float = 1e-9
    open: bool = False
    free: bool = False
    corners: bool = False
    jumps: bool = True
    slide: frozenset[int] = frozenset()
    pieces: int = 0

    def order(self, angles: Array, one: Array, other: Array) -> int:
        """Number of derivatives kept across an edge, given those along it.

        Parameters
        ----------
        angles : ndarray (q,)
            Angles between the normals of its two faces.
        one, other : ndarray (q,)
            Curvatures of both across it, 1/mm; NaN where undefined.
        """
        if not np.nanmax(angles, initial=0.0) <= max(CREASE, self.fit):
            return 0
        if self.keep in CONTINUITY:
            return CONTINUITY[self.keep]
        allowed = self.bend + BENT * np.maximum(np.abs(one), np.abs(other))
        return 2 if bool((np.abs(one - other) <= allowed).all()) else 1
