"""Features taken from a model: above what surrounds them, or above a level."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mracad.bspline.fit import through
from mracad.bspline.surface import Net
from mracad.constraint.frozen import separate
from mracad.constraint.seam import seams
from mracad.constraint.wishes import Wishes
from mracad.edit.feature.base import Surroundings
from mracad.edit.feature.chart import Charts
from mracad.edit.feature.detail import LOST, Feature, Origin, taper
from mracad.edit.feature.ground import STEEP, Ground
from mracad.edit.feature.locate import Window
from mracad.edit.feature.patch import Patch
from mracad.errors import EditError

Array = np.ndarray

FINEST, COARSEST = 512, 64
"""Cells of a table across, at most and at least."""


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
    around = Surroundings(ground, window, reach, label)
    chart = around.chart
    offsets: dict[int, Array] = {}
    windows: dict[int, Array] = {}
    for index, patch in ground.patches.items():
        net = patch.net
        points, normals = _grid(patch)
        local = (points - chart.origin[0]) @ chart.axes[0].T
        hit = np.flatnonzero(
            (np.linalg.norm(local[:, :2], axis=1) <= 1.1 * reach)
            & (np.abs(local[:, 2]) <= 1.5 * reach)
            & (normals @ chart.axes[0][2] > -STEEP)
        )
        if not len(hit):
            continue
        feet = around.feet(local[hit])
        shares = window.share(patch, hit, chart.coordinates(feet, np.zeros(len(hit), int)), width)
        weight = taper(shares)
        hit, weight, feet = hit[shares < 1], weight[shares < 1], feet[shares < 1]
        if not len(hit):
            continue
        values = np.zeros((len(points), 3))
        values[hit] = (local[hit] - feet) @ chart.axes[0] @ patch.turn
        flat = np.zeros(len(points))
        flat[hit] = weight
        w = flat.reshape(net.poles.shape[:2])
        offsets[index] = through(net, values.reshape(*net.poles.shape)) * w[..., None]
        windows[index] = w
    return _made(ground.without(offsets), chart, window, reach, offsets, windows, keep, label, named)


def between_levels(
    ground: Ground, bands: Mapping[int, Array], window: Window, width: float, keep: str, label: str, named: str
) -> Feature:
    """The feature that bands of detail (offsets by surface) make under a window; ``ground`` is without them."""
    reach = window.reach(width)
    feet = window.feet
    found, _ = ground.charts(feet, feet.along, np.array([1.05 * reach]))
    offsets, windows = {}, {}
    for index, patch in ground.patches.items():
        points, normals = _grid(patch)
        apart = np.linalg.norm(points - feet.points[0], axis=1)
        hit = np.flatnonzero((apart <= 1.02 * reach) & (normals @ feet.normals[0] > STEEP))
        if not len(hit):
            continue
        zero = np.zeros(len(hit), int)
        shares = window.share(patch, hit, found.coordinates(found.local(points[hit], zero), zero), width)
        flat = np.zeros(len(points))
        flat[hit] = taper(shares)
        w = flat.reshape(patch.net.poles.shape[:2])
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
    orders = seams(model, {face.index for i in offsets for face in ground.patches[i].faces}, Wishes(keep)).orders
    for index in list(offsets):
        patch = ground.patches[index]
        surface = model.surfaces[index]
        faces = [model.faces[i] for i in surface.faces]
        edges = [model.edges[trim.edge] for face in faces for trim in face.trims if model.edges]
        moving = {e.index for e in edges if len(e.sides) == 2 and {side.face for side in e.sides} <= ground.chosen}
        free = separate(surface.net, faces, [f.index for f in patch.faces], orders, moving).free
        lost = float(np.linalg.norm(offsets[index][~free], axis=-1).max(initial=0.0))
        if lost > LOST * largest:
            raise EditError(
                f"{label}: {lost:.3g} mm of the feature lie on control points of #{patch.faces[0].index + 1} that "
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
            apart = np.linalg.norm(np.diff(ground.patches[index].net.poles, axis=axis), axis=-1)
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
        patch = ground.patches[index]
        uv, found = _under(patch, chart, ab)
        channels = np.concatenate([offset @ patch.turn.T, windows[index][..., None]], axis=-1)
        values = np.asarray(Net(patch.net.u, patch.net.v, channels, patch.net.weights).evaluate(uv[found]))
        new = found.copy()
        new[found] = table[disc[found], 3] == 0
        values = values[new[found]]
        table[disc[new], :3] = np.einsum("qij,qj->qi", frames[new], values[:, :3])
        table[disc[new], 3] = values[:, 3]
    return table.reshape(cells + 1, cells + 1, 4)


def _under(patch: Patch, chart: Charts, ab: Array) -> tuple[Array, Array]:
    """Parameters of the points of a patch over places of a chart, and which of them exist."""
    from scipy.spatial import cKDTree

    origin, (x, y, n) = chart.origin[0], chart.axes[0]
    us, vs = (np.unique(np.concatenate([k.breaks, (k.breaks[1:] + k.breaks[:-1]) / 2])) for k in patch.knots)
    uv = np.stack(np.meshgrid(us, vs, indexing="ij"), axis=-1).reshape(-1, 2)
    spots = (np.asarray(patch.net.grid(us, vs)).reshape(-1, 3) - origin) @ chart.axes[0].T
    near = (np.linalg.norm(spots[:, :2], axis=1) <= 1.5 * chart.reach[0]) & (np.abs(spots[:, 2]) < 2 * chart.reach[0])
    if not near.any():
        near = np.ones(len(spots), bool)
    uv = uv[near][cKDTree(spots[near, :2]).query(ab)[1]]
    low, high = patch.domain
    size = high - low
    for _ in range(8):
        s, su, sv = patch.net.evaluate(uv, 1)
        r = np.stack([(s - origin) @ x - ab[:, 0], (s - origin) @ y - ab[:, 1]], axis=1)
        a, b, c, d = su @ x, sv @ x, su @ y, sv @ y
        det = a * d - b * c
        det = np.where(np.abs(det) > 1e-300, det, 1e-300)
        step = np.stack([d * r[:, 0] - b * r[:, 1], a * r[:, 1] - c * r[:, 0]], axis=1) / det[:, None]
        uv = uv - np.clip(step, -0.1 * size, 0.1 * size)
        if not patch.periodic.all():
            uv = np.where(patch.periodic, uv, np.clip(uv, low - 0.01 * size, high + 0.01 * size))
        if np.abs(step).max(initial=0.0) < 1e-13 * size.max():
            break
    inside = ((uv >= low - 1e-9 * size) & (uv <= high + 1e-9 * size)) | patch.periodic
    tight = np.linalg.norm(r, axis=1) < 1e-6 * chart.reach[0]
    return uv, inside.all(axis=1) & tight & ((s - origin) @ n > -2 * chart.reach[0])


def _grid(patch: Patch) -> tuple[Array, Array]:
    """Greville points of a patch and outward normals there, ``(nu nv, 3)``."""
    net = patch.net
    points, normals = patch.lattice(net.u.greville(), net.v.greville())
    return points.reshape(-1, 3), normals.reshape(-1, 3)
