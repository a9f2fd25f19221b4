"""What is in a document: faces and their scales, seams, validity, places."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from mracad.brief import named_line
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

    document: Document
    model: Model
    width: float
    keep: str
    scales: Mapping[int, FaceScales]
    seams: list[SeamMeasure]
    valid: Validity
    sizes: Sequence[tuple[Mass, Spot]]
    spots: Sequence[Spot]

    def __repr__(self) -> str:
        return named_line("Info", self.model.name, ", ".join(f"{name.lower()}: {text}" for name, text in self._facts()))

    def _repr_html_(self) -> str:
        from mracad.report.notebook import cell

        return cell([("Model", self.model.name), *self._facts()], document=self.document)

    def _facts(self) -> list[tuple[str, str]]:
        kinds = Counter(face.kind for face in self.model.faces)
        return [
            ("Diagonal", f"{self.model.diagonal:.6g} mm"),
            ("Solids", str(self.valid.solids)),
            ("Shapes", "valid" if self.valid.valid else "not valid"),
            ("Seams", f"{len(self.seams)} of NURBS faces"),
            ("Faces", ", ".join(f"{count} {kind}" for kind, count in kinds.most_common())),
        ]


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
    from mracad.occ.probe import middles, nearest, on_face
    from mracad.occ.sizes import face_masses
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
