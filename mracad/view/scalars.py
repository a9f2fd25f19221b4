"""Numbers at the points of meshes, as pictures show them: measured on the surfaces at the points' own parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mracad.errors import UsageError
from mracad.mesh.scene import Body, Legend, Node, Scene
from mracad.model.facets import Facets
from mracad.occ.facets import facets, grounds
from mracad.spec.pictures import scalar_of
from mracad.view.fields import Field, map_of, numbers_of
from mracad.view.runs import groups
from mracad.view.spots import Spots, bends, shape, steady

if TYPE_CHECKING:
    from mracad.occ.document import Document

Array = np.ndarray

CHORD, ANGLE = 2e-4, 30.0
"""Of the triangles from which nearest points are sought: a share of the diagonal, and degrees."""

_SAME = 1e-9  # of the diagonal: instances whose numbers differ by less are one body
_PLAIN = "#ffffff"  # of faces, whose points have colours


def scalars(document: Document, what: Sequence[str], *, reference: Document | None = None) -> Callable[[Scene], Scene]:
    """What gives the points of a mesh numbers and colours; for ``paint`` of :func:`mracad.occ.files.write`.

    Parameters
    ----------
    document : Document
        What is written.
    what : sequence of str
        ``"curvature:mean"``, ``"deviation"``, ``"roughness:10mm"`` …; the first gives the colours.
    reference : Document, optional
        What deviation is measured from.

    Raises
    ------
    UsageError
        For other numbers, or deviation without a reference.
    """
    shows = [scalar_of(text) for text in what]
    deviates = any(show.kind == "deviation" for show in shows)
    if deviates and reference is None:
        raise UsageError("scalar: deviation needs what it is measured from", "write deviation:REF.step")
    base = facets(reference, CHORD, ANGLE) if deviates and reference else None

    def paint(scene: Scene) -> Scene:
        size = _diagonal(scene)
        known = dict(_facets(document, scene))
        maps = [each for show in shows if (each := map_of(show, size))]
        fields = [at for show in shows if (at := numbers_of(show, size, known, base))]
        painter = _Painter(scene, known, dict(zip([m.name for m in maps], fields, strict=True)), deviates, size)
        roots = tuple(painter.node(node, np.eye(4)) for node in scene.roots)
        every = [np.concatenate([b.places.values[m.name] for b in painter.made if b.places]) for m in maps]
        scales = [m.scale(values) for m, values in zip(maps, every, strict=True)]
        legends = tuple(
            Legend(m.name, m.title, m.unit, scale.low, scale.high, float(values.min()), float(values.max()))
            for m, scale, values in zip(maps, scales, every, strict=True)
        )
        bodies = []
        for body in painter.made:
            assert body.places is not None
            shades = scales[0].colours(body.places.values[maps[0].name])
            colours = np.round(255.0 * shades).astype(np.uint8)
            bodies.append(replace(body, places=replace(body.places, colours=colours)))
        return Scene(scene.name, tuple(bodies), roots, legends)

    return paint


class _Painter:
    """Bodies with numbers at their places: one for each part, and for each instance whose numbers differ.

    Attributes
    ----------
    made : list of Body
    """

    def __init__(
        self, scene: Scene, facets: Mapping[int, Facets], fields: Mapping[str, Field], placed: bool, size: float
    ) -> None:
        self.scene, self.facets, self.fields, self.placed, self.size = scene, facets, fields, placed, size
        self.made: list[Body] = []
        self.spots: dict[int, Spots] = {}
        self.copies: dict[int, list[int]] = {}

    def node(self, node: Node, above: Array) -> Node:
        """A node and those below, with the bodies that have numbers."""
        frame = above @ node.frame
        children = tuple(self.node(child, frame) for child in node.children)
        body = None if node.body is None else self._body(node.body, frame)
        return replace(node, body=body, children=children)

    def _body(self, number: int, frame: Array) -> int:
        """The position of a body with numbers where it is placed."""
        body, copies = self.scene.bodies[number], self.copies.setdefault(number, [])
        if copies and not self.placed:
            return copies[0]
        if number not in self.spots:
            self.spots[number] = _spots(body, self.facets)
        spots = self.spots[number]
        point = frame[:3, :3] @ spots.point + frame[:3, 3:]
        values = {name: at(replace(spots, point=point)) for name, at in self.fields.items()}
        for copy in copies:
            places = self.made[copy].places
            if places and all(np.allclose(values[n], places.values[n], 0.0, _SAME * self.size) for n in values):
                return copy
        assert body.places is not None
        places = replace(body.places, normals=spots.normal.T, values=values)
        copies.append(len(self.made))
        self.made.append(replace(body, colours=(_PLAIN,) * len(body.colours), places=places))
        return copies[-1]


def _diagonal(scene: Scene) -> float:
    """The diagonal of the box of all points as placed, mm."""
    ends = np.array([[body.points.min(axis=0), body.points.max(axis=0)] for body in scene.placed()])
    return float(np.linalg.norm(ends[:, 1].max(axis=0) - ends[:, 0].min(axis=0)))


def _facets(document: Document, scene: Scene) -> Iterator[tuple[int, Facets]]:
    """The triangles of every face, and the surface under it."""
    under = grounds(document)
    for body in scene.bodies:
        assert body.places is not None
        for _, triangles in body.groups():
            face = int(body.numbers[triangles.start]) - 1
            own, corners = np.unique(body.places.corners[triangles], return_inverse=True)
            points, uv = body.points[body.places.point[own]], body.places.uv[own]
            yield face, Facets(face, points, uv, corners.reshape(-1, 3), *under[face], {})


def _spots(body: Body, known: Mapping[int, Facets]) -> Spots:
    """The places of a body on the surfaces, in its own frame."""
    places = body.places
    assert places is not None
    count = len(places.point)
    face, triangle = np.empty((2, count), int)
    face[places.corners] = body.numbers[:, None] - 1
    triangle[places.corners] = np.arange(len(places.corners))[:, None]
    middle = places.uv[places.corners[triangle]].mean(axis=1)
    point, normal, bend = np.empty((3, count)), np.empty((3, count)), np.empty((2, count))
    order = np.argsort(face, kind="stable")
    for own in (order[stretch] for stretch in groups(face[order])):
        facets = known[int(face[own[0]])]
        inner = middle[own]
        jet = steady(facets.ground, places.uv[own], 2, inner.__getitem__).swapaxes(1, 2)
        outward, curved = shape(jet)
        point[:, own], normal[:, own] = jet[0], facets.outward * outward
        bend[:, own] = bends(curved, np.full(len(own), facets.outward))
    return Spots(face, places.uv, point, normal, bend)
