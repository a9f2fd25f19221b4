"""Features taken from random places on sewn grounds to random places on others, against the closed form.

Usage: python -m tests.edit.feature.random_places [COUNT [SEED]]

Source and target are 2 × 2 sewn patches, whose seams lie at random beside the feature and the copy, under or off them.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np
from mracad_cli.__main__ import main as mracad

from mracad.bspline.closest import feet
from mracad.occ.step import read_step
from mracad.occ.view import view
from samples.models.panel import sewn
from samples.models.splines import split
from tests.edit.feature import grounds
from tests.edit.feature.grounds import HEIGHT, bump
from tests.occ import shapes

NAMES = "plane", "cylinder 30", "cone 40", "sphere 60"
SIZE, REACH, FAR = 3.0, 15.0, np.array([0.0, 300.0, 0.0])
"""Deviation of the bump, radius of the place, and the way from source to target, mm."""


def distance(name: str, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Distance along a ground from where a = b = 0, mm."""
    if name.startswith("sphere"):
        return 60.0 * np.arccos(np.cos(a / 60.0) * np.cos(b / 60.0))
    if not name.startswith("cone"):
        return np.hypot(a, b)
    slant = 40.0 * np.hypot(1, 0.3) / 0.3
    angle = b / 40.0 * 0.3 / np.hypot(1, 0.3)
    return np.sqrt((slant + a) ** 2 + slant**2 - 2 * slant * (slant + a) * np.cos(angle))


def patches(net, cuts):
    """A net as 2 × 2 sewn patches."""
    strips = split(net.u.knots, net.poles, 3, [cuts[0]])
    halves = ((u, split(net.v.knots, part.swapaxes(0, 1), 3, [cuts[1]])) for u, part in strips)
    return sewn([[(u, v, part.swapaxes(0, 1)) for v, part in parts] for u, parts in halves])


def placed(number: int, seed: int, folder: Path) -> tuple[str, int, float, float]:
    """What was tried, the exit code, the largest error of the copy in the file, and its height, both over the true
    one."""
    rng = np.random.default_rng((seed, number))
    source, target = rng.choice(NAMES, 2)
    cuts, turn = rng.uniform(-14, 14, (2, 2)), rng.uniform(0, 360)
    hill = grounds.above(source, lambda a, b: bump(distance(source, a, b), sigma=SIZE), half=30.0, spans=120)
    bare = grounds.above(target, lambda a, b: 0 * a, half=30.0, spans=int(rng.integers(20, 90)))
    bare = type(bare)(bare.u, bare.v, bare.poles + FAR)
    path = shapes.save(shapes.compound(patches(hill, cuts[0]), patches(bare, cuts[1])), folder / "in.step")
    top = [np.stack(grounds.GROUNDS[name](*np.zeros((3, 1))), axis=1)[0] for name in (source, target)]
    words = [",".join(repr(float(x)) for x in point) for point in (top[0], top[1] + FAR)]
    out = folder / "out.step"
    where = "--feature", f"near:{words[0]},radius:{REACH}", "--at", words[1], "--rotate", f"{turn:.1f}"
    code = mracad(["repeat", str(path), "-o", str(out), "--overwrite", "--quiet", *where])
    what = f"{source} to {target}, seams at {np.round(cuts, 1).tolist()}"
    if code:
        return what, code, np.nan, np.nan
    r, t = 12 * np.sqrt(rng.random(600)), 2 * np.pi * rng.random(600)
    a, b = np.append(r * np.cos(t), 0.0), np.append(r * np.sin(t), 0.0)
    wanted = np.stack(grounds.GROUNDS[target](a, b, bump(distance(target, a, b), sigma=SIZE)), axis=1) + FAR
    ground = np.stack(grounds.GROUNDS[target](a, b, 0 * a), axis=1) + FAR
    nets = [surface.net for surface in view(read_step(out)).surfaces[4:]]
    found = [
        feet(net, wanted, np.clip(np.stack([a, b], 1), *np.transpose([net.u.domain, net.v.domain]))) for net in nets
    ]
    apart = np.min([off for _, off in found], axis=0)
    net, (uv, _) = min(zip(nets, found, strict=True), key=lambda each: each[1][1][-1])
    rise = float(np.linalg.norm(net.evaluate(uv[-1:]) - ground[-1:]))
    return what, code, float(apart.max() / HEIGHT), rise / HEIGHT


def main(arguments: list[str]) -> None:
    """Place a number of features, from the command line, and print what became of each."""
    count, seed = (int(x) for x in (*arguments, *("200", "1")[len(arguments) :]))
    every = []
    with tempfile.TemporaryDirectory() as folder:
        for number in range(count):
            what, code, off, rise = placed(number, seed, Path(folder))
            every.append((code, off, rise))
            print(f"{number:4d} exit {code}  error {off:.1e}  height {rise:.4f}  {what}", flush=True)
    codes, off, rise = np.transpose(every)
    there = codes == 0
    print(
        f"{there.sum()} of {count} placed, exit codes {sorted(set(codes.astype(int).tolist()))}; "
        f"largest error {off[there].max():.1e} of the height; "
        f"heights {rise[there].min():.4f} to {rise[there].max():.4f} of the true one"
    )


if __name__ == "__main__":
    main(sys.argv[1:])
