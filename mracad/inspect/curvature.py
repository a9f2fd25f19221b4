"""Curvature of surfaces and how it varies, from their derivatives."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

Array = np.ndarray

THIN = 1e-6
"""Sine of the angle between S_u and S_v below which a surface counts as degenerate."""

VOID = 1e-40
"""|S_u × S_v| up to which a surface counts as degenerate too: powers of smaller numbers underflow."""

FORMS, BENT = slice(0, 8), slice(8, 13)
"""What :func:`figures` returns: the rows of :class:`Forms`; and in the frame of S_u / |S_u| and the tangent normal to
it, components 11, 12 and 22 of the shape operator, and the gradient of the mean curvature."""


@dataclass(frozen=True, eq=False)
class Forms:
    """Curvature figures of a surface at points; zero where it is degenerate.

    Attributes
    ----------
    rows : ndarray (8, q)
    """

    rows: Array

    @property
    def normal(self) -> Array:
        """Unit normals S_u × S_v / |…|, ``(3, q)``."""
        return np.asarray(self.rows[:3])

    @property
    def density(self) -> Array:
        """Area per unit of parameter area, |S_u × S_v|, ``(q,)``."""
        return np.asarray(self.rows[3])

    @property
    def speeds(self) -> Array:
        """|S_u| and |S_v|, ``(2, q)``; also where the surface is degenerate."""
        return np.asarray(self.rows[4:6])

    @property
    def largest(self) -> Array:
        """max(|κ₁|, |κ₂|), ``(q,)``."""
        return np.asarray(self.rows[6])

    @property
    def regular(self) -> Array:
        """Where the surface is not degenerate, ``(q,)`` of bool."""
        return np.asarray(self.rows[7] > 0)


def shapes(jets: Iterable[Array], rows: slice) -> Array:
    """Some of the :func:`figures` of a surface with derivatives in blocks of points, see
    :func:`mracad.bspline.jets.jets`."""
    return np.concatenate([np.stack(figures(jet[1], jet[2], jet[3:6], jet[6:])[rows]) for jet in jets], axis=1)


def dot(a: Any, b: Any) -> Any:
    """Product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def figures(su: Any, sv: Any, second: Any, third: Any) -> Any:
    """Figures from derivatives of each order, whose coordinates are numbers or arrays.

    Notes
    -----
    do Carmo, *Differential Geometry of Curves and Surfaces*, §3.3.  With the first form g_ij, the second b_ij =
    n · S_ij and n_x = −b_xk g^kl S_l (Weingarten), the mean curvature H = ½ g^ij b_ij has the derivatives

        H_x = ½ g^ij (n · S_ijx + n_x · S_ij) − g^ik b_kl g^lj S_ix · S_j
    """
    suu, suv, svv = second
    suuu, suuv, suvv, svvv = third
    ee, ff, gg = dot(su, su), dot(su, sv), dot(sv, sv)
    n = su[1] * sv[2] - su[2] * sv[1], su[2] * sv[0] - su[0] * sv[2], su[0] * sv[1] - su[1] * sv[0]
    size = np.sqrt(dot(n, n))
    speed = np.sqrt(ee), np.sqrt(gg)
    share = 1.0 * (size > np.maximum(THIN * (speed[0] * speed[1]), VOID))
    rest = 1.0 - share
    safe = share * size + rest
    across = share / safe
    n = n[0] * across, n[1] * across, n[2] * across
    inverse = 1.0 / (safe * safe)
    a, b, c = gg * inverse, -ff * inverse, ee * inverse  # g^11, g^12, g^22
    e, f, g = dot(n, suu), dot(n, suv), dot(n, svv)
    uu_u, uv_u, vv_u = dot(su, suu), dot(su, suv), dot(su, svv)
    uu_v, uv_v, vv_v = dot(sv, suu), dot(sv, suv), dot(sv, svv)
    nuuv, nuvv = dot(n, suuv), dot(n, suvv)
    trace_u = a * dot(n, suuu) + 2.0 * b * nuuv + c * nuvv
    trace_v = a * nuuv + 2.0 * b * nuvv + c * dot(n, svvv)
    pull, push = a * uu_u + 2.0 * b * uv_u + c * vv_u, a * uu_v + 2.0 * b * uv_v + c * vv_v  # g^ij S_ij · S_l
    uu, uv, vu, vv = e * a + f * b, e * b + f * c, f * a + g * b, f * b + g * c  # b_xk g^kl
    p, q, r = a * uu + b * vu, a * uv + b * vv, b * uv + c * vv  # g^ik b_kl g^lj
    hu = 0.5 * (trace_u - uu * pull - uv * push) - (p * uu_u + q * (uu_v + uv_u) + r * uv_v)
    hv = 0.5 * (trace_v - vu * pull - vv * push) - (p * uv_u + q * (uv_v + vv_u) + r * vv_v)
    long = share * ee + rest
    skew, root = ff / long, np.sqrt(long)
    first, twist = share * e / long, across * (f - skew * e)
    last = across * across * long * (g - 2.0 * skew * f + skew * skew * e)
    half, mean = 0.5 * (first - last), 0.5 * (first + last)
    return (
        n[0], n[1], n[2], size * share, speed[0], speed[1], np.abs(mean) + np.sqrt(half * half + twist * twist), share,
        first, twist, last, share * hu / root, across * root * (hv - skew * hu),
    )  # fmt: skip
