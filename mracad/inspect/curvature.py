"""Curvature of surfaces and how it varies, from their derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

Array = np.ndarray

THIN = 1e-6
"""Sine of the angle between S_u and S_v below which a surface counts as degenerate."""

VOID = 1e-40
"""|S_u × S_v| up to which it does, too: powers of less are no numbers."""


@dataclass(frozen=True, eq=False)
class Forms:
    """What the derivatives of a surface say at points.

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
    regular : ndarray of bool (q,)
        Where the surface is not degenerate; elsewhere all figures are zero.
    """

    normal: Array
    density: Array
    speeds: Array
    bending: Array
    variation: Array
    largest: Array
    regular: Array

    def part(self, points: slice) -> Forms:
        """The forms at some of the points."""
        return Forms(*(getattr(self, each.name)[..., points] for each in fields(self)))

    @classmethod
    def joined(cls, parts: Sequence[Forms]) -> Forms:
        """The forms at the points of all of them."""
        if len(parts) == 1:
            return parts[0]
        return cls(*(np.concatenate([getattr(part, each.name) for part in parts], axis=-1) for each in fields(cls)))


def forms(jet: Array) -> Forms:
    """The forms of a surface with derivatives ``jet``, see :func:`mracad.inspect.jets.jets`.

    Notes
    -----
    do Carmo, *Differential Geometry of Curves and Surfaces*, §3.3: H = (e G − 2 f F + g E) / 2 (E G − F²), the
    derivatives of the normal by Weingarten's equations.
    """
    _, su, sv, suu, suv, svv, suuu, suuv, suvv, svvv = jet
    ee, ff, gg = _dot(su, su), _dot(su, sv), _dot(sv, sv)
    normal = _cross(su, sv)
    density = np.sqrt(_dot(normal, normal))
    regular = density > np.maximum(THIN * np.sqrt(ee * gg), VOID)
    safe = np.where(regular, density, 1.0)
    normal = normal * np.where(regular, 1 / safe, 0.0)
    area2 = safe * safe
    e, f, g = _dot(normal, suu), _dot(normal, suv), _dot(normal, svv)
    mean = 0.5 * (e * gg - 2 * f * ff + g * ee) / area2
    gauss = (e * g - f * f) / area2
    tangent = (_dot(su, suu), _dot(su, suv), _dot(su, svv)), (_dot(sv, suu), _dot(sv, suv), _dot(sv, svv))
    slopes = []
    for axis, third in enumerate(((suuu, suuv, suvv), (suuv, suvv, svvv))):
        pull, push = (e, f) if axis == 0 else (f, g)
        a, b = (push * ff - pull * gg) / area2, (pull * ff - push * ee) / area2  # n_x = a S_u + b S_v
        de, df, dg = (_dot(normal, third[i]) + a * tangent[0][i] + b * tangent[1][i] for i in range(3))
        dee, dgg = 2 * tangent[0][axis], 2 * tangent[1][axis + 1]
        dff = tangent[1][axis] + tangent[0][axis + 1]
        numerator = de * gg + e * dgg - 2 * (df * ff + f * dff) + dg * ee + g * dee
        slopes.append((0.5 * numerator - mean * (dee * gg + ee * dgg - 2 * ff * dff)) / area2)
    hu, hv = slopes
    variation = (gg * hu * hu - 2 * ff * hu * hv + ee * hv * hv) / area2
    return Forms(
        normal,
        density * regular,
        np.sqrt(np.stack([ee, gg])),
        (4 * mean * mean - 2 * gauss) * regular,
        np.maximum(variation, 0.0) * regular,
        (np.abs(mean) + np.sqrt(np.maximum(mean * mean - gauss, 0.0))) * regular,
        regular,
    )


def _dot(a: Array, b: Array) -> Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Array, b: Array) -> Array:
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
