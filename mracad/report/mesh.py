"""Triangles of a model in a few bytes, for browsers: coordinates of 16 bits, normals as octahedra, deflated."""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mracad.bspline.vectors import cross
from mracad.errors import FileError
from mracad.model.facets import Body, Facets
from mracad.occ.document import Document
from mracad.occ.facets import facets
from mracad.report.shades import Shades, shades
from mracad.view.colours import CLAY, rgb

Array = np.ndarray

MOST = 150_000
"""Largest number of triangles in pages; coarser ones are made beyond that."""

CHORD, ANGLE = 4e-4, 18.0
"""Distance of the first triangles from the surface, as a share of the diagonal, and their turn, degrees."""

_COARSER, _TRIES = 2.5, 6
_STEPS = 65535
_FLAT = 1e-9  # of the product of the lengths of S_u and S_v: the normal is that of triangles


@dataclass(frozen=True, eq=False)
class Mesh:
    """A model for browsers.

    Attributes
    ----------
    head : mapping
        What the numbers are: the box, the faces with the counts of their points, triangles and edge segments, the
        bodies, and where they stand; JSON-ready.
    data : bytes
        Deflated: for all points three coordinates (16 bits) in the box, then octahedral normals (2 × 16 bits), the
        corners of triangles and the ends of edge segments, as numbers of points of their face.
    triangles : int
        Number of triangles, each face once.
    chord : float
        Largest distance of triangles from the surface, mm.
    shades : Shades or None
        Deviation as colours, from a reference if there is one.
    """

    head: Mapping[str, Any]
    data: bytes
    triangles: int
    chord: float
    shades: Shades | None = None


def mesh(
    document: Document, names: Mapping[int, str], reference: Document | None = None, most: int = MOST
) -> Mesh | None:
    """The mesh of a document; None where even the coarsest has more triangles than a browser should be given.

    Parameters
    ----------
    document : Document
    names : mapping of int to str
        What faces are called, by index.
    reference : Document, optional
        What deviation is measured from.
    most : int
        Largest number of triangles, each face once.

    Raises
    ------
    FileError
        When nothing can be meshed.
    """
    chord, angle = CHORD, ANGLE
    for _ in range(_TRIES):
        body = facets(document, chord, angle)
        count = sum(len(each.corners) for each in body.facets.values())
        if not count:
            raise FileError(f"'{document.name}' cannot be meshed", "check its geometry")
        if count <= most:
            other = facets(reference, chord, angle) if reference else None
            shown = shades(body, sorted(body.facets), other) if other and other.facets else None
            return replace(_packed(body, names, count, chord * body.diagonal), shades=shown)
        chord, angle = chord * _COARSER, min(angle * _COARSER, 90.0)
    return None


def _packed(body: Body, names: Mapping[int, str], count: int, chord: float) -> Mesh:
    every = sorted(body.facets)
    points = np.concatenate([body.facets[face].points for face in every])
    low, high = points.min(axis=0), points.max(axis=0)
    step = np.where(high > low, (high - low) / _STEPS, 1.0)
    rims = {face: _segments(body.facets[face]) for face in every}
    wide = max(len(body.facets[face].points) for face in every) > _STEPS
    parts = [
        np.round((points - low) / step).astype("<u2"),
        np.concatenate([octahedral(normals(body.facets[face])) for face in every]),
        *(body.facets[face].corners.astype("<u4" if wide else "<u2") for face in every),
        *(rims[face].astype("<u4" if wide else "<u2") for face in every),
    ]
    place = {face: k for k, face in enumerate(every)}
    kinds: dict[tuple[tuple[int, str], ...], int] = {}
    stands = []
    for each in body.placed:
        own = tuple((place[f], c) for f, c in zip(each.faces, each.colours, strict=True) if f in place)
        if own:
            stands.append({"body": kinds.setdefault(own, len(kinds)), "frame": each.frame.T.ravel().tolist()})
    head = {
        "low": low.tolist(),
        "step": step.tolist(),
        "wide": wide,
        "clay": [round(255 * float(x)) for x in rgb(CLAY)],
        "faces": [
            [
                face + 1,
                names.get(face, ""),
                len(body.facets[face].points),
                len(body.facets[face].corners),
                len(rims[face]),
            ]
            for face in every
        ],
        "bodies": [{"faces": [k for k, _ in own], "colours": [colour for _, colour in own]} for own in kinds],
        "placed": stands,
        "box": _extent(body).tolist(),
    }
    return Mesh(head, zlib.compress(b"".join(part.tobytes() for part in parts), 9), count, chord)


def _extent(body: Body) -> Array:
    """The box of all points as placed."""
    ends = []
    for place in body.placed:
        own = [body.facets[face].points for face in place.faces if face in body.facets]
        if own:
            points = np.concatenate(own) @ place.frame[:3, :3].T + place.frame[:3, 3]
            ends += [points.min(axis=0), points.max(axis=0)]
    return np.array([np.min(ends, axis=0), np.max(ends, axis=0)])


def _segments(face: Facets) -> Array:
    """The segments of edges, ``(n, 2)``."""
    found: Sequence[Array] = [np.stack([along[:-1], along[1:]], axis=1) for along in face.rims.values()]
    return np.concatenate([np.empty((0, 2), int), *found])


def normals(face: Facets) -> Array:
    """Outward unit normals ``(n, 3)`` of the surface at the points of a face; of its triangles where it has none."""
    _, su, sv = face.ground.jets(face.uv, 1)
    found = face.outward * cross(su, sv)
    size = np.linalg.norm(found, axis=1)
    most = np.linalg.norm(su, axis=1) * np.linalg.norm(sv, axis=1)
    flat = ~(size > _FLAT * most)
    if flat.any():
        a, b, c = face.points[face.corners.T]
        around, own = np.zeros_like(face.points), cross(b - a, c - a)
        for corner in face.corners.T:
            np.add.at(around, corner, own)
        found = np.where(flat[:, None], around, found)
        size = np.linalg.norm(found, axis=1)
    found[size == 0.0] = [0.0, 0.0, 1.0]
    return np.asarray(found / np.where(size == 0.0, 1.0, size)[:, None])


def octahedral(normals: Array) -> Array:
    """Unit vectors ``(n, 3)`` unfolded from an octahedron onto a square, two numbers of 16 bits each.

    Meyer et al., *On floating-point normal vectors*, 2010.
    """
    flat = normals / np.abs(normals).sum(axis=1, keepdims=True)
    x, y = flat[:, 0], flat[:, 1]
    below = flat[:, 2] < 0.0
    folded = np.stack([(1.0 - np.abs(y)) * np.where(x < 0, -1.0, 1.0), (1.0 - np.abs(x)) * np.where(y < 0, -1.0, 1.0)])
    return np.asarray(np.round(32767 * np.where(below, folded, [x, y])).T.astype("<i2"))
