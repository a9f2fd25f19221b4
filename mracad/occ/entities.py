"""Faces in STEP files that this package wrote, compared entity by entity, whatever their numbers."""

from __future__ import annotations

import re

import numpy as np

Array = np.ndarray

_REFERENCE = re.compile(rb"'[^']*'|#(\d+)")
_NUMBER = re.compile(rb"[-+.0-9E]+")
_DOWN = (  # from a face to its vertices
    b"FACE_BOUND(", b"FACE_OUTER_BOUND(", b"EDGE_LOOP(", b"ORIENTED_EDGE(", b"EDGE_CURVE(", b"VERTEX_LOOP(",
    b"VERTEX_POINT(", b"SEAM_CURVE(",
)  # fmt: skip


class _File:
    """The entities of a file by number."""

    def __init__(self, text: bytes) -> None:
        start, end = text.find(b"\n#") + 2, text.rfind(b";\nENDSEC;")  # strings have no line breaks
        pieces = (piece.partition(b" = ") for piece in text[start:end].split(b";\n#"))
        self.entities = {int(number): entity for number, _, entity in pieces}
        self.faces = [number for number, entity in self.entities.items() if entity.startswith(b"ADVANCED_FACE(")]

    def entity(self, number: int) -> bytes:
        """An entity without its own number; empty where a damaged file has none."""
        return self.entities.get(number, b"")

    def below(self, number: int) -> list[int]:
        """The entities that one refers to, in order."""
        return [int(found[1]) for found in _REFERENCE.finditer(self.entity(number)) if found[1]]

    def bare(self, number: int) -> bytes:
        """An entity without the numbers of those that it refers to."""
        return _REFERENCE.sub(lambda found: b"#" if found[1] else found[0], self.entity(number))

    def middle(self, face: int) -> Array:
        """The middle of the vertices of a face; far away if it has none."""
        seen, left, points = set(), [face], []
        while left:
            number = left.pop()
            for each in self.below(number):
                entity = self.entity(each)
                if each in seen:
                    continue
                if entity.startswith(_DOWN):
                    seen.add(each)
                    left.append(each)
                elif entity.startswith(b"CARTESIAN_POINT(") and self.entity(number).startswith(b"VERTEX_POINT("):
                    points.append([float(x) for x in _NUMBER.findall(entity.rpartition(b"(")[2])])
        return np.mean(points, axis=0) if points else np.full(3, np.inf)


def alike(one: bytes, other: bytes, places: Array, near: float) -> bool:
    """Whether two files have the same faces at some places, and all that these faces consist of is the same.

    Parameters
    ----------
    one, other : bytes
        STEP files as :func:`mracad.occ.step.step` writes them.
    places : ndarray (k, 3)
        The middle of the vertices of each face that is meant, in the unit of the files.  Faces with the same one are
        all compared.
    near : float
        Largest distance of a face from its place.
    """
    files = _File(one), _File(other)
    middles = [np.array([file.middle(face) for face in file.faces]).reshape(-1, 3) for file in files]
    for place in places:
        with np.errstate(invalid="ignore"):  # a face without vertices is not found
            at = [np.flatnonzero((np.abs(each - place) <= near).all(axis=1)).tolist() for each in middles]
        if not at[0] or len(at[0]) != len(at[1]):
            return False
        if not all(_same(*files, files[0].faces[i], files[1].faces[j]) for i, j in zip(*at, strict=True)):
            return False
    return True


def _same(one: _File, other: _File, first: int, second: int) -> bool:
    """Whether two faces, and all of which they consist, say the same; curves on other surfaces are of other faces."""
    own = [one.below(first)[-1], other.below(second)[-1]]
    seen, left = {(first, second)}, [(first, second)]
    while left:
        a, b = left.pop()
        elsewhere = one.below(a)[:1] != own[:1] and other.below(b)[:1] != own[1:]
        if elsewhere and one.entity(a).startswith(b"PCURVE("):
            continue
        if one.bare(a) != other.bare(b):
            return False
        pairs = set(zip(one.below(a), other.below(b), strict=True)) - seen
        seen |= pairs
        left += pairs
    return True
