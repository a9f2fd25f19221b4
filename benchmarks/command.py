"""The whole command against a bare kernel read and write of the same file: ratios of time and of peak memory.

Usage: python benchmarks/command.py [FILE.step …]     (default: the samples, and the corpus where MRACAD_CORPUS is set)

Both sides are processes of their own, run alternately; the best of the runs counts.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

BARE = """
import sys
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Reader, STEPControl_Writer
reader = STEPControl_Reader()
reader.ReadFile(sys.argv[1])
reader.TransferRoots()
writer = STEPControl_Writer()
writer.Transfer(reader.OneShape(), STEPControl_AsIs)
writer.Write(sys.argv[2])
"""
RUNS = 3


def measured(command: list[str]) -> tuple[float, float, int]:
    """Wall time (s), peak memory (MB) and exit code of one run."""
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return time.perf_counter() - start, usage.ru_maxrss / 1024, process.returncode


def compare(path: Path, folder: Path) -> tuple[float, float]:
    """Print one line for a file and return the ratios of time and memory."""
    out = str(folder / "out.step")
    bare = [sys.executable, "-c", BARE, str(path), out]
    smooth = [sys.executable, "-m", "mracad_cli", "smooth", str(path), "--scale", "2%", "--overwrite", "-o", out]
    runs = [(measured(bare), measured(smooth)) for _ in range(RUNS)]
    times = [min(run[side][0] for run in runs) for side in (0, 1)]
    memory = [min(run[side][1] for run in runs) for side in (0, 1)]
    ratios = times[1] / times[0], memory[1] / memory[0]
    print(
        f"{path.name:42s} bare {times[0]:5.2f} s {memory[0]:4.0f} MB   smooth {times[1]:5.2f} s {memory[1]:4.0f} MB"
        f"   ratio {ratios[0]:.2f} {ratios[1]:.2f}   exit {runs[0][1][2]}",
        flush=True,
    )
    return ratios


def main() -> None:
    """Compare on every file given."""
    paths = [Path(p) for p in sys.argv[1:]]
    if not paths:
        paths = sorted(Path(__file__).parent.parent.glob("samples/*.step"))
        if corpus := os.environ.get("MRACAD_CORPUS"):
            paths += sorted(Path(corpus).glob("*.step"))
    with tempfile.TemporaryDirectory() as folder:
        ratios = [compare(path, Path(folder)) for path in paths]
    print(f"worst ratio: time {max(t for t, _ in ratios):.2f}, memory {max(m for _, m in ratios):.2f}")


if __name__ == "__main__":
    main()
