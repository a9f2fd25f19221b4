"""Matching faces of two documents, whatever their numbers and however they are cut."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping

import numpy as np

from mracad.inspect.compare.subject import Array, Match, Subject
from mracad.model.brep import Face

_STRANGE = 0.3  # largest difference in place and size between partners, as a share of the diagonal
_ALIKE = 1e-6  # share of the diagonal within which faces are in the same place and of the same size
_WHOLE = 0.03  # share of its area by which a face may differ from the sum of its parts: areas are exact to 1 %
_PROBES = 5  # number of points by which a face is found to lie on another


def match(ref: Subject, new: Subject, slack: float, by_product: bool) -> list[Match]:
    """Matching faces, in the order of the reference.

    Faces with the same number that agree in place, size, kind and product are partners; the others are paired by the
    least total difference.  A remaining face may be a part of one that was cut.

    Parameters
    ----------
    ref, new : Subject
    slack : float
        Largest distance of a part from its whole face, mm.
    by_product : bool
        Whether partners must be of products of the same name, if there is a choice.
    """
    partners = _partners(ref, new, by_product)
    slack = max(slack, _ALIKE * ref.model.diagonal)
    groups = {i: Match((i,), (j,)) for i, j in partners.items()}
    cut = _parts(ref, new, partners, slack)
    joined = _parts(new, ref, {j: i for i, j in partners.items()}, slack)
    for i, parts in cut.items():
        groups = {k: group for k, group in groups.items() if group.new[0] not in parts}
        groups[i] = Match((i,), tuple(parts))
    for j, parts in joined.items():
        groups = {k: group for k, group in groups.items() if k not in parts and j not in group.new}
        groups[parts[0]] = Match(tuple(parts), (j,))
    return [groups[i] for i in sorted(groups)]


def _partners(ref: Subject, new: Subject, by_product: bool) -> dict[int, int]:
    """Partners: new face by reference face."""
    from scipy.spatial import cKDTree

    old, fresh = _features(ref), _features(new)
    if not len(old) or not len(fresh):
        return {}
    scale = max(ref.model.diagonal, 1e-300)
    there = cKDTree(fresh).query_ball_point(old, _ALIKE * scale)
    back = cKDTree(old).query_ball_point(fresh, _ALIKE * scale)
    facing = _Facing(ref, new)

    def alone(i: int, j: int) -> bool:
        return len(there[i]) == 1 and len(back[j]) == 1

    def same(i: int) -> bool:
        kin = _kin(ref.model.faces[i], new.model.faces[i], by_product)
        return kin and (alone(i, i) or facing(i, i))

    partners = {i: i for i, found in enumerate(there) if i in found and same(i)}
    partners |= {i: found[0] for i, found in enumerate(there) if len(found) == 1 and alone(i, found[0])}
    rest = [i for i in range(len(old)) if i not in partners]
    free = sorted(set(range(len(fresh))) - set(partners.values()))
    if rest and free:
        apart = np.linalg.norm(old[rest][:, None] - fresh[free][None], axis=2) / scale
        odds = [
            [
                0.1 * (not _kin(ref.model.faces[i], new.model.faces[j], by_product))
                + 0.1 * (j in there[i] and not facing(i, j))
                for j in free
            ]
            for i in rest
        ]
        order = 1e-9 * np.abs(np.array(rest)[:, None] - np.array(free)) / (len(old) + len(fresh))
        partners |= {rest[r]: free[c] for r, c in _assigned(apart, np.array(odds) + order)}
    return dict(sorted(partners.items()))


def _assigned(apart: Array, extra: Array) -> list[tuple[int, int]]:
    """Rows and columns with the least total cost, without those too far apart."""
    from scipy.optimize import linear_sum_assignment

    rows, columns = linear_sum_assignment(np.minimum(apart, 2 * _STRANGE) + extra)
    return [(int(r), int(c)) for r, c in zip(rows, columns, strict=True) if apart[r, c] < _STRANGE]


class _Facing:
    """Whether two faces have the same orientation; each is evaluated once."""

    def __init__(self, ref: Subject, new: Subject) -> None:
        self._subjects = ref, new
        self._known: dict[tuple[int, int], Array] = {}

    def __call__(self, i: int, j: int) -> bool:
        return float(self._of(0, i) @ self._of(1, j)) >= 0

    def _of(self, side: int, face: int) -> Array:
        if (side, face) not in self._known:
            self._known[side, face] = self._subjects[side].gauge.facing(face)
        return self._known[side, face]


def _features(subject: Subject) -> Array:
    """Centre and size of each face, mm."""
    return np.array([(*face.centre, max(face.area, 0.0) ** 0.5) for face in subject.faces]).reshape(-1, 4)


def _kin(a: Face, b: Face, by_product: bool) -> bool:
    return a.kind == b.kind and (a.product == b.product or not by_product)


def _parts(whole: Subject, cut: Subject, partners: Mapping[int, int], slack: float) -> dict[int, list[int]]:
    """Faces of one document that are cut into several of the other.

    Only remaining faces, and those whose partner has another size, are considered.
    """
    taken = {j: i for i, j in partners.items()}
    left = [j for j in range(len(cut.faces)) if j not in taken]
    if not left:
        return {}
    odd = [j for j, i in taken.items() if not _sized(whole.faces[i].area, cut.faces[j].area)]
    probes = {j: _probes(cut, j) for j in (*left, *odd)}
    parts: dict[int, list[int]] = defaultdict(list)
    for j, points in probes.items():
        for i in _hosts(whole, points, slack):
            parts[i].append(j)
    for i, found in parts.items():
        partner = partners.get(i)
        if partner is not None and partner not in found and _on(whole, i, _probes(cut, partner), slack):
            found.append(partner)
    return {
        i: sorted(found)
        for i, found in parts.items()
        if len(found) > 1 and _sized(whole.faces[i].area, sum(cut.faces[j].area for j in found))
    }


def _sized(area: float, other: float) -> bool:
    return abs(other - area) <= _WHOLE * abs(area)


def _probes(subject: Subject, face: int) -> Array:
    """A few points inside a face."""
    points = subject.gauge.sample(face, (0, 0))
    return np.asarray(points[np.linspace(0, len(points) - 1, min(_PROBES, len(points))).astype(int)])


def _hosts(subject: Subject, points: Array, slack: float) -> Iterable[int]:
    """The faces on which all given points lie."""
    if len(points):
        for face in subject.model.faces:
            within = bool((points >= face.box[0] - slack).all() and (points <= face.box[1] + slack).all())
            if within and _on(subject, face.index, points, slack):
                yield face.index


def _on(subject: Subject, face: int, points: Array, slack: float) -> bool:
    return len(points) > 0 and bool((subject.gauge.face_distances(face, points) <= slack).all())
