"""The shell: the upper half of a handheld case in a dozen patches, milled and scanned, with an emboss."""

from __future__ import annotations

import numpy as np

from mracad.occ.document import Document

from .documents import single
from .panel import cut, sewn
from .splines import clamped, greville, settle

SIZE = (240.0, 120.0)
PATCHES = (4, 3)
SPANS = (120, 60)

EMBOSS = (90.0, 60.0)
"""Where the emboss is, in u and v."""

NOISE, CHATTER, STEP = 0.008, 0.06, 5.0
"""Noise of each coordinate of control points, amplitude of the marks of milling, and their wavelength along u, mm."""


def emboss(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Height of the control points of a drop of 1.5 mm, mm: blunt at one end, thin at the other."""
    return 1.7 * np.exp(-((x / 7.5) ** 2) - (y / (3.8 - 0.09 * np.clip(x, -15.0, 15.0))) ** 2)


def shell_net(height: float = 1.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return knots in u and v and the poles of the smooth shell before it is cut, its emboss times a height.

    An arched case of 240 × 115 × 45 mm, u along it and v over it, with a waist, a hollow for the thumb and a soft line
    along one flank; made with + − × ÷ and √ alone but for the emboss.
    """
    knots = [clamped(np.linspace(0.0, size, spans + 1), 3) for size, spans in zip(SIZE, SPANS, strict=True)]
    u, v = np.meshgrid(*(greville(k, 3) for k in knots), indexing="ij")
    p, t = u / 120.0 - 1.0, 0.8 * (v / 60.0 - 1.0)
    wide = 56.0 - 10.0 * p * p - 9.0 / (1.0 + 12.0 * (p - 0.1) ** 2)
    high = 46.0 - 14.0 * p * p - 5.0 * p
    y, z = wide * 2.0 * t / (1.0 + t * t), high * (1.0 - t * t) / (1.0 + t * t)
    z = z - 3.0 / (1.0 + 12.0 * (p - 0.55) ** 2 + 7.0 * t * t)
    line = (v - 88.0 - 8.0 * p) / 16.0
    y = y + 2.5 * line / np.sqrt(1.0 + line * line)
    poles = np.stack((u, y, z), axis=-1)
    normal = np.cross(np.gradient(poles, axis=0), np.gradient(poles, axis=1))
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return *knots, poles + height * emboss(u - EMBOSS[0], v - EMBOSS[1])[..., None] * normal


def shell_noise() -> np.ndarray:
    """Return the displacements that mills and scanners leave, mm."""
    u, v = (greville(clamped(np.linspace(0.0, s, n + 1), 3), 3) for s, n in zip(SIZE, SPANS, strict=True))
    noise = NOISE * np.random.default_rng(103).standard_normal((len(u), len(v), 3))
    noise[..., 2] += CHATTER * np.sin(2.0 * np.pi * u / STEP)[:, None]
    return noise


def shell() -> Document:
    """The shell with noise and marks on every control point, added before cutting, so C2 across the seams."""
    u, v, poles = shell_net()
    return single(sewn(cut(u, v, settle(poles + shell_noise(), 10), PATCHES)), "shell")
