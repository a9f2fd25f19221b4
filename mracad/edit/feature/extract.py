"""Features separated from a model: above their surroundings, or above a level."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from mracad.bspline.fit import through
from mracad.bspline.surface import Net, pairs
from mracad.edit.feature.base import under
from mracad.edit.feature.chart import Charts
from mracad.edit.feature.detail import LOST, Feature, Origin, load, taper
from mracad.edit.feature.ground import STEEP, Ground
from mracad.edit.feature.locate import Window, window
from mracad.edit.feature.patch import Patch
from mracad.edit.feature.source import made
from mracad.errors import EditError
from mracad.model.brep import Model
from mracad.seam.hold import separate
from mracad.seam.natural import seams
from mracad.seam.wishes import Wishes
from mracad.spec.places import Disc, Rectangle, Stored, feature
from mracad.spec.quantity import band_of, length
from mracad.spec.steps import Featured, Transfer
from mracad.wavelet.project import band

Array = np.ndarray

FINEST, COARSEST = 512, 64
"""Largest and smallest number of cells across a table."""

NEWTON = 8
"""Steps to find the parameters of a point over a place."""


@dataclass(frozen=True, eq=False)
class Cut:
    """The part of a feature on one surface: offsets ``(nu, nv, 3)`` of its control points, and the window ``(nu, nv)``
    that contains them."""

    offset: Array
    window: Array


def feature_of(model: Model, options: Featured | Transfer, faces: Collection[int], text: str) -> Feature:
    """The feature that a text names: from a file, a source, or a window on faces of a model.

    Raises
    ------
    UsageError
        For an invalid text.
    EditError
        If there is no feature, or edges hold part of it.
    FileError
        For an invalid file.
    """
    given = feature(text, "feature")
    if isinstance(given, Stored):
        return load(given.path)
    width = None if options.taper is None else length(options.taper, model.diagonal, "taper")
    if not isinstance(given, Disc | Rectangle):
        return made(given, text, width)
    if not faces:
        raise EditError(f"{model.name}: no NURBS face to edit", "select faces with --faces")
    ground = Ground.of(model, faces)
    area = window(ground, given, text, width)
    if options.base == "surroundings":
        return above_surroundings(ground, area, options.keep)
    low, high = band_of(options.band or "", model.diagonal)
    parts = {i: band(model.surfaces[i].net, low, high) for i in ground.patches}
    clear = Ground.of(model, faces, {i: coarse.poles for i, (coarse, _) in parts.items()})
    return between_levels(clear, {i: fine.poles for i, (_, fine) in parts.items()}, area, options.keep)


def above_surroundings(ground: Ground, area: Window, keep: str) -> Feature:
    """The feature under a window, above the surface that its surroundings determine.

    Parameters
    ----------
    ground : Ground
    area : Window
    keep : {"as-is", "g0", "g1", "g2"}
        Continuity of edges that do not move.
    """
    base, reach = under(ground, area), area.reach
    (origin,), (frame,), cuts = base.chart.origin, base.chart.axes, {}
    for index, patch in ground.patches.items():
        points, normals = _lattice(patch)
        local = (points - origin) @ frame.T
        near = (np.linalg.norm(local[:, :2], axis=1) <= 1.1 * reach) & (np.abs(local[:, 2]) <= 1.5 * reach)
        hit = np.flatnonzero(near & (normals @ frame[2] > -STEEP))
        if len(hit):
            feet = base.feet(local[hit])
            shares = area.shares(patch, hit, base.chart.coordinates(feet, np.zeros(len(hit), int)))
            values = np.zeros(patch.net.poles.shape)
            values.reshape(-1, 3)[hit] = (local[hit] - feet) @ frame @ patch.turn
            weight = taper(shares)
            if weight.any():
                offset = through(patch.net, np.where((shares < 1)[..., None], values, 0.0))
                cuts[index] = Cut(offset * weight[..., None], weight)
    made = _made(ground.without({i: cut.offset for i, cut in cuts.items()}), base.chart, area, cuts, keep)
    return replace(made, base=base.error)


def between_levels(ground: Ground, bands: Mapping[int, Array], area: Window, keep: str) -> Feature:
    """The feature formed by bands of detail (offsets by surface) under a window; ``ground`` is without them."""
    feet, reach, cuts = area.feet, area.reach, {}
    chart, _ = ground.charts(feet, feet.along, np.array([1.05 * reach]))
    for index, patch in ground.patches.items():
        points, normals = _lattice(patch)
        near = np.linalg.norm(points - feet.points[0], axis=1) <= 1.02 * reach
        hit = np.flatnonzero(near & (normals @ feet.normals[0] > STEEP))
        zero = np.zeros(len(hit), int)
        weight = taper(area.shares(patch, hit, chart.coordinates(chart.local(points[hit], zero), zero)))
        if weight.any():
            cuts[index] = Cut(bands[index] * weight[..., None], weight)
    return _made(ground, chart, area, cuts, keep)


def _lattice(patch: Patch) -> tuple[Array, Array]:
    """Greville points of a patch and outward normals there, ``(nu nv, 3)``."""
    points, normals = patch.lattice(*(k.greville() for k in patch.knots))
    return points.reshape(-1, 3), normals.reshape(-1, 3)


def _made(ground: Ground, chart: Charts, area: Window, cuts: Mapping[int, Cut], keep: str) -> Feature:
    """The feature with its table, on a ground without it."""
    largest = max((float(np.linalg.norm(cut.offset, axis=-1).max()) for cut in cuts.values()), default=0.0)
    if not cuts:
        raise EditError(f"{area.label}: no control point lies under the window", "use a larger one")
    if largest <= 1e-7:
        raise EditError(
            f"{area.label}: nothing stands out there", "choose a window over a feature; see mracad feature list"
        )
    orders = seams(ground.model, {f.index for i in cuts for f in ground.patches[i].faces}, Wishes(keep)).orders
    free = {i: _free(ground, ground.patches[i], orders) for i in cuts}
    for i, cut in cuts.items():
        lost = float(np.linalg.norm(cut.offset[~free[i]], axis=-1).max(initial=0.0))
        if lost > LOST * largest:
            raise EditError(
                f"{area.label}: {lost:.3g} mm of the feature is on control points of "
                f"#{ground.patches[i].faces[0].index + 1} that edges or holes keep in place",
                "use a smaller window or --keep g0",
            )
    cuts = {i: Cut(np.where(free[i][..., None], cut.offset, 0.0), cut.window) for i, cut in cuts.items()}
    spacing = _spacing(ground, cuts, area.reach)
    origin = Origin({i: cut.offset for i, cut in cuts.items()}, ground.feet(chart.origin), chart.axes[0])
    table = _table(ground, chart, cuts, area.reach, spacing)
    return Feature(area.radius, area.reach, spacing, table, area.name, origin)


def _free(ground: Ground, patch: Patch, orders: Mapping[int, int]) -> Array:
    """Control points of a patch that may move, with the edges between faces of the ground."""
    model = ground.model
    surface = model.surfaces[patch.index]
    faces = [model.faces[i] for i in surface.faces]
    edges = [model.edges[trim.edge] for face in faces for trim in face.trims if model.edges]
    moving = {e.index for e in edges if len(e.sides) == 2 and {side.face for side in e.sides} <= ground.chosen}
    return separate(surface.net, faces, [f.index for f in patch.faces], orders, moving).free


def _spacing(ground: Ground, cuts: Mapping[int, Cut], reach: float) -> float:
    """Distance between control points under a window, in the denser direction, mm."""
    steps = []
    for index, cut in cuts.items():
        for axis in (0, 1):
            apart = np.linalg.norm(np.diff(ground.patches[index].net.poles, axis=axis), axis=-1)
            own = apart[(cut.window[1:] if axis == 0 else cut.window[:, 1:]) > 0]
            steps += [float(np.median(own))] if len(own) else []
    return max(min(steps, default=reach), 1e-3 * reach)


def _table(ground: Ground, chart: Charts, cuts: Mapping[int, Cut], reach: float, spacing: float) -> Array:
    """Displacements in carried frames and window over the square of normal coordinates."""
    cells = int(np.clip(2 * np.ceil(2 * reach / spacing), COARSEST, FINEST))
    side = np.linspace(-reach, reach, cells + 1)
    xy = pairs(side, side)
    table = np.zeros((len(xy), 4))
    disc = np.flatnonzero(np.linalg.norm(xy, axis=1) <= reach * (1 + 1e-9))
    zero = np.zeros(len(disc), int)
    ab = chart.places(xy[disc], zero)
    frames = chart.jets(ab, zero)[1]
    for index, cut in cuts.items():
        patch = ground.patches[index]
        uv, new = _under(patch, chart, ab)
        new &= table[disc, 3] == 0
        channels = np.concatenate([cut.offset @ patch.turn.T, cut.window[..., None]], axis=-1)
        values = np.asarray(Net(*patch.knots, channels, patch.net.weights).evaluate(uv[new]))
        table[disc[new], :3] = np.einsum("qij,qj->qi", frames[new], values[:, :3])
        table[disc[new], 3] = values[:, 3]
    return table.reshape(cells + 1, cells + 1, 4)


def _under(patch: Patch, chart: Charts, ab: Array) -> tuple[Array, Array]:
    """Parameters of the points of a patch over places of a chart, and whether they exist."""
    from scipy.spatial import cKDTree

    (origin,), (frame,), (reach,) = chart.origin, chart.axes, chart.reach
    us, vs = (np.unique(np.concatenate([k.breaks, (k.breaks[1:] + k.breaks[:-1]) / 2])) for k in patch.knots)
    spots = (np.asarray(patch.net.grid(us, vs)).reshape(-1, 3) - origin) @ frame.T
    near = (np.linalg.norm(spots[:, :2], axis=1) <= 1.5 * reach) & (np.abs(spots[:, 2]) < 2 * reach)
    if not near.any():
        near[:] = True
    uv = pairs(us, vs)[near][cKDTree(spots[near, :2]).query(ab)[1]]
    low, high = patch.domain
    size = high - low
    for _ in range(NEWTON):
        s, su, sv = (np.asarray(x) for x in patch.net.evaluate(uv, 1))
        r = np.stack([(s - origin) @ axis for axis in frame[:2]], axis=1) - ab
        (a, c), (b, d) = ([way @ axis for axis in frame[:2]] for way in (su, sv))
        det = a * d - b * c
        det = np.where(np.abs(det) > 1e-300, det, 1e-300)
        step = np.stack([d * r[:, 0] - b * r[:, 1], a * r[:, 1] - c * r[:, 0]], axis=1) / det[:, None]
        uv = uv - np.clip(step, -0.1 * size, 0.1 * size)
        uv = np.where(patch.periodic, uv, np.clip(uv, low - 0.01 * size, high + 0.01 * size))
        if np.abs(step).max(initial=0.0) < 1e-13 * size.max():
            break
    inside = ((uv >= low - 1e-9 * size) & (uv <= high + 1e-9 * size)) | patch.periodic
    tight = np.linalg.norm(r, axis=1) < 1e-6 * reach
    return uv, inside.all(axis=1) & tight & ((s - origin) @ frame[2] > -2 * reach)
