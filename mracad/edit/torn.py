"""How far seams may open in an edit, and the faces of those that open further."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence

from mracad.edit.result import Edit
from mracad.edit.tolerances import Tolerances
from mracad.inspect.seams import SeamMeasure
from mracad.model.brep import Model


def torn(
    model: Model,
    before: Sequence[SeamMeasure],
    after: Sequence[SeamMeasure],
    edit: Edit,
    allowed: Tolerances,
    keep: str,
) -> set[int]:
    """Faces of seams that an edit would open or make less smooth than it is meant to.

    Parameters
    ----------
    model : Model
    before, after : sequence of SeamMeasure
        Seams in the same order.
    edit : Edit
        The edit; edges that it does not mention stay, and one that restores what was there opens nothing.
    allowed : Tolerances
    keep : str
        Continuity to keep; with ``"g0"`` a kink is no fault.
    """
    if edit.restored:
        return set()
    steeper, found = math.degrees(allowed.angle), set()
    for (old, widest), new in zip(_widest(model, before, edit, allowed), after, strict=True):
        bent = keep != "g0" and old.smooth and new.angle > old.angle + steeper
        if widest is not None and (new.gap > widest or bent):
            found |= set(old.faces)
    return found


def gaps(model: Model, before: Sequence[SeamMeasure], edit: Edit, allowed: Tolerances) -> dict[tuple[int, ...], float]:
    """The gaps allowed for seams of edited faces that do not move exactly, mm, by their faces.

    Parameters as for :func:`torn`.
    """
    exact = {each.edge for each in edit.edges if each.how == "coupled"}
    edited, found = {each.face for each in edit.faces("edited")}, defaultdict[tuple[int, ...], float](float)
    for seam, widest in _widest(model, before, edit, allowed):
        if widest is not None and seam.edge not in exact and edited.intersection(seam.faces):
            pair = tuple(sorted(seam.faces))
            found[pair] = max(found[pair], widest)
    return dict(found)


def _widest(
    model: Model, before: Sequence[SeamMeasure], edit: Edit, allowed: Tolerances
) -> Iterator[tuple[SeamMeasure, float | None]]:
    """Seams, and their allowed gaps, mm; None where they were to be mended."""
    ways: Mapping[int, str] = {each.edge: each.how for each in edit.edges}
    for seam in before:
        how = ways.get(seam.edge)
        wider = allowed.gap if how in ("to tolerance", "slid") else allowed.wider(model.edges[seam.edge], seam.gap)
        yield seam, None if how == "mended" else seam.gap + wider
