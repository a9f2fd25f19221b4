"""Surveyed faces along displacements of their surfaces, taken in any amount."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from mracad.bspline.surface import Net
from mracad.inspect.creases import Tangents
from mracad.inspect.curvature import Forms
from mracad.inspect.roughness import Change
from mracad.inspect.survey import Survey, largest, roughness
from mracad.inspect.sweep import NOISY
from mracad.inspect.tally import Tally

Array = np.ndarray

STEEP = 20.0
"""Where noise is being removed, normals that turn by more than this, degrees, are compared with those around, too."""

_STEEP = 2 * np.sin(np.radians(STEEP / 2))

STEADY = 0.05
"""Weight of a turn of the normal at a singular point, per radian, against a relative change of its curvature."""


@dataclass(frozen=True, eq=False)
class Ramp:
    """Surveyed faces along displacements.

    Attributes
    ----------
    surveyed : sequence of Survey
    offsets : sequence of ndarray (nu, nv, 3)
        The whole displacement of the surface of each, mm.
    lasting : bool
        Whether what the whole displacements add is kept for other amounts.
    """

    surveyed: Sequence[Survey]
    offsets: Sequence[Array]
    lasting: bool = True
    _slopes: dict[int, _Slope] = field(default_factory=dict)

    def changes(self, amounts: Mapping[int, float]) -> dict[int, Change]:
        """The changes of some of the faces, by position, each after the given amount of its displacement."""
        return {i: self._change(i, amount) for i, amount in amounts.items()}

    def _change(self, i: int, amount: float) -> Change:
        survey = self.surveyed[i]
        slope = self._slopes.get(i) or _Slope.of(survey, self.offsets[i])
        if self.lasting:
            self._slopes[i] = slope
        return _change(survey, slope, amount)


@dataclass(frozen=True, eq=False)
class _Slope:
    """What a whole displacement adds to a face.

    Attributes
    ----------
    offset : ndarray (nu, nv, 3)
        The displacement, mm.
    along : ndarray
        What is added to derivatives along u.
    deviation, motion : float
        Largest motion along the normal, and in any direction, mm.
    tangents : list of Tangents
        At places where they may jump.
    """

    offset: Array
    along: Array
    deviation: float
    motion: float
    tangents: Sequence[Tangents]

    @classmethod
    def of(cls, survey: Survey, offset: Array) -> _Slope:
        net = survey.net.with_poles(offset)
        tangents = [each.crossing.tangents(net) for each in survey.crossed]
        return cls(offset, *survey.sight.added(net, survey.marks), tangents)


def _change(survey: Survey, slope: _Slope, amount: float) -> Change:
    """The change of a face after an amount of a displacement."""
    net = survey.net.with_poles(survey.net.poles + amount * slope.offset)
    along, places = survey.along + amount * slope.along, survey.places
    tally = survey.sight.tally(along, survey.marks) if amount else survey.tally
    turned, unsettled = _normals(survey, along, tally)
    now = list(_angles(survey, slope, net, amount))
    opened = [angles - each.angles for each, angles in zip(survey.crossed, now, strict=True)]
    return Change(
        survey.roughness,
        roughness(tally, largest(now)),
        survey.noise,
        float(np.degrees(largest(opened))),
        float(np.degrees(turned.max(initial=0.0))),
        amount * slope.deviation,
        amount * slope.motion,
        float(unsettled.max(initial=0.0)),
        places.compared(tally, turned, unsettled, opened) if places else None,
    )


def _normals(survey: Survey, along: Array, tally: Tally) -> tuple[Array, Array]:
    """Turns of normals, radians, and changes of singular points: the largest of each place."""
    chords, unsettled = tally.tops[2], np.zeros(survey.marks.places)
    if survey.singular or (chords.max(initial=0.0) > _STEEP and tally.sums[6].sum() >= 0):
        form = survey.sight.forms(along)
        place = survey.sight.pairs(*survey.marks.strips, np.add)
        np.maximum.at(unsettled, place, _unsettled(survey, form))
        chords = np.zeros(survey.marks.places)
        np.maximum.at(chords, place, _turned(survey, form).astype(float))
    return 2 * np.arcsin(np.minimum(chords / 2, 1.0)), unsettled


def _angles(survey: Survey, slope: _Slope, net: Net, amount: float) -> Iterator[Array]:
    """The angles at places where tangents may jump, of a displaced net."""
    for each, added in zip(survey.crossed, slope.tangents, strict=True):
        (su, sv), (tu, tv) = each.tangents, added
        yield each.crossing.angles(net, (su + amount * tu, sv + amount * tv))


def _unsettled(survey: Survey, form: Forms) -> Array:
    """Relative change of curvature, or turn of normals, at points that stay singular; 0 elsewhere, ``(q,)``."""
    found, those = np.zeros(len(survey.sharp)), survey.sharp > 0
    if those.any():
        before, after = survey.sharp[those], form.largest[those]
        change = np.where(after > before.min(), np.abs(after / before - 1), 0.0)
        turned = np.linalg.norm(form.normal[:, those].astype(np.float32) - survey.marks.normals[:, those], axis=0)
        found[those] = np.maximum(change, STEADY * turned)
    return found


def _turned(survey: Survey, form: Forms) -> Array:
    """Distances of normals from those before, as chords, ``(q,)``.

    If noise is removed all over the face, large turns are measured to the nearest normal within one span: removing
    noise turns a normal towards its neighbours, whereas a fold turns it over.
    """
    normals, regular = form.normal.astype(np.float32), survey.marks.counts > 0
    counted = form.regular & regular
    off = np.where(counted, np.linalg.norm(normals - survey.marks.normals, axis=0), 0.0)
    rule = survey.rule
    if (off > _STEEP).any() and np.median(off[counted]) > NOISY:
        reach, mask = (rule.v.shape[1], rule.u.shape[1]), rule.mask.T
        place = np.full(mask.shape, -1)
        place[mask] = np.where(regular, np.arange(len(off)), -1)
        place = np.pad(place, [(r, r) for r in reach], constant_values=-1)
        row, column = np.nonzero(mask)
        steps = np.ndindex(2 * reach[0] + 1, 2 * reach[1] + 1)
        for down, right in sorted(steps, key=lambda step: float(np.abs(np.subtract(step, reach)).sum())):
            those = np.flatnonzero(off > _STEEP)
            beside = place[row[those] + down, column[those] + right]
            near = np.linalg.norm(normals[:, those] - survey.marks.normals[:, beside], axis=0)
            off[those] = np.where(beside < 0, off[those], np.minimum(off[those], near))
    return off
