"""Surveyed faces along displacements of their surfaces, taken in any amount.

The derivatives of a displaced surface are linear in the amount a, for rational surfaces too, as their weights stay:

    ∂(f + a δ) = ∂f + a ∂δ

so those of f are taken from the survey, those of δ are computed once, and every amount costs a sum of the two.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from mracad.bspline.jets import blocks, jets
from mracad.inspect.creases import Tangents
from mracad.inspect.curvature import Forms, forms, forms_along
from mracad.inspect.roughness import Change
from mracad.inspect.survey import Survey, largest, roughness

Array = np.ndarray

NOISY, STEEP = 1.0, 20.0
"""If normals turn by more than the first in the median, degrees, noise is being removed; those that turn by more than
the second are then also compared with those around."""

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
    """

    surveyed: Sequence[Survey]
    offsets: Sequence[Array]
    _slopes: dict[int, _Slope] = field(default_factory=dict)

    def changes(self, amounts: Mapping[int, float]) -> dict[int, Change]:
        """The changes of some of the faces, by position, each after the given amount of its displacement."""
        for i in amounts.keys() - self._slopes.keys():
            self._slopes[i] = _Slope.of(self.surveyed[i], self.offsets[i])
        return {
            i: _change(self.surveyed[i], self._slopes[i], amounts[i], form) for i, form in self._forms(amounts).items()
        }

    def forget(self) -> None:
        """Drop derivatives, to compute them again where more amounts are asked for."""
        self._slopes.clear()

    def _forms(self, amounts: Mapping[int, float]) -> dict[int, Forms]:
        """The forms of faces; those with few points are computed together."""
        few, found = {}, {}
        for i, amount in amounts.items():
            before, added = self.surveyed[i].jet, self._slopes[i].jet
            if before is None or added is None:
                found[i] = _in_blocks(self.surveyed[i], amount * self.offsets[i])
            else:
                few[i] = before, added, amount
        return found | dict(zip(few, forms_along(list(few.values())), strict=True)) if few else found


@dataclass(frozen=True, eq=False)
class _Slope:
    """What a whole displacement adds to a face.

    Attributes
    ----------
    offset : ndarray (nu, nv, 3)
        The displacement, mm.
    jet : ndarray (10, 3, q) or None
        Derivatives at the points of the survey, if those before are kept.
    deviation, motion : float
        Largest motion along the normal, and in any direction, mm.
    tangents : list of Tangents
        At places where they may jump.
    """

    offset: Array
    jet: Array | None
    deviation: float
    motion: float
    tangents: Sequence[Tangents]

    @classmethod
    def of(cls, survey: Survey, offset: Array) -> _Slope:
        net, rule = survey.net.with_poles(offset), survey.rule
        jet = jets(net, rule.u, rule.v, rule.mask, np.zeros(3), 3 if survey.jet is not None else 0)
        deviation = float(np.abs((jet[0] * survey.normals).sum(axis=0)).max(initial=0.0))
        motion = float(np.sqrt((jet[0] ** 2).sum(axis=0).max(initial=0.0)))
        tangents = [each.crossing.tangents(net) for each in survey.crossed]
        return cls(offset, jet if survey.jet is not None else None, deviation, motion, tangents)


def _in_blocks(survey: Survey, offset: Array) -> Forms:
    """The forms of a face at many points after a displacement."""
    net, rule = survey.net.with_poles(survey.net.poles + offset), survey.rule
    parts = (forms(part) for part in blocks(net, rule.u, rule.v, rule.mask, survey.centre))
    return Forms.joined(parts, len(survey.weights))


def _change(survey: Survey, slope: _Slope, amount: float, form: Forms) -> Change:
    """The change of a face after an amount of a displacement, with its forms there."""
    both = form.regular & survey.regular
    turned = 2 * np.arcsin(np.minimum(_turned(survey, form.normal.astype(np.float32), both) / 2, 1.0))
    now = list(_angles(survey, slope, amount))
    opened = [(each.crossing, angles - each.angles) for each, angles in zip(survey.crossed, now, strict=True)]
    areas, unsettled, places = survey.weights * form.density, _unsettled(survey, form), survey.places
    return Change(
        survey.roughness,
        roughness(areas, form, survey.regular, survey.rounding, largest(now)),
        survey.noise,
        np.degrees(largest(grew for _, grew in opened)).item(),
        np.degrees(turned.max(initial=0.0)).item(),
        amount * slope.deviation,
        amount * slope.motion,
        float(unsettled.max(initial=0.0)),
        places.compared(form, areas * survey.regular, turned, unsettled, opened) if places else None,
    )


def _angles(survey: Survey, slope: _Slope, amount: float) -> Iterator[Array]:
    """The angles at places where tangents may jump."""
    if survey.crossed:
        net = survey.net.with_poles(survey.net.poles + amount * slope.offset)
    for each, added in zip(survey.crossed, slope.tangents, strict=True):
        sides = zip(each.tangents, added, strict=True)
        now = [(su + amount * tu, sv + amount * tv) for (su, sv), (tu, tv) in sides]
        yield each.crossing.angles(net, now)


def _unsettled(survey: Survey, form: Forms) -> Array:
    """Relative change of curvature, or turn of normals, at points that stay singular; 0 elsewhere, ``(q,)``."""
    found, those = np.zeros(len(survey.sharp)), survey.sharp > 0
    if those.any():
        before, after = survey.sharp[those], form.largest[those]
        change = np.where(after > before.min(), np.abs(after / before - 1), 0.0)
        turned = np.linalg.norm(form.normal[:, those].astype(np.float32) - survey.normals[:, those], axis=0)
        found[those] = np.maximum(change, STEADY * turned)
    return found


def _turned(survey: Survey, normals: Array, counted: Array) -> Array:
    """Distances of normals ``(3, q)`` from those before, as chords, ``(q,)``.

    If noise is removed all over the face, large turns are measured to the nearest normal within one span: removing
    noise turns a normal towards its neighbours, whereas a fold turns it over.
    """
    off = np.where(counted, np.linalg.norm(normals - survey.normals, axis=0), 0.0)
    rule, (noisy, most) = survey.rule, 2 * np.sin(np.radians([NOISY / 2, STEEP / 2]))
    if (off > most).any() and np.median(off[counted]) > noisy:
        reach, mask = (rule.v.shape[1], rule.u.shape[1]), rule.mask.T
        place = np.full(mask.shape, -1)
        place[mask] = np.where(survey.regular, np.arange(len(off)), -1)
        place = np.pad(place, [(r, r) for r in reach], constant_values=-1)
        row, column = np.nonzero(mask)
        steps = np.ndindex(2 * reach[0] + 1, 2 * reach[1] + 1)
        for down, right in sorted(steps, key=lambda step: float(np.abs(np.subtract(step, reach)).sum())):
            those = np.flatnonzero(off > most)
            beside = place[row[those] + down, column[those] + right]
            near = np.linalg.norm(normals[:, those] - survey.normals[:, beside], axis=0)
            off[those] = np.where(beside < 0, off[those], np.minimum(off[those], near))
    return off
