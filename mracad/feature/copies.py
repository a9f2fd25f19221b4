"""Copies of a feature on the ground: the ideal displacement at any point, and the control points that come near it.

The ideal displacement of a copy at a point of the coarse surface is that of the feature at the same normal
coordinates (turned, mirrored, scaled), in the frame carried there from the copy's place.  Control points are those of
the interpolant at the Greville points (W δ in the polynomial space where the surface is rational): a spline of the
target's space is reproduced exactly.  Spans that are too wide are divided where the interpolant misses the ideal.
Where a target's control net is that of the source moved by whole spans, its offsets are those of the source, moved.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mracad.bspline.interpolate import interpolated
from mracad.bspline.knots import KnotVector
from mracad.bspline.net import Net
from mracad.constraint.frozen import separate
from mracad.constraint.hold import held, matching
from mracad.constraint.seam import Seam, Wishes, opening, seams
from mracad.errors import EditError
from mracad.feature.chart import Charts
from mracad.feature.detail import LOST, Feature
from mracad.feature.ground import STEEP, Feet, Ground, Sheet
from mracad.feature.place import Place
from mracad.model import Offset, Surface
from mracad.wavelet.ladder import arc_lengths

Array = np.ndarray

MISSED, FACETTED = 3e-4, 1e-2
"""Share of its height by which a copy may miss the ideal before knots are inserted; for nets of degree 1."""

FIRST = 4.0
"""Spans under a copy are at first no longer than its reach over this."""

SPARE = 1.5
"""Spans are not divided that are at most so many times as wide as those that held the feature."""

UNEVEN = 1.4
"""By how much a span may be wider somewhere than on average."""

ROUNDS, PIECES = 5, 6
"""Times that spans are divided, and into how many pieces at most each time."""

CHECKS, FEWEST, ALL = 300, 60, 30_000
"""Points in each direction at which a copy is compared with the ideal: at most, at least, and for all copies."""

BATCH = 48
"""Copies worked on at a time."""

EXACT, CONGRUENT = 1e-6, 1e-3
"""Nets match when knots agree to this share of a span, and control points to this share of the feature's height."""

WIDER, STEEPER = 1e-7, np.radians(0.01)
"""A seam may end up with so much more of a gap (mm) and of an angle; otherwise it is frozen."""

NARROWEST = 1e-3
"""Least width of a knot span that is made for a copy, mm."""

MOST = 4_000_000
"""Control points that a net may grow to."""


@dataclass(frozen=True)
class Copy:
    """What became of one copy.

    Attributes
    ----------
    place : str
    at : (float, float, float)
        Where it stands, mm.
    faces : tuple of int
        Faces that it touches.
    deviation, rms : float
        Largest and mean square distance from the ideal copy, mm, constraints included.
    lost : float
        Largest part of it that constraints took away, mm.
    exact : bool
        Whether it is an exact shift of control points.
    """

    place: str
    at: tuple[float, float, float]
    faces: tuple[int, ...]
    deviation: float
    rms: float
    lost: float
    exact: bool


@dataclass(frozen=True, eq=False)
class Laid:
    """Copies as offsets of control points.

    Attributes
    ----------
    offsets : dict of int to Offset
        By surface, in its own frame.
    copies : tuple of Copy
    frozen : dict of int to str
        Seams under copies that could not move, and why.
    moving : frozenset of int
        Edges that moved with both faces.
    """

    offsets: dict[int, Offset]
    copies: tuple[Copy, ...]
    frozen: dict[int, str]
    moving: frozenset[int]


class Copies:
    """Copies of a feature at places.

    Parameters
    ----------
    ground : Ground
        What they stand on, the source's own feature taken away.
    feature : Feature
    places : sequence of Place
    feet : Feet
        Where those stand.
    overlap : {"add", "max", "replace"}
    mirror : bool
    """

    def __init__(
        self, ground: Ground, feature: Feature, places: Sequence[Place], feet: Feet, overlap: str, mirror: bool
    ) -> None:
        self.ground, self.feature, self.places, self.feet = ground, feature, places, feet
        self.overlap, self.mirror = overlap, mirror
        self.sizes = np.array([p.size for p in places])
        self.heights = np.array([p.height for p in places])
        self.turns = np.array([p.rotate for p in places])
        self.reach = feature.reach * self.sizes
        given = [feet.along[i] if p.direction is None else p.direction for i, p in enumerate(places)]
        blocks = [slice(k, k + BATCH) for k in range(0, len(places), BATCH)]
        parts = [ground.charts(_part(feet, b), np.array(given[b]), 1.05 * self.reach[b]) for b in blocks]
        names = ("origin", "axes", "reach", "graph", "log", "exp")
        self.charts = Charts(*(np.concatenate([getattr(c, name) for c, _ in parts]) for name in names))
        self.touched = np.concatenate([t for _, t in parts])
        self.shifts: dict[int, Array] = {}
        self._kept: dict[tuple[int, KnotVector, KnotVector], Array] = {}

    @property
    def height(self) -> float:
        """Largest displacement of the least of them, mm."""
        return float(self.feature.height * np.abs(self.heights).min())

    def ideal(self, sheet: Sheet, points: Array, normals: Array, without: Array | None = None) -> tuple[Array, Array]:
        """The displacement ``(q, 3)`` at points of a sheet, in the part's frame, and how many copies reach each.

        ``without`` marks copies that do not count.
        """
        from scipy.spatial import cKDTree

        total, count = np.zeros((len(points), 3)), np.zeros(len(points), int)
        number = list(self.ground.sheets).index(sheet.index)
        chosen = np.flatnonzero(self.touched[:, number] & (True if without is None else ~without))
        if not len(points) or not len(chosen):
            return total, count
        tree = cKDTree(points)
        for k in range(0, len(chosen), BATCH):
            some = chosen[k : k + BATCH]
            lists = tree.query_ball_point(self.charts.origin[some], 1.02 * self.reach[some], return_sorted=True)
            which = np.repeat(some, [len(x) for x in lists])
            index = np.concatenate([np.asarray(x, int) for x in lists])
            same = (normals[index] * self.feet.normals[which]).sum(axis=1) > STEEP
            which, index = which[same], index[same]
            delta, window = self._each(points[index], which)
            if self.overlap == "add":
                np.add.at(total, index, delta)
                np.add.at(count, index, 1)
                continue
            for copy in some:
                own = which == copy
                at, d, w = index[own], delta[own], window[own]
                count[at] += 1
                if self.overlap == "max":
                    larger = (d**2).sum(axis=1) > (total[at] ** 2).sum(axis=1)
                    total[at] = np.where(larger[:, None], d, total[at])
                else:
                    total[at] = (1 - w[:, None]) * total[at] + d
        return total, count

    def _each(self, points: Array, which: Array) -> tuple[Array, Array]:
        """Displacement and window of one copy each at points."""
        xy, frames = self.charts.jets(self.charts.local(points, which), which)
        xy = xy / self.sizes[which][:, None]
        cos, sin = np.cos(self.turns[which]), np.sin(self.turns[which])
        x, y = cos * xy[:, 0] + sin * xy[:, 1], cos * xy[:, 1] - sin * xy[:, 0]
        flip = -1.0 if self.mirror else 1.0
        found = self.feature.lookup(np.stack([x, flip * y], axis=1))
        t, s = found[:, 0], flip * found[:, 1]
        size, height = self.sizes[which], self.heights[which]
        moved = np.stack([size * (cos * t - sin * s), size * (sin * t + cos * s), height * found[:, 2]], axis=1)
        return np.einsum("qij,qi->qj", frames, moved), np.clip(found[:, 3], 0.0, 1.0)

    @cached_property
    def matched(self) -> Array:
        """Copies that are exact shifts; their offsets are in ``shifts``."""
        matched = np.zeros(len(self.places), bool)
        origin = self.feature.origin
        if origin is None or self.overlap != "add" or self.mirror or len(origin.offsets) != 1:
            return matched
        ((index, delta),) = origin.offsets.items()
        if int(origin.feet.surface[0]) != index or index not in self.ground.sheets:
            return matched
        source = self.ground.sheets[index]
        rows, columns = (np.flatnonzero(delta.any(axis=(1 - axis, 2))) for axis in (0, 1))
        box = (rows[0], rows[-1] + 1), (columns[0], columns[-1] + 1)
        plain = (self.sizes == 1) & (np.abs(np.sin(self.turns)) < 1e-12) & (np.cos(self.turns) > 0)
        for i in np.flatnonzero(plain & (self.touched.sum(axis=1) == 1)):
            target = self.ground.sheets.get(int(self.feet.surface[i]))
            found = _shift(source, target, box, self.feet.uv[i] - origin.feet.uv[0]) if target else None
            if found is None or target is None:
                continue
            turn = self._congruent(source, target, box, found, self.charts.axes[i].T @ origin.axes)
            if turn is None:
                continue
            (u0, u1), (v0, v1) = box
            own = delta[u0:u1, v0:v1] @ (target.turn.T @ turn @ source.turn).T * self.heights[i]
            sums = self.shifts.setdefault(target.index, np.zeros(target.net.poles.shape))
            at = np.ix_(
                *((np.arange(a, b) + k) % kv.count for (a, b), k, kv in zip(box, found, target.knots, strict=True))
            )
            sums[at] += own
            matched[i] = True
        return matched

    def _congruent(
        self, source: Sheet, target: Sheet, box: tuple[tuple[int, int], ...], shift: tuple[int, int], near: Array
    ) -> Array | None:
        """The rotation that takes the source's net to the target's, where they are congruent and their outsides are."""
        index = [np.arange(a, b) for a, b in box]
        one = source.net.poles[np.ix_(*index)].reshape(-1, 3)
        there = np.ix_(*((k + s) % kv.count for k, s, kv in zip(index, shift, target.knots, strict=True)))
        two = target.net.poles[there].reshape(-1, 3)
        weights = [
            np.ones(len(one)) if s.net.weights is None else s.net.weights[w].ravel()
            for s, w in ((source, np.ix_(*index)), (target, there))
        ]
        if np.abs(weights[0] / weights[0][0] - weights[1] / weights[1][0]).max() > 1e-9:
            return None
        a, b = one - one.mean(axis=0), two - two.mean(axis=0)
        limit = CONGRUENT * self.height
        turn = np.eye(3)
        if np.abs(a - b).max() > limit:
            u, _, vt = np.linalg.svd(b.T @ a)
            turn = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt
        if np.abs(a @ turn.T - b).max() > limit or np.abs(turn - near).max() > 0.05:
            return None
        return turn

    def laid(self, wishes: Wishes, coupled: bool, clip: bool, removed: Mapping[int, Array]) -> Laid:
        """The copies as offsets.

        Parameters
        ----------
        wishes : Wishes
        coupled : bool
            Whether edges between faces of the ground may move.
        clip : bool
            Whether frozen points may take more than a little of a copy.
        removed : mapping of int to ndarray (nu, nv, 3)
            Offsets over the surfaces' own nets to be added: those that take the source's feature away.

        Raises
        ------
        EditError
            For a copy that frozen points take too much of.
        """
        model = self.ground.model
        known = seams(model, self.ground.chosen, wishes)
        loose = {edge: "joint varies along the seam" for s in known.found if s.loose for edge in (s.edge, s.twin)}
        closing, frozen = known.closing, known.frozen | loose
        found = [s for s in known.found if not s.loose]
        joined = [(s, r) for s in found if (r := self._stretch(s, removed)) is not None] if coupled else []
        extra = self._refined([])
        while True:
            if joined:
                extra = self._refined(joined, extra)
            moving = set(closing) | {e for s, _ in joined for e in (s.edge, s.twin)}
            offsets, before = self._offsets(extra, [s for s, _ in joined], moving, wishes.keep, removed)
            broken = self._broken([s for s, _ in joined], offsets)
            if not broken:
                break
            frozen = frozen | dict.fromkeys(broken, "would not hold")
            joined = [(s, r) for s, r in joined if s.edge not in broken]
        copies = self._compared(offsets, before, removed)
        for copy, place in zip(copies, self.places, strict=True):
            share = copy.lost / (self.feature.height * abs(place.height))
            if share > LOST and not clip:
                raise EditError(
                    f"{copy.place}: edges or holes that do not move take {100 * min(share, 1):.0f} % of the height of "
                    f"the copy there ({_numbers(copy.faces)})",
                    "move it away from them, make it smaller with --size, or let them take it with --clip",
                )
        used = {i: o for i, o in offsets.items() if np.any(o.poles)}
        return Laid(used, tuple(copies), frozen, frozenset(moving - set(closing)))

    def _stretch(self, seam: Seam, removed: Mapping[int, Array]) -> tuple[float, float] | None:
        """Fractions of a seam between which copies, or what is removed, move it."""
        share = np.linspace(0, 1, 401)
        far = np.zeros(len(share), bool)
        for border in (seam.a, seam.b):
            sheet = self.ground.sheets[border.surface]
            points, _, _, normals = sheet.evaluate(border.places(share))
            delta, _ = self.ideal(sheet, points, normals)
            if border.surface in removed:
                taken = Net(*sheet.knots, removed[border.surface], sheet.net.weights)
                far |= np.linalg.norm(np.asarray(taken.evaluate(border.places(share))), axis=1) > 1e-7 * self.height
            far |= np.linalg.norm(delta, axis=1) > 1e-7 * self.height
        if not far.any():
            return None
        step = share[1]
        return float(share[far].min() - step), float(share[far].max() + step)

    def _spans(self, sheet: Sheet, extra: tuple[Array, Array]) -> tuple[KnotVector, KnotVector]:
        u, v = sheet.knots
        return u.refined(extra[0]), v.refined(extra[1])

    def _refined(
        self, joined: Sequence[tuple[Seam, tuple[float, float]]], extra: Mapping[int, tuple[Array, Array]] | None = None
    ) -> dict[int, tuple[Array, Array]]:
        """Knots to insert in u and v of every sheet."""
        result = dict(extra or {})
        if extra is None:
            for i, sheet in self.ground.sheets.items():
                result[i] = self._fine(sheet)
        knots = {
            (i, axis): kv
            for i, sheet in self.ground.sheets.items()
            for axis, kv in enumerate(self._spans(sheet, result[i]))
        }
        stretches = []
        for number, (seam, (low, high)) in enumerate(joined):
            # the functions next to the stretch take part
            pad = 0.0
            for border in (seam.a, seam.b):
                kv = knots[border.surface, 1 - border.axis]
                at = np.sort(border.start + np.array([low, high]) * (border.stop - border.start))
                near = (kv.breaks >= at[0] - 1e-12) & (kv.breaks <= at[1] + 1e-12)
                steps = np.diff(kv.breaks)
                local = steps[np.clip(np.flatnonzero(near) - 1, 0, len(steps) - 1)] if near.any() else steps
                pad = max(pad, (kv.degree + 1) * float(np.median(local)) / abs(border.stop - border.start))
            stretches.append((number, low - pad, high + pad))
        for (i, axis), more in matching(knots, [s for s, _ in joined], stretches).items():
            own = list(result[i])
            own[axis] = np.sort(np.concatenate([own[axis], more]))
            result[i] = (own[0], own[1])
        return result

    def _fine(self, sheet: Sheet) -> tuple[Array, Array]:
        """Knots that divide spans too wide to hold the copies."""
        extra = np.empty(0), np.empty(0)
        number = list(self.ground.sheets).index(sheet.index)
        some = self.touched[:, number] & ~self.matched
        if not some.any():
            return extra
        widest = [float(arc_lengths(sheet.net, axis).max()) for axis in (0, 1)]
        if all(UNEVEN * x <= SPARE * self._least(kv) for x, kv in zip(widest, sheet.knots, strict=True)):
            return extra
        limit = np.array([FACETTED if k.degree == 1 else MISSED for k in sheet.knots]) * self.height
        extra = self._first(sheet, some, max(widest))
        for _ in range(ROUNDS):
            knots = self._spans(sheet, extra)
            if knots[0].count * knots[1].count > MOST:
                raise EditError(
                    f"the copies need {knots[0].count} × {knots[1].count} control points on "
                    f"#{sheet.faces[0].index + 1}",
                    "use larger or fewer copies",
                )
            poles = self._interpolant(sheet, *knots)
            delta = Net(*knots, poles, weights_over(sheet, *knots))
            more = []
            for axis, (kv, (uv, span)) in enumerate(zip(knots, self._between(sheet, knots, some), strict=True)):
                points, _, _, normals = sheet.evaluate(uv)
                wanted, _ = self.ideal(sheet, points, normals, self.matched)
                missed = np.linalg.norm(np.asarray(delta.evaluate(uv)) - wanted, axis=1)
                worst = np.zeros(kv.spans)
                np.maximum.at(worst, span, missed)
                pieces = np.clip(np.ceil((worst / limit[axis]) ** (1 / (kv.degree + 1))), 1, PIECES)
                pieces = np.minimum(pieces, self._most(sheet, knots, axis, uv, span)).astype(int)
                more.append(divided(kv, pieces))
            if not any(len(x) for x in more):
                break
            extra = np.sort(np.r_[extra[0], more[0]]), np.sort(np.r_[extra[1], more[1]])
        return extra

    def _most(self, sheet: Sheet, knots: tuple[KnotVector, KnotVector], axis: int, uv: Array, span: Array) -> Array:
        """Into how many pieces spans may be divided: copies need none narrower than those that held the feature."""
        kv = knots[axis]
        speed = np.zeros(kv.spans)
        np.maximum.at(speed, span, np.linalg.norm(sheet.evaluate(uv)[1 + axis], axis=1))
        least = self._least(kv)
        width = speed * np.diff(kv.breaks)
        return np.where(width > SPARE * least, np.ceil(width / least), 1.0)

    def _least(self, kv: KnotVector) -> float:
        """Width of the spans that hold the smallest copy at this degree, mm."""
        return self.feature.spacing * float(self.sizes.min()) * (1.0 if kv.degree > 2 else 0.5)

    def _first(self, sheet: Sheet, some: Array, longest: float) -> tuple[Array, Array]:
        """Knots that make spans under copies no longer than a share of their reach."""
        if 2 * longest <= float(self.reach[some].min()) / FIRST:
            return np.empty(0), np.empty(0)
        us, vs = (np.unique(np.r_[k.breaks, np.linspace(*k.domain, 160)]) for k in sheet.knots)
        points = np.asarray(sheet.net.grid(us, vs))
        from scipy.spatial import cKDTree

        apart = np.full(points.shape[:2], np.inf)
        tree = cKDTree(points.reshape(-1, 3))
        for i in np.flatnonzero(some):
            hit = tree.query_ball_point(self.charts.origin[i], self.reach[i])
            apart.ravel()[hit] = np.minimum(apart.ravel()[hit], self.reach[i])
            near = tree.query(self.charts.origin[i])[1]
            apart.ravel()[near] = min(apart.ravel()[near], self.reach[i])
        result = []
        for axis, (kv, at) in enumerate(zip(sheet.knots, (us, vs), strict=True)):
            length = np.linalg.norm(np.diff(points, axis=axis), axis=-1)
            room = np.minimum(*(apart[s] if axis == 0 else apart[:, s] for s in (slice(None, -1), slice(1, None))))
            room = np.minimum.reduce([room, apart[1:] if axis == 0 else apart[:, 1:]])
            room = np.minimum(room, apart[:-1] if axis == 0 else apart[:, :-1])
            cell = np.searchsorted(kv.breaks, (at[1:] + at[:-1]) / 2) - 1
            lengths = np.zeros((kv.spans, length.shape[1 - axis]))
            np.add.at(lengths, cell, length if axis == 0 else length.T)
            rooms = np.full((kv.spans, length.shape[1 - axis]), np.inf)
            np.minimum.at(rooms, cell, room if axis == 0 else room.T)
            needed = (lengths / (rooms / FIRST)).max(axis=1)
            result.append(divided(kv, np.maximum(np.ceil(needed - 1e-6), 1).astype(int)))
        return result[0], result[1]

    def _between(self, sheet: Sheet, knots: tuple[KnotVector, KnotVector], some: Array) -> list[tuple[Array, Array]]:
        """For each direction: places under copies half-way between Greville points in it, on them in the other, and
        the spans they are in."""
        from scipy.spatial import cKDTree

        at = [k.greville() for k in knots]
        tree = cKDTree(np.asarray(sheet.net.grid(at[0], at[1])).reshape(-1, 3))
        rng = np.random.default_rng(0)
        which = np.flatnonzero(some)
        hits = tree.query_ball_point(self.charts.origin[which], self.reach[which])
        most = int(np.clip(ALL // max(len(which), 1), FEWEST, CHECKS))
        chosen = [np.asarray(h, int) if len(h) <= most else rng.choice(h, most, replace=False) for h in hits]
        index = np.unique(np.concatenate(chosen)) if chosen else np.empty(0, int)
        found = []
        for axis, kv in enumerate(knots):
            place = list(np.divmod(index, len(at[1])))
            order = np.argsort(at[axis], kind="stable")
            rank = np.empty(len(order), int)
            rank[order] = np.arange(len(order))
            own = rank[place[axis]]
            keep = own + 1 < len(order)
            uv = np.stack([at[0][place[0]], at[1][place[1]]], axis=1)[keep]
            uv[:, axis] = (at[axis][order[own[keep]]] + at[axis][order[own[keep] + 1]]) / 2
            span = np.clip(np.searchsorted(kv.breaks, uv[:, axis], side="right") - 1, 0, kv.spans - 1)
            found.append((uv, span))
        return found

    def _interpolant(self, sheet: Sheet, u: KnotVector, v: KnotVector) -> Array:
        """Control points whose surface takes the ideal displacement (of copies that are no shifts), part's frame."""
        key = sheet.index, u, v
        if key in self._kept:
            return self._kept[key]
        us, vs = u.greville(), v.greville()
        points, normals = sheet.lattice(us, vs)
        values, count = self.ideal(sheet, points.reshape(-1, 3), normals.reshape(-1, 3), self.matched)
        values, near = values.reshape(points.shape), count.reshape(points.shape[:2]) > 0
        weights = weights_over(sheet, u, v)
        if weights is not None:
            values = values * np.asarray(Net(u, v, weights[..., None]).grid(us, vs))
        poles = interpolated(u, v, values)
        if weights is not None:
            poles = poles / weights[..., None]
        self._kept = {k: x for k, x in self._kept.items() if k[0] != sheet.index}
        self._kept[key] = np.where(_grown(near, (u, v))[..., None], poles, 0.0)
        return self._kept[key]

    def _offsets(
        self,
        extra: Mapping[int, tuple[Array, Array]],
        joined: Sequence[Seam],
        moving: set[int],
        keep: str,
        removed: Mapping[int, Array],
    ) -> tuple[dict[int, Offset], dict[int, Array]]:
        """Offsets that obey every constraint, and those (part's frame) that the copies alone would be."""
        model = self.ground.model
        nets, delta, free, before = {}, {}, {}, {}
        matched = self.matched
        for number, (i, sheet) in enumerate(self.ground.sheets.items()):
            if not self.touched[:, number].any() and i not in removed:
                continue
            own = model.surfaces[i].net
            net = own.refined(*extra[i])
            own_space = np.zeros(own.poles.shape) if i not in removed else removed[i].copy()
            if i in self.shifts:
                own_space += self.shifts[i]
            poles = refined_offset(own, net, own_space)
            alone = poles - (refined_offset(own, net, removed[i]) if i in removed else 0.0)
            if (self.touched[:, number] & ~matched).any():
                laid = self._interpolant(sheet, net.u, net.v) @ sheet.turn
                poles, alone = poles + laid, alone + laid
            faces = [model.faces[f] for f in model.surfaces[i].faces]
            edited = [f.index for f in sheet.faces]
            free[i] = separate(net, faces, edited, keep, moving).free
            before[i] = alone
            nets[i], delta[i] = net, np.where(free[i][..., None], poles, 0.0)
        if joined:
            needed = sorted({b.surface for s in joined for b in (s.a, s.b)})
            some = held({i: nets[i] for i in needed}, joined, delta, free)
            for i, d in some.items():
                delta[i] = np.where(np.linalg.norm(d, axis=-1, keepdims=True) > 1e-13, d, 0.0)
        return {i: Offset(d, *extra[i]) for i, d in delta.items()}, before

    def _broken(self, joined: Sequence[Seam], offsets: Mapping[int, Offset]) -> list[int]:
        """Seams that would not hold."""
        if not joined:
            return []
        model = self.ground.model
        surfaces = list(model.surfaces)
        for i, o in offsets.items():
            net = o.over(surfaces[i].net)
            surfaces[i] = Surface(i, Net(net.u, net.v, net.poles + o.poles, net.weights), surfaces[i].faces)
        after = model.with_surfaces(surfaces)
        broken = []
        for seam in joined:
            gap, angle = opening(after, seam.a, seam.b)
            if gap > seam.gap + WIDER or (seam.joint.order and angle > seam.angle + STEEPER):
                broken.append(seam.edge)
        return broken

    def _compared(
        self, offsets: Mapping[int, Offset], before: Mapping[int, Array], removed: Mapping[int, Array]
    ) -> list[Copy]:
        """Every copy beside its ideal."""
        count = len(self.places)
        worst, lost, squares, samples = np.zeros(count), np.zeros(count), np.zeros(count), np.zeros(count)
        faces: list[set[int]] = [set() for _ in range(count)]
        from scipy.spatial import cKDTree

        for number, (i, sheet) in enumerate(self.ground.sheets.items()):
            if i not in offsets or not self.touched[:, number].any():
                continue
            own = self.ground.model.surfaces[i].net
            net = offsets[i].over(own)
            taken = refined_offset(own, net, removed[i]) if i in removed else 0.0
            both = np.concatenate([(offsets[i].poles - taken) @ sheet.turn.T, before[i] @ sheet.turn.T], axis=-1)
            pair = Net(net.u, net.v, both, net.weights)
            some = self.touched[:, number]
            for uv, _ in self._between(sheet, (net.u, net.v), some):
                only = np.full(len(uv), sheet.faces[0].index)
                uv = uv[sheet.covers(uv)]
                points, _, _, normals = sheet.evaluate(uv)
                wanted, _ = self.ideal(sheet, points, normals)
                if not len(uv):
                    continue
                on = self.ground.faces(np.full(len(uv), i), uv) if len(sheet.faces) > 1 else only
                values = np.asarray(pair.evaluate(uv))
                missed = np.linalg.norm(values[:, :3] - wanted, axis=1)
                gone = np.linalg.norm(values[:, :3] - values[:, 3:], axis=1)
                chosen = np.flatnonzero(some)
                hits = cKDTree(points).query_ball_point(self.charts.origin[chosen], self.reach[chosen])
                for k, hit in zip(chosen, hits, strict=True):
                    if not len(hit):
                        continue
                    worst[k], lost[k] = max(worst[k], missed[hit].max()), max(lost[k], gone[hit].max())
                    squares[k] += (missed[hit] ** 2).sum()
                    samples[k] += len(hit)
                    faces[k].update(on[hit].tolist())
        rms = np.sqrt(squares / np.maximum(samples, 1))
        return [
            Copy(
                place.label,
                tuple(float(x) for x in self.feet.points[k]),  # type: ignore[arg-type]
                tuple(sorted(faces[k] - {-1})),
                float(worst[k]),
                float(rms[k]),
                float(lost[k]),
                bool(self.matched[k]),
            )
            for k, place in enumerate(self.places)
        ]


def _numbers(faces: Sequence[int]) -> str:
    return " ".join(f"#{i + 1}" for i in faces)


def _part(feet: Feet, some: slice) -> Feet:
    return replace(feet, **{name: getattr(feet, name)[some] for name in feet.__dataclass_fields__})


def weights_over(sheet: Sheet, u: KnotVector, v: KnotVector) -> Array | None:
    return sheet.net.weights if sheet.net.weights is None else sheet.net.over(u, v).weights


def refined_offset(own: Net, net: Net, offset: Array) -> Array:
    """Offsets over a net's own knots as offsets over finer ones."""
    if net is own:
        return offset
    return Net(own.u, own.v, offset, own.weights).over(net.u, net.v).poles


def divided(kv: KnotVector, pieces: Array) -> Array:
    """Knots that divide each span into equal pieces."""
    found = [
        low + (high - low) * np.arange(1, k) / k
        for low, high, k in zip(kv.breaks[:-1], kv.breaks[1:], pieces, strict=True)
        if k > 1
    ]
    return np.concatenate(found) if found else np.empty(0)


def _grown(near: Array, knots: tuple[KnotVector, KnotVector]) -> Array:
    """Poles at most one beside those near a copy."""
    for axis, kv in enumerate(knots):
        for step in (-1, 1):
            moved = np.roll(near, step, axis)
            if not kv.periodic:
                edge = 0 if step == 1 else -1
                (moved if axis == 0 else moved.T)[edge] = False
            near = near | moved
    return near


def _shift(source: Sheet, target: Sheet, box: tuple[tuple[int, int], ...], way: Array) -> tuple[int, int] | None:
    """By how many poles a target's knots are those of the source moved by ``way``; None where they are not."""
    found = []
    for axis, (a, b) in enumerate(box):
        one, two = source.knots[axis], target.knots[axis]
        if one.degree != two.degree:
            return None
        d = one.degree
        own = one.knots[a : b + d + 1]
        span = np.diff(own)[np.diff(own) > 0].min()
        flat, turn = two.knots, 0.0
        wanted = own[0] + way[axis]
        if two.periodic:
            low, high = two.domain
            turn = np.floor((wanted - low) / (high - low)) * (high - low)
            flat = np.concatenate([two.breaks[:-1].repeat(two.multiplicities[:-1]) + k * two.period for k in range(3)])
        start = int(np.abs(flat - (wanted - turn)).argmin())
        # of equal knots the one from which the others follow
        for first in range(max(start - d, 0), min(start + d + 1, len(flat) - len(own) + 1)):
            if np.abs(flat[first : first + len(own)] + turn - own - way[axis]).max() <= EXACT * span:
                k = first - a
                if two.periodic:
                    k += _first_index(two)
                found.append(k)
                break
        else:
            return None
    return found[0], found[1]


def _first_index(kv: KnotVector) -> int:
    """Index of the function whose support begins with the first knot of a periodic domain."""
    return int(np.searchsorted(kv.knots, kv.domain[0], side="left")) % kv.count
