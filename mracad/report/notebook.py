"""What notebooks show of an object: a small table, and the model to turn in a frame of its own."""

from __future__ import annotations

from collections.abc import Sequence

from mracad.brief import shortened
from mracad.errors import FileError
from mracad.occ.document import Document
from mracad.report.figures import still
from mracad.report.mesh import mesh
from mracad.report.page import Page, html, rendered

MOST = 40_000
"""Largest number of triangles, each face once: notebooks keep every cell."""

ROWS = 20
"""Largest number of rows."""

TEXT = 300
"""Longest text in a table, characters."""


def cell(
    facts: Sequence[tuple[str, str]],
    heads: Sequence[str] = (),
    rows: Sequence[Sequence[str]] = (),
    document: Document | None = None,
) -> str:
    """HTML for the output of a cell; it needs no network, and the frame cannot reach the notebook.

    Parameters
    ----------
    facts : sequence of (str, str)
        What is said, by name.
    heads, rows : sequence of str, sequence of rows
        A table, and what stands over it.
    document : Document, optional
        The model to turn; one with too many faces gets a picture.
    """
    return rendered(
        "cell.html",
        [(name, shortened(text, TEXT)) for name, text in facts],
        heads=heads,
        rows=[[shortened(text, TEXT) for text in row] for row in rows[:ROWS]],
        more=max(len(rows) - ROWS, 0),
        frame=_frame(document) if document else "",
    ).decode()


def _frame(document: Document) -> str:
    names = {
        face: part.face_names.get(face - part.first) or part.product for part in document.parts for face in part.numbers
    }
    try:
        page = Page(document.name, "Model", (), (), (), still(document), mesh(document, names, most=MOST))
    except FileError:
        return ""  # what cannot be drawn still has its table
    return html(page, "frame.html").decode()
