"""Curvature of surfaces and how it varies, from their derivatives."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields
from functools import cache
from itertools import pairwise
from types import FunctionType
from typing import Any, cast

import numpy as np

Array = np.ndarray

THIN = 1e-6
"""Sine of the angle between S_u and S_v below which a surface counts as degenerate."""

VOID = 1e-40
"""|S_u × S_v| up to which a surface counts as degenerate too: powers of smaller numbers underflow."""


MANY = 4_500_000
"""Number of points above which it pays to import a compiler."""


_BLOCK = 8192
"""Points that are processed at once: their figures fit the processor's cache."""


@dataclass(frozen=True, eq=False)
class Forms:
    """Curvature figures of a surface at points.

    Attributes
    ----------
    normal : ndarray (3, q)
        Unit normals S_u × S_v / |…|.
    density : ndarray (q,)
        Area per unit of parameter area, |S_u × S_v|.
    speeds : ndarray (2, q)
        |S_u| and |S_v|.
    bending : ndarray (q,)
        κ₁² + κ₂².
    variation : ndarray (q,)
        |∇H|², H the mean curvature, its gradient along the surface.
    largest : ndarray (q,)
        max(|κ₁|, |κ₂|).
    shape : ndarray (3, q)
        Components 11, 12 and 22 of the shape operator in the frame of S_u / |S_u| and the tangent normal to it.
    slope : ndarray (2, q)
        ∇H in that frame.
    regular : ndarray of bool (q,)
        Where the surface is not degenerate; elsewhere all figures are zero.
    """

    normal: Array
    density: Array
    speeds: Array
    bending: Array
    variation: Array
    largest: Array
    shape: Array
    slope: Array
    regular: Array

    def part(self, points: slice) -> Forms:
        """The forms at some of the points."""
        return Forms(*(getattr(self, each.name)[..., points] for each in fields(self)))

    @classmethod
    def joined(cls, parts: Iterable[Forms], count: int) -> Forms:
        """The forms at the points of all parts, one after another, ``count`` in all; no part is kept."""
        whole, end = None, 0
        for part in parts:
            begin, end = end, end + len(part.density)
            if whole is None:
                if end == count:
                    return part
                every = (getattr(part, each.name) for each in fields(cls))
                whole = cls(*(np.empty((*values.shape[:-1], count), values.dtype) for values in every))
            for each in fields(cls):
                getattr(whole, each.name)[..., begin:end] = getattr(part, each.name)
        assert whole is not None and end == count
        return whole


class _Work:
    """Number of points processed so far in this process."""

    done = 0


def forms(jet: Array) -> Forms:
    """The forms of a surface with derivatives ``jet``, see :func:`mracad.bspline.jets.jets`.

    The results are the same, bit for bit, however many points there are.
    """
    _Work.done += jet.shape[2]
    return forms_one_by_one(jet, jet, 0.0) if _Work.done >= MANY else _by_blocks(jet)


def forms_along(parts: Sequence[tuple[Array, Array, float]]) -> list[Forms]:
    """The forms of displaced surfaces, given as derivatives before, what the whole displacement adds, and its amount.

    The results are the same, bit for bit, as those of :func:`forms` for sums ``before + amount * added``.
    """
    sizes = [before.shape[2] for before, *_ in parts]
    _Work.done += sum(sizes)
    if _Work.done >= MANY:
        return [forms_one_by_one(*part) for part in parts]
    jets = [before + amount * added for before, added, amount in parts]
    together = _by_blocks(jets[0] if len(jets) == 1 else np.concatenate(jets, axis=2))
    ends = np.cumsum([0, *sizes]).tolist()
    return [together.part(slice(begin, end)) for begin, end in pairwise(ends)]


def _by_blocks(jet: Array) -> Forms:
    begins = range(0, max(jet.shape[2], 1), _BLOCK)
    return Forms.joined((forms_at_once(jet[:, :, i : i + _BLOCK]) for i in begins), jet.shape[2])


def forms_at_once(jet: Array) -> Forms:
    """The same as :func:`forms`, by array operations on all points."""
    every = _figures(THIN, VOID, jet[1:])
    return Forms(*(np.stack(each) if isinstance(each, tuple) else each for each in every))


def forms_one_by_one(before: Array, added: Array, amount: float) -> Forms:
    """The forms for ``before + amount * added``, by compiled code."""
    points = before.shape[2]
    density, bending, variation, largest = np.empty((4, points))
    regular = np.empty(points, bool)
    normal, shape = np.empty((2, 3, points))
    speeds, slope = np.empty((2, 2, points))
    found = Forms(normal, density, speeds, bending, variation, largest, shape, slope, regular)
    both = (np.ascontiguousarray(each) for each in (before, added))
    _compiled()(*both, amount, THIN, VOID, tuple(getattr(found, each.name) for each in fields(found)))
    return found


def _figures(thin: Any, void: Any, derivatives: Any) -> Any:
    """The fields of :class:`Forms`, from derivatives (u, v, uu, …, vvv) whose coordinates are numbers or arrays.

    Notes
    -----
    do Carmo, *Differential Geometry of Curves and Surfaces*, §3.3: H = (e G − 2 f F + g E) / 2 (E G − F²), the
    derivatives of the normal by Weingarten's equations.
    """

    su, sv, suu, suv, svv, suuu, suuv, suvv, svvv = derivatives

    def dot(a: Any, b: Any) -> Any:
        return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]

    ee, ff, gg = dot(su, su), dot(su, sv), dot(sv, sv)
    n = su[1] * sv[2] - su[2] * sv[1], su[2] * sv[0] - su[0] * sv[2], su[0] * sv[1] - su[1] * sv[0]
    size = np.sqrt(dot(n, n))
    regular = size > np.maximum(thin * np.sqrt(ee * gg), void)
    share = 1.0 * regular
    safe = share * size + (1.0 - share)
    scale = share / safe
    n = n[0] * scale, n[1] * scale, n[2] * scale
    area2 = safe * safe
    e, f, g = dot(n, suu), dot(n, suv), dot(n, svv)
    mean = 0.5 * (e * gg - 2 * f * ff + g * ee) / area2
    gauss = (e * g - f * f) / area2
    uu_u, uv_u, vv_u = dot(su, suu), dot(su, suv), dot(su, svv)
    uu_v, uv_v, vv_v = dot(sv, suu), dot(sv, suv), dot(sv, svv)

    def slope(pull: Any, push: Any, thirds: Any, dee: Any, dff: Any, dgg: Any) -> Any:
        a, b = (push * ff - pull * gg) / area2, (pull * ff - push * ee) / area2  # n_x = a S_u + b S_v
        de = dot(n, thirds[0]) + a * uu_u + b * uu_v
        df = dot(n, thirds[1]) + a * uv_u + b * uv_v
        dg = dot(n, thirds[2]) + a * vv_u + b * vv_v
        numerator = de * gg + e * dgg - 2 * (df * ff + f * dff) + dg * ee + g * dee
        return (0.5 * numerator - mean * (dee * gg + ee * dgg - 2 * ff * dff)) / area2

    hu = slope(e, f, (suuu, suuv, suvv), 2 * uu_u, uu_v + uv_u, 2 * uv_v)
    hv = slope(f, g, (suuv, suvv, svvv), 2 * uv_u, uv_v + vv_u, 2 * vv_v)
    variation = (gg * hu * hu - 2 * ff * hu * hv + ee * hv * hv) / area2
    largest = np.abs(mean) + np.sqrt(np.maximum(mean * mean - gauss, 0.0))
    long = share * ee + (1.0 - share)
    skew, root = ff / long, np.sqrt(long)
    across = share / safe
    shape = share * e / long, across * (f - skew * e), across * across * long * (g - 2 * skew * f + skew * skew * e)
    falls = share * hu / root, across * root * (hv - skew * hu)
    return (
        n, size * share, (np.sqrt(ee), np.sqrt(gg)), (4 * mean * mean - 2 * gauss) * share,
        np.maximum(variation, 0.0) * share, largest * share, shape, falls, regular,
    )  # fmt: skip


def _swept(before: Any, added: Any, amount: Any, thin: Any, void: Any, found: Any) -> None:
    """Fill in the figures (those of :class:`Forms`, in order) point by point."""
    normal, density, speeds, bending, variation, largest, shape, slope, regular = found

    def at(order: int, p: int) -> Any:
        return (
            before[order, 0, p] + amount * added[order, 0, p],
            before[order, 1, p] + amount * added[order, 1, p],
            before[order, 2, p] + amount * added[order, 2, p],
        )

    for p in range(before.shape[2]):
        n, density[p], sides, bending[p], variation[p], largest[p], bent, fall, regular[p] = _figures(
            thin, void, (at(1, p), at(2, p), at(3, p), at(4, p), at(5, p), at(6, p), at(7, p), at(8, p), at(9, p))
        )
        normal[0, p], normal[1, p], normal[2, p] = n
        shape[0, p], shape[1, p], shape[2, p] = bent
        (speeds[0, p], speeds[1, p]), (slope[0, p], slope[1, p]) = sides, fall


@cache
def _compiled() -> Callable[..., None]:
    """:func:`_swept`, compiled once, and cached on disk until this file changes."""
    from numba import njit

    figures = njit(error_model="numpy")(_figures)
    swept = FunctionType(_swept.__code__, {**globals(), "_figures": figures}, _swept.__name__)
    return cast(Callable[..., None], njit(cache=True, error_model="numpy")(swept))
