"""Draw the pictures of the documentation: reflection lines on the samples, before and after edits.

Usage: python docs/picture.py [FOLDER]
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

import mracad
from mracad.job.document import play
from mracad.spec import recipe

HERE = Path(__file__).parent
SAMPLES = HERE.parent / "samples"
SHELL = SAMPLES / "shell.step"
EXAMPLE = SAMPLES / "example" / "recipe.toml"
ABOVE, ASIDE = (0.0, 0.0, 1.0), (-0.3, -0.8, 1.1)
LIGHT = np.array([0.4, 0.9, 0.0]) / np.linalg.norm([0.4, 0.9, 0.0])
"""To the right, up, and to the viewer."""

FINE = 2
"""A pixel is the mean of this many, squared."""

DENSE = 1.6
"""Number of points of a surface per fine pixel, along each parameter line."""

GREYS, STRIPES = 16, 22.0
BACK = 0.97


def zebra(model: mracad.Model, view: Sequence[float], width: int, stripes: float) -> np.ndarray:
    """Grey values ``(height, width)``: stripes of the angle between the mirrored view direction and a light."""
    toward = np.array(view) / np.linalg.norm(view)
    right = np.cross((0.0, 1.0, 0.0) if toward[2] > 0.99 else (0.0, 0.0, 1.0), toward)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(toward, right), toward])
    light = LIGHT @ axes
    box = np.concatenate([surface.net.poles.reshape(-1, 3) for surface in model.surfaces]) @ axes.T
    low, size = box.min(axis=0), np.ptp(box, axis=0)
    pixel = size[0] / (width * FINE)
    height = int(np.ceil(size[1] / pixel / FINE)) * FINE
    image = np.full((height, width * FINE), BACK)
    nearest = np.full(image.shape, -np.inf)
    for surface in model.surfaces:
        points, normals = _samples(surface.net, pixel / DENSE)
        x, y, depth = axes @ points.T - low[:, None]
        at = tuple(
            np.clip(each.astype(int), 0, most - 1)
            for each, most in zip((height - y / pixel, x / pixel), image.shape, strict=True)
        )
        mirrored = 2 * (normals @ toward)[:, None] * normals - toward
        lines = np.tanh(3 * np.sin(stripes * np.arcsin(np.clip(mirrored @ light, -1, 1))))
        grey = (0.62 + 0.33 * lines) * (0.55 + 0.45 * np.clip(normals @ toward, 0, 1))
        order = np.argsort(depth)
        at, grey, depth = tuple(each[order] for each in at), grey[order], depth[order]
        front = depth >= nearest[at]
        at = tuple(each[front] for each in at)
        nearest[at], image[at] = depth[front], grey[front]
    return image.reshape(height // FINE, FINE, width, FINE).mean(axis=(1, 3))


def _samples(net: mracad.Net, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Points and normals ``(n, 3)`` of a surface, not much farther apart than a step, mm."""
    at = []
    for axis, knots in enumerate((net.u, net.v)):
        longest = np.linalg.norm(np.diff(net.poles, axis=axis), axis=-1).sum(axis=axis).max()
        at.append(np.linspace(*knots.domain, int(longest / step) + 2))
    points, along_u, along_v = (np.asarray(each).reshape(-1, 3) for each in net.grid(*at, derivatives=1))
    normals = np.cross(along_u, along_v)
    return points, normals / np.linalg.norm(normals, axis=-1, keepdims=True)


def save(images: Sequence[np.ndarray], path: Path) -> None:
    """Images side by side, in a few greys."""
    gap = np.full((len(images[0]), 12), BACK)
    row = [part for image in images for part in (image, gap)][:-1]
    whole = Image.fromarray(np.round(np.concatenate(row, axis=1) * 255).astype(np.uint8))
    whole.quantize(GREYS).save(path, optimize=True)
    print(f"{path}: {path.stat().st_size / 1e3:.0f} kB")


def panel(folder: Path) -> None:
    """The panel as it came, smoothed with its seams frozen, and with its seams moving."""
    before = mracad.snapshot(mracad.read(SAMPLES / "panel.step"))
    after = [
        mracad.smooth(before, mracad.Smooth(scale="25mm", edges=edges)).displacement.applied(before)
        for edges in ("frozen", "coupled")
    ]
    save([zebra(model, ABOVE, 460, 60.0) for model in (before, *after)], folder / "panel.png")


def example(folder: Path) -> None:
    """The shell as it came, and after each edit of the example."""
    document = mracad.read(SHELL)
    save([zebra(mracad.snapshot(document), ASIDE, 760, STRIPES)], folder / "example-0.png")
    *edits, _ = recipe.load(str(EXAMPLE)).steps(str(SHELL))
    for number, step in enumerate(edits, 1):
        play(document, [step])
        save([zebra(mracad.snapshot(document), ASIDE, 760, STRIPES)], folder / f"example-{number}.png")


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE
    panel(target)
    example(target)
