"""An edit with one process and with more: elapsed time, CPU time of all of them, and that the results are the same.

Usage: python benchmarks/workers.py [FILE…]

By default the models of less than 4 MB in the folder MRACAD_CORPUS, else a sample.  ``smooth --scale 2%`` in memory,
after a first run of everything; up to as many processes as there are processors.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent

LARGE = 4e6
"""Size of the smallest file that is left out by default, bytes."""


def main(paths: list[str]) -> None:
    """Print one line for each file."""
    sys.path[:0] = [str(ROOT)]
    from mracad.edit.smooth import smooth
    from mracad.occ.step import read_step
    from mracad.occ.view import view
    from mracad.spec.steps import Smooth

    for path in paths:
        model = view(read_step(path))
        smooth(model, Smooth(scale="2%"))
        found: list[tuple[float, float, Any]] = []
        for count in range(1, len(os.sched_getaffinity(0)) + 1):
            os.environ["MRACAD_WORKERS"] = str(count)
            start, used = time.perf_counter(), _used()
            edit = smooth(model, Smooth(scale="2%"))
            found.append((time.perf_counter() - start, _used() - used, edit))
        same = all(_bytes(edit) == _bytes(found[0][2]) for _, _, edit in found)
        took = "   ".join(f"{n}: {wall:.2f} s ({cpu:.2f} s of CPU)" for n, (wall, cpu, _) in enumerate(found, 1))
        print(f"{Path(path).name:40s} {took}   {'the same' if same else 'DIFFERENT'}", flush=True)


def _used() -> float:
    """CPU time of this process and of those that ended."""
    return sum(os.times()[:4])


def _models() -> list[str]:
    folder = os.environ.get("MRACAD_CORPUS")
    files = sorted(Path(folder).glob("*.st*p")) if folder else [ROOT / "samples" / "shell.step"]
    return [str(file) for file in files if file.stat().st_size < LARGE]


def _bytes(edit: Any) -> list[bytes]:
    return [offset.poles.tobytes() for _, offset in sorted(edit.displacement.offsets.items())]


if __name__ == "__main__":
    main(sys.argv[1:] or _models())
