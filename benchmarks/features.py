"""Time and memory of many copies of a feature: 100 and 500 on a face of 400 × 400 control points.

Usage: python benchmarks/features.py [COPIES …]
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
SIDE, PLACE = 397.0, 25.0


def ground(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The height of a curved sheet."""
    return 10 * np.sin(x / 90) * np.cos(y / 120)


def make_face(path: Path) -> None:
    """A sheet of 1 mm bicubic spans with one bump."""
    from mracad.occ.step import write_step
    from samples.models import documents, geometry, splines, topology

    knots = splines.clamped(np.linspace(0.0, SIDE, int(SIDE) + 1), 3)
    x, y = np.meshgrid(splines.greville(knots, 3), splines.greville(knots, 3), indexing="ij")
    bump = 0.8 * np.exp(-((x - PLACE) ** 2 + (y - PLACE) ** 2) / (2 * 2.0**2))
    surface = geometry.surface(np.stack([x, y, ground(x, y) + bump], axis=-1), knots, knots)
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace

    write_step(documents.single(BRepBuilderAPI_MakeFace(surface, topology.TOL).Face(), "sheet"), path)


def peak() -> float:
    """The peak memory of this process, MB (Linux), without that of its parent."""
    status = Path("/proc/self/status").read_text()
    return int(status.split("VmHWM:")[1].split()[0]) / 1024


def measure(source: Path, copies: int) -> None:
    """One run in this process: reading, editing, writing."""
    from mracad.edit.feature.edits import repeat
    from mracad.job.document import run
    from mracad.occ.step import read_step, write_step
    from mracad.spec.steps import Repeat

    rng = np.random.default_rng(0)
    x, y = rng.uniform(15, SIDE - 15, (2, copies))
    rows = np.stack([x, y, ground(x, y), rng.uniform(0, 360, copies)], axis=1)
    places = source.with_suffix(".csv")
    np.savetxt(places, rows, delimiter=",", fmt="%.6f")
    z = ground(np.float64(PLACE), np.float64(PLACE)) + 0.8
    begin = time.perf_counter()
    run(read_step(source), repeat, Repeat(feature=f"near:{PLACE},{PLACE},{z},radius:10", at=(f"{x[0]},{y[0]},0",)))
    first = time.perf_counter() - begin
    times = [time.perf_counter()]
    document = read_step(source)
    times.append(time.perf_counter())
    held = peak()
    report = run(document, repeat, Repeat(feature=f"near:{PLACE},{PLACE},{z},radius:10", at=(f"@{places}",)))
    times.append(time.perf_counter())
    more = peak() - held
    write_step(document, source.with_name("out.step"))
    times.append(time.perf_counter())
    read, edit, write = np.diff(times)
    worst = max(c.deviation for c in report.edit.copies)
    shape = report.edit.displacement.offsets[0].poles.shape[:2]
    print(f"one copy, including loading libraries: {first:.1f} s with reading")
    print(
        f"{copies} copies: read {read:.1f} s, edited in {edit:.1f} s, written in {write:.1f} s; "
        f"{more:.0f} MB more at peak; deviation ≤ {worst:.1e} mm; {shape[0]} × {shape[1]} control points"
    )


def main(arguments: list[str]) -> None:
    """Run each count in a process of its own."""
    sys.path.insert(0, str(ROOT))
    if arguments[:1] == ["--one"]:
        measure(Path(arguments[1]), int(arguments[2]))
        return
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "sheet.step"
        make_face(source)
        for copies in arguments or ["100", "500"]:
            subprocess.run([sys.executable, __file__, "--one", str(source), copies], check=True)


if __name__ == "__main__":
    main(sys.argv[1:])
