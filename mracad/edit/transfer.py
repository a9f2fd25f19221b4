"""Transfer: the detail of faces of another model, or of a file of details, put on the faces of this one.

With d the detail of a face in a band of wavelengths and d' that of the other at the corresponding points, a face gets
(s − 1) d + s' d': s = s' = 1 adds, s = 0 and s' = 1 replaces, s = 1 − b and s' = b blends, band by band.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mracad.edit.atlas import charts, corners
from mracad.edit.character import NOTHING, Along, Carried, Character, Nearest, wide_enough
from mracad.edit.detailed import Detailed, detailed
from mracad.edit.details import Detail
from mracad.edit.feature.edits import FACE, transferred
from mracad.edit.feature.fit import MISSED
from mracad.edit.feature.ground import Ground
from mracad.edit.feature.ideal import Way
from mracad.edit.feature.locate import face_number, patch_of
from mracad.edit.feature.patch import Patch
from mracad.edit.mra import load
from mracad.edit.result import Edit, Reason
from mracad.edit.texture import Grown, grown
from mracad.errors import EditError, UsageError
from mracad.model.brep import Model
from mracad.spec.places import is_feature
from mracad.spec.quantity import length
from mracad.spec.select import Scope
from mracad.spec.select import scope as scope_of
from mracad.spec.steps import Transfer
from mracad.spec.steps.shape import bands_apart

Array = np.ndarray
Shares = Sequence[tuple[float, float, float, float]]
"""Least and largest wavelength of bands (mm), shares of the own detail that stays and of the other that comes."""

NEAR = 0.05
"""Share of the model's diagonal up to which faces of another model are over its own."""

ROUGHLY = 0.02
"""Share of its root mean square height by which a texture may be missed."""

FINER = 0.65
"""Width of knot spans for a texture, in those of its source: its waves are in other places than the knots."""

SOME = 500
"""Number of points at which surfaces are asked whether there is detail over them."""


@dataclass(frozen=True, eq=False)
class Origin:
    """What detail is taken from.

    Attributes
    ----------
    model : Model
    details : mapping of int to Detail
        By surface, if it is a file of details.
    shares : sequence
        What is taken; empty for all details of a file.
    """

    model: Model
    details: Mapping[int, Detail]
    shares: Shares

    @classmethod
    def of(cls, options: Transfer, source: Model | None) -> Origin:
        """The origin that options name."""
        details: dict[int, Detail] = {}
        if source is None:
            stored = load(options.source)
            source, details = stored.as_model(), dict(enumerate(stored.surfaces))
        shares = options.shares(source.diagonal)
        bands_apart([each[:3] for each in shares])
        return cls(source, details, shares)

    def character(self, patch: Patch) -> Character:
        """What a surface of it gives away."""
        if self.shares:
            return Character.of(patch, [(low, high, comes) for low, high, _, comes in self.shares])
        detail = self.details[patch.index]
        return Character.above(patch, detail.net, detail.motion)

    def own(self, patch: Patch) -> Character:
        """What a surface that receives detail loses, negative."""
        if self.shares:
            return Character.of(patch, [(low, high, stays - 1.0) for low, high, stays, _ in self.shares])
        return Character.above(patch, patch.net, patch.net.with_poles(np.zeros_like(patch.net.poles)))

    @property
    def gives(self) -> bool:
        """Whether anything is taken from it."""
        return not self.shares or any(comes for *_, comes in self.shares)

    def wavelength(self, surfaces: Sequence[int]) -> float:
        """Of the longest waves that some of its surfaces give away, mm."""
        if self.shares:
            return max(high for _, high, *_ in self.shares)
        return max(self.details[i].wavelength for i in surfaces)

    def patch(self, text: str, label: str) -> Patch:
        """The surface of a face of it."""
        index = face_number(self.model, text, label, FACE)
        face = self.model.faces[index]
        if face.surface is None:
            what = f"has no details in {self.model.name}" if self.details else f"({face.kind}) is not a NURBS face"
            raise EditError(f"{label}: #{index + 1} {what}", "name another face")
        return Patch.of(self.model, face.surface, self.model.surfaces[face.surface].faces)


def transfer(
    model: Model,
    options: Transfer,
    source: Model | None = None,
    *,
    scope: Scope | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Edit:
    """Transfer the detail of faces, or a feature, of another model to this one.

    Parameters
    ----------
    model : Model
    options : Transfer
    source : Model, optional
        The other model, unless the options name a file of details; other parameters as for
        :func:`mracad.edit.whole.edited`.

    Raises
    ------
    FileError
        For a file that is not one of details.
    EditError
        For faces that cannot give or take detail.
    """
    scope = scope or scope_of(model, options)
    if options.from_ is not None and is_feature(options.from_):
        assert source is not None
        return transferred(model, options, source, scope)
    origin = Origin.of(options, source)
    ground = Ground.of(model, scope.movable(model))
    if options.by_place:
        pieces, chosen = _over(model, origin, options, ground), ground.chosen
    else:
        pieces, chosen = _mapped(origin, options, ground)
    wavelength = max(piece.wavelength for piece in pieces.values())
    taper = wavelength / 2 if options.taper is None else length(options.taper, model.diagonal, "taper")
    wish = Detailed(pieces, options.refine == "auto", taper=taper)
    bare = [face for face in ground.chosen if face not in chosen or model.faces[face].surface not in pieces]
    edit = detailed(model, options, wish, scope, progress, bare)
    left = edit.faces("left")
    if left and options.amount and not edit.faces("edited"):
        hint = "use --keep g0" if left[0].reason is Reason.NO_FREE else "use a smaller --amount, or other faces"
        raise EditError(f"to: #{left[0].face + 1}: {left[0].words}", hint)
    return edit


def _mapped(origin: Origin, options: Transfer, ground: Ground) -> tuple[dict[int, Carried], frozenset[int]]:
    """Detail by surface, and the faces that get it, for pairs of faces."""
    taken: dict[int, tuple[Patch, Patch, str]] = {}
    chosen: dict[int, str] = {}
    label, other = ("map", "map") if options.map else ("from", "to")
    for text, there in options.pairs():
        source, face = origin.patch(text, label), face_number(ground.model, there, other, FACE)
        target = patch_of(ground, face, other)
        if chosen.get(face, text) != text:
            raise UsageError(f"{other}: #{face + 1} gets the detail of two faces", "give it that of one", other)
        chosen[face] = text
        before = taken.setdefault(target.index, (source, target, text))[0]
        if before.index != source.index:
            message = f"{other}: #{face + 1} shares its surface with another face, which gets other detail"
            raise UsageError(message, "give both the detail of one face", other)
    for index, (source, target, text) in taken.items():
        target = replace(target, faces=tuple(face for face in target.faces if face.index in chosen))
        if origin.details:  # which side is outward is not in the file
            faces = tuple(replace(face, reversed=target.faces[0].reversed) for face in source.faces)
            source = replace(source, faces=faces)
        taken[index] = source, target, text
    own = {index: origin.own(target) for index, (_, target, _) in taken.items()}
    others = {source.index: origin.character(source) for source, *_ in taken.values()}
    for index, (source, _, text) in taken.items():
        if others[source.index].height * abs(options.height) <= NOTHING and not own[index].height and origin.gives:
            raise EditError(f"{label}: {text} has no detail in the band", "give another --band")
    pieces = {}
    for given in others:
        some = {index: own[index] for index, (source, *_) in taken.items() if source.index == given}
        wavelength = origin.wavelength([given])
        least = wide_enough(others[given].spacing * (FINER if options.grow else 1.0), options.size)
        for index, (ideal, missed) in _ideals(ground.model, some, others[given], wavelength, options).items():
            pieces[index] = Carried(taken[index][1], ideal, own[index].detail, missed, least, wavelength)
    return pieces, frozenset(chosen)


def _ideals(
    model: Model, own: Mapping[int, Character], other: Character, wavelength: float, options: Transfer
) -> dict[int, tuple[Callable[[Array], Array], float]]:
    """For surfaces that get the detail of another one, what they get, and by how much they may miss it (mm)."""
    way = Way(np.radians(options.rotate), options.size, options.height, options.mirror)
    if not (options.grow and other.height > NOTHING):
        missed = MISSED * other.height * abs(options.height)
        return {i: (Along(each, other, way), missed) for i, each in own.items()}
    laid = charts(model, own)
    places = way.back(corners(own, laid))
    texture = grown(other, wavelength, places.min(axis=0), places.max(axis=0), options.seed)
    missed = ROUGHLY * float(texture.heights.std()) * abs(options.height)
    return {i: (Grown(each, laid[i], way, texture), missed) for i, each in own.items()}


def _over(model: Model, origin: Origin, options: Transfer, ground: Ground) -> dict[int, Carried]:
    """Detail by surface, for surfaces over those of the source."""
    every = [face.index for face in origin.model.faces if face.surface is not None]
    others = {i: origin.character(patch) for i, patch in Ground.of(origin.model, every).patches.items()}
    if not others:
        raise EditError(f"map: {origin.model.name} has no NURBS faces", "give another file")
    coarse = Ground(origin.model, frozenset(every), {i: each.coarse for i, each in others.items()})
    height = max(each.height for each in others.values()) * abs(options.height)
    least = min(each.spacing for each in others.values())
    wavelength, pieces = origin.wavelength(list(others)), {}
    for index, target in ground.patches.items():
        own = origin.own(target)
        ideal = Nearest(own, others, coarse, options.height, NEAR * model.diagonal, wavelength / 2)
        some = target.seeds[0][:: max(len(target.seeds[0]) // SOME, 1)]
        if own.height or not origin.gives or np.abs(ideal(some)).max(initial=0.0) > NOTHING:
            pieces[index] = Carried(target, ideal, own.detail, MISSED * height, least, wavelength)
    if not pieces:
        message = f"map: no face of {origin.model.name} with detail in the band is over one of {model.name}"
        raise EditError(message, "give another --band, or pairs of faces, as --map '#3=#7,#4=#8'")
    return pieces
