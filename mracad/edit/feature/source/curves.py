"""Closed curves of SVG and DXF files as polygons, and what they enclose."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from mracad.errors import FileError, needing

Array = np.ndarray

MOST_BYTES, MOST_PARTS, MOST_POINTS = 20_000_000, 20_000, 300_000
"""Largest file, and most elements and points that are read of it."""

PIECES = 96
"""Chords of a curved segment."""

_PIXEL = 25.4 / 96
_KINDS = {"svg": "an SVG", "dxf": "a DXF"}
_CHUNK = 4096


@dataclass(frozen=True, eq=False)
class Shape:
    """Closed polygons ``(n, 2)`` (mm, y up; the last point leads back to the first) filled by one rule."""

    loops: tuple[Array, ...]
    odd: bool

    def inside(self, points: Array) -> Array:
        """Which points ``(q, 2)`` it encloses."""
        a = np.concatenate(self.loops)
        b = np.concatenate([np.roll(loop, -1, axis=0) for loop in self.loops])
        found = np.zeros(len(points), int)
        order = np.argsort(points[:, 1], kind="stable")
        low, high = np.minimum(a[:, 1], b[:, 1]), np.maximum(a[:, 1], b[:, 1])
        for k in range(0, len(order), _CHUNK):
            part = order[k : k + _CHUNK]
            x, y = points[part].T
            near = np.flatnonzero((low <= y[-1]) & (high > y[0]))
            (x0, y0), (x1, y1) = a[near].T, b[near].T
            for j in range(0, len(near), 512):
                s = slice(j, j + 512)
                up = (y0[s] <= y[:, None]) & (y1[s] > y[:, None])
                down = (y1[s] <= y[:, None]) & (y0[s] > y[:, None])
                rise = np.where(y1[s] == y0[s], 1.0, y1[s] - y0[s])
                right = x0[s] + (y[:, None] - y0[s]) / rise * (x1[s] - x0[s]) > x[:, None]
                found[part] += (right & up).sum(axis=1) - (right & down).sum(axis=1)
        return np.asarray(found % 2 != 0 if self.odd else found != 0)


def shapes(file: Path) -> tuple[list[Shape], tuple[str, ...]]:
    """The filled shapes of a file, and notes on what was assumed about their size; raises FileError."""
    kind = file.suffix.lower()[1:]
    try:
        if file.stat().st_size > MOST_BYTES:
            raise FileError(f"'{file.name}' is larger than {MOST_BYTES // 10**6} MB", "simplify it")
        found, notes = (_svg(file), ()) if kind == "svg" else _dxf(file)
    except FileError:
        raise
    except OSError as error:
        if error.strerror is None:
            raise _damaged(file, kind) from error
        raise FileError(f"cannot read '{file}': {error.strerror}", f"give the path of {_KINDS[kind]} file") from error
    found = [Shape(loops, each.odd) for each in found if (loops := tuple(filter(_encloses, each.loops)))]
    if not found:
        message = f"'{file.name}' contains no closed outline"
        raise FileError(message, "draw closed curves, and turn text into paths")
    points = np.concatenate([loop for each in found for loop in each.loops])
    if not np.isfinite(points).all() or np.abs(points).max() > 1e6:
        raise _damaged(file, kind)
    if len(points) > MOST_POINTS:
        raise FileError(f"'{file.name}' has more than {MOST_POINTS} points", "simplify it")
    return found, notes


def _damaged(file: Path, kind: str) -> FileError:
    return FileError(f"'{file.name}' is not {_KINDS[kind]} file, or damaged", "export it again")


def _encloses(loop: Array) -> bool:
    return len(loop) > 2 and bool(np.ptp(loop, axis=0).min() > 0)


def _svg(file: Path) -> list[Shape]:
    """Filled shapes of an SVG file; if nothing is filled, its closed strokes by the even-odd rule."""
    from xml.etree import ElementTree

    with needing("features", f"cannot read '{file}'"):
        from svgelements import SVG
        from svgelements import Shape as Drawn

    try:
        if _expanded(ElementTree.parse(file).getroot()) > MOST_PARTS:
            raise FileError(f"'{file.name}' has more than {MOST_PARTS} elements", "simplify it")
        drawn = [e for e in SVG.parse(str(file), reify=True, ppi=96).elements() if isinstance(e, Drawn) and _shown(e)]
        filled: list[Shape] = []
        stroked: list[Array] = []
        for each in drawn:
            loops = tuple(_loops(each))
            if each.fill is None or each.fill.value is None:
                stroked += loops
            else:
                filled.append(Shape(loops, "evenodd" in str(each.values.get("fill-rule", "")).replace("-", "")))
    except FileError:
        raise
    except (ElementTree.ParseError, ValueError, TypeError, AttributeError, KeyError, IndexError, ZeroDivisionError,
            OverflowError, RecursionError) as error:  # fmt: skip
        raise _damaged(file, "svg") from error
    return filled or [Shape(tuple(stroked), True)]


def _shown(each: Any) -> bool:
    hidden = each.values.get("display") == "none" or each.values.get("visibility") in ("hidden", "collapse")
    return not hidden and each.values.get("opacity") not in ("0", "0.0")


def _expanded(root: Any) -> int:
    """How many elements a tree has once those that it uses again are counted, too; endless ones count as many."""
    named = {e.get("id"): e for e in root.iter() if e.get("id")}
    counts: dict[int, int] = {}

    def count(element: Any, depth: int) -> int:
        if depth > 100:
            return MOST_PARTS + 1
        if id(element) not in counts:
            target = element.get("{http://www.w3.org/1999/xlink}href") or element.get("href") or ""
            used = named.get(target[1:]) if element.tag.endswith("use") else None
            parts = [*element, *([] if used is None else [used])]
            counts[id(element)] = min(1 + sum(count(part, depth + 1) for part in parts), MOST_PARTS + 1)
        return counts[id(element)]

    return count(root, 0)


def _loops(drawn: Any) -> Iterator[Array]:
    """The subpaths of a shape."""
    from svgelements import Close, Line, Move
    from svgelements import Path as Curve

    for part in Curve(drawn).as_subpaths():
        points: list[Array] = []
        for segment in Curve(part):
            if segment.end is None or isinstance(segment, Move):
                continue
            share = np.array([0.0, 1.0]) if isinstance(segment, Line | Close) else np.linspace(0, 1, PIECES + 1)
            points += [np.array([[p[0], p[1]] for p in map(segment.point, share[:-1])])]
        if points:
            yield np.concatenate(points) * (_PIXEL, -_PIXEL)


def _dxf(file: Path) -> tuple[list[Shape], tuple[str, ...]]:
    """The closed curves of a DXF file, by the even-odd rule, and a note if it states no unit; lines and arcs that meet
    are joined."""
    with needing("features", f"cannot read '{file}'"):
        import ezdxf
        from ezdxf import disassemble, path, units

    try:
        document = ezdxf.readfile(file)
        unit = units.InsertUnits(document.units) or units.InsertUnits.Millimeters
        factor = units.conversion_factor(unit, units.InsertUnits.Millimeters)
        parts = list(islice(disassemble.recursive_decompose(document.modelspace()), MOST_PARTS + 1))
        if len(parts) > MOST_PARTS:
            raise FileError(f"'{file.name}' has more than {MOST_PARTS} entities", "simplify it")
        curves = [curve for each in parts for curve in _curves(path, each)]
        every = np.array([(p.x, p.y) for c in curves for p in c.control_vertices()]).reshape(-1, 2)
        size = max(float(np.ptp(every, axis=0).max()) if len(every) else 0.0, 1e-9)
        lines = [np.array([(p.x, p.y) for p in c.flattening(size / 10_000, 16)]) * factor for c in curves]
    except FileError:
        raise
    except (ezdxf.DXFError, UnicodeDecodeError, ValueError, TypeError, KeyError, IndexError, RecursionError) as error:
        raise _damaged(file, "dxf") from error
    notes = () if document.units else ("the file states no unit: its numbers are taken as mm",)
    return [Shape(tuple(joined(lines)), True)], notes


def _curves(path: Any, entity: Any) -> list[Any]:
    """The curves of an entity; none for those that are no curves."""
    if entity.dxftype() in ("HATCH", "MPOLYGON"):
        return list(path.from_hatch(entity))
    try:
        return [curve for curve in path.make_path(entity).sub_paths() if len(curve)]
    except TypeError:
        return []


def joined(lines: Sequence[Array]) -> list[Array]:
    """Closed polygons from open and closed polylines, whose ends meet."""
    if not lines:
        return []
    near = 1e-5 * float(np.ptp(np.concatenate(lines), axis=0).max())
    closed = [line[:-1] for line in lines if np.linalg.norm(line[0] - line[-1]) <= near]
    rest = [line for line in lines if np.linalg.norm(line[0] - line[-1]) > near]
    while rest:
        chain = rest.pop()
        while (found := _next(chain[-1], rest, near)) is not None:
            index, turned = found
            line = rest.pop(index)
            chain = np.concatenate([chain, (line[::-1] if turned else line)[1:]])
            if np.linalg.norm(chain[0] - chain[-1]) <= near:
                closed.append(chain[:-1])
                break
    return closed


def _next(end: Array, rest: Sequence[Array], near: float) -> tuple[int, bool] | None:
    """The line that goes on at an end, and whether it has to be turned."""
    for index, line in enumerate(rest):
        if np.linalg.norm(line[0] - end) <= near:
            return index, False
        if np.linalg.norm(line[-1] - end) <= near:
            return index, True
    return None


def inside(every: Iterable[Shape], points: Array) -> Array:
    """Which points ``(q, 2)`` any shape encloses."""
    return np.asarray(np.any([each.inside(points) for each in every], axis=0))
