"""The problem of surfaces that move together: their spaces, how they are joined and how they are held."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from mracad.bspline.surface import Net
from mracad.edit.target import Sheet
from mracad.edit.tolerances import Tolerances
from mracad.model.brep import Model
from mracad.seam.conditions import doubled, matched
from mracad.seam.conditions import rows as seam_rows
from mracad.seam.contact import Contact, Rows
from mracad.seam.contact import rows as contact_rows
from mracad.seam.domains import problem
from mracad.seam.guide import Led, led
from mracad.seam.interface import Joints, away, contact, mended_ends, rims, twists
from mracad.seam.solve import Problem, Soft, Space
from mracad.seam.space import refined
from mracad.seam.stretch import Limit
from mracad.seam.zones import Zoned, faded

Array = np.ndarray

TIGHT = 0.3
"""Share of the allowed error of a contact that its conditions aim at."""

EASY = 30.0
"""Factor on the allowed error of smooth contacts between surfaces in the target of an edit: splines over unrelated
knots that must agree closely along a curve could hardly follow the target beside it.  At creases it does not apply:
sliding on one side would push the other."""


WITHIN = 0.8
"""Share of the allowed growth that contacts may use, because the result is measured in other places than theirs."""


@dataclass(frozen=True, eq=False)
class Scene:
    """The model and the surfaces that an edit works on.

    Attributes
    ----------
    model : Model
    sheets : mapping of int to Sheet
        The surfaces that the edit may move.
    joints : Joints
    tolerances : Tolerances
    refine : bool
        Whether control points may be added beside rims.
    still : dict of int to ndarray
        Curvatures at edges of faces beside surfaces that move, once known: see :class:`mracad.seam.sides.Bends`.
    """

    model: Model
    sheets: Mapping[int, Sheet]
    joints: Joints
    tolerances: Tolerances
    refine: bool = True
    still: dict[int, Array] = field(default_factory=dict)

    def meeting(self, surfaces: Iterable[int]) -> list[int]:
        """The edges at which surfaces meet any others or themselves, in the order of all."""
        return [edge for _, edge in sorted({each for i in surfaces for each in self._meetings.get(i, ())})]

    @cached_property
    def _meetings(self) -> dict[int, list[tuple[int, int]]]:
        """Positions of meetings, and their edges, by surface."""
        found: dict[int, list[tuple[int, int]]] = {}
        for position, (edge, meeting) in enumerate(self.joints.meetings.items()):
            for face in meeting.faces:
                surface = self.model.faces[face].surface
                if surface is not None:
                    found.setdefault(surface, []).append((position, edge))
        return found

    def allowed(self, contact: Contact, joined: Joints, width: float) -> tuple[float, float, float]:
        """By how much the gap (mm), the slope and the curvature (1/mm) of a contact may grow.

        Where both faces of an edge move separately, they share it.
        """
        t = self.tolerances
        meeting, edge = joined.meetings.get(contact.edge), self.model.edges[contact.edge]
        if contact.b is not None or meeting is None:
            return t.contact(width)
        moving = sum(self.model.faces[face].surface in self.sheets for face in meeting.faces)
        sharing = min(max(moving, 1), 2)
        return t.wider(edge, meeting.gap) / sharing, t.angle / sharing, t.bend / width / sharing


@dataclass(frozen=True, eq=False)
class Pose:
    """A problem and its contacts.

    Attributes
    ----------
    problem : Problem
    contacts : Rows
    owners : sequence of set of int
        The surfaces of each contact.
    opened : ndarray (conditions, 3)
        Errors of contacts between two surfaces before the edit: gap, slope, curvature.
    limits : ndarray (conditions,)
        Allowed errors of contacts.
    trimmed : ndarray of bool (conditions,)
        Conditions of seams along trim curves that are to be mended.
    share : ndarray (points, 1), optional
        0 in regions where nothing may move, 1 farther than a wavelength from them.
    led : Led or None
        The conditions of edges that slide.
    """

    problem: Problem
    contacts: Rows
    owners: list[set[int]]
    opened: Array
    limits: Array
    trimmed: Array
    share: Array | None = None
    led: Led | None = None

    def faded(self, delta: Array) -> Array:
        """A displacement, faded out within a wavelength of regions where nothing may move."""
        return delta if self.share is None else self.problem.nearest(self.share * delta)

    def open(self, delta: Array) -> tuple[set[int], float]:
        """The seams along trim curves that should be mended and stay open after a displacement, and the share of their
        conditions that does."""
        lacked = np.linalg.norm(self.opened + self.contacts.matrix @ delta, axis=1)
        which = (lacked > self.limits) & self.trimmed
        return set(self.contacts.owner[which].tolist()), float(which.sum() / max(self.trimmed.sum(), 1))


def pose(
    scene: Scene,
    members: Mapping[int, Sheet],
    joined: Joints,
    width: float,
    detail: float,
    *,
    finer: Collection[int] = (),
    spans: Mapping[int, float] | None = None,
) -> Pose:
    """The problem of surfaces that move together.

    Parameters
    ----------
    scene : Scene
    members : mapping of int to Sheet
    joined : Joints
    width : float
        Width within which displacements fade, mm.
    detail : float
        Size of the wanted displacements, mm: contacts weigh more where it is larger.
    finer : collection of int
        Surfaces that get control points beside rims if they have few.
    spans : mapping of int to float, optional
        Longest knot spans beside edges, mm.
    """
    movable = {face for sheet in members.values() for face in sheet.movable}
    nets = {i: beside_rims(sheet, joined) if i in finer else sheet.net for i, sheet in members.items()}
    if spans:
        nets = {i: _beside(net, members[i], spans) for i, net in nets.items()}
    nets = matched(nets, joined.exact)
    nets = matched(doubled(nets, joined.exact), joined.exact)
    shares: list[Array] = []
    spaces, contacts = {}, [contact(seam) for seam in joined.loose]
    for i, net in nets.items():
        sheet = members[i]
        form = sheet.measured(net)
        points = sheet.seen(net, form)
        held, more = rims(scene.model, net, sheet.all_faces, movable, joined)
        held &= ~mended_ends(scene.model, net, i, sheet.all_faces, movable, joined, width / 2)
        held |= twists(held)
        contacts += more
        zoned = _zoned(sheet, net, joined, width)
        held |= zoned.held
        far = np.minimum(away(net, sheet.faces, joined.moving, sheet.stretch), zoned.away)
        shares.append(faded(zoned.away.ravel(), width))
        spaces[i] = Space(net, form, points & ~held, points, sheet.trend.over(net.u, net.v).poles, far)
    found = contact_rows(nets, contacts)
    f = np.concatenate([net.poles.reshape(-1, 3) for net in nets.values()])
    f = f - f.mean(axis=0)
    rows, goal = seam_rows(nets, joined.exact, everywhere=True)
    pairs = np.array([each.b is not None for each in contacts], bool)[found.owner]
    opened = np.where(pairs[:, None], found.matrix @ f, 0.0) if pairs.any() else np.zeros((len(pairs), 3))
    most = WITHIN * np.array([scene.allowed(each, joined, width) for each in contacts]).reshape(-1, 3)
    limits, tolerances = found.limits(opened, most), found.limits(0.0 * opened, most)
    mends = np.array([(each.close, each.fit, False) for each in contacts], bool).reshape(-1, 3)
    mends = mends[found.owner, found.order]
    limits = np.where(mends, tolerances, limits)
    weight = worth(detail, width)
    shut = np.where(mends[:, None], opened, 0.0) if joined.mended else opened
    smooth = pairs & np.array([each.order > 0 for each in contacts], bool)[found.owner]
    between = weight * found.form(np.where(smooth, EASY * limits, np.inf)) if smooth.any() else None
    pull = -weight * found.pull(shut, limits) if shut.any() else None
    soft = Soft(weight * found.form(limits), pull, between) if contacts else None
    trimmed = mends & np.array([not each.since for each in contacts], bool)[found.owner]
    sliding = [each for each in joined.slides if each.trace.surface in nets]
    slid = led(nets, sliding, WITHIN * scene.tolerances.gap, weight)
    guides = slid.guides(scene.model, nets) if slid else None
    posed = problem(spaces, rows, np.where(goal[:, None], -(rows @ f), 0.0), soft, guides=guides)
    owners = [each.surfaces for each in contacts]
    share = np.concatenate(shares)[:, None] if joined.zones else None
    return Pose(posed, found, owners, opened, limits, trimmed, share, slid)


def _zoned(sheet: Sheet, net: Net, joined: Joints, width: float) -> Zoned:
    """The part of a surface in regions where nothing may move; curvature is measured without what will be removed."""
    look = sheet.stretch.limit
    if joined.zones and look is None:
        look = Limit.of(sheet.net, sheet.stretch.times(width), sheet.creases)
    return Zoned.of(net, sheet.all_faces, joined.zones, look)


def worth(detail: float, width: float) -> float:
    """The weight of a contact with its whole allowed error, mm³: that of displacements of size ``detail`` (mm) within
    ``width`` (mm)."""
    return (detail / TIGHT) ** 2 * width


def beside_rims(sheet: Sheet, joined: Joints) -> Net:
    """A surface with knot spans of at most a quarter of the wavelength beside its rims."""
    held = tuple(trim.curve for face in sheet.faces for trim in face.trims if trim.edge not in joined.moving)
    return refined(sheet.net, held, sheet.stretch.times(sheet.wavelength / 4))


def _beside(net: Net, sheet: Sheet, spans: Mapping[int, float]) -> Net:
    """A surface with knot spans of at most a length (mm) beside edges."""
    for longest in sorted(set(spans.values()), reverse=True):
        trims = (trim for face in sheet.faces for trim in face.trims)
        curves = tuple(trim.curve for trim in trims if spans.get(trim.edge) == longest)
        net = refined(net, curves, sheet.stretch.times(longest))
    return net
