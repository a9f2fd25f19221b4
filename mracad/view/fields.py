"""Numbers at places on faces, for maps in pictures and for the points of meshes, and their colours."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mracad.model.facets import Body, Facets
from mracad.spec.pictures import Show
from mracad.spec.quantity import length
from mracad.view.colours import diverging, sequential
from mracad.view.runs import groups
from mracad.view.spots import Spots

if TYPE_CHECKING:
    from mracad.view.rough import Rough

Array = np.ndarray
Field = Callable[[Spots], Array]
"""Numbers ``(q,)`` of places."""

WAVELENGTH = 0.05
"""Default wavelength of roughness, as a share of the diagonal."""

SHARE = 0.98
"""Share of places whose curvature and roughness lie within the range of the colours."""

_STEPS = 1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0


@dataclass(frozen=True)
class Scale:
    """The range of a map's colours.

    Attributes
    ----------
    low, high : float
    below, above : bool
        Whether the picture has values beyond.
    """

    low: float
    high: float
    below: bool = False
    above: bool = False

    def colours(self, values: Array) -> Array:
        """Colours ``(q, 3)`` of values."""
        if self.low < 0.0:
            return diverging(values / self.high)
        return sequential(values / self.high)


def scale(values: Array, share: float, signed: bool) -> Scale:
    """A range with round ends for a share of the values, from 0, or the same to both sides of it."""
    size = np.sort(np.abs(values))
    most = float(size[-1]) if len(size) else 0.0
    bound = float(size[min(int(share * len(size)), len(size) - 1)]) if len(size) else 0.0
    high = rounded(bound) if bound > 0.0 else (rounded(most) if most > 0.0 else 1.0)
    return Scale(-high if signed else 0.0, high, signed and bool((values < -high).any()), bool((values > high).any()))


def rounded(value: float) -> float:
    """The next round number from a positive one up."""
    power = float(10.0 ** np.floor(np.log10(value)))
    return next(step for step in _STEPS if step * power >= value * (1 - 1e-9)) * power


@dataclass(frozen=True)
class Map:
    """What numbers are, and which share of them lies within the range of colours.

    Attributes
    ----------
    name, title, unit : str
        The name is a word.
    share : float
    signed : bool
    """

    name: str
    title: str
    unit: str
    share: float
    signed: bool

    def scale(self, values: Array) -> Scale:
        """The range of colours for values."""
        return scale(values, self.share, self.signed)


_MAPS = {
    "max": Map("curvature_max", "largest curvature", "1/mm", SHARE, False),
    "mean": Map("curvature_mean", "mean curvature", "1/mm", SHARE, True),
    "gauss": Map("curvature_gauss", "Gaussian curvature", "1/mm²", SHARE, True),
}
_DEVIATION = Map("deviation", "deviation", "mm", 1.0, True)


def map_of(show: Show, diagonal: float) -> Map | None:
    """What the numbers of a map are, for a model of a diagonal (mm); None for what is no map."""
    match show.kind:
        case "curvature":
            return _MAPS[show.of]
        case "deviation":
            return _DEVIATION
        case "roughness":
            return Map("roughness", f"roughness below {_wavelength(show, diagonal):.3g} mm", "1/mm", SHARE, False)
    return None


def numbers_of(show: Show, diagonal: float, facets: Mapping[int, Facets], reference: Body | None) -> Field | None:
    """The numbers of a map on faces; None for what is no map. ``reference`` is what deviation is measured from."""
    match show.kind:
        case "curvature":
            return {"max": largest, "mean": mean, "gauss": gauss}[show.of]
        case "deviation":
            from mracad.view.deviation import Reference

            assert reference is not None
            return Reference.of(reference).deviation
        case "roughness":
            return _Roughness(facets, _wavelength(show, diagonal), {})
    return None


@dataclass(frozen=True, eq=False)
class _Roughness:
    """The roughness of faces, each measured when it is first asked for."""

    facets: Mapping[int, Facets]
    wavelength: float
    known: dict[int, Rough | None]

    def __call__(self, spots: Spots) -> Array:
        from mracad.view.rough import Rough

        found = np.zeros(len(spots.face))
        order = np.argsort(spots.face, kind="stable")
        for stretch in groups(spots.face[order]):
            own = order[stretch]
            face = int(spots.face[own[0]])
            if face not in self.known:
                self.known[face] = Rough.of(self.facets[face], self.wavelength)
            rough = self.known[face]
            if rough is not None:
                found[own] = rough(spots.uv[own])
        return found


def mean(spots: Spots) -> Array:
    """Mean curvature, 1/mm, positive where convex."""
    return np.asarray(spots.bends[0])


def gauss(spots: Spots) -> Array:
    """Gaussian curvature, 1/mm²."""
    return np.asarray(spots.bends[1])


def largest(spots: Spots) -> Array:
    """The larger principal curvature without its sign, 1/mm."""
    half, product = spots.bends
    return np.asarray(np.abs(half) + np.sqrt(np.maximum(half * half - product, 0.0)))


def _wavelength(show: Show, diagonal: float) -> float:
    return length(show.of, diagonal, "roughness") if show.of else WAVELENGTH * diagonal
