"""Faces chosen by a CadQuery selector."""

from __future__ import annotations

from mracad.errors import UsageError, needing
from mracad.occ.document import Document


def select_cq(document: Document, expression: str) -> set[int]:
    """The faces that a CadQuery string selector such as ``">Z"`` picks among all placed faces.

    A face is picked if any of its instances is.

    Parameters
    ----------
    document : Document
    expression : str

    Returns
    -------
    set of int
        Face indices.

    Raises
    ------
    UsageError
        For an expression that CadQuery does not understand.
    """
    with needing("cadquery", f"cannot select 'cq:{expression}'"):
        from cadquery import Face, StringSyntaxSelector  # takes seconds to import
        from pyparsing import ParseException

    placed = [
        (Face(document.faces[index].Moved(placement)), index)
        for part in document.parts
        for index in part.numbers
        for placement in part.placements
    ]
    try:
        picked = {id(face) for face in StringSyntaxSelector(expression).filter([face for face, _ in placed])}
    except (ParseException, ValueError, IndexError) as error:
        raise UsageError(f"'{expression}' is not a CadQuery face selector", "write it as '>Z' or '%Plane'") from error
    return {index for face, index in placed if id(face) in picked}
