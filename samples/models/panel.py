"""The panel: six patches, clean and noisy, by themselves and inside a frame."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from OCP.TopoDS import TopoDS_Edge, TopoDS_Shell

from mracad.occ.document import Document

from .documents import single
from .geometry import curve, line2d, surface
from .splines import breaks, clamped, greville, settle, split
from .topology import Side, edge, face, shell, vertex

PANEL = (300.0, 200.0)
PATCHES = (3, 2)
PATCH_SPANS = 32


def panel_net() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return knots in u and v and the poles of the smooth panel before it is cut into patches.

    A crowned surface of 300 × 200 mm with a soft character line and a slight bulge, made with + − × ÷ and √ alone, so
    that every machine gets the same bits.
    """
    rng = np.random.default_rng(101)
    knots = []
    for length, patches in zip(PANEL, PATCHES, strict=True):
        ends = np.linspace(0.0, length, patches + 1)
        cuts = [breaks(rng, low, high, PATCH_SPANS) for low, high in pairwise(ends)]
        knots.append(clamped(np.unique(np.concatenate(cuts)), 3))
    u, v = np.meshgrid(*(greville(k, 3) for k in knots), indexing="ij")
    p, q = u / 150.0 - 1.0, v / 100.0 - 1.0
    bulged = v + 6.0 * q * (1.0 - p * p)
    line = (v - 118.0 - 14.0 * p) / 32.0
    crown = 42.0 - 26.0 * p * p - 15.0 * q * q + 4.0 * p * q * q
    z = crown + 8.0 * line / np.sqrt(1.0 + line * line) + 4.0 / (1.0 + 5.0 * ((p - 0.3) ** 2 + (q + 0.4) ** 2))
    return *knots, np.stack((u, bulged, z), axis=-1)


def panel_noise(shape: Sequence[int]) -> np.ndarray:
    """Return displacements of 0.05 mm rms, equal in every direction."""
    return 0.05 / 3.0**0.5 * np.random.default_rng(102).standard_normal(shape)


def cut(
    u_knots: np.ndarray, v_knots: np.ndarray, poles: np.ndarray, patches: tuple[int, int] = PATCHES
) -> list[list[tuple[np.ndarray, np.ndarray, np.ndarray]]]:
    """Cut a net into even patches at its knots, each with knots in u and v and poles; exact, so C2 across."""
    seams = [np.linspace(k[0], k[-1], n + 1)[1:-1] for k, n in zip((u_knots, v_knots), patches, strict=True)]
    rows = []
    for u, strip in split(u_knots, poles, 3, seams[0]):
        columns = split(v_knots, strip.swapaxes(0, 1), 3, seams[1])
        rows.append([(u, v, net.swapaxes(0, 1)) for v, net in columns])
    return rows


def sewn(rows: Sequence[Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]]]) -> TopoDS_Shell:
    """Join a grid of patches into one shell; neighbours share their edge and its curve."""
    count_u, count_v = len(rows), len(rows[0])
    corners = {
        (i, j): vertex(rows[min(i, count_u - 1)][min(j, count_v - 1)][2][-(i == count_u), -(j == count_v)])
        for i in range(count_u + 1)
        for j in range(count_v + 1)
    }
    along: dict[tuple[str, int, int], TopoDS_Edge] = {}
    for i in range(count_u):
        for j in range(count_v + 1):
            u, _, net = rows[i][min(j, count_v - 1)]
            path = curve(net[:, -(j == count_v)], u)
            along["u", i, j] = edge(path, (corners[i, j], corners[i + 1, j]), (u[0], u[-1]))
    for i in range(count_u + 1):
        for j in range(count_v):
            _, v, net = rows[min(i, count_u - 1)][j]
            path = curve(net[-(i == count_u)], v)
            along["v", i, j] = edge(path, (corners[i, j], corners[i, j + 1]), (v[0], v[-1]))
    faces = []
    for i, row in enumerate(rows):
        for j, (u, v, net) in enumerate(row):
            loop = [
                Side(along["u", i, j], line2d((0.0, v[0]), (1, 0))),
                Side(along["v", i + 1, j], line2d((u[-1], 0.0), (0, 1))),
                Side(along["u", i, j + 1], line2d((0.0, v[-1]), (1, 0)), False),
                Side(along["v", i, j], line2d((u[0], 0.0), (0, 1)), False),
            ]
            faces.append(face(surface(net, u, v), [loop]))
    return shell(faces)


def panel_clean() -> Document:
    """The true panel: 3 × 2 bicubic patches of 35 × 35 control points on uneven knots, C2 across every seam."""
    return single(sewn(cut(*panel_net())), "panel clean")


def panel() -> Document:
    """The panel with noise on every control point, added before cutting: patches are rough but C2 across the seams."""
    u, v, poles = panel_net()
    return single(sewn(cut(u, v, settle(poles + panel_noise(poles.shape), 6))), "panel")


def panel_inside() -> Document:
    """The panel with noise inside the patches only: two rows of points round each are clean, so every seam is G1."""
    rows = cut(*panel_net())
    noise = panel_noise((*PATCHES, PATCH_SPANS + 3, PATCH_SPANS + 3, 3))
    for i, row in enumerate(rows):
        for j, (u, v, net) in enumerate(row):
            rough = net.copy()
            rough[2:-2, 2:-2] = settle(net + noise[i, j], 6)[2:-2, 2:-2]
            row[j] = u, v, rough
    return single(sewn(rows), "panel inside")
