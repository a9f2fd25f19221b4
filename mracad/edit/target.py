"""Surfaces as an edit looks at them before it solves anything."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from mracad.bspline.net import Net
from mracad.inspect.cells import quadrature
from mracad.model import Face, Model
from mracad.seam.energy import forms
from mracad.seam.metric import SMOOTHER, creases, seen, smoothed
from mracad.seam.solve import Problem, Space
from mracad.wavelet.ladder import arc_lengths, ladder_for_scale
from mracad.wavelet.project import projection

Array = np.ndarray

DEGREE = 3
"""Least degree of a surface that moves: knots set into a lower one make facets."""


@dataclass(frozen=True, eq=False)
class Sheet:
    """A surface that an edit may move.

    Attributes
    ----------
    index : int
        In ``Model.surfaces``.
    origin, net : Net
        As it is, and of degree 3 at least.
    all_faces, faces : tuple of Face
        All faces on it, and those that may move.
    metric : Net
        What displacements are measured on.
    creases : pair of frozenset of float
        Crease lines in u and v.
    trend : Net
        The surface projected on the splines of a few wavelengths: what is in it is shape.
    detail : float
        Largest displacement of a control point were nothing held, mm.
    """

    index: int
    origin: Net
    net: Net
    all_faces: tuple[Face, ...]
    faces: tuple[Face, ...]
    metric: Net
    creases: tuple[frozenset[float], frozenset[float]]
    trend: Net
    detail: float

    @property
    def movable(self) -> frozenset[int]:
        """Numbers of the faces that may move."""
        return frozenset(face.index for face in self.faces)


def sheets(model: Model, movable: Collection[int], stiffness: float, scale: float) -> dict[int, Sheet]:
    """The surfaces with faces that may move, by index.

    Parameters
    ----------
    model : Model
    movable : collection of int
        Faces.
    stiffness : float
        With which the edit filters, mm⁴.
    scale : float
        Waves longer than this are shape, mm.
    """
    found = {}
    for surface in model.surfaces:
        every = tuple(model.faces[i] for i in surface.faces)
        faces = tuple(face for face in every if face.index in movable)
        if faces:
            found[surface.index] = _sheet(surface.index, surface.net, every, faces, stiffness, scale)
    return found


def _sheet(
    index: int, origin: Net, every: tuple[Face, ...], faces: tuple[Face, ...], stiffness: float, scale: float
) -> Sheet:
    net = origin.over(origin.u.elevated(DEGREE), origin.v.elevated(DEGREE))
    points = quadrature(net, faces)
    metric = smoothed(net, points, SMOOTHER**4 * stiffness)
    sharp = creases(net, np.ones(net.poles.shape[:2], bool))
    form = forms(net, metric, points, sharp)
    reach = seen(net, form)
    trend = _trend(net, sharp, scale)
    change = Problem({index: Space(net, form, reach, reach, trend.poles)}).filtered(stiffness, trended=True)
    detail = float(np.linalg.norm(change, axis=1).max(initial=0.0))
    return Sheet(index, origin, net, every, faces, metric, sharp, trend, detail)


def _trend(net: Net, sharp: tuple[frozenset[float], frozenset[float]], scale: float) -> Net:
    """The projection of a net on the splines of a scale that keep its creases."""
    poles = net.poles
    for axis, knots in enumerate((net.u, net.v)):
        coarse = ladder_for_scale(knots, arc_lengths(net, axis), scale, keep=sharp[axis])
        if coarse != knots:
            poles = projection(coarse, knots).apply(poles, axis=axis)
    return Net(net.u, net.v, poles, net.weights)
