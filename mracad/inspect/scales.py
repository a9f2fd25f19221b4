"""Detail on the faces of a model below a scale, from their nets alone: no edit is made, no seam is measured."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from mracad.bspline.crease import crease_lines
from mracad.inspect.spectrum import NOTHING, spectrum
from mracad.model.brep import Face, Model, Surface
from mracad.seam.hold import separate
from mracad.wavelet.ladder import arc_lengths

LEAST = NOTHING[0]
"""Smallest height that counts as detail, mm: the kernel's coincidence tolerance."""


@dataclass(frozen=True)
class FaceScales:
    """Scales and detail of one NURBS face.

    Attributes
    ----------
    face : int
        Index in ``Model.faces``.
    spans : (float, float)
        Smallest and largest knot span, mm.
    first : float
        The shortest wavelength at which there are waves, mm; 0 if there are none.
    creases : int
        Crease lines inside the face, which every edit keeps.
    detail : float
        Root mean square height that smoothing at the scale would remove if nothing were held, mm.
    free, points : int
        Numbers of control points that can move while all edges stay, and of all on which the face depends.
    """

    face: int
    spans: tuple[float, float]
    first: float
    creases: int
    detail: float
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
    creases = sum(len(crease_lines(net, axis, separation.visible)) for axis in (0, 1))
    extent = float(min(s.min() for s in spans)), float(max(s.max() for s in spans))

    def of(face: Face) -> FaceScales:
        waves, reach = spectrum(net, face), separation.reach[face.index]
        free, points = int((reach & separation.free).sum()), int(reach.sum())
        return FaceScales(face.index, extent, waves.first, creases, waves.below(scale), free, points)

    return [of(face) for face in faces]
