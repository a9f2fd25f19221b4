"""How far an edit moved each face: the length of the displacement, measured on a grid.

δ(u, v) = Σ R_ij(u, v) δ_ij with unchanged weights, so max ‖δ_ij‖ bounds it.  It is evaluated at the Greville points of
the (refined) net inside each face and along its edges; outside the face the surface may move farther.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mracad.bspline.scattered import Place, normals, scattered
from mracad.bspline.surface import Net, pairs
from mracad.bspline.vectors import cross
from mracad.model.brep import Face, Model
from mracad.model.cells import inside_grid
from mracad.model.displacement import Displacement, Offset
from mracad.model.region import covered, supported

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
    looks = [look for index, offset in displacement.offsets.items() for look in _looks(model, index, offset)]
    if not looks:
        return []
    rims: list[Place] = [(look.net, look.rim, ("right", "right")) for look in looks]
    _, su, sv = scattered(rims, 1)
    (beside,) = scattered([(look.motion, look.rim, ("right", "right")) for look in looks], 0)
    ends = np.cumsum([len(look.rim) for look in looks])[:-1]
    sizes = np.split(np.linalg.norm(beside, axis=1), ends)
    heights = np.split(_along(beside, normals(rims, su, sv)), ends)
    found = [look.found(*rim) for look, *rim in zip(looks, sizes, heights, strict=True)]
    return sorted(found, key=lambda d: d.face)


@dataclass(frozen=True, eq=False)
class _Look:
    """A face whose surface moves.

    Attributes
    ----------
    face : Face
    net, motion : Net
        The surface and its displacement.
    bound : float
        The longest offset of a control point on which the face depends, mm.
    inside : ndarray (p, 2)
        Parameters on the face.
    sizes, heights : ndarray (p,)
        Lengths of displacements there, and of their part along the normal, mm.
    rim : ndarray (q, 2)
        Parameters on its edges.
    """

    face: Face
    net: Net
    motion: Net
    bound: float
    inside: Array
    sizes: Array
    heights: Array
    rim: Array

    def found(self, sizes: Array, heights: Array) -> Deviation:
        """Its deviation, given the lengths of displacements on its edges."""
        uv, every = np.concatenate([self.inside, self.rim]), np.concatenate([self.sizes, sizes])
        height = float(np.concatenate([self.heights, heights]).max())
        largest = int(every.argmax())
        where = self.face.placed(self.net.evaluate(uv[largest : largest + 1])[0])
        mean = float(self.sizes.mean()) if len(self.sizes) else float(every.mean())
        at = float(where[0]), float(where[1]), float(where[2])
        return Deviation(self.face.index, float(every[largest]), mean, self.bound, height, at)


def _looks(model: Model, index: int, offset: Offset) -> Iterator[_Look]:
    """The faces of a surface that moves."""
    surface = model.surfaces[index]
    net = offset.over(surface.net)
    motion = net.with_poles(offset.poles)
    us, vs = net.u.greville(), net.v.greville()
    moved = np.asarray(motion.grid(us, vs))
    sizes, lengths = np.linalg.norm(moved, axis=-1), np.linalg.norm(offset.poles, axis=-1)
    heights = _along(moved, cross(*(net.tangents(us, vs, k) for k in (0, 1))))
    for face in (model.faces[number] for number in surface.faces):
        bound = float(lengths[supported(net, covered(net, face))].max(initial=0.0))
        inner = inside_grid(face, net, us, vs)
        rim = [trim.curve.evaluate(np.linspace(*trim.curve.knots.domain, RIM))[0] for trim in face.trims]
        inside = pairs(us, vs)[inner.ravel()]
        rims = np.concatenate(rim) if rim else np.empty((0, 2))
        yield _Look(face, net, motion, bound, inside, sizes[inner], heights[inner], rims)


def _along(moved: Array, normals: Array) -> Array:
    """Lengths of displacements along normals of any length; 0 where there is none."""
    length = np.linalg.norm(normals, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.nan_to_num(np.abs((moved * normals).sum(axis=-1)) / length))
