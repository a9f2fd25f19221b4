"""Deviation as colours on the triangles of a model: long triangles are divided, so that detail is not stepped over."""

from __future__ import annotations

import base64
import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np

from mracad.model.facets import Body, Facets, Placed
from mracad.spec.pictures import Show
from mracad.view.deviation import Reference
from mracad.view.fields import Scale, map_of

Array = np.ndarray

SAMPLES = 40_000
"""Number of places on all triangles beyond their corners, about."""

MOST = 400_000
"""Largest number of places in all."""

COUNT = 255
"""Number of colours; the middle one is that of no deviation."""

_PARTS = 255  # of a side of a triangle
_COARSER = 1.25
_STOPS = 17  # of the gradient of the bar


@dataclass(frozen=True, eq=False)
class Shades:
    """Deviation on the triangles of a mesh, for browsers.

    Attributes
    ----------
    data : bytes
        Deflated: for each triangle the number of parts of its sides (8 bits); then for each instance and each of its
        faces the colours (8 bits) at its points, and for each triangle of more than one part those of its grid, row by
        row from the first corner to the second, in each towards the third.
    bar : Scale
        What the colours stand for, mm.
    lowest, highest : float
        mm.
    """

    data: bytes
    bar: Scale
    lowest: float
    highest: float

    @property
    def head(self) -> dict[str, Any]:
        """JSON-ready: the red, green and blue of each colour (8 bits), as base64."""
        return {"table": base64.b64encode(self._colours(COUNT).tobytes()).decode()}

    @property
    def gradient(self) -> str:
        """The colours as CSS, from the lowest value to the highest."""
        return ", ".join("rgb({} {} {})".format(*each) for each in self._colours(_STOPS).tolist())

    @property
    def marks(self) -> list[str]:
        """Numbers along the bar."""
        return [f"{each:.3g}".replace("-", "−") for each in np.linspace(self.bar.low, self.bar.high, 5).tolist()]

    def _colours(self, count: int) -> Array:
        found = self.bar.colours(np.linspace(self.bar.low, self.bar.high, count))
        return np.asarray((255.0 * found + 0.5).astype(np.uint8))


def shades(body: Body, faces: list[int], reference: Body) -> Shades | None:
    """Deviation of a body from another one; None where that would be too much for a browser.

    Parameters
    ----------
    body : Body
    faces : list of int
        The faces in their order.
    reference : Body
    """
    parts = _parts(body, faces)
    entries = [(place, face) for place in body.placed for face in place.faces if face in body.facets]
    grids = {face: _grid(body.facets[face], parts[face]) for face in faces}
    points = [_placed(place, body.facets[face], grids[face]) for place, face in entries]
    if sum(map(len, points)) > MOST:
        return None
    found = Reference.of(reference).distances(np.concatenate(points))
    shown = map_of(Show("deviation"), body.diagonal)
    assert shown is not None
    bar = shown.scale(found)
    coded = np.clip(np.round((found / bar.high + 1.0) * (COUNT // 2)), 0, COUNT - 1).astype(np.uint8)
    sides = np.concatenate([parts[face] for face in faces]).astype(np.uint8)
    data = zlib.compress(sides.tobytes() + coded.tobytes(), 9)
    return Shades(data, bar, float(found.min()), float(found.max()))


def _parts(body: Body, faces: list[int]) -> dict[int, Array]:
    """Into how many parts the sides of each triangle are divided."""
    corners = {face: body.facets[face].points[body.facets[face].corners] for face in faces}
    longest = {
        face: np.linalg.norm(each - np.roll(each, 1, axis=1), axis=2).max(axis=1) for face, each in corners.items()
    }
    every = np.concatenate([longest[face] for face in faces])
    shown = np.concatenate([np.full(len(longest[face]), _instances(body, face)) for face in faces])
    step = float(every.max()) / _PARTS
    while ((count := np.ceil(every / step)) * (count + 3) * shown * (count > 1)).sum() > 2 * SAMPLES:
        step *= _COARSER
    return {face: np.maximum(np.ceil(longest[face] / step), 1).astype(int) for face in faces}


def _instances(body: Body, face: int) -> int:
    return sum(face in place.faces for place in body.placed)


def _grid(facets: Facets, parts: Array) -> Array:
    """Parameters of the points of a face, and of the grids of its divided triangles."""
    found = [facets.uv]
    for count, corners in zip(parts.tolist(), facets.uv[facets.corners], strict=True):
        if count > 1:
            i, j = np.array([(i, j) for i in range(count + 1) for j in range(count + 1 - i)]).T / count
            found.append(np.stack([1.0 - i - j, i, j], axis=1) @ corners)
    return np.concatenate(found)


def _placed(place: Placed, facets: Facets, uv: Array) -> Array:
    """Points of the surface, as placed."""
    return np.asarray(facets.ground.jets(uv, 1)[0] @ place.frame[:3, :3].T + place.frame[:3, 3])
