"""How far an edit moved each face: the length of the displacement, measured on a grid.

δ(u, v) = Σ R_ij(u, v) δ_ij with unchanged weights, so max ‖δ_ij‖ bounds it.  It is evaluated at the Greville points of
the (refined) net inside each face and along its edges; outside the face the surface may move farther.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mracad.bspline.surface import pairs
from mracad.bspline.vectors import cross
from mracad.model.brep import Model
from mracad.model.cells import inside_grid
from mracad.model.displacement import Displacement
from mracad.model.region import face_region, supported

Array = np.ndarray

RIM = 33
"""Number of points along each edge."""


@dataclass(frozen=True)
class Deviation:
    """Displacement of one face, mm.

    Attributes
    ----------
    face : int
        Index in ``Model.faces``.
    largest, mean : float
        Largest and mean length over the sample of the face.
    bound : float
        Certified bound: the longest offset of a control point.
    normal : float
        Largest component along the normal of the surface.
    where : tuple of float
        Point of the largest displacement, before the edit, in the part's frame, mm.
    """

    face: int
    largest: float
    mean: float
    bound: float
    normal: float
    where: tuple[float, float, float]


def deviations(model: Model, displacement: Displacement) -> list[Deviation]:
    """Deviation of every face whose surface moves, in face order."""
    found = []
    for index, offset in displacement.offsets.items():
        surface = model.surfaces[index]
        net, motion = offset.over(surface.net), offset.motion(surface.net)
        us, vs = net.u.greville(), net.v.greville()
        moved = np.asarray(motion.grid(us, vs))
        sizes, heights = (
            np.linalg.norm(moved, axis=-1),
            _along(moved, cross(*(net.tangents(us, vs, k) for k in (0, 1)))),
        )
        for number in surface.faces:
            face = model.faces[number]
            reach = supported(net, face_region(net, face).inside)
            inner = inside_grid(face, net, us, vs)
            rim = [trim.curve.evaluate(np.linspace(*trim.curve.knots.domain, RIM))[0] for trim in face.trims]
            uv = np.concatenate([pairs(us, vs)[inner.ravel()], *rim])
            edge = uv[inner.sum() :]
            beside = motion.evaluate(edge)
            size = np.concatenate([sizes[inner], np.linalg.norm(beside, axis=1)])
            height = float(np.concatenate([heights[inner], _along(beside, net.normals(edge))]).max())
            largest = int(size.argmax())
            where = face.placed(net.evaluate(uv[largest : largest + 1])[0])
            bound = float(np.linalg.norm(offset.poles, axis=-1)[reach].max(initial=0.0))
            mean = float(sizes[inner].mean()) if inner.any() else float(size.mean())
            at = float(where[0]), float(where[1]), float(where[2])
            found.append(Deviation(number, float(size[largest]), mean, bound, height, at))
    return sorted(found, key=lambda d: d.face)


def _along(moved: Array, normals: Array) -> Array:
    """Lengths of displacements along normals of any length; 0 where there is none."""
    length = np.linalg.norm(normals, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.nan_to_num(np.abs((moved * normals).sum(axis=-1)) / length))
