"""Proposed features: places where the detail of a face stands out.

On each surface the detail finer than a scale (by a projection, as for smoothing) is measured at scales that double.  A
place stands out if that detail is much larger than its median, on a small part of the face; the smallest scale with
nearly all of it counts.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from mracad.edit.feature.patch import Patch
from mracad.model.brep import Model
from mracad.wavelet.ladder import arc_lengths
from mracad.wavelet.project import at_scale

Array = np.ndarray

USUAL = 8.0
"""Ratio to the median above which detail stands out."""

RIM = 0.1
"""A feature ends where its detail falls below this share of its height."""

LARGEST = 0.2
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
    """

    face: int
    place: tuple[float, float, float]
    size: float
    height: float
    scales: tuple[float, float]

    @property
    def text(self) -> str:
        """The value for ``--feature``: a window twice as wide as the feature, so that its rim lies on flat
        surroundings."""
        x, y, z = (f"{value:.6g}" for value in np.round(self.place, 6) + 0.0)
        return f"near:{x},{y},{z},radius:{self.size:.4g}"


def found(model: Model, faces: Collection[int]) -> list[Found]:
    """Features of faces, the highest first."""
    result = []
    for surface in model.surfaces:
        own = [i for i in surface.faces if i in faces]
        if own:
            result += _on(Patch.of(model, surface.index, own))
    return sorted(result, key=lambda f: -f.height)


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
    while scale < max(float(x.sum()) for x in lengths) / 2:
        finer = net.with_poles(net.poles - at_scale(net, scale).poles)
        height = (np.asarray(finer.grid(us, vs)) * normals).sum(axis=-1)
        size = np.where(seen, np.abs(height), 0.0)
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
            new = Found(face, tuple(float(x) for x in place), across, float(size[peak]), (scale / 2, scale))  # type: ignore[arg-type]
            kept = _merged(kept, new)
        scale *= 2
    return [f for f in kept if not any(_lobe(f, g) for g in kept)]


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
