"""What an edit wants, and surfaces as it looks at them before it solves anything."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from mracad.bspline.surface import Net
from mracad.model.brep import Face, Model
from mracad.model.cells import quadrature
from mracad.seam.energy import forms
from mracad.seam.interface import Joints
from mracad.seam.ladders import Creases
from mracad.seam.metric import SMOOTHER, creases, seen, smoothed
from mracad.seam.solve import Problem, Space
from mracad.wavelet.ladder import arc_lengths
from mracad.wavelet.project import at_scale

Array = np.ndarray

DEGREE = 3
"""Least degree of a surface that moves: knots set into a lower one make facets."""

TREND, BASE = 2.5, 6.0
"""Waves of more wavelengths than the first are shape, of more than the second what waves show beside."""


class Wish(Protocol):
    """What an edit wants.

    Attributes
    ----------
    spread : float
        Within how many wavelengths what it takes from a place spreads; infinite where that is no fault.
    fairs : bool
        Whether it makes faces fairer; else it changes what they are, and takes free edges and poles with them.
    """

    @property
    def spread(self) -> float: ...

    @property
    def fairs(self) -> bool: ...

    def wavelength(self, net: Net, faces: Sequence[Face], creases: Creases) -> float:
        """Wavelength below which it takes waves from faces of a surface, mm; beside what is held it fades within it."""
        ...

    def space(self, net: Net) -> Net:
        """A surface over knots that can hold what it wants; itself where those that it has will do."""
        ...

    def target(self, problem: Problem, sheets: Mapping[int, Sheet], joined: Joints) -> Array:
        """What it would do to surfaces that seams join were no rim held, ``(points, 3)``."""
        ...

    def ways(self, problem: Problem, target: Array, width: float) -> Iterable[Iterable[Array]]:
        """Displacements ``(points, 3)`` of a problem, of which that is done that may come nearest to the target.

        They come in batches: the next is looked at only where the judge takes much off the one before.  Beside what is
        held, they fade within ``width`` (mm).
        """
        ...


@dataclass(frozen=True, eq=False)
class Sheet:
    """A surface that an edit may move.

    Attributes
    ----------
    index : int
        In ``Model.surfaces``.
    origin, net : Net
        As it is, and of degree 3 at least over knots that can hold what is wanted.
    all_faces, faces : tuple of Face
        All faces on it, and those that may move.
    metric : Net
        What displacements are measured on.
    creases : pair of frozenset of float
        Crease lines in u and v.
    wavelength : float
        Below which the edit takes waves from it, mm.
    reach : float
        Within which what it takes spreads, mm.
    trend, base : Net
        The surface projected on the splines of a few wavelengths: what is in it is shape; and of many, for the judge: a
        trend that swings about a mark would hide waves that are made there.
    detail : float
        Largest displacement of a control point were nothing held, mm.
    """

    index: int
    origin: Net
    net: Net
    all_faces: tuple[Face, ...]
    faces: tuple[Face, ...]
    metric: Net
    creases: Creases
    wavelength: float
    reach: float
    trend: Net
    base: Net
    detail: float = 0.0

    @property
    def movable(self) -> frozenset[int]:
        """Numbers of the faces that may move."""
        return frozenset(face.index for face in self.faces)


def stiffness(wavelength: float) -> float:
    """ℓ⁴, mm⁴, of a wavelength 2πℓ."""
    return (wavelength / (2 * math.pi)) ** 4


def sheets(model: Model, movable: Collection[int], wish: Wish) -> dict[int, Sheet]:
    """The surfaces with faces (``movable``) that an edit may move, by index."""
    found = {}
    for surface in model.surfaces:
        every = tuple(model.faces[i] for i in surface.faces)
        faces = tuple(face for face in every if face.index in movable)
        if faces:
            found[surface.index] = _sheet(surface.index, surface.net, every, faces, wish)
    return found


def _sheet(index: int, origin: Net, every: tuple[Face, ...], faces: tuple[Face, ...], wish: Wish) -> Sheet:
    net = wish.space(origin.over(origin.u.elevated(DEGREE), origin.v.elevated(DEGREE)))
    points = quadrature(net, faces)
    sharp = creases(net, np.ones(net.poles.shape[:2], bool))
    wavelength = wish.wavelength(origin, faces, sharp)
    metric = smoothed(net, points, SMOOTHER**4 * stiffness(wavelength))
    form = forms(net, metric, points, sharp)
    reach = seen(net, form)
    trend, base = (at_scale(net, waves * wavelength, sharp) for waves in (TREND, BASE))
    sheet = Sheet(index, origin, net, every, faces, metric, sharp, wavelength, wish.spread * wavelength, trend, base)
    alone = Problem({index: Space(net, form, reach, reach, sheet.trend.poles)})
    change = wish.target(alone, {index: sheet}, Joints())
    return replace(sheet, detail=float(np.linalg.norm(change[alone.seen], axis=1).max(initial=0.0)))


def eased(net: Net, share: Array, width: float) -> Array:
    """Shares ``(nu, nv)`` of the control points of a net that change smoothly, and are nowhere larger than they were.

    The mean over a window of the width (mm) of the least over the same window.
    """
    from scipy.ndimage import minimum_filter, uniform_filter

    spacing = (arc_lengths(net, axis).sum() / net.poles.shape[axis] for axis in (0, 1))
    window = tuple(2 * int(min(width / 2 / step, count)) + 1 for step, count in zip(spacing, share.shape, strict=True))
    least = minimum_filter(share, window, mode="nearest")
    return np.asarray(np.minimum(share, uniform_filter(least, window, mode="nearest")))
