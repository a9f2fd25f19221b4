"""Single parts: a trimmed block, a bottle and a blade."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from OCP.Geom import (
    Geom_Circle,
    Geom_Curve,
    Geom_Line,
    Geom_Plane,
    Geom_Surface,
)
from OCP.Geom2d import Geom2d_Circle, Geom2d_Curve
from OCP.gp import gp_Ax2, gp_Ax2d, gp_Dir, gp_Dir2d, gp_Pnt, gp_Pnt2d
from OCP.TopoDS import TopoDS_Edge, TopoDS_Face

from mracad.occ.document import Document

from .documents import single
from .geometry import Path3, curve, line2d, on_surface, surface
from .splines import breaks, clamped, greville, insert, settle
from .topology import BUILD, Rim, Side, block, edge, face, solid, vertex


def rough_top(
    seed: int, size: tuple[float, float], spans: tuple[int, int], height: float, noise: float, bits: int = 7
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return knots in u and v and poles of a gently saddled bicubic surface over a rectangle, rough along z.

    Its parameters are x and y; `bits` says how fine the grid is that numbers are put on.
    """
    rng = np.random.default_rng(seed)
    u_knots, v_knots = (clamped(breaks(rng, 0.0, *pair, 2.0, bits), 3) for pair in zip(size, spans, strict=True))
    x, y = np.meshgrid(greville(u_knots, 3), greville(v_knots, 3), indexing="ij")
    p, q = 2.0 * x / size[0] - 1.0, 2.0 * y / size[1] - 1.0
    z = height * (1.0 - 0.45 * p * p + 0.3 * q * q + 0.15 * p * q + 0.2 * p * p * p)
    return u_knots, v_knots, np.stack((x, y, settle(z + noise * rng.standard_normal(z.shape), bits)), axis=-1)


def natural_rims(net: tuple[np.ndarray, np.ndarray, np.ndarray]) -> dict[str, Rim]:
    """Return the four sides of a `rough_top` as rims walked anticlockwise."""
    u, v, poles = net
    along_u, along_v = (u[0], u[-1]), (v[0], v[-1])

    def side(
        row: np.ndarray, knots: np.ndarray, start: tuple[float, float], way: tuple[int, int], forward: bool
    ) -> Rim:
        ground = Geom_Line(gp_Pnt(*start, 0.0), gp_Dir(*way, 0))
        return Rim(Path3(row, knots), line2d(start, way), ground, (knots[0], knots[-1]), forward)

    return {
        "bottom": side(poles[:, 0], u, (0.0, along_v[0]), (1, 0), True),
        "right": side(poles[-1], v, (along_u[1], 0.0), (0, 1), True),
        "top": side(poles[:, -1], u, (0.0, along_v[1]), (1, 0), False),
        "left": side(poles[0], v, (along_u[0], 0.0), (0, 1), False),
    }


def trimmed() -> Document:
    """A cover plate whose rough top ends on three natural sides and a trim curve across it, with a round hole.

    The trim curve and the hole are exact in the parameter plane; the edges in space are within 0.001 mm of the surface.
    """
    net = rough_top(201, (115.0, 52.0), (80, 36), 9.0, 0.05)
    top = surface(net[2], net[0], net[1])
    sides = natural_rims(net)
    bow = np.array([(98.0, 0.0), (121.0, 15.0), (90.0, 31.0), (106.0, 52.0)])
    bezier = np.repeat([0.0, 1.0], 4)
    slant, slant_ground = curve(bow, bezier), curve(np.column_stack((bow, np.zeros(4))), bezier)
    ring = Geom2d_Circle(gp_Ax2d(gp_Pnt2d(46.0, 24.0), gp_Dir2d(1, 0)), 10.0)
    ring_ground = Geom_Circle(gp_Ax2(gp_Pnt(46.0, 24.0, 0.0), gp_Dir(0, 0, 1), gp_Dir(1, 0, 0)), 10.0)

    def trim(path: Geom2d_Curve, ground: Geom_Curve, span: tuple[float, float], pieces: int, forward: bool) -> Rim:
        return Rim(on_surface(top, path, *span, pieces), path, ground, span, forward, 1e-3)

    outer = [
        replace(sides["bottom"], span=(0.0, 98.0)),
        trim(slant, slant_ground, (0.0, 1.0), 140, True),
        replace(sides["top"], span=(0.0, 106.0)),
        sides["left"],
    ]
    half = float(np.pi)
    hole = [trim(ring, ring_ground, span, 64, False) for span in ((half, 2.0 * half), (0.0, half))]
    return single(block(top, [outer, hole]), "cover plate")


def bottle() -> Document:
    """A bottle whose wall and base are one rippled face, periodic round the axis, its first row of poles one point.

    The ripples fade towards the base and the neck. A plane closes the mouth.
    """
    rng = np.random.default_rng(301)
    coarse = np.array([0.0, 11.0, 22.0, 43.0, 64.0, 80.0, 91.0, 101.0, 110.0, 124.0, 142.0])
    knots = clamped(coarse, 3)
    r = np.array([0.0, 4.0, 10.5, 11.5, 11.0, 11.0, 11.5, 11.0, 7.5, 4.8, 5.0, 5.4, 5.4])
    z = np.array([0.0, 0.0, -1.2, 9.0, 22.0, 39.0, 56.0, 73.0, 84.0, 90.0, 104.0, 113.0, 120.0])
    profile = np.column_stack((r, z))
    for value in np.setdiff1d(breaks(rng, 14.0, 102.0, 62, 2.0), coarse):
        knots, profile = insert(knots, profile, 3, value)
    r, z = profile.T
    place = greville(knots, 3)
    around = 48
    turn = 2.0 * np.pi * np.arange(around) / around
    fade = np.clip((place - 18.0) / 8.0, 0.0, 1.0) * np.clip((98.0 - place) / 8.0, 0.0, 1.0)
    ripples = 0.05 * rng.standard_normal((around, len(z))) + 0.05 * np.cos(16.0 * turn)[:, None]
    radius = r + ripples * fade
    x, y = radius * np.cos(turn)[:, None], radius * np.sin(turn)[:, None]
    poles = np.stack((x, y, np.broadcast_to(z, radius.shape)), axis=-1)
    poles, u = settle(poles), np.arange(around + 1.0)
    wall = surface(poles, u, knots, u_periodic=True)
    meridian = (poles[0] + 4.0 * poles[1] + poles[2]) / 6.0  # where the face meets itself, u = 0

    base, mouth = vertex(meridian[0]), vertex(meridian[-1])
    apex = edge(None, (base, base), (u[0], u[-1]))
    closing = edge(curve(meridian, knots), (base, mouth), (knots[0], knots[-1]))
    rim = edge(curve(poles[:, -1], u, periodic=True), (mouth, mouth), (u[0], u[-1]))
    loop = [
        Side(apex, line2d((0.0, 0.0), (1, 0))),
        Side(closing, line2d((u[-1], 0.0), (0, 1))),
        Side(rim, line2d((0.0, knots[-1]), (1, 0)), False),
        Side(closing, line2d((0.0, 0.0), (0, 1)), False),
    ]
    side = face(wall, [loop])
    BUILD.Range(apex, side, u[0], u[-1])
    lid = face(Geom_Plane(gp_Pnt(0, 0, meridian[-1, 2]), gp_Dir(0, 0, 1)), [[Side(rim)]])
    return single(solid([side, lid]), "bottle")


def blade() -> Document:
    """A twisted, tapered blade: one rational face round the section, degree 3 × 5, double knots both ways, rough.

    It runs from the trailing edge over the leading edge back; a ruled strip closes the blunt trailing edge, planes the
    root and the tip.
    """
    rng = np.random.default_rng(401)
    u_breaks, v_breaks = breaks(rng, 0.0, 48.0, 32, 2.0), breaks(rng, 0.0, 135.0, 75, 2.0)
    u_breaks[16] = 24.0
    u, v = clamped(u_breaks, 3, [8, 16, 25]), clamped(v_breaks, 5, [18, 37, 38, 58])
    section, span = greville(u, 3) / 48.0, greville(v, 5)
    half = np.pi * section
    x = np.cos(half) ** 2
    camber = 0.16 * x * (1.0 - x)
    thick = np.sin(half) * np.cos(half) * (0.3 * (1.0 - 0.45 * x)) + 0.012 * np.cos(half) ** 3
    along = (span / 135.0)[None, :]
    chord = 24.0 - 10.0 * along * along
    twist = np.pi / 180.0 * (52.0 - 46.0 * along + 14.0 * along * along)
    right, up = chord * (x - 0.35)[:, None], chord * (camber + thick)[:, None]
    across = right * np.cos(twist) - up * np.sin(twist)
    upward = right * np.sin(twist) + up * np.cos(twist) + 10.0 * along * along
    poles = np.stack((across, upward, np.broadcast_to(span, up.shape)), axis=-1)
    noise = 0.03 * rng.standard_normal(poles.shape)
    noise[:, [0, -1], 2] = 0.0
    poles = settle(poles + noise)
    weights = settle(1.0 + 0.3 * np.sin(2.0 * np.pi * section)[:, None] * np.cos(np.pi * along) + 0.1 * along)
    skin = surface(poles, u, v, (3, 5), weights)
    rear = np.array([0.0, 0.0, 1.0, 1.0])
    strip = surface(poles[[-1, 0]], rear, v, (1, 5), weights[[-1, 0]])

    ends = {(i, j): vertex(poles[i, j]) for i in (0, -1) for j in (0, -1)}
    rounds, closes, rails = {}, {}, {}
    for k in (0, -1):
        path = curve(poles[:, k], u, 3, weights[:, k])
        rounds[k] = edge(path, (ends[0, k], ends[-1, k]), (u[0], u[-1]))
        closes[k] = edge(curve(poles[[-1, 0], k], rear, 1), (ends[-1, k], ends[0, k]), (0.0, 1.0))
        rails[k] = edge(curve(poles[k], v, 5, weights[k]), (ends[k, 0], ends[k, -1]), (v[0], v[-1]))

    def sheet(on: Geom_Surface, sides: dict[int, TopoDS_Edge], width: float, left: int, right: int) -> TopoDS_Face:
        loop = [
            Side(sides[0], line2d((0.0, 0.0), (1, 0))),
            Side(rails[right], line2d((width, 0.0), (0, 1))),
            Side(sides[-1], line2d((0.0, v[-1]), (1, 0)), False),
            Side(rails[left], line2d((0.0, 0.0), (0, 1)), False),
        ]
        return face(on, [loop])

    def cap(k: int) -> TopoDS_Face:
        plane = Geom_Plane(gp_Pnt(0, 0, float(poles[0, k, 2])), gp_Dir(0, 0, 1))
        return face(plane, [[Side(rounds[k]), Side(closes[k])]], outward=k != 0)

    return single(
        solid([sheet(skin, rounds, u[-1], 0, -1), sheet(strip, closes, 1.0, -1, 0), cap(0), cap(-1)]), "blade"
    )
