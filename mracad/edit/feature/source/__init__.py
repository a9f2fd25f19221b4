"""Features from heightmaps, outlines, textures and formulas (:mod:`mracad.spec.sources`)."""

from __future__ import annotations

from mracad.edit.feature.detail import Feature
from mracad.edit.feature.source import formula, grid, outline, texture
from mracad.edit.feature.source.relief import Relief, tabulated
from mracad.spec.sources import Formula, Heightmap, Outline, Source


def made(given: Source, name: str, taper: float | None = None) -> Feature:
    """The feature that a source becomes.

    Parameters
    ----------
    given : Source
    name : str
        Its text.
    taper : float, optional
        Width over which it fades out, mm: inside the border of a rectangle that is not level there, beyond the radius
        of a formula.

    Raises
    ------
    FileError
        For a file that is not what its extension says, or is too large.
    UsageError
        For sizes that do not fit, or a text that is no formula.
    EditError
        If nothing stands out.
    """
    return tabulated(heights(given, taper), name, given.spacing)


def heights(given: Source, taper: float | None = None) -> Relief:
    """The heights of a source; parameters and errors as for :func:`made`."""
    if isinstance(given, Heightmap):
        return grid.heightmap(given, taper)
    if isinstance(given, Outline):
        return outline.relief(given)
    if isinstance(given, Formula):
        return formula.relief(given, taper)
    return texture.relief(given, taper)
