"""What an edit did to faces and edges, in colours and words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mracad.view.colours import rgb
from mracad.view.legend import Entry
from mracad.view.lines import Stroke
from mracad.view.looks import Look, tinted

FACES = {
    "edited": "#8cc596",
    "in part": "#d3dd84",
    "unchanged": "#a9d3d6",
    "left": "#eda779",
    "held": "#a7b6df",
    "unselected": "#d2d5d8",
    "analytic": "#ebebe7",
}
"""Colours of faces by what became of them."""

EDGES = {
    "coupled": "#177a3a",
    "mended": "#7b2cbf",
    "to tolerance": "#a67c00",
    "slid": "#0b62c4",
    "idle": "#8b9197",
    "stayed 1": "#c1121f",
    "stayed 2": "#e8700a",
    "stayed 3": "#d6339a",
    "stayed": "#6b3a1f",
}
"""Colours of edges by how they were treated: those that stayed although something moved beside them, by the commonest
reasons; the last is that of all other reasons."""

_WIDE = 1.2  # pixels: half the width of edges


@dataclass(frozen=True)
class Told:
    """What an edit did.

    Attributes
    ----------
    faces, edges : mapping of int to str
        By index, one of ``FACES`` and of ``EDGES``; others were not looked at.
    words : mapping of str to str
        What the key says of each of these.
    """

    faces: Mapping[int, str]
    edges: Mapping[int, str]
    words: Mapping[str, str]

    @property
    def key(self) -> list[Entry]:
        """The colours with their words."""
        return [
            Entry(tuple(rgb(colour)), self.words[what], table is EDGES)
            for table in (FACES, EDGES)
            for what, colour in table.items()
            if what in self.words
        ]

    def look(self) -> Look:
        """Faces and edges in their colours."""
        count = max(self.faces, default=-1) + 2
        table = np.array([rgb(FACES[self.faces.get(face, "analytic")]) for face in range(count)])
        strokes = {edge: Stroke(tuple(rgb(EDGES[how])), _WIDE, 1.0) for edge, how in self.edges.items()}
        return Look(
            lambda stage, seen: tinted(stage, seen, table[np.minimum(seen.face, count - 1)]), 1, strokes=strokes
        )
