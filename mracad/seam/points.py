"""Figures of the metric of energies, point by point: numbers, or arrays of them, and compiled code for many points."""

from __future__ import annotations

from typing import Any

import numpy as np

from mracad.compiled import Compiled

FEW, MANY = 10_000, 20_000_000
"""Numbers of points above which it pays to load compiled code, and to compile it."""


def product(a: Any, b: Any) -> Any:
    """Product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def framed(xu: Any, xv: Any, least: Any) -> Any:
    """The area per parameters from tangents; their first form (e, f, g), with floors for e and g against division by
    zero; p, q and r: p ∂_u and q ∂_u + r ∂_v are orthonormal."""
    e, f, g = product(xu, xu), product(xu, xv), product(xv, xv)
    area = np.sqrt(np.maximum(e * g - f * f, 0.0))
    e, g = np.maximum(e, least[0]), np.maximum(g, least[1])
    most = 0.999 * np.sqrt(e * g)
    f = np.minimum(np.maximum(f, -most), most)
    p, r = 1.0 / np.sqrt(e), np.sqrt(e / (e * g - f * f))
    return area, e, f, g, p, -f / e * r, r


def curved(xu: Any, xv: Any, second: Any) -> Any:
    """The second fundamental form from tangents and second derivatives."""
    n = xu[1] * xv[2] - xu[2] * xv[1], xu[2] * xv[0] - xu[0] * xv[2], xu[0] * xv[1] - xu[1] * xv[0]
    size = np.maximum(np.sqrt(product(n, n)), 1e-300)
    return product(n, second[0]) / size, product(n, second[1]) / size, product(n, second[2]) / size


def shaped(frame: Any, form: Any) -> Any:
    """The shape operator in the frame (p, q, r), from the second form, and its largest eigenvalue's size."""
    (p, q, r), (a, b, c) = frame, form
    across = q * a + r * b
    one, both, other = p * p * a, p * across, q * (across + r * b) + r * r * c
    half = 0.5 * (one - other)
    return one, both, other, np.abs(0.5 * (one + other)) + np.sqrt(half * half + both * both)


def root(first: Any, lengths: Any, lead: Any) -> Any:
    """R of lengths along the lines of a parameter and across them, in the frame of a first form; ``lead``: 0 for u, 1
    for v."""
    (e, f, g), (along, across) = first, lengths
    cos = lead * (f / np.sqrt(e * g)) + (1.0 - lead)
    square, both = cos * cos, cos * np.sqrt(1.0 - cos * cos)
    return across + (along - across) * square, (along - across) * both, along + (across - along) * square


def limited(own: Any, bent: Any, scale: Any, least: Any) -> Any:
    """(R⁻⁴ + (scale |S|)⁴)^(-1/4), for R and the shape operator S; the sum's eigenvalues are no less than ``least``."""
    half, mean = 0.5 * (own[0] - own[2]), 0.5 * (own[0] + own[2])
    half = np.sqrt(half * half + own[1] * own[1])
    high, low = 1.0 / fourth(mean + half), 1.0 / fourth(mean - half)
    first = changed(own, mean, half, high, low)
    half, mean = 0.5 * (bent[0] - bent[2]), 0.5 * (bent[0] + bent[2])
    half = np.sqrt(half * half + bent[1] * bent[1])
    high, low = fourth(scale * (mean + half)), fourth(scale * (mean - half))
    more = changed(bent, mean, half, high, low)
    total = first[0] + more[0], first[1] + more[1], first[2] + more[2]
    half, mean = 0.5 * (total[0] - total[2]), 0.5 * (total[0] + total[2])
    half = np.sqrt(half * half + total[1] * total[1])
    high, low = np.maximum(mean + half, least), np.maximum(mean - half, least)
    return changed(total, mean, half, 1.0 / np.sqrt(np.sqrt(high)), 1.0 / np.sqrt(np.sqrt(low)))


def fourth(x: Any) -> Any:
    """x⁴."""
    return (x * x) * (x * x)


def changed(form: Any, mean: Any, half: Any, high: Any, low: Any) -> Any:
    """A symmetric form of eigenvalues ``mean ± half``, with others instead."""
    middle, slope = 0.5 * (high + low), (high - low) / np.maximum(2.0 * half, 1e-300)
    return middle + slope * (form[0] - mean), slope * form[1], middle + slope * (form[2] - mean)


def bending(jet: Any, first: Any, frame: Any, own: Any) -> Any:
    """Coefficients in H̃_11, √2 H̃_12 and H̃_22 of ∂_u, ∂_v, ∂_uu, ∂_uv and ∂_vv, R given."""
    (xu, xv, xuu, xuv, xvv), (e, f, g), (p, q, r), (a, b, c) = jet, first, frame, own
    x, y, x2, y2 = p * a + q * b, p * b + q * c, r * b, r * c  # the frame, times R
    uu0, uu1, uu2 = x * x, 2.0**0.5 * x * y, y * y
    uv0, uv1, uv2 = 2.0 * x * x2, 2.0**0.5 * (x * y2 + y * x2), 2.0 * y * y2
    vv0, vv1, vv2 = x2 * x2, 2.0**0.5 * x2 * y2, y2 * y2
    det = e * g - f * f
    i, j = product(xuu, xu) / det, product(xuu, xv) / det
    k, m = product(xuv, xu) / det, product(xuv, xv) / det
    n, o = product(xvv, xu) / det, product(xvv, xv) / det
    i, j, k, m, n, o = g * i - f * j, e * j - f * i, g * k - f * m, e * m - f * k, g * n - f * o, e * o - f * n
    return (
        (-uu0 * i - uv0 * k - vv0 * n, -uu1 * i - uv1 * k - vv1 * n, -uu2 * i - uv2 * k - vv2 * n),
        (-uu0 * j - uv0 * m - vv0 * o, -uu1 * j - uv1 * m - vv1 * o, -uu2 * j - uv2 * m - vv2 * o),
        (uu0, uu1, uu2), (uv0, uv1, uv2), (vv0, vv1, vv2),
    )  # fmt: skip


def squared(rows: Any, area: Any) -> Any:
    """Products of five vectors of coefficients with each other, times an area."""
    a, b, c, d, e = rows
    return (
        product(a, a) * area,
        product(b, a) * area, product(b, b) * area,
        product(c, a) * area, product(c, b) * area, product(c, c) * area,
        product(d, a) * area, product(d, b) * area, product(d, c) * area, product(d, d) * area,
        product(e, a) * area, product(e, b) * area, product(e, c) * area, product(e, d) * area, product(e, e) * area,
    )  # fmt: skip


def over_weights(rows: Any, jet: Any) -> Any:
    """Coefficients for w_i B_i / w in terms of derivatives of w_i B_i, from its own: those of five derivatives, then
    those of the value."""
    w, wu, wv, wuu, wuv, wvv = jet
    u, v = wu / w, wv / w
    one = weighted((rows[0][0], rows[1][0], rows[2][0], rows[3][0], rows[4][0]), (w, u, v, wuu, wuv, wvv))
    two = weighted((rows[0][1], rows[1][1], rows[2][1], rows[3][1], rows[4][1]), (w, u, v, wuu, wuv, wvv))
    three = weighted((rows[0][2], rows[1][2], rows[2][2], rows[3][2], rows[4][2]), (w, u, v, wuu, wuv, wvv))
    return (
        (one[0], two[0], three[0]), (one[1], two[1], three[1]), (one[2], two[2], three[2]),
        (one[3], two[3], three[3]), (one[4], two[4], three[4]),
    ), (one[5], two[5], three[5])  # fmt: skip


def weighted(row: Any, jet: Any) -> Any:
    """The same for one row of coefficients."""
    w, u, v, wuu, wuv, wvv = jet
    fu, fv, fuu, fuv, fvv = row[0] / w, row[1] / w, row[2] / w, row[3] / w, row[4] / w
    slope_u, slope_v = fu - 2.0 * fuu * u - fuv * v, fv - fuv * u - 2.0 * fvv * v
    value = -(slope_u * u + slope_v * v) - (fuu * wuu + fuv * wuv + fvv * wvv) / w
    return slope_u, slope_v, fuu, fuv, fvv, value


def _frame(jets: Any, points: Any, least: Any, found: Any) -> None:
    """:func:`framed`, ``(7, points)``."""
    n, x = points, 3 * points
    for i in range(n):
        (
            found[i], found[n + i], found[2 * n + i], found[3 * n + i], found[4 * n + i], found[5 * n + i],
            found[6 * n + i],
        ) = framed(
            (jets[x + i], jets[x + n + i], jets[x + 2 * n + i]),
            (jets[2 * x + i], jets[2 * x + n + i], jets[2 * x + 2 * n + i]), least,
        )  # fmt: skip


def _curve(jets: Any, points: Any, found: Any) -> None:
    """:func:`curved`, ``(3, points)``."""
    n, x = points, 3 * points
    for i in range(n):
        found[i], found[n + i], found[2 * n + i] = curved(
            (jets[x + i], jets[x + n + i], jets[x + 2 * n + i]),
            (jets[2 * x + i], jets[2 * x + n + i], jets[2 * x + 2 * n + i]),
            (
                (jets[3 * x + i], jets[3 * x + n + i], jets[3 * x + 2 * n + i]),
                (jets[4 * x + i], jets[4 * x + n + i], jets[4 * x + 2 * n + i]),
                (jets[5 * x + i], jets[5 * x + n + i], jets[5 * x + 2 * n + i]),
            ),
        )  # fmt: skip


def _look(frame: Any, forms: Any, points: Any, limit: Any, found: Any) -> None:
    """:func:`shaped` where nothing is found yet; where it turns too much, and whether it does anywhere."""
    n, (shape, left, count) = points, found
    count[0] = 0
    for i in range(n):
        if left[i]:
            one, both, other, size = shaped(
                (frame[i], frame[n + i], frame[2 * n + i]), (forms[i], forms[n + i], forms[2 * n + i])
            )
            shape[i], shape[n + i], shape[2 * n + i] = one, both, other
            left[i] = size > limit
            count[0] += left[i]


def _square(metric: Any, own: Any, weights: Any, points: Any, found: Any) -> None:
    """Densities of mass and bending.

    Parameters
    ----------
    metric : tuple
        Derivatives ``(6, 3, points)``, :func:`framed` of them, and which points count.
    own : tuple
        Lengths and ``lead`` of :func:`root`, the shape operator, ``scale`` and ``least`` of :func:`limited`, and
        whether there is one.
    weights : tuple
        Weights of the points along v and along u; those of the net and their derivatives ``(6, points)``, and whether
        there are any.
    points : tuple
        Numbers of points along v and along u.
    found : tuple
        Mass, and products of derivatives.
    """
    jets, frame, counts = metric
    along, across, lead, bent, scale, least, limits = own
    wv, wu, w, rational = weights
    n, x, i = points[0] * points[1], 3 * points[0] * points[1], 0
    mass, to = found
    for row in range(points[0]):
        for column in range(points[1]):
            if counts[i]:
                area = frame[i] * (wv[row] * wu[column])
                first, basis = (
                    (frame[n + i], frame[2 * n + i], frame[3 * n + i]),
                    (frame[4 * n + i], frame[5 * n + i], frame[6 * n + i]),
                )
                r = root(first, (along, across), lead)
                if limits:
                    r = limited(r, (bent[i], bent[n + i], bent[2 * n + i]), scale, least)
                rows = bending(
                    (
                        (jets[x + i], jets[x + n + i], jets[x + 2 * n + i]),
                        (jets[2 * x + i], jets[2 * x + n + i], jets[2 * x + 2 * n + i]),
                        (jets[3 * x + i], jets[3 * x + n + i], jets[3 * x + 2 * n + i]),
                        (jets[4 * x + i], jets[4 * x + n + i], jets[4 * x + 2 * n + i]),
                        (jets[5 * x + i], jets[5 * x + n + i], jets[5 * x + 2 * n + i]),
                    ),
                    first, basis, r,
                )  # fmt: skip
                mass[i] = area
                if rational:
                    mass[i] = area / (w[i] * w[i])
                    rows, value = over_weights(
                        rows, (w[i], w[n + i], w[2 * n + i], w[3 * n + i], w[4 * n + i], w[5 * n + i])
                    )
                    to[15 * n + i] = product(rows[0], value) * area
                    to[16 * n + i] = product(rows[1], value) * area
                    to[17 * n + i] = product(rows[2], value) * area
                    to[18 * n + i] = product(rows[3], value) * area
                    to[19 * n + i] = product(rows[4], value) * area
                    to[20 * n + i] = product(value, value) * area
                (
                    to[i], to[n + i], to[2 * n + i], to[3 * n + i], to[4 * n + i], to[5 * n + i], to[6 * n + i],
                    to[7 * n + i], to[8 * n + i], to[9 * n + i], to[10 * n + i], to[11 * n + i], to[12 * n + i],
                    to[13 * n + i], to[14 * n + i],
                ) = squared(rows, area)  # fmt: skip
            i += 1


_REAL, _WHOLE, _NUMBER = "float64*", "int64", "float64"
FRAME = Compiled(
    _frame, ((_REAL,), (_WHOLE,), (_NUMBER, _NUMBER), (_REAL,)), inlined=(product, framed), work=(FEW, MANY)
)
CURVE = Compiled(_curve, ((_REAL,), (_WHOLE,), (_REAL,)), inlined=(product, curved), work=(FEW, MANY))
LOOK = Compiled(
    _look,
    ((_REAL,), (_REAL,), (_WHOLE,), (_NUMBER,), (_REAL, "uint8*", "int64*")),
    inlined=(shaped,),
    work=(FEW, MANY),
)
SQUARE = Compiled(
    _square,
    (
        (_REAL, _REAL, "uint8*"),
        (_NUMBER, _NUMBER, _NUMBER, _REAL, _NUMBER, _NUMBER, _WHOLE),
        (_REAL, _REAL, _REAL, _WHOLE),
        (_WHOLE, _WHOLE),
        (_REAL, _REAL),
    ),
    inlined=(product, root, fourth, changed, limited, bending, squared, weighted, over_weights),
    work=(FEW, MANY),
)
