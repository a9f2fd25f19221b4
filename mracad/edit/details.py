"""Details: what an edit removed from the surfaces of a model, level by level, and the coarse surfaces that remain.

With c the control points of a coarse surface and f those of the surface before, over the same knots, d = f − c is a
displacement, also of a rational surface, whose weights stay.  On the ladder of these knots, and with S the L2
projections between its rungs, it is the sum of the splines

    d₀ − S d₀,   d₁ − S d₁,   …,   d_L      with d₀ = d and d_{j+1} = S d_j,

which are orthogonal over the parameters: they lie in the spaces that wavelets on these knots span.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import zip_longest

import numpy as np

from mracad.brief import line
from mracad.bspline.surface import Net
from mracad.model.brep import Face, Model, Surface
from mracad.model.displacement import Displacement, Offset
from mracad.wavelet.ladder import arc_lengths, rungs_by_level
from mracad.wavelet.project import projection

Array = np.ndarray

MOST = 0.99
"""Share of the energy of details that determines their wavelength."""

ROUNDING = 1e-15
"""Share of the details below which the remainder of their levels counts as zero."""


@dataclass(frozen=True, eq=False)
class Detail:
    """The details of one surface.

    Attributes
    ----------
    net : Net
        The surface without the details, over knots that hold both.
    levels : sequence of Net
        The details of each level, without weights, over the knots of the level: from the finest, which are those of the
        surface, to the coarsest, with all that is coarser still.
    rest : ndarray (nu, nv, 3), optional
        Rounding loss of the levels, mm.
    wavelength : float
        Approximate length of the longest waves in them, mm.
    faces : tuple of int
        Indices of the faces on the surface.
    product : str
    names : tuple of str
        Names of these faces.
    """

    net: Net
    levels: Sequence[Net]
    rest: Array | None
    wavelength: float
    faces: tuple[int, ...] = ()
    product: str = ""
    names: tuple[str, ...] = ()

    __repr__ = line

    @classmethod
    def of(cls, net: Net, offset: Array) -> Detail:
        """The details of a coarse surface, from their control points ``(nu, nv, 3)``."""
        lengths = [arc_lengths(net, axis) for axis in (0, 1)]
        ladders = [rungs_by_level(k, lengths=each) for k, each in zip((net.u, net.v), lengths, strict=True)]
        rungs = zip_longest(*(ladder[1:] for ladder in ladders))
        levels, u, v = [], net.u, net.v
        for rung in rungs:
            coarse_u, coarse_v = rung[0] or u, rung[1] or v
            coarse = projection(coarse_v, v).coarse(projection(coarse_u, u).coarse(offset, 0), 1)
            levels.append(Net(u, v, offset - Net(coarse_u, coarse_v, coarse).over(u, v).poles))
            offset, u, v = coarse, coarse_u, coarse_v
        levels.append(Net(u, v, offset))
        spacing = [min(float(x.sum()) / k.spans for x, k in zip(lengths, (e.u, e.v), strict=True)) for e in levels]
        return cls(net, tuple(levels), None, math.sqrt(2) * spacing[_longest(levels)])

    @cached_property
    def offset(self) -> Array:
        """Their control points, mm, ``(nu, nv, 3)``."""
        found = summed(self.levels)
        return found if self.rest is None else found + self.rest

    @property
    def motion(self) -> Net:
        """The details as a net of their own."""
        return self.net.with_poles(self.offset)


@dataclass(frozen=True)
class Details:
    """The details of a model.

    Attributes
    ----------
    model : str
        Its name.
    diagonal : float
        mm.
    made : str
        What was done to the model.
    surfaces : tuple of Detail
    """

    model: str
    diagonal: float
    made: str
    surfaces: tuple[Detail, ...]

    __repr__ = line

    @classmethod
    def of(cls, model: Model, displacement: Displacement, made: str = "") -> Details:
        """The details that an edit removed from a model."""
        found = []
        for index, offset in displacement.offsets.items():
            surface = model.surfaces[index]
            faces = [model.faces[i] for i in surface.faces]
            names = tuple(face.name for face in faces)
            taken = _taken(surface.net, offset)
            found.append(replace(taken, faces=surface.faces, product=faces[0].product, names=names))
        return cls(model.name, model.diagonal, made, tuple(found))

    def as_model(self) -> Model:
        """The model with its details, as far as they tell: faces without boundaries, whose normals are S_u × S_v."""
        surfaces = [
            Surface(i, each.net.with_poles(each.net.poles + each.offset), each.faces)
            for i, each in enumerate(self.surfaces)
        ]
        names = [("", "")] * (1 + max((face for each in self.surfaces for face in each.faces), default=-1))
        on: list[int | None] = [None] * len(names)
        for i, each in enumerate(self.surfaces):
            for face, name in zip(each.faces, each.names, strict=False):
                on[face], names[face] = i, (name, each.product)
        faces = tuple(
            Face(i, "bspline", on[i], (), False, np.eye(4), np.zeros((2, 3)), *names[i]) for i in range(len(names))
        )
        return Model(self.model, tuple(surfaces), faces, (), self.diagonal)


def summed(levels: Sequence[Net]) -> Array:
    """Control points of the sum of levels, over the knots of the first."""
    total = levels[-1]
    for level in reversed(levels[:-1]):
        total = level.with_poles(level.poles + total.over(level.u, level.v).poles)
    return total.poles


def _taken(net: Net, offset: Offset) -> Detail:
    """The details that an offset removed from a surface."""
    fine = offset.over(net)
    coarse = fine.with_poles(fine.poles + offset.poles)
    wanted = fine.poles - coarse.poles
    found = Detail.of(coarse, wanted)
    rest = wanted - found.offset
    return replace(found, rest=rest) if np.abs(rest).max() > ROUNDING * np.abs(wanted).max() else found


def _longest(levels: Sequence[Net]) -> int:
    """The number of the level up to which most of the energy is, and of the knots beyond it."""
    energy = np.cumsum([float((level.poles**2).mean()) for level in levels])
    return min(int(np.searchsorted(energy, MOST * energy[-1])) + 1, len(levels) - 1)
