"""Detail on the faces of a model at a scale, from knots and nets alone: no edit is made, no seam is measured.

At a scale s the surface S_f of each face is projected onto the coarse space of its knots at that scale, as in
smoothing; the difference d = S_f − S_{Pf} is measured in the knot cells that the face touches.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mracad.bspline.basis import gauss
from mracad.bspline.crease import crease_lines
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.model.brep import Face, Model, Surface
from mracad.model.region import face_region
from mracad.seam.hold import separate
from mracad.wavelet.ladder import arc_lengths, finest_scale
from mracad.wavelet.project import at_scale

Array = np.ndarray

LEAST = 1e-7
"""Smallest height that counts as detail, mm: the kernel's coincidence tolerance."""

_POINTS = 2  # places at which a knot cell is sampled in each direction


@dataclass(frozen=True)
class FaceScales:
    """Scales and detail of one NURBS face.

    Attributes
    ----------
    face : int
        Index in ``Model.faces``.
    spans : (float, float)
        Smallest and largest knot span, mm.
    finest : float
        Smallest wavelength that the knots allow to remove, mm; 0 if there is none.
    creases : int
        Crease lines inside the face, which every edit keeps.
    coarser : bool
        Whether the knots allow a coarser surface at the scale.
    detail, rms : float
        Largest and root mean square height of the detail that smoothing would remove if nothing were held, mm.
    free, points : int
        Numbers of control points that can move while all edges stay, and of all on which the face depends.
    """

    face: int
    spans: tuple[float, float]
    finest: float
    creases: int
    coarser: bool
    detail: float
    rms: float
    free: int
    points: int


def scales(
    model: Model, scale: float, keep: str = "g1", progress: Callable[[int, int], None] | None = None
) -> dict[int, FaceScales]:
    """Measure the NURBS faces of a model.

    Parameters
    ----------
    model : Model
    scale : float
        Wavelength, mm.
    keep : {"g0", "g1", "g2"}
        Continuity that edges keep; it determines which control points are free.
    progress : callable, optional
        Called with surfaces done and surfaces in all.

    Returns
    -------
    dict of int to FaceScales
        Figures by face index; faces without a NURBS surface are left out.
    """
    found: dict[int, FaceScales] = {}
    for done, surface in enumerate(model.surfaces):
        if progress:
            progress(done, len(model.surfaces))
        found |= {each.face: each for each in _of_surface(model, surface, scale, keep)}
    return found


def _of_surface(model: Model, surface: Surface, scale: float, keep: str) -> list[FaceScales]:
    net, faces = surface.net, [model.faces[i] for i in surface.faces]
    spans = arc_lengths(net, 0), arc_lengths(net, 1)
    separation = separate(net, faces, surface.faces, keep)
    creases = crease_lines(net, 0, separation.visible), crease_lines(net, 1, separation.visible)
    directions = list(zip((net.u, net.v), spans, creases, strict=True))
    finest = [finest_scale(*each) for each in directions]
    smoothed = at_scale(net, scale, creases)
    coarser = smoothed.poles is not net.poles
    squares = _squares(net, net.poles - smoothed.poles) if coarser else np.zeros((net.u.spans, net.v.spans, 1))
    area = np.multiply.outer(*spans)

    def of(face: Face) -> FaceScales:
        inside, reach = face_region(net, face).inside, separation.reach[face.index]
        heights = squares[inside]
        mean = np.average(heights.mean(axis=-1), weights=area[inside]) if area[inside].any() else 0.0
        return FaceScales(
            face.index,
            (float(min(s.min() for s in spans)), float(max(s.max() for s in spans))),
            min(filter(None, finest), default=0.0),
            sum(map(len, creases)),
            coarser,
            float(np.sqrt(heights.max(initial=0.0))),
            float(np.sqrt(mean)),
            int((reach & separation.free).sum()),
            int(reach.sum()),
        )

    return [of(face) for face in faces]


def _squares(net: Net, offsets: Array) -> Array:
    """Squared lengths of offsets at a few places of every knot cell, ``(cells_u, cells_v, places)``."""
    us, vs = (_places(knots) for knots in (net.u, net.v))
    heights = net.with_poles(offsets).grid(us, vs)
    squares = np.square(heights).sum(axis=-1)
    cells = squares.reshape(net.u.spans, _POINTS, net.v.spans, _POINTS)
    return np.asarray(cells.swapaxes(1, 2).reshape(net.u.spans, net.v.spans, _POINTS**2))


def _places(knots: KnotVector) -> Array:
    """Parameters of the places in every span."""
    span, offset, _ = gauss(knots, _POINTS)
    return np.asarray((knots.knots[span][:, None] + offset).ravel())
