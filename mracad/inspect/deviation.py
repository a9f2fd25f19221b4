"""How far an edit moved each face: the length of the displacement, measured on a grid.

δ(u, v) = Σ R_ij(u, v) δ_ij with unchanged weights, so max ‖δ_ij‖ bounds it.  It is evaluated at the Greville points of
the (refined) net inside each face and along its edges; outside the face the surface may move farther.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mracad.bspline.surface import pairs
from mracad.model.brep import Model
from mracad.model.cells import inside_grid
from mracad.model.displacement import Displacement
from mracad.model.region import face_region, supported

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
    where : tuple of float
        Point of the largest displacement, before the edit, in the part's frame, mm.
    """

    face: int
    largest: float
    mean: float
    bound: float
    where: tuple[float, float, float]


def deviations(model: Model, displacement: Displacement) -> list[Deviation]:
    """Deviation of every face whose surface moves, in face order."""
    found = []
    for index, offset in displacement.offsets.items():
        surface = model.surfaces[index]
        net, motion = offset.over(surface.net), offset.motion(surface.net)
        us, vs = net.u.greville(), net.v.greville()
        sizes = np.linalg.norm(motion.grid(us, vs), axis=-1)
        for number in surface.faces:
            face = model.faces[number]
            reach = supported(net, face_region(net, face).inside)
            inner = inside_grid(face, net, us, vs)
            rim = [trim.curve.evaluate(np.linspace(*trim.curve.knots.domain, RIM))[0] for trim in face.trims]
            uv = np.concatenate([pairs(us, vs)[inner.ravel()], *rim])
            size = np.concatenate([sizes[inner], np.linalg.norm(motion.evaluate(uv[inner.sum() :]), axis=1)])
            largest = int(size.argmax())
            where = face.placed(net.evaluate(uv[largest : largest + 1])[0])
            bound = float(np.linalg.norm(offset.poles, axis=-1)[reach].max(initial=0.0))
            mean = float(sizes[inner].mean()) if inner.any() else float(size.mean())
            found.append(Deviation(number, float(size[largest]), mean, bound, tuple(float(x) for x in where)))  # type: ignore[arg-type]
    return sorted(found, key=lambda d: d.face)
