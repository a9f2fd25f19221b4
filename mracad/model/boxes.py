"""The exact box of a trimmed NURBS face, which may be far smaller than that of its control points.

Each coordinate has its extremes on the boundary, or inside where its gradient vanishes.  The boundary is known from
its edges; inside, the best points of a grid are refined by Newton's method.  Where the box of the control points does
not exceed the boundary's, the inside is skipped.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.model.brep import Edge, Face
from mracad.model.cells import inside_grid
from mracad.model.sampling import between, hermite, slopes

Array = np.ndarray

CLOSE = 1e-6
"""Error allowed of a face's box, as a share of the face's size."""

PER_SPAN, MOST = 2, 64
"""Grid lines per span, and roughly the largest number in all, in either direction."""

STEPS = 4
"""Steps of Newton's method."""

_FEW = 16  # largest number of knots of an edge that its samples resolve


def rims(edges: Sequence[Edge]) -> list[Array]:
    """The box (2, 3) of each edge between its first and last samples, in its part's frame; empty for edges without
    samples."""
    result = [np.array([np.full(3, np.inf), np.full(3, -np.inf)])] * len(edges)
    shown = [k for k, edge in enumerate(edges) if len(edge.points)]
    if shown:
        lines = _lines(np.array([edges[k].points for k in shown]), np.array([edges[k].tangents for k in shown]))
        for k, low, high in zip(shown, -_peaks(-lines), _peaks(lines), strict=True):
            result[k] = np.array([low, high])
    return result


def box(face: Face, net: Net, rim: Array, outer: Array, slack: float = 0.0) -> Array:
    """The box of a face in its part's frame.

    Parameters
    ----------
    face : Face
    net : Net
        Its surface.
    rim : ndarray (2, 3)
        The box of its edges, by :func:`rims`, and vertices.
    outer : ndarray (2, 3)
        A box around its control points, which contains the face.
    slack : float
        Allowed error, mm, besides ``CLOSE`` of the face's size.
    """
    slack = max(slack, CLOSE * float(np.linalg.norm(outer[1] - outer[0])))
    if np.abs(outer - rim).max() > slack:
        rim = _with_long(face, net, rim)
    wanted = [(k, axis) for k in (0, 1) for axis in range(3) if abs(outer[k, axis] - rim[k, axis]) > slack]
    if not wanted:
        return rim
    us, vs = _grid(face, net)
    points = face.placed(net.grid(us, vs))
    result = rim.copy()
    inside: Array | None = None
    for k, axis in wanted:
        sign = 2 * k - 1
        heights = sign * points[..., axis]
        if heights.max() <= sign * rim[k, axis]:  # a grid point outside the face bounds what lies in between as well
            continue
        inside = inside_grid(face, net, us, vs) if inside is None else inside
        if not inside.any():
            continue
        i, j = np.unravel_index(np.where(inside, heights, -np.inf).argmax(), heights.shape)
        direction = sign * face.frame[axis, :3]
        peak, uv = _sharpened(net, us, vs, (int(i), int(j)), direction)
        best = heights[i, j]
        if inside_grid(face, net, uv[:1], uv[1:]).all():
            best = max(best, peak + sign * face.frame[axis, 3])
        result[k, axis] = sign * max(sign * rim[k, axis], best)
    return np.asarray(np.clip(result, outer[0], outer[1]))


def _with_long(face: Face, net: Net, rim: Array) -> Array:
    """The box of the boundary, with edges of many spans also between their samples."""
    long = [trim.curve for trim in face.trims if len(trim.curve.knots.breaks) > _FEW]
    if not long:
        return rim
    uv = np.concatenate([curve.evaluate(_quarters(curve.knots.breaks))[0] for curve in long])
    points = face.placed(net.evaluate(uv))
    return np.array([np.minimum(rim[0], points.min(axis=0)), np.maximum(rim[1], points.max(axis=0))])


def _quarters(breaks: Array) -> Array:
    """Breaks, and the quarters of the spans between them."""
    count = len(breaks)
    return np.asarray(np.interp(np.arange(4 * count - 3) / 4, np.arange(count), breaks))


def _lines(points: Array, tangents: Array) -> Array:
    """Points along edges, close to each other, ``(e, q, 3)``, from their samples ``(e, k, 3)``."""
    return hermite(points, slopes(points, tangents), *between(points.shape[1]))


def _peaks(lines: Array) -> Array:
    """The largest of each coordinate ``(e, 3)``, by the parabola through the highest point and its neighbours."""
    place = lines.argmax(axis=1)[:, None]
    i = np.clip(place, 1, lines.shape[1] - 2)
    before, top, after = (np.take_along_axis(lines, i + k, axis=1)[:, 0] for k in (-1, 0, 1))
    bend = 2 * top - before - after
    curved = (place == i)[:, 0] & (bend > 0)
    return np.asarray(
        lines.max(axis=1) + np.where(curved, (before - after) ** 2 / (8 * np.where(curved, bend, 1.0)), 0.0)
    )


def _grid(face: Face, net: Net) -> tuple[Array, Array]:
    """Parameters of a grid over a face."""
    around = np.concatenate([trim.curve.poles for trim in face.trims]) if face.trims else np.empty((0, 2))
    limits = [(x.min(), x.max()) for x in around.T] if len(around) else [net.u.domain, net.v.domain]
    return _spread(net.u, *limits[0]), _spread(net.v, *limits[1])


def _spread(knots: KnotVector, low: float, high: float) -> Array:
    first, last = knots.domain
    if not knots.periodic:
        low, high = max(low, first), min(high, last)
    spans = len(knots.breaks) * (high - low) / (last - first)
    return np.linspace(low, high, int(np.clip(PER_SPAN * spans, 5, MOST)) + 1)


def _sharpened(net: Net, us: Array, vs: Array, at: tuple[int, int], direction: Array) -> tuple[float, Array]:
    """Height and parameters of the peak in a direction near a grid point, no farther away than the next grid lines."""
    start = np.array([us[at[0]], vs[at[1]]])
    step = np.array([us[1] - us[0], vs[1] - vs[0]])
    ends = np.array([[us[0], vs[0]], [us[-1], vs[-1]]])
    low, high = np.maximum(start - step, ends[0]), np.minimum(start + step, ends[1])
    uv, best = start, (-np.inf, start)
    for _ in range(STEPS):
        point, su, sv, suu, suv, svv = (float(x[0] @ direction) for x in net.evaluate(uv[None], 2))
        best = max(best, (point, uv), key=lambda found: found[0])
        hessian = np.array([[suu, suv], [suv, svv]])
        if not (suu < 0 and np.linalg.det(hessian) > 0):
            break
        uv = np.clip(uv - np.linalg.solve(hessian, [su, sv]), low, high)
    return best
