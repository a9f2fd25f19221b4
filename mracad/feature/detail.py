"""A detail feature: a displacement of compact support, told from what it stands above.

The *table* of a feature holds its displacement in the frames carried from its place (along x, along y, along the
normal) and its window, on a square grid of geodesic normal coordinates in millimetres: nothing in it depends on the
parameters, knots or units of where it was found.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import msgspec
import numpy as np

from mracad.bspline.interpolate import interpolated
from mracad.bspline.net import Net
from mracad.constraint.frozen import separate
from mracad.errors import EditError, FileError
from mracad.feature.chart import DEGREE, Charts, charts, monomials
from mracad.feature.ground import STEEP, Feet, Ground, Sheet, axes
from mracad.feature.place import Window

Array = np.ndarray

FORMAT = "mracad feature 1"

RING = 1.5
"""What lies between the rim of a feature and so many times its radius tells what it stands above."""

WORTH, BETTER = 3e-3, 3.0
"""A ground is bridged by more than a plane where that changes the ring by more than this share of the feature's height,
and by degree 6 instead of 4 where that fits so many times better."""

SECTORS = 16
"""The ring must be there in three quarters of so many directions."""

PLATE, CLOSE, CELLS = 600, 1.2, 64
"""Points of the ring that the thin plate passes through, first those up to so many times the reach; and the cells, up
to there, over which it is tabulated."""

NORMALS = 6
"""Steps to the foot of a point on the plate."""

FINEST, COARSEST = 512, 64
"""Cells of a table across, at most and at least."""

LOST = 0.01
"""Share of its height that frozen points may take from a feature unless parts may be clipped."""

SPREAD = 48
"""Samples of a sheet in each direction around a feature."""


@dataclass(frozen=True, eq=False)
class Origin:
    """Where in a model a feature was found: by surface, its offsets over the surface's own net, and the window.

    Attributes
    ----------
    offsets : dict of int to ndarray (nu, nv, 3)
        In each surface's own frame, mm.
    feet : Feet
        Its place on the ground without it.
    axes : ndarray (3, 3)
        Its frame there.
    """

    offsets: dict[int, Array]
    feet: Feet
    axes: Array


@dataclass(frozen=True, eq=False)
class Feature:
    """A feature.

    Attributes
    ----------
    radius, reach : float
        Where its taper begins and where it ends, mm.
    spacing : float
        Width of the knot spans that held it, mm.
    table : ndarray (n, n, 4)
        Displacement along x, y and the normal (mm) and window (0 to 1) over ``[-reach, reach]²``.
    name : str
    origin : Origin or None
        None for a feature from a file.
    """

    radius: float
    reach: float
    spacing: float
    table: Array
    name: str = ""
    origin: Origin | None = field(default=None)

    @cached_property
    def height(self) -> float:
        """Its largest displacement, mm."""
        return float(np.linalg.norm(self.table[..., :3], axis=-1).max())

    @cached_property
    def _splines(self) -> list[Array]:
        from scipy.ndimage import spline_filter

        return [spline_filter(self.table[..., k], order=3, mode="constant") for k in range(4)]

    def lookup(self, xy: Array) -> Array:
        """Displacement and window ``(q, 4)`` at normal coordinates (mm); zero beyond its reach."""
        from scipy.ndimage import map_coordinates

        cells = len(self.table) - 1
        at = (xy.T / self.reach + 1) * cells / 2
        channels = [map_coordinates(s, at, order=3, mode="constant", prefilter=False) for s in self._splines]
        return np.stack(channels, axis=-1)


class _File(msgspec.Struct, forbid_unknown_fields=True):
    """What a feature file holds; lengths in mm."""

    format: str
    name: str
    radius: float
    reach: float
    spacing: float
    size: int
    along_x: list[float]
    along_y: list[float]
    along_normal: list[float]
    window: list[float]


def save(feature: Feature) -> bytes:
    """A feature as the bytes of a file (JSON, ``docs/features.md``)."""
    columns = np.round(feature.table.reshape(-1, 4).T, 9).tolist()
    content = _File(FORMAT, feature.name, feature.radius, feature.reach, feature.spacing, len(feature.table), *columns)
    return msgspec.json.encode(content) + b"\n"


def load(path: str | os.PathLike) -> Feature:
    """A feature from a file; raises FileError."""
    file = Path(path)
    hint = "make one with mracad feature extract"
    try:
        content = msgspec.json.decode(file.read_bytes(), type=_File)
    except OSError as error:
        raise FileError(f"cannot read '{file}': {error.strerror}", hint) from error
    except (msgspec.DecodeError, msgspec.ValidationError) as error:
        raise FileError(f"'{file.name}' is not a feature: {error}", hint) from error
    columns = [content.along_x, content.along_y, content.along_normal, content.window]
    if content.format != FORMAT:
        raise FileError(f"'{file.name}' is not a feature: its format is {content.format!r}, not {FORMAT!r}", hint)
    if content.size < 4 or any(len(column) != content.size**2 for column in columns):
        raise FileError(f"'{file.name}' is damaged: its table is not {content.size} × {content.size}", hint)
    if not (0 < content.radius <= content.reach < np.inf and 0 < content.spacing < np.inf):
        raise FileError(f"'{file.name}' is damaged: its radius is {content.radius} mm", hint)
    table = np.array(columns).T.reshape(content.size, content.size, 4)
    return Feature(content.radius, content.reach, content.spacing, table, content.name)


def taper(share: Array) -> Array:
    """1 down to 0 as ``share`` goes from 0 to 1, with two vanishing derivatives at both ends."""
    t = np.clip(share, 0.0, 1.0)
    return np.asarray(1.0 - t**3 * (10.0 - 15.0 * t + 6.0 * t**2))


def above_surroundings(ground: Ground, window: Window, width: float, keep: str, label: str, named: str) -> Feature:
    """The feature under a window, above what a thin plate through its surroundings makes of the place.

    Parameters
    ----------
    ground : Ground
    window : Window
    width : float
        Of the taper beyond the window, mm.
    keep : {"g0", "g1", "g2"}
        Continuity of edges that do not move.
    label, named : str
        The window in messages, and the feature's name.
    """
    reach = window.reach(width)
    around = _Surroundings(ground, window, reach, label)
    chart = around.chart
    offsets: dict[int, Array] = {}
    windows: dict[int, Array] = {}
    for index, sheet in ground.sheets.items():
        net = sheet.net
        points, normals = _grid(sheet)
        local = (points - chart.origin[0]) @ chart.axes[0].T
        hit = np.flatnonzero(
            (np.linalg.norm(local[:, :2], axis=1) <= 1.1 * reach)
            & (np.abs(local[:, 2]) <= 1.5 * reach)
            & (normals @ chart.axes[0][2] > -STEEP)
        )
        if not len(hit):
            continue
        feet = around.feet(local[hit])
        shares = window.share(sheet, hit, chart.coordinates(feet, np.zeros(len(hit), int)), width)
        weight = taper(shares)
        hit, weight, feet = hit[shares < 1], weight[shares < 1], feet[shares < 1]
        if not len(hit):
            continue
        values = np.zeros((len(points), 3))
        values[hit] = (local[hit] - feet) @ chart.axes[0] @ sheet.turn
        values = values.reshape(*net.poles.shape)
        weights = np.ones(net.poles.shape[:2]) if net.weights is None else net.weights
        if net.weights is not None:
            first = Net(net.u, net.v, net.weights[..., None]).grid(net.u.greville(), net.v.greville())
            values = values * np.asarray(first)
        flat = np.zeros(len(points))
        flat[hit] = weight
        w = flat.reshape(net.poles.shape[:2])
        offsets[index] = interpolated(net.u, net.v, values) / weights[..., None] * w[..., None]
        windows[index] = w
    cleared = {i: ground.model.surfaces[i].net.poles - offset for i, offset in offsets.items()}
    ground = Ground(ground.model, ground.chosen, cleared)
    return _made(ground, chart, window, reach, offsets, windows, keep, label, named)


class _Surroundings:
    """What a thin plate through the surroundings of a window makes of the place.

    Attributes
    ----------
    chart : Charts
        Of one place: that of the window, brought to the plate.
    """

    def __init__(self, ground: Ground, window: Window, reach: float, label: str) -> None:
        from scipy.interpolate import RBFInterpolator, RectBivariateSpline

        feet, centre = window.feet, window.point
        points, near = (x[0] for x in ground.samples(feet, np.array([RING * reach]), SPREAD)[:2])
        normal = feet.normals[0]
        for _ in range(3):
            frame = axes(normal[None], feet.along)[0]
            local = (points - centre) @ frame.T
            radius = np.linalg.norm(local[:, :2], axis=1)
            ring = near & (radius > reach) & (radius <= RING * reach)
            angle = np.arctan2(local[ring, 1], local[ring, 0])
            if len(np.unique(np.floor((angle / (2 * np.pi) + 0.5) * SECTORS))) < 0.75 * SECTORS:
                raise EditError(
                    f"{label}: the feature, {2 * reach:.4g} mm across with its taper, is larger than its face",
                    "use a smaller window or a shorter --taper, or select its neighbours, too",
                )
            rows = np.c_[local[ring, :2], np.ones(ring.sum())]
            a, b, _ = np.linalg.lstsq(rows, local[ring, 2], rcond=None)[0]
            normal = frame.T @ (np.array([-a, -b, 1.0]) / np.sqrt(1 + a**2 + b**2))
        frame = axes(normal[None], feet.along)[0]
        local = (points - centre) @ frame.T / reach
        degree = _bridging(local, ring, near & ~ring)
        own = local[ring]
        rows = monomials(own[:, 0], own[:, 1], degree)
        graph = np.linalg.lstsq(rows, own[:, 2], rcond=None)[0]
        order = np.random.default_rng(0).permutation(len(own))
        far = np.linalg.norm(own[order, :2], axis=1) > CLOSE
        rim = order[np.argsort(far, kind="stable")][:PLATE]
        rest = own[rim, 2] - rows[rim] @ graph
        plate = RBFInterpolator(own[rim, :2], rest, kernel="thin_plate_spline", degree=1)
        side = np.linspace(-CLOSE, CLOSE, CELLS + 1)
        ab = np.stack(np.meshgrid(side, side, indexing="ij"), axis=-1).reshape(-1, 2)
        heights = monomials(ab[:, 0], ab[:, 1], degree) @ graph + plate(ab)
        level = float(heights[len(heights) // 2])
        # the chart's origin is the place on the plate, not on the feature
        self._spline = RectBivariateSpline(side, side, (heights - level).reshape(CELLS + 1, -1))
        self._reach = reach
        origin = centre + reach * level * frame[2]
        within = np.flatnonzero(np.linalg.norm(ab, axis=1) <= CLOSE)[::8]
        graph_points = origin + reach * np.c_[ab, heights - level][within] @ frame
        self.chart = charts(
            origin[None], frame[None], np.array([CLOSE * reach]), graph_points[None], np.ones((1, len(within)), bool)
        )

    def feet(self, local: Array) -> Array:
        """The points of the plate on whose normals points ``(q, 3)`` stand, both in the chart's axes, mm."""
        at = local / self._reach
        height = np.zeros(len(at))
        foot = at
        for _ in range(NORMALS):
            a, b = foot[:, 0], foot[:, 1]
            slopes = [self._spline.ev(a, b, dx=dx, dy=1 - dx) for dx in (1, 0)]
            normal = np.stack([-slopes[0], -slopes[1], np.ones(len(at))], axis=1)
            normal /= np.linalg.norm(normal, axis=1, keepdims=True)
            foot = at - height[:, None] * normal
            height = height + (foot[:, 2] - self._spline.ev(foot[:, 0], foot[:, 1])) * normal[:, 2]
            foot = at - height[:, None] * normal
        return np.asarray(self._reach * foot)


def _bridging(local: Array, ring: Array, within: Array) -> int:
    """Degree of the polynomial that the plate corrects.

    A plate reproduces cubics whatever its hole; what a ground has beyond them a higher degree must bridge, which makes
    more of the feature's own tails: only where that is much.
    """

    def missed(degree: int) -> tuple[float, float]:
        rows = monomials(local[:, 0], local[:, 1], degree)
        rest = local[:, 2] - rows @ np.linalg.lstsq(rows[ring], local[ring, 2], rcond=None)[0]
        return float(np.sqrt((rest[ring] ** 2).mean())), float(np.abs(rest[within]).max(initial=0.0))

    rest, height = missed(3)
    if rest <= WORTH * height:
        return 1
    return DEGREE if missed(DEGREE)[0] * BETTER < missed(4)[0] else 4


def between_levels(
    ground: Ground, bands: Mapping[int, Array], window: Window, width: float, keep: str, label: str, named: str
) -> Feature:
    """The feature that bands of detail (offsets by surface) make under a window; ``ground`` is without them."""
    reach = window.reach(width)
    feet = window.feet
    found, _ = ground.charts(feet, feet.along, np.array([1.05 * reach]))
    offsets, windows = {}, {}
    for index, sheet in ground.sheets.items():
        points, normals = _grid(sheet)
        apart = np.linalg.norm(points - feet.points[0], axis=1)
        hit = np.flatnonzero((apart <= 1.02 * reach) & (normals @ feet.normals[0] > STEEP))
        if not len(hit):
            continue
        zero = np.zeros(len(hit), int)
        shares = window.share(sheet, hit, found.coordinates(found.local(points[hit], zero), zero), width)
        flat = np.zeros(len(points))
        flat[hit] = taper(shares)
        w = flat.reshape(sheet.net.poles.shape[:2])
        if w.any():
            windows[index], offsets[index] = w, bands[index] * w[..., None]
    return _made(ground, found, window, reach, offsets, windows, keep, label, named)


def _made(
    ground: Ground,
    chart: Charts,
    window: Window,
    reach: float,
    offsets: dict[int, Array],
    windows: dict[int, Array],
    keep: str,
    label: str,
    named: str,
) -> Feature:
    """The feature with its table, on a ground without it."""
    largest = max((float(np.linalg.norm(x, axis=-1).max()) for x in offsets.values()), default=0.0)
    if not any(w.any() for w in windows.values()):
        raise EditError(f"{label}: no control point lies under the window", "use a larger one")
    if largest <= 1e-7:
        raise EditError(f"{label}: nothing stands out there", "name a window over a feature; see mracad feature list")
    model = ground.model
    for index in list(offsets):
        sheet = ground.sheets[index]
        surface = model.surfaces[index]
        faces = [model.faces[i] for i in surface.faces]
        edges = [model.edges[trim.edge] for face in faces for trim in face.trims if model.edges]
        moving = {e.index for e in edges if len(e.sides) == 2 and {side.face for side in e.sides} <= ground.chosen}
        free = separate(surface.net, faces, [f.index for f in sheet.faces], keep, moving).free
        lost = float(np.linalg.norm(offsets[index][~free], axis=-1).max(initial=0.0))
        if lost > LOST * largest:
            raise EditError(
                f"{label}: {lost:.3g} mm of the feature lie on control points of #{sheet.faces[0].index + 1} that "
                "an edge or a hole holds",
                "use a smaller window or --keep g0",
            )
        offsets[index] = np.where(free[..., None], offsets[index], 0.0)
    spacing = _spacing(ground, windows, reach)
    table = _table(ground, chart, reach, spacing, offsets, windows)
    origin = Origin(offsets, ground.feet(chart.origin), chart.axes[0])
    return Feature(window.radius, reach, spacing, table, named, origin)


def _spacing(ground: Ground, windows: Mapping[int, Array], reach: float) -> float:
    """Distance between control points under a window, in the denser direction, mm."""
    steps = []
    for index, w in windows.items():
        for axis in (0, 1):
            apart = np.linalg.norm(np.diff(ground.sheets[index].net.poles, axis=axis), axis=-1)
            own = apart[(w[1:] if axis == 0 else w[:, 1:]) > 0]
            steps += [float(np.median(own))] if len(own) else []
    return max(min(steps, default=reach), 1e-3 * reach)


def _table(
    ground: Ground,
    chart: Charts,
    reach: float,
    spacing: float,
    offsets: Mapping[int, Array],
    windows: Mapping[int, Array],
) -> Array:
    """Displacements in carried frames and window over the square of normal coordinates."""
    cells = int(np.clip(2 * np.ceil(2 * reach / spacing), COARSEST, FINEST))
    side = np.linspace(-reach, reach, cells + 1)
    xy = np.stack(np.meshgrid(side, side, indexing="ij"), axis=-1).reshape(-1, 2)
    table = np.zeros((len(xy), 4))
    disc = np.flatnonzero(np.linalg.norm(xy, axis=1) <= reach * (1 + 1e-9))
    zero = np.zeros(len(disc), int)
    ab = chart.places(xy[disc], zero)
    frames = chart.jets(ab, zero)[1]
    for index, offset in offsets.items():
        sheet = ground.sheets[index]
        uv, found = _under(sheet, chart, ab)
        channels = np.concatenate([offset @ sheet.turn.T, windows[index][..., None]], axis=-1)
        values = np.asarray(Net(sheet.net.u, sheet.net.v, channels, sheet.net.weights).evaluate(uv[found]))
        new = found.copy()
        new[found] = table[disc[found], 3] == 0
        values = values[new[found]]
        table[disc[new], :3] = np.einsum("qij,qj->qi", frames[new], values[:, :3])
        table[disc[new], 3] = values[:, 3]
    return table.reshape(cells + 1, cells + 1, 4)


def _under(sheet: Sheet, chart: Charts, ab: Array) -> tuple[Array, Array]:
    """Parameters of the points of a sheet over places of a chart, and which of them exist."""
    from scipy.spatial import cKDTree

    origin, (x, y, n) = chart.origin[0], chart.axes[0]
    us, vs = (np.unique(np.concatenate([k.breaks, (k.breaks[1:] + k.breaks[:-1]) / 2])) for k in sheet.knots)
    uv = np.stack(np.meshgrid(us, vs, indexing="ij"), axis=-1).reshape(-1, 2)
    spots = (np.asarray(sheet.net.grid(us, vs)).reshape(-1, 3) - origin) @ chart.axes[0].T
    near = (np.linalg.norm(spots[:, :2], axis=1) <= 1.5 * chart.reach[0]) & (np.abs(spots[:, 2]) < 2 * chart.reach[0])
    if not near.any():
        near = np.ones(len(spots), bool)
    uv = uv[near][cKDTree(spots[near, :2]).query(ab)[1]]
    low, high = sheet.domain
    size = high - low
    for _ in range(8):
        s, su, sv = sheet.net.evaluate(uv, 1)
        r = np.stack([(s - origin) @ x - ab[:, 0], (s - origin) @ y - ab[:, 1]], axis=1)
        a, b, c, d = su @ x, sv @ x, su @ y, sv @ y
        det = a * d - b * c
        det = np.where(np.abs(det) > 1e-300, det, 1e-300)
        step = np.stack([d * r[:, 0] - b * r[:, 1], a * r[:, 1] - c * r[:, 0]], axis=1) / det[:, None]
        uv = uv - np.clip(step, -0.1 * size, 0.1 * size)
        if not sheet.periodic.all():
            uv = np.where(sheet.periodic, uv, np.clip(uv, low - 0.01 * size, high + 0.01 * size))
        if np.abs(step).max(initial=0.0) < 1e-13 * size.max():
            break
    inside = ((uv >= low - 1e-9 * size) & (uv <= high + 1e-9 * size)) | sheet.periodic
    tight = np.linalg.norm(r, axis=1) < 1e-6 * chart.reach[0]
    return uv, inside.all(axis=1) & tight & ((s - origin) @ n > -2 * chart.reach[0])


def _grid(sheet: Sheet) -> tuple[Array, Array]:
    """Greville points of a sheet and outward normals there, ``(nu nv, 3)``."""
    net = sheet.net
    points, normals = sheet.lattice(net.u.greville(), net.v.greville())
    return points.reshape(-1, 3), normals.reshape(-1, 3)
