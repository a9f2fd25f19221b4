"""Dimples all over a ball of six sewn patches: time, memory, and whether the mesh is closed.

Usage: python benchmarks/fill.py [PLACES [hexagons|grid|poisson]]
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
RADIUS = 21.335
DEEP = 0.12
"""Depth of a dimple over its radius."""


def make(folder: Path, spacing: float) -> None:
    """The ball, and a dimple that fits between its neighbours."""
    from mracad.edit.feature.detail import Feature, save
    from mracad.occ.step import write_step
    from tests.edit.feature import grounds

    write_step(grounds.sewn(grounds.ball(RADIUS, 24), "ball"), folder / "ball.step")
    radius = 0.48 * spacing
    x, y = np.meshgrid(*[np.linspace(-1, 1, 65)] * 2, indexing="ij")
    share = np.clip(1 - x**2 - y**2, 0, None)
    table = np.stack([0 * x, 0 * x, -DEEP * radius * share**3, share > 0], axis=-1)
    (folder / "dimple.feature").write_bytes(save(Feature(radius, radius, radius / 3, table, "dimple")))


def open_sides(path: Path) -> int:
    """Sides of triangles of a binary STL that have no partner in the other direction."""
    corners = np.frombuffer(path.read_bytes()[84:], np.dtype([("n", "<f4", 3), ("c", "V12", 3), ("a", "<u2")]))["c"]
    _, index = np.unique(corners.ravel(), return_inverse=True)
    three = index.reshape(-1, 3)
    sides = Counter(map(tuple, np.concatenate([three[:, [0, 1]], three[:, [1, 2]], three[:, [2, 0]]]).tolist()))
    return sum(sides[b, a] != count for (a, b), count in sides.items())


def main(arguments: list[str]) -> None:
    """Fill a ball with about so many dimples, from the command line."""
    sys.path.insert(0, str(ROOT))
    count, kind = int((arguments or ["5000"])[0]), (arguments[1:] or ["hexagons"])[0]
    room = {"hexagons": 0.75**0.5, "grid": 1.0, "poisson": 1.42}[kind]
    spacing = float(np.sqrt(4 * np.pi * RADIUS**2 / count / room))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        make(folder, spacing)
        fill = f"{kind},spacing:{spacing:.4f}mm"
        words = ["repeat", "ball.step", "--feature", "dimple.feature", "--fill", fill, "--clip", "-o", "ball.stl"]
        subprocess.run([sys.executable, "-m", "mracad_cli", *words], cwd=folder, check=True)
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        print(
            f"{count} {kind}: {used.ru_utime + used.ru_stime:.0f} s of CPU, {used.ru_maxrss / 1e6:.1f} GB, "
            f"{open_sides(folder / 'ball.stl')} open sides"
        )


if __name__ == "__main__":
    main(sys.argv[1:])
