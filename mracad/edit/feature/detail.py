"""A detail feature: a displacement of compact support, separated from the surface under it.

The *table* of a feature holds its displacement in the frames carried from its place (along x, along y, along the
normal) and its window, on a square grid of geodesic normal coordinates in millimetres: nothing in it depends on the
parameters, knots or units of the source.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import msgspec
import numpy as np

from mracad.edit.feature.ground import Feet
from mracad.errors import FileError

Array = np.ndarray

FORMAT = "mracad feature 1"

LOST = 0.01
"""Share of its height that frozen points may cut off a feature unless clipping is allowed."""


@dataclass(frozen=True, eq=False)
class Origin:
    """Where in a model a feature was found.

    Attributes
    ----------
    offsets : dict of int to ndarray (nu, nv, 3)
        Its offsets by surface, over the surface's own net and in its frame, mm.
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
        Radii where its taper begins and ends, mm.
    spacing : float
        Width of its knot spans in the source, mm.
    table : ndarray (n, n, 4)
        Displacement along x, y and the normal (mm) and window (0 to 1) over ``[-reach, reach]²``.
    name : str
    origin : Origin or None
        None for a feature from a file.
    base : float
        Error of the surface that it was separated from, root mean square, mm; 0 if not known.
    notes : tuple of str
        What to know about how it was made.
    """

    radius: float
    reach: float
    spacing: float
    table: Array
    name: str = ""
    origin: Origin | None = field(default=None)
    base: float = 0.0
    notes: tuple[str, ...] = ()

    @cached_property
    def height(self) -> float:
        """Its largest displacement, mm."""
        return float(np.linalg.norm(self.table[..., :3], axis=-1).max())

    @cached_property
    def curvature(self) -> float:
        """Its largest second derivative along x or y, 1/mm."""
        cell, height = 2 * self.reach / (len(self.table) - 1), self.table[..., 2]
        return float(max(np.abs(np.diff(height, 2, axis)).max() for axis in (0, 1)) / cell**2)

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
    """The content of a feature file; lengths in mm."""

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
    base: float = 0.0


def save(feature: Feature) -> bytes:
    """A feature as the bytes of a file (JSON, ``docs/features.md``)."""
    x, y, normal, window = np.round(feature.table.reshape(-1, 4).T, 9).tolist()
    numbers = feature.radius, feature.reach, feature.spacing, len(feature.table)
    content = _File(FORMAT, feature.name, *numbers, x, y, normal, window, feature.base)
    return msgspec.json.encode(content) + b"\n"


def load(path: str | os.PathLike[str]) -> Feature:
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
    return Feature(content.radius, content.reach, content.spacing, table, content.name, base=content.base)


def taper(share: Array) -> Array:
    """1 down to 0 as ``share`` goes from 0 to 1, with two vanishing derivatives at both ends."""
    t = np.clip(share, 0.0, 1.0)
    return np.asarray(1.0 - t**3 * (10.0 - 15.0 * t + 6.0 * t**2))
