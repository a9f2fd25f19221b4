"""Proposed features: places where the detail of a face stands out of its surroundings.

On each surface the detail finer than a scale (by a projection, as for smoothing) is measured at scales that double, and
places where it is much larger than its median are looked at.  One is a feature if, under the window that shows it best,
it stands far higher above its base than that base is uncertain, which noise, rims and the shape itself never do, and if
it can be separated there.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from mracad.edit.feature.base import Base, under
from mracad.edit.feature.extract import above_surroundings
from mracad.edit.feature.ground import Ground
from mracad.edit.feature.locate import Window, window
from mracad.edit.feature.patch import Patch
from mracad.errors import EditError
from mracad.model.brep import Model
from mracad.spec import places
from mracad.wavelet.ladder import arc_lengths
from mracad.wavelet.project import at_scale

Array = np.ndarray

USUAL = 3.0
"""Ratio to the median above which detail is looked at."""

MOST = 25
"""Number of places that are looked at, those of the largest detail first."""

CLEAR = 8.0
"""Height of a feature over the error of its base, at least."""

FLOOR = 16.0
"""Height of a feature over the median of the finest detail of its face, which is noise, at least."""

WINDOWS, SMALLER = 4, 0.65
"""Number of windows that are tried at a place, and the ratio of their radii."""

RIM = 0.1
"""A feature ends where its detail falls below this share of its height."""

LARGEST = 0.5
"""Share of a face that one feature may cover."""

GROWS = 1.25
"""Ratio of heights above which a larger scale counts."""

LOBE, FAR = 0.15, 4.0
"""Detail lower than this share of a feature, within this many of its largest scales, is a side lobe."""

LEAST = 1e-4
"""Least height of a feature, mm."""


@dataclass(frozen=True)
class Found:
    """A proposed feature.

    Attributes
    ----------
    face : int
    place : (float, float, float)
        Its middle, mm.
    size, height : float
        Diameter and height, mm.
    scales : (float, float)
        Wavelengths between which most of it lies, mm.
    floor : float
        Height below which it would be noise, mm.
    window : (float, float, float, float), optional
        Middle and radius of a window that shows it, mm.
    """

    face: int
    place: tuple[float, float, float]
    size: float
    height: float
    scales: tuple[float, float]
    floor: float = 0.0
    window: tuple[float, float, float, float] | None = None

    @property
    def text(self) -> str:
        """The value for ``--feature``: a window twice as wide as the feature unless another is known to show it."""
        x, y, z, radius = self.around
        return f"near:{x:.6g},{y:.6g},{z:.6g},radius:{radius:.4g}"

    @property
    def around(self) -> tuple[float, ...]:
        """Middle and radius of that window, rounded as in the text, mm."""
        *middle, radius = np.round(self.window or (*self.place, self.size), 6) + 0.0
        return *(float(f"{x:.6g}") for x in middle), float(f"{radius:.4g}")


def found(model: Model, faces: Collection[int]) -> list[Found]:
    """Features of faces, the highest first."""
    proposed: list[Found] = []
    for surface in model.surfaces:
        own = [i for i in surface.faces if i in faces]
        if own:
            proposed += _on(Patch.of(model, surface.index, own))
    ground, kept = Ground.of(model, faces), list[Found]()
    for each in sorted(proposed, key=lambda f: -f.height)[:MOST]:
        if any(_within(each, f) for f in kept):
            continue
        new = _confirmed(ground, each)
        if new is not None and not any(_within(new, f) for f in kept):
            kept.append(new)
    return sorted(kept, key=lambda f: -f.height)


def _within(f: Found, g: Found) -> bool:
    """Whether the place of ``f`` belongs to ``g``."""
    return bool(np.linalg.norm(np.subtract(f.place, g.place)) < g.size)


def _confirmed(ground: Ground, proposed: Found) -> Found | None:
    """The feature at a place, if there is one."""
    tried = [replace(proposed, size=proposed.size * SMALLER**k) for k in range(WINDOWS)]
    seen = [(each, base) for each in tried if (base := _base(ground, each)) is not None]
    first, base = max(seen, key=lambda pair: _clear(pair[1]), default=(proposed, None))
    if base is None or _clear(base) < CLEAR / 2:
        return None
    better = _measured(ground, first, base)
    for each in (better, replace(better, size=first.size), first):
        base = _base(ground, each)
        if base is not None and _stands_out(base, each.floor) and _separable(ground, each):
            return replace(_measured(ground, each, base), window=(*each.place, each.size))
    return None


def _base(ground: Ground, found: Found) -> Base | None:
    """The base under the window of a feature, if there is one."""
    try:
        return under(ground, _window(ground, found))
    except EditError:
        return None


def _stands_out(base: Base, floor: float) -> bool:
    """Whether what stands on a base is above its error and the noise."""
    return _clear(base) >= CLEAR and float(np.abs(base.heights).max()) > floor


def _window(ground: Ground, found: Found) -> Window:
    *middle, radius = found.around
    return window(ground, places.Disc(places.Point(tuple(middle)), radius), found.text, None)


def _clear(base: Base) -> float:
    """Height of what stands on a base over the error of the base."""
    return float(np.abs(base.heights).max(initial=0.0)) / max(base.error, LEAST / CLEAR)


def _measured(ground: Ground, found: Found, base: Base) -> Found:
    """A feature with the height, middle and diameter that it has above a base."""
    size = np.abs(base.heights)
    height = float(size.max())
    own = size > max(RIM * height, 3 * base.error)
    middle = np.average(base.points[own], axis=0, weights=size[own] ** 2)
    feet = ground.feet(middle[None])
    (place,), (face,) = feet.points, ground.faces(feet.surface, feet.uv).tolist()
    across = 2 * float(np.linalg.norm(base.points[own] - place, axis=1).max())
    face = found.face if face < 0 else face
    return replace(found, face=face, place=tuple(place.tolist()), size=across, height=height)


def _separable(ground: Ground, found: Found) -> bool:
    """Whether a feature can be moved."""
    try:
        return bool(above_surroundings(ground, _window(ground, found), "as-is").origin)
    except EditError:
        return False


def _on(patch: Patch) -> list[Found]:
    """Features of one surface."""
    from scipy.ndimage import label

    net = patch.net
    lengths = [arc_lengths(net, axis) for axis in (0, 1)]
    us, vs = net.u.greville(), net.v.greville()
    points, normals = patch.lattice(us, vs)
    uv = np.stack(np.meshgrid(us, vs, indexing="ij"), axis=-1).reshape(-1, 2)
    seen = patch.covers(uv).reshape(points.shape[:2])
    if seen.sum() < 64:
        return []
    _, su, sv = net.grid(us, vs, 1)
    area = np.linalg.norm(np.cross(su, sv), axis=-1) * np.outer(np.gradient(us), np.gradient(vs))
    scale = 4 * min(float(np.median(x)) for x in lengths)
    kept: list[Found] = []
    floor = 0.0
    while scale < max(float(x.sum()) for x in lengths) / 2:
        finer = net.with_poles(net.poles - at_scale(net, scale).poles)
        height = (np.asarray(finer.grid(us, vs)) * normals).sum(axis=-1)
        size = np.where(seen, np.abs(height), 0.0)
        floor = floor or FLOOR * float(np.median(size[seen]))
        usual = max(USUAL * float(np.median(size[seen])), LEAST)
        regions, count = label(size > usual, np.ones((3, 3)))
        for k in range(1, count + 1):
            peak = np.unravel_index(np.where(regions == k, size, 0.0).argmax(), size.shape)
            rim, _ = label(size > max(RIM * size[peak], usual / USUAL), np.ones((3, 3)))
            own = rim == rim[peak]
            if area[own].sum() > LARGEST * area[seen].sum() or own.sum() < 9:
                continue
            weight = size[own] ** 2 * area[own]
            middle = (points[own] * weight[:, None]).sum(axis=0) / weight.sum()
            place = points[own][np.linalg.norm(points[own] - middle, axis=1).argmin()]
            across = 2 * float(np.linalg.norm(points[own] - place, axis=1).max())
            face = next((f.index for f in patch.faces), 0)
            new = Found(face, tuple(float(x) for x in place), across, float(size[peak]), (scale / 2, scale), floor)  # type: ignore[arg-type]
            kept = _merged(kept, new)
        scale *= 2
    return [f for f in kept if f.height > floor and not any(_lobe(f, g) for g in kept)]


def _lobe(f: Found, g: Found) -> bool:
    """Whether ``f`` is only a side lobe of ``g``."""
    return f.height < LOBE * g.height and bool(np.linalg.norm(np.subtract(f.place, g.place)) < FAR * g.scales[1])


def _merged(kept: list[Found], new: Found) -> list[Found]:
    """The list with a feature found at a larger scale, which replaces those it covers if it is much higher."""
    near = [f for f in kept if np.linalg.norm(np.subtract(f.place, new.place)) < (f.size + new.size) / 4]
    if not near:
        return [*kept, new]
    if new.height < GROWS * max(f.height for f in near):
        return kept
    least = min(f.scales[0] for f in near)
    return [f for f in kept if f not in near] + [replace(new, scales=(least, new.scales[1]))]
