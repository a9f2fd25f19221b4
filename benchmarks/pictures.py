"""Drawing against reading and meshing with the bare kernel: ratios of CPU time and of peak memory.

Usage: python benchmarks/pictures.py FILE.step … [--show zebra]

The kernel reads with names and colours, and meshes as finely as by default here. mracad keeps healed documents in a
cache: set MRACAD_CACHE=off to measure drawing a file for the first time.  Both sides are processes of their
own, run alternately; the median of the runs counts.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

BARE = """
import sys
from OCP.Bnd import Bnd_Box
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDocStd import TDocStd_Document
from OCP.XCAFDoc import XCAFDoc_DocumentTool
document = TDocStd_Document(TCollection_ExtendedString("BinXCAF"))
reader = STEPCAFControl_Reader()
reader.ReadFile(sys.argv[1])
reader.Transfer(document)
shape, bounds = XCAFDoc_DocumentTool.ShapeTool_s(document.Main()).GetOneShape(), Bnd_Box()
BRepBndLib.Add_s(shape, bounds)
BRepMesh_IncrementalMesh(shape, 2e-4 * bounds.SquareExtent() ** 0.5, False, 0.2094)
"""
RUNS = 3


def measured(command: list[str]) -> tuple[float, float]:
    """CPU time (s) and peak memory (MB) of one run."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def main() -> None:
    """Compare on every file given."""
    words = sys.argv[1:]
    more = words[words.index("--show") :] if "--show" in words else []
    for path in words[: len(words) - len(more)]:
        with tempfile.TemporaryDirectory() as folder:
            draw = [sys.executable, "-m", "mracad_cli", "render", path, "-o", f"{folder}/a.png", "--overwrite", *more]
            runs = [(measured([sys.executable, "-c", BARE, path]), measured(draw)) for _ in range(RUNS)]
        (bare, size), (drawn, most) = sorted(runs, key=lambda run: run[1][0] / run[0][0])[RUNS // 2]
        print(
            f"{Path(path).name:42s} bare {bare:5.2f} s {size:4.0f} MB   render {drawn:5.2f} s {most:4.0f} MB"
            f"   ratio {drawn / bare:.2f} {most / size:.2f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
