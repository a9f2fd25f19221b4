"""The changes made to surfaces, and a closer look at them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mracad.bspline.surface import Net
from mracad.edit.target import Sheet
from mracad.edit.tolerances import Tolerances
from mracad.edit.trial import gained
from mracad.edit.watch import Tried, Watch, amounts
from mracad.inspect.roughness import Change, Worse
from mracad.model.displacement import Displacement, Offset
from mracad.seam.interface import Joints

Array = np.ndarray

CLOSER = 7
"""Points per span at which a result is judged again."""


@dataclass(frozen=True, eq=False)
class Moved:
    """The change made to a surface.

    Attributes
    ----------
    sheet : Sheet
    tried : Tried
        The wanted displacement, watched closely.
    amount : float
        Share of the wanted change that was allowed.
    changes : mapping of int to Change
        Changes of the roughness of its faces, by face.
    limits : tuple of Worse
        What limited the amount.
    free : int
        Free control points.
    gain, wanted : float
        By how much the surfaces that move with it came nearer to the target, and the whole distance, as squared norms.
    rough : bool
        Whether the wanted change would reduce its roughness at all.
    sliding : bool
        Whether its edges slide.
    held_back : bool
        Whether only its held rims prevent the wanted change: together with others it may do more.
    gaining : bool
        Whether some of the wanted change is made, or would make it fairer if nothing were held: more control points
        may help.
    """

    sheet: Sheet
    tried: Tried
    amount: float
    changes: Mapping[int, Change]
    limits: tuple[Worse, ...]
    free: int
    gain: float = 0.0
    wanted: float = 0.0
    rough: bool = True
    sliding: bool = False
    held_back: bool = False
    gaining: bool = True

    @classmethod
    def whole(cls, sheet: Sheet, net: Net, offset: Array, free: int, amount: float = 1.0) -> Moved:
        """A displacement ``(nu, nv, 3)`` that is made in full; ``amount`` is reported as the share of what was
        wanted."""
        tried = Tried(closely(sheet, net), [net], [offset / amount])
        return cls(sheet, tried, amount, tried.changes({0: amount})[0], (), free)

    @property
    def net(self) -> Net:
        """The surface before, in the space of the displacement."""
        return self.tried.nets[0]

    @property
    def offset(self) -> Array:
        """The displacement made, mm, ``(nu, nv, 3)``."""
        return np.asarray(self.amount * self.tried.parts[0])

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
        """The change multiplied by an amount."""
        if amount == self.amount:
            return self
        return replace(self, amount=amount, changes=self.tried.changes({0: amount})[0])

    def shifted(self, offset: Array) -> Moved:
        """A slightly different change."""
        tried = Tried(self.tried.watch, self.tried.nets, [offset / self.amount])
        return replace(self, tried=tried, changes=tried.changes({0: self.amount})[0])

    def undone(self) -> Moved:
        """No change instead."""
        still = {face: change.undone() for face, change in self.changes.items()}
        return replace(self, amount=0.0, changes=still, limits=(), gain=0.0)

    def done(self) -> Moved:
        """The same change, without the measurements made for it."""
        return replace(self, tried=Tried(replace(self.tried.watch), self.tried.nets, self.tried.parts))

    def confirmed(self, tolerances: Tolerances) -> Moved:
        """The part of the change that is allowed when judged at more points; none if no face gains from that part."""
        if not self.amount:
            return self
        (amount,), (changes,), (limits,) = amounts(self.tried, np.zeros(1), np.array([self.amount]), tolerances)
        found = replace(self, amount=amount, changes=changes, limits=limits or self.limits)
        enough = gained(changes, tolerances, self.sheet.least)
        return found if enough else replace(found.undone(), limits=found.limits)

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


def closely(sheet: Sheet, net: Net, targets: Sequence[Array] = ()) -> Watch:
    """A closer look at the faces of a surface, in the space of a displacement, of which a target may be wanted."""
    return Watch([(net, sheet.base, sheet.faces)], sheet.wavelength, [sheet.reach], CLOSER, targets)
