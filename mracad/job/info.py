"""What is in a document: faces and their scales, seams, validity, places."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from mracad.edit.feature.locate import face_number
from mracad.inspect.scales import FaceScales, scales
from mracad.inspect.seams import SeamMeasure, seams
from mracad.job.document import Progress, tell
from mracad.model.brep import Model
from mracad.spec.places import PLACE, OnFace, Point
from mracad.spec.quantity import length

if TYPE_CHECKING:
    from mracad.model.facts import Mass, Spot, Validity
    from mracad.occ.document import Document


@dataclass(frozen=True)
class Info:
    """What was read and measured.

    Attributes
    ----------
    document : Document
    model : Model
        Its faces, surfaces and edges, as plain arrays; ``model.diagonal`` is in millimetres.
    width : float
        The scale at which detail was looked for, mm.
    keep : str
        The continuity that edges keep.
    scales : mapping
        For each NURBS face by index, how much smoothing at that scale would change it.
    seams : list of SeamMeasure
        Gaps in mm, angles in degrees, jumps of curvature in 1/mm.
    valid : Validity
    sizes : sequence of (Mass, Spot)
        Area and centre of each face, and the place in the middle of its parameters, if they were asked for.
    spots : sequence of Spot
        The places that were asked for.
    """

    document: Document = field(repr=False)
    model: Model = field(repr=False)
    width: float
    keep: str
    scales: Mapping[int, FaceScales] = field(repr=False)
    seams: list[SeamMeasure] = field(repr=False)
    valid: Validity = field(repr=False)
    sizes: Sequence[tuple[Mass, Spot]] = field(repr=False)
    spots: Sequence[Spot] = field(repr=False)


def info(
    document: Document,
    scale: str = "2%",
    keep: Literal["g0", "g1", "g2"] = "g1",
    *,
    sized: bool = False,
    places: Sequence[Point | OnFace] = (),
    progress: Progress | None = None,
) -> Info:
    """Look at a document.

    Parameters
    ----------
    document : Document
    scale : str
        Scale at which to look for detail.
    keep : str
        Continuity that edges keep.
    sized : bool
        Whether to measure the sizes of faces.
    places : sequence of (Point or OnFace)
        Points (mm) whose nearest places on faces to find, and places on faces.
    """
    from mracad.occ.check import check
    from mracad.occ.measure import face_masses
    from mracad.occ.probe import middles, nearest, on_face
    from mracad.occ.view import view

    tell(progress, "looking at faces")
    model = view(document)
    width = length(scale, model.diagonal, "scale")
    found = scales(model, width, keep, lambda done, total: tell(progress, "looking at scales", done, total))
    tell(progress, "measuring seams")
    measures = seams(model)
    tell(progress, "checking")
    valid = check(document)
    sizes = list(zip(face_masses(document), middles(document), strict=True)) if sized else []
    spots = [
        on_face(document, face_number(model, each.face, "at", PLACE), np.array(each.uv))
        if isinstance(each, OnFace)
        else nearest(document, model, np.array(each.xyz))
        for each in places
        if model.faces
    ]
    return Info(document, model, width, keep, found, measures, valid, sizes, spots)
