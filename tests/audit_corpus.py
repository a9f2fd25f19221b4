"""What smoothing does to real models: the tables of faces that got rougher and of known noise.

Usage: python -m tests.audit_corpus smooth FOLDER --scale 2% [--only NAME …] [OPTION …]
       python -m tests.audit_corpus noise FOLDER --scale 5% --noise 0.5% [--only NAME …] [OPTION …]

Further options go to ``mracad smooth`` as they are.

``smooth`` smooths each model through the command and compares the file with its output (see :mod:`tests.roughness`).

``noise`` adds noise to the free control points of each NURBS face that has any (at least ``FREE``), normally
distributed in all three directions with the given deviation (% of the scale), writes that, smooths it through the
command and measures what is left: the root mean square of (result − original)·n inside the trims over that of the noisy
input, at the original's parameters and along its normals.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import mean, median

import numpy as np

from mracad.model.brep import Model
from mracad.model.displacement import Displacement, Offset
from mracad.occ.apply import apply
from mracad.occ.settings import quiet
from mracad.occ.step import read_step, write_step
from mracad.occ.view import view
from mracad.seam.hold import separate
from mracad.spec.quantity import length
from tests.roughness import FEWEST, POINTS, Face, compared, faces, matched, opened, removed, report
from tests.sheet import Sheet, grid

FREE = 1
"""Fewest free control points of a face that noise is put on."""

SEED = 2006


def smoothed(source: Path, target: Path, scale: str, options: Sequence[str] = ()) -> int:
    """Run the command; its exit code."""
    words = [sys.executable, "-m", "mracad_cli", "smooth", source, "-o", target, "--scale", scale, "--overwrite"]
    return subprocess.run([*map(str, words), *options], capture_output=True, check=False).returncode


def audited(source: Path, scale: str, options: Sequence[str] = ()) -> tuple[int, list[Face]]:
    """Exit code of smoothing a model, and what became of its faces (nothing where no file was written)."""
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / source.name
        code = smoothed(source, target, scale, options)
        size = view(opened(source, source.stat().st_mtime_ns)).diagonal
        return code, compared(source, target if target.exists() else source, length(scale, size, "scale"))


def shaken(model: Model, sigma: float, seed: int = SEED) -> tuple[Displacement, set[int]]:
    """Noise for the free control points of a model, and the faces that got some."""
    rng = np.random.default_rng(seed)
    offsets, chosen = {}, set()
    for surface in model.surfaces:
        members = [model.faces[i] for i in surface.faces]
        free = separate(surface.net, members, list(surface.faces)).free
        if free.sum() >= FREE:
            offsets[surface.index] = Offset(
                np.where(free[..., None], rng.normal(0, sigma, surface.net.poles.shape), 0.0)
            )
            chosen |= set(surface.faces)
    return Displacement(offsets), chosen


@dataclass(frozen=True)
class Left:
    """Normal error of a face, mm: of the noisy input and of the result."""

    index: int
    noise: float
    error: float

    @property
    def share(self) -> float:
        return self.error / self.noise


def denoised(source: Path, scale: str, noise: float, options: Sequence[str] = ()) -> tuple[int, list[Left]]:
    """Exit code of smoothing a noisy copy of a model, and what is left of the noise on each face that got some."""
    with tempfile.TemporaryDirectory() as folder, quiet():
        noisy, target = Path(folder) / source.name, Path(folder) / "smooth.step"
        document = read_step(source)
        model = view(document)
        width = length(scale, model.diagonal, "scale")
        displacement, chosen = shaken(model, noise * width)
        if not chosen:
            return 0, []
        apply(document, model, displacement)
        write_step(document, noisy)
        code = smoothed(noisy, target, f"{width!r}mm", options)
        before, between, after = (faces(each) for each in (source, noisy, target if target.exists() else noisy))
        left = [
            Left(i, *_errors(*(Sheet.of(each) for each in (before[i], between[j], after[k]))))
            for (i, j), (_, k) in zip(matched(before, between), matched(before, after), strict=True)
            if i in chosen
        ]
        return code, [each for each in left if each.noise > 0]


def _errors(clean: Sheet, noisy: Sheet, result: Sheet) -> tuple[float, float]:
    """Root mean squares of the normal distance of the noisy face and of the result from the clean one."""
    (u, wu, _), (v, wv, _) = (grid(result, POINTS, FEWEST, axis) for axis in (0, 1))
    on = clean.inside(u, v)
    s = clean.derivatives(u, v, 1)
    cross = np.cross(s[1, 0], s[0, 1])
    density = np.linalg.norm(cross, axis=2)
    normals = cross / np.maximum(density, 1e-300)[..., None]
    areas = wu[:, None] * wv * density * on
    found = [((each.derivatives(u, v, 0)[0, 0] - s[0, 0]) * normals).sum(axis=2) for each in (noisy, result)]
    return tuple(float(np.sqrt((areas * each**2).sum() / areas.sum())) for each in found) if areas.any() else (0.0, 0.0)


def table_of_smoothing(files: Sequence[Path], scale: str, options: Sequence[str], verbose: bool) -> None:
    """A line a model, and the sums."""
    head = ("model", "exit", "faces", "moved", "bending", "variat.", "largest", "fold", "worse", "removed", "fair")
    print(("{:36}" + " {:>7}" * 10).format(*head))
    rows = []
    for source in files:
        code, found = audited(source, scale, options)
        counts = [sum(name in each.grew for each in found) for name in ("bending", "variation", "largest", "fold")]
        worse = sum(bool(each.grew) for each in found)
        rows.append(
            [len(found), sum(each.moved for each in found), *counts, worse, removed(found), removed(found, True)]
        )
        detailed = any(each.detail[0] > 0 for each in found)
        print(
            f"{source.stem:36} {code:7}" + "".join(f" {n:7}" for n in rows[-1][:7])
            + ("".join(f" {x:7.3f}" for x in rows[-1][7:]) if detailed else "  nothing below the scale"), flush=True,
        )  # fmt: skip
        if not detailed:
            rows[-1][7:] = [None, None]
        if verbose:
            print(report(found))
    shares = [mean(row[k] for row in rows if row[k] is not None) for k in (7, 8)]
    totals = [sum(row[k] for row in rows) for k in range(7)]
    print(f"{'all':44}" + "".join(f" {n:7}" for n in totals) + "".join(f" {x:7.3f}" for x in shares))


def table_of_noise(files: Sequence[Path], scale: str, noise: float, options: Sequence[str], verbose: bool) -> None:
    """A line a model, and the sums."""
    print(("{:36}" + " {:>7}" * 5).format("model", "exit", "faces", "median", "worst", "worse"))
    every: list[float] = []
    for source in files:
        code, left = denoised(source, scale, noise, options)
        shares = [each.share for each in left]
        every += shares
        if shares:
            print(_line(f"{source.stem:36} {code:7}", shares), flush=True)
        if verbose:
            print(*(f"  #{each.index + 1}: {each.noise:.3g} → {each.error:.3g} mm" for each in left), sep="\n")
    print(_line(f"{'all':44}", every))


def _line(head: str, shares: Sequence[float]) -> str:
    worse = sum(x > 1 + 1e-6 for x in shares)
    return f"{head} {len(shares):7} {median(shares):7.3f} {max(shares):7.3f} {worse:7}"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("table", choices=["smooth", "noise"])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--scale", required=True)
    parser.add_argument("--noise", default="0.5%", help="%% of the scale")
    parser.add_argument("--only", action="append", default=[], help="part of a file's name")
    parser.add_argument("--verbose", action="store_true")
    given, further = parser.parse_known_args()
    models = [
        path
        for path in sorted(given.folder.glob("*.step"))
        if not given.only or any(part in path.name for part in given.only)
    ]
    if given.table == "smooth":
        table_of_smoothing(models, given.scale, further, given.verbose)
    else:
        table_of_noise(models, given.scale, float(given.noise.strip("%")) / 100, further, given.verbose)
