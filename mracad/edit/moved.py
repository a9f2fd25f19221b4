"""The changes made to surfaces, and a closer look at them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from mracad.bspline.surface import Net
from mracad.edit.target import Sheet
from mracad.edit.tolerances import Tolerances
from mracad.edit.trial import gained
from mracad.edit.watch import Tried, Watch, amounts, displaced
from mracad.inspect.roughness import Change, Worse
from mracad.model.displacement import Displacement, Offset
from mracad.seam.interface import Joints

Array = np.ndarray

CLOSER = 9
"""Points a span at which a result is judged again."""


@dataclass(frozen=True, eq=False)
class Moved:
    """The change made to a surface.

    Attributes
    ----------
    sheet : Sheet
    net : Net
        Before, in the space of the displacement.
    offset : ndarray (nu, nv, 3)
    amount : float
        Share of the wanted change that was allowed.
    changes : mapping of int to Change
        Of the roughness of its faces, by face.
    limits : tuple of Worse
        What limited the amount.
    free : int
        Free control points.
    gain, wanted : float
        How much nearer the surfaces that move with it came to the target, and the whole distance, as squared norms.
    rough : bool
        Whether the wanted change would reduce its roughness at all.
    sliding : bool
        Whether its edges slide.
    hindered : bool
        Whether nothing but what holds it stands against the wanted change: together with others it may do more.
    """

    sheet: Sheet
    net: Net
    offset: Array
    amount: float
    changes: Mapping[int, Change]
    limits: tuple[Worse, ...]
    free: int
    gain: float
    wanted: float
    rough: bool = True
    sliding: bool = False
    hindered: bool = False

    @property
    def deviation(self) -> float:
        """Largest motion along the normal, mm."""
        return max((each.deviation for each in self.changes.values()), default=0.0)

    @property
    def motion(self) -> float:
        """Largest motion, mm."""
        return max((each.motion for each in self.changes.values()), default=0.0)

    @property
    def finer(self) -> bool:
        """Whether it has more control points than the surface."""
        return self.net is not self.sheet.net and (self.net.u, self.net.v) != (self.sheet.net.u, self.sheet.net.v)

    @property
    def share(self) -> float:
        """The share of the way to the target."""
        return self.gain / self.wanted if self.wanted > 0.0 else 0.0

    def scaled(self, amount: float) -> Moved:
        """The same change with another amount."""
        if amount == self.amount:
            return self
        offset = self.offset * (amount / self.amount)
        now = self._watch().changes({0: displaced(self.net, offset)})[0]
        return replace(self, offset=offset, amount=amount, changes=now)

    def shifted(self, offset: Array) -> Moved:
        """A slightly different change."""
        return replace(self, offset=offset, changes=self._watch().changes({0: displaced(self.net, offset)})[0])

    def undone(self) -> Moved:
        """No change instead."""
        still = {face: change.undone() for face, change in self.changes.items()}
        return replace(self, offset=np.zeros_like(self.offset), amount=0.0, changes=still, limits=(), gain=0.0)

    def confirmed(self, tolerances: Tolerances) -> Moved:
        """The part that passes a closer look: growth between the points of the first is taken back; nothing is left if
        no face gains from the rest."""
        if not self.amount:
            return self
        whole, most = self.offset / self.amount, np.array([self.amount])
        tried = Tried(self._watch(), [self.net], [whole])
        (amount,), (changes,), (limits,) = amounts(tried, np.zeros(1), most, tolerances)
        found = replace(self, offset=amount * whole, amount=amount, changes=changes, limits=limits or self.limits)
        return found if gained(changes, tolerances) else replace(found.undone(), limits=found.limits)

    def _watch(self) -> Watch:
        return Watch.of(
            [(self.net, self.sheet.base, self.sheet.faces)], self.sheet.wavelength, [self.sheet.reach], CLOSER
        )

    def displacement(self) -> Offset:
        """The displacement over the original surface."""
        return Offset.of(self.sheet.origin, self.net, self.offset)


@dataclass(frozen=True, eq=False)
class Result:
    """The changes of all surfaces, and the joints that moved with them; ``sheets`` are all that were considered, and
    ``mended`` the edges that were mended."""

    moved: Mapping[int, Moved]
    joints: Joints
    sheets: Mapping[int, Sheet] = field(default_factory=dict)
    mended: frozenset[int] = frozenset()

    def displacement(self) -> Displacement:
        """The displacement of all surfaces that move."""
        offsets = {i: each.displacement() for i, each in self.moved.items() if np.any(each.offset)}
        return Displacement(offsets, {s.edge: s.trace.face for s in self.joints.slides if s.trace.surface in offsets})
