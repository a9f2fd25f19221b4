"""Options of the transfer of detail from one file to another."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal

from msgspec import Meta

from mracad.errors import UsageError
from mracad.spec import places
from mracad.spec.fields import dashed
from mracad.spec.files import File
from mracad.spec.quantity import Length, band_of, blend_of
from mracad.spec.steps import features
from mracad.spec.steps.base import Edges
from mracad.spec.steps.shape import bands_apart
from mracad.spec.steps.smooth import Fairing

PLACE = "place"
"""The map by which each point gets the detail at the nearest point."""


_OF_FACES = (
    "mode", "blend", "grow", "seed", "amount", "max_deviation", "refine", "gap_tolerance", "fit_g1", "close_gaps",
    "free_edges", "corners",
)  # fmt: skip
"""Options of the transfer of detail that do nothing to a feature."""


def _blend(text: str, name: str) -> None:
    """Raise UsageError for a text that is not a share, alone or of a band."""
    blend_of(text, None)


def _pairs(text: str, name: str) -> None:
    """Raise UsageError for a text that does not tell which faces belong together."""
    if text != PLACE:
        for pair in text.split(","):
            source, equals, target = (part.strip() for part in pair.partition("="))
            if not (source and equals and target):
                hint = f"write source face = target face, as #3=#7,#4=#8, or {PLACE}"
                raise UsageError(f"{name}: {text!r} is not a list of pairs of faces", hint)


class Transfer(Fairing, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Copy the detail of faces, or a feature, from another file to this one; units may differ."""

    function: ClassVar[str] = "mracad.edit.transfer:transfer"
    example: ClassVar[str] = "mracad transfer old.step new.step --from near:10,20,5,radius:8 --to 40,20,5 -o both.step"

    source: Annotated[
        File, Meta(description="The file that the detail is taken from: a model, or details (.mra) of mracad level.")
    ]
    from_: Annotated[
        Annotated[str, places.NAMED] | None,
        Meta(description="What to take: a face (#3 or its name) with its detail, or a feature as for mracad repeat."),
    ] = None
    to: Annotated[str | None, Meta(description="Where to: a face for the detail of a face; a place for a feature.")] = (
        None
    )
    map: Annotated[
        tuple[Annotated[str, _pairs], ...],
        Meta(
            description="Instead of --from and --to: several faces, as #3=#7,#4=#8 (source face = target face); or "
            "place: each point of the faces to edit gets the detail of the source at the nearest point."
        ),
    ] = ()
    mode: Annotated[
        Literal["add", "replace"],
        Meta(description="Whether detail is added to a face's own, or replaces that in the --band."),
    ] = "add"
    blend: Annotated[
        tuple[Annotated[str, _blend], ...],
        Meta(
            description="Mix detail instead: 0.3 takes 30% of the other face's detail in the --band and 70% of the "
            "face's own; 2mm:10mm=0.3 does so in a band of its own, repeatable."
        ),
    ] = ()
    grow: Annotated[
        bool,
        Meta(
            description="Instead of the other face's detail, which is mirrored where it ends, heights with the same "
            "spectrum, which go on over any size and across seams without repeating."
        ),
    ] = False
    seed: Annotated[int, Meta(description="Seed of the random numbers of --grow.", ge=0)] = 0
    band: features.Band = None
    edges: Edges = "coupled"
    taper: Annotated[
        Length | None,
        Meta(
            description="Width over which detail fades out towards edges and faces that stay; by default half its "
            "longest wavelength. For a feature: that beyond its window, as for mracad repeat."
        ),
    ] = None
    base: features.Base = "surroundings"
    rotate: features.Rotate = 0.0
    size: features.Size = 1.0
    height: features.Height = 1.0
    mirror: features.Mirror = False
    clip: features.Clip = False

    def __post_init__(self) -> None:
        super().__post_init__()
        features.separable(self.base, self.band)
        features.not_flat(self.height)
        if bool(self.map) == (self.from_ is not None or self.to is not None):
            hint = "give --from and --to, or --map '#3=#7,#4=#8'"
            raise UsageError("map: either it or from and to are needed", hint, "map")
        if not self.map and (self.from_ is None or self.to is None):
            raise UsageError("from and to belong together", "give both, or --map", "from" if self.to else "to")
        if self.from_ is not None and self.to is not None and places.is_feature(self.from_):
            places.feature(self.from_, "from")
            places.spot(self.to, "to")
            self._refuse(_OF_FACES, "it is for the detail of faces, not for a feature")
            if self.stored:
                raise UsageError(f"from: {self.source} contains no features", "name a face, as #3", "from")
        else:
            self._refuse(("clip", "base"), "it is for a feature, not for the detail of faces")
            self._check_faces()

    def _refuse(self, names: Sequence[str], why: str) -> None:
        """Raise UsageError for options that were given and have no effect."""
        for name in self.given():
            if name in names:
                raise UsageError(f"{dashed(name)}: {why}", "leave it out", name)

    def _check_faces(self) -> None:
        """Raise UsageError for options of the detail of faces that do not go together."""
        if self.by_place and len(self.map) > 1:
            raise UsageError("map: place names no faces, and cannot be combined with pairs", "give one of them", "map")
        if self.by_place:
            self._refuse(("rotate", "size", "mirror"), "detail that goes to the nearest place keeps its own")
            self._refuse(("grow",), "it needs pairs of faces, as --map '#1=#3'")
        if not self.grow:
            self._refuse(("seed",), "it needs --grow")
        if self.blend and self.mode == "replace":
            raise UsageError("blend and mode cannot be combined", "give --blend 1 to replace detail")
        banded = any("=" in text for text in self.blend)
        if banded and self.band is not None:
            raise UsageError("blend: bands of its own exclude --band", "leave out --band", "blend")
        if len(self.blend) > 1 and not all("=" in text for text in self.blend):
            raise UsageError("blend: several shares need a band each", "write --blend 2mm:10mm=0.3", "blend")
        if self.band is None and not banded and not (self.stored and self.mode == "add" and not self.blend):
            message = "band: the detail of a face cannot be told without one"
            raise UsageError(message, "give --band 0mm:20mm", "band")
        if not any("%" in text for text in self.blend):
            bands_apart([each[:3] for each in self.shares(None)])

    @property
    def stored(self) -> bool:
        """Whether the source is a file of details."""
        return self.source.endswith(".mra")

    @property
    def by_place(self) -> bool:
        """Whether points correspond to the nearest ones."""
        return PLACE in self.map

    def pairs(self) -> list[tuple[str, str]]:
        """Source and target faces that belong together."""
        if self.from_ is not None and self.to is not None:
            return [(self.from_, self.to)]
        each = (pair.partition("=") for text in self.map for pair in text.split(",") if text != PLACE)
        return [(source.strip(), target.strip()) for source, _, target in each]

    def shares(self, diagonal: float | None) -> list[tuple[float, float, float, float]]:
        """Smallest and largest wavelength (mm) of each band, in ascending order, and the shares of the face's own
        detail that stays and of the other's that comes; empty for everything in a file of details."""
        stays, comes = (0.0, 1.0) if self.mode == "replace" else (1.0, 1.0)
        found = []
        for text in self.blend:
            band, share = blend_of(text, diagonal)
            found.append((*(band or band_of(self.band or "", diagonal)), 1.0 - share, share))
        if not found and self.band is not None:
            found = [(*band_of(self.band, diagonal), stays, comes)]
        return sorted(found)

    def models(self) -> tuple[str, ...]:
        return () if self.stored else (self.source,)

    @property
    def done(self) -> str:
        return "edited with transferred detail"

    @property
    def quiet(self) -> str:
        return "unchanged" if self.amount else "unchanged: amount 0"
