"""Time and memory of a model whose seams all move: panels of 16, 49 and 100 patches of 60 × 60 control points.

Usage: python benchmarks/seams.py [SIDE …], of panels of SIDE × SIDE patches
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from itertools import pairwise
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SPANS = 57


def peak() -> float:
    """The most memory that this process has held, MB (Linux)."""
    status = Path("/proc/self/status").read_text()
    return int(status.split("VmHWM:")[1].split()[0]) / 1024


def make_panel(path: Path, side: int) -> None:
    """A noisy panel of ``side × side`` patches."""
    from mracad.occ.step import write_step
    from tests.edit import panels

    _, noisy = panels.whole(SPANS, 0.05, patches=(side, side))
    write_step(panels.document(panels.cut(noisy, (side, side))), path)


def measure(source: Path) -> None:
    """One run in this process: reading, the whole job, writing."""
    from mracad import job
    from mracad.edit.smooth import smooth
    from mracad.occ.step import read_step, write_step
    from mracad.options import Smooth

    marks = [time.perf_counter()]
    document = read_step(source)
    marks.append(time.perf_counter())
    report = job.run(document, smooth, Smooth(scale="12mm"))
    marks.append(time.perf_counter())
    with (source.parent / "out.step").open("wb") as stream:
        write_step(document, stream)
    marks.append(time.perf_counter())
    read, whole, write = (b - a for a, b in pairwise(marks))
    seams = sum(edge.how == "coupled" for edge in report.edit.edges)
    print(
        f"{len(report.model.faces)} faces, {seams} seams: read {read:.2f} s, job {whole:.2f} s "
        f"({whole / (read + write):.2f} of reading and writing), write {write:.2f} s, {peak():.0f} MB",
        flush=True,
    )


def main(arguments: list[str]) -> None:
    """Make the models and measure each in a process of its own."""
    sys.path[:0] = [str(ROOT)]
    if arguments[:1] == ["--measure"]:
        measure(Path(arguments[1]))
        return
    with tempfile.TemporaryDirectory() as folder:
        for side in map(int, arguments or ["4", "7", "10"]):
            source = Path(folder) / f"{side}.step"
            make_panel(source, side)
            subprocess.run([sys.executable, __file__, "--measure", str(source)], check=True)


if __name__ == "__main__":
    main(sys.argv[1:])
