"""Sweeps: points of a surface are moved; its coarse shape follows them, and its details turn with the coarse shape.

The coarse shape moves by the least displacement that goes through the points (:mod:`mracad.seam.anchor`), with the ℓ of
the scale; details turn with it (:mod:`mracad.edit.ride`).  Because details also move the points, the goals of the
coarse shape are corrected for that, and a last least displacement takes the points exactly to their goals.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from msgspec import structs

from mracad.bspline.fit import evenly
from mracad.bspline.surface import Net
from mracad.edit.bound import reached
from mracad.edit.led import Led, led
from mracad.edit.result import Edit
from mracad.edit.ride import Rider
from mracad.edit.target import Sheet, Wish, stiffness
from mracad.edit.tolerances import TURNED, tolerances
from mracad.edit.whole import edited
from mracad.errors import EditError
from mracad.inspect.roughness import Growth, Rougher
from mracad.model.brep import Face, Model
from mracad.model.cells import quadrature
from mracad.seam.anchor import Anchors
from mracad.seam.energy import forms, slopes
from mracad.seam.interface import Joints
from mracad.seam.ladders import Creases
from mracad.seam.solve import Problem, Soft, Space
from mracad.seam.space import MOST_POINTS
from mracad.spec.quantity import length
from mracad.spec.select import Scope
from mracad.spec.select import scope as scope_of
from mracad.spec.steps.shape import Sweep
from mracad.wavelet.ladder import arc_lengths

Array = np.ndarray

REACH = 3.0
"""Number of scales from the points beyond which surfaces stay: a move has faded to 1e-5 there."""

SPANS = 8.0, 6.0, 4.0
"""Numbers of parts of a scale into which spans in reach are divided: as many as the surface has room for."""

COARSE = 1.4
"""Wavelength of the coarse shape on which details turn, in scales: details within that shape would turn only partly."""

ROUNDS = 8
"""Largest number of corrections of the goals of the coarse shape."""

MET = 1e-7
"""Largest distance of points from their goals, mm."""

FREE = 0.01
"""Least freedom of a point, see :class:`mracad.seam.anchor.Anchors`: with less, the surface beside it would move much
farther."""

WITHIN = 0.999
"""Share of a limit of the deviation that is aimed at."""

FARTHER = 3.0
"""Largest motion over the largest that was asked for: contradicting points move other places far."""


@dataclass(frozen=True)
class Through(Wish):
    """The wish of a sweep.

    Attributes
    ----------
    scale : float
        Scale, mm.
    points : Led
        The points, and how far they move.
    refine : bool
        Whether knots may be inserted where spans are long for the scale.
    """

    scale: float
    points: Led
    refine: bool = True
    spread: ClassVar[float] = np.inf
    fairs: ClassVar[bool] = False
    whole: ClassVar[bool] = True
    fades: ClassVar[bool] = False
    limited: ClassVar[bool] = True  # the metric keeps the lengths of rounds
    growth: ClassVar[Growth] = TURNED

    def wavelength(self, net: Net, faces: Sequence[Face], creases: Creases) -> float:
        """The scale."""
        return self.scale

    def space(self, net: Net, faces: Sequence[Face]) -> Net:
        """The surface, with spans in reach of a point divided so that they can follow."""
        if not self.refine:
            return net
        near = [self._near(net, faces, axis) for axis in (0, 1)]
        for parts in SPANS:
            pieces = [
                np.where(on, np.ceil(arc_lengths(net, axis) / self.scale * parts - 1e-9), 1).astype(int)
                for axis, on in enumerate(near)
            ]
            fine = net.refined(*(evenly(k, np.maximum(p, 1)) for k, p in zip((net.u, net.v), pieces, strict=True)))
            if fine.u.count * fine.v.count <= max(MOST_POINTS, net.u.count * net.v.count):
                return fine
        return net

    def _near(self, net: Net, faces: Sequence[Face], axis: int) -> Array:
        """Mask of the spans along an axis that are within reach of a point, ``(spans,)``."""
        knots, other = (net.u, net.v)[:: 1 - 2 * axis]
        along = np.linspace(knots.breaks[:-1], knots.breaks[1:], 5, axis=1).ravel()
        across = np.linspace(*other.domain, 4 * other.spans + 1)
        us, vs = (along, across)[:: 1 - 2 * axis]
        points = np.asarray(net.grid(us, vs))
        away = self.points.away(faces, points).min(axis=1 - axis)
        return np.asarray(away.reshape(knots.spans, -1).min(axis=1) <= REACH * self.scale)

    def detail(self, alone: Problem, sheet: Sheet) -> float:
        """The largest move, if the surface is in reach of a point."""
        points = np.asarray(sheet.net.grid(sheet.net.u.greville(), sheet.net.v.greville()))
        near = self.points.away(sheet.faces, points).min() <= REACH * self.scale
        return self.points.largest if near or sheet.index in self.points.places else 0.0

    def target(self, problem: Problem, sheets: Mapping[int, Sheet], joined: Joints) -> Array:
        """The displacement that moves the points of these surfaces to their goals, ``(points, 3)``."""
        places = {i: self.points.places[i] for i in problem.spaces if i in self.points.places}
        if not places:
            return np.zeros_like(problem.f)
        stiff = stiffness(self.scale)
        plain = _plain(problem, sheets)
        anchors = Anchors.of(_tense(plain, sheets, stiff), places, stiff)
        self.points.refuse(places, anchors.freedom < FREE, "is held, or too near to something held")
        goal = np.concatenate([self.points.moves[i] for i in places])
        still = np.zeros_like(problem.f)
        rider = Rider(plain, COARSE * self.scale)
        ride, missed = still, np.inf
        for _ in range(ROUNDS):
            delta = anchors.led(still, goal - anchors.matrix @ ride)
            last, ride = ride, rider.carried(delta)
            missed, before = float(np.abs(anchors.matrix @ (ride - last)).max()), missed
            if missed <= MET or not missed < before:
                break
        found = anchors.led(plain.nearest(delta + ride, beyond=True), goal)
        self._check(anchors, found, places)
        return found

    def _check(self, anchors: Anchors, found: Array, places: Mapping[int, Array]) -> None:
        """Raise EditError for points that cannot be met, or only with other places moving far."""
        goal = np.concatenate([self.points.moves[i] for i in places])
        missed = np.abs(anchors.matrix @ found - goal).max(axis=1) > MET
        self.points.refuse(places, missed, "cannot be met together with the others")
        if np.linalg.norm(found, axis=1).max() > FARTHER * self.points.largest:
            self.points.refuse(places, np.ones(len(goal), bool), "would move other places much farther")

    def ways(self, problem: Problem, target: Array, width: float) -> Iterable[Iterable[Array]]:
        """The target itself: it is admissible."""
        yield [target]


def _plain(problem: Problem, sheets: Mapping[int, Sheet]) -> Problem:
    """The same problem with equal lengths in all directions: rounds do not limit how far a sweep spreads."""
    spaces = {}
    for i, space in problem.spaces.items():
        sheet = sheets[i]
        form = forms(space.net, sheet.metric, quadrature(space.net, sheet.faces), sheet.creases)
        spaces[i] = replace(space, forms=form)
    return _like(problem, spaces)


def _tense(problem: Problem, sheets: Mapping[int, Sheet], stiff: float) -> Problem:
    """The same problem with the form M + 2 ℓ² G + ℓ⁴ K, G of gradients, for the stiffness ℓ⁴."""
    spaces = {}
    for i, space in problem.spaces.items():
        slope = slopes(space.net, sheets[i].metric, quadrature(space.net, sheets[i].faces))
        form = replace(space.forms, bending=space.forms.bending + 2 / np.sqrt(stiff) * slope)
        spaces[i] = replace(space, forms=form)
    return _like(problem, spaces)


def _like(problem: Problem, spaces: Mapping[int, Space]) -> Problem:
    """A problem with other spaces, joined and held in the same way, with nothing to mend."""
    soft = None if problem.soft is None else Soft(problem.soft, between=problem.between)
    return Problem(spaces, problem.rows, soft=soft, effort=problem.effort)


def sweep(
    model: Model,
    options: Sweep,
    *,
    scope: Scope | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Edit:
    """Move points of the NURBS faces of a model; parameters as for :func:`mracad.edit.whole.edited`.

    Raises
    ------
    EditError
        For points that are held or not on the faces to edit, and if the surface would fold.
    """
    scope = scope or scope_of(model, options)
    scale, bound = length(options.scale, model.diagonal, "scale"), tolerances(model, options).deviation
    points = led(model, options, scope, scale)
    plain = structs.replace(options, amount=1.0 if options.amount else 0.0, max_deviation=None)

    def swept(share: float) -> Edit:
        wish = Through(scale, points.times(share), options.refine == "auto")
        edit = edited(model, plain, wish, scope, progress)
        if plain.amount:
            _refuse_missed(model, edit, wish.points)
        outcomes = tuple(replace(each, amount=share * each.amount) for each in edit.outcomes)
        return replace(edit, outcomes=outcomes)

    share = options.amount or 1.0
    edit = swept(share)
    for _ in range(ROUNDS):
        far = reached(model, edit)
        if far <= bound:
            return edit
        share *= WITHIN * bound / far
        edit = swept(share)
    raise EditError(f"{model.name}: no sweep stays within {options.max_deviation}", "allow more, or move points less")


def _refuse_missed(model: Model, edit: Edit, points: Led) -> None:
    """Raise EditError if points did not reach their goals."""
    for surface, places in points.places.items():
        net, moved = model.surfaces[surface].net, np.zeros((len(places), 3))
        if surface in edit.displacement.offsets:
            moved = edit.displacement.offsets[surface].motion(net).evaluate(places)
        missed = np.linalg.norm(moved - points.moves[surface], axis=1) > 10 * MET
        if missed.any():
            name = points.labels[surface][int(np.flatnonzero(missed)[0])]
            own = [outcome for outcome in edit.outcomes if outcome.face in model.surfaces[surface].faces]
            face = next((each for each in own if each.status in ("edited", "left")), own[0])
            judged = face.status == "edited" or face.said == Rougher.FOLD.value  # part of the sweep would not fold
            why = "would fold" if judged else face.words
            raise EditError(
                f"{name} cannot go there: #{face.face + 1} {why}", "move it less far, or at a larger --scale"
            )
