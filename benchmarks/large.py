"""Time and memory of one large net: an untrimmed face of n × n control points with waves and noise, n = 67 to 515.

``smooth`` and ``level`` in memory, with reading and writing, beside the kernel's own reading and writing of the same
file; each in a process of its own.  The scale is that of six spans, so nets differ in size only.  The last lines give
the exponents by which CPU time grows with the number of control points.

Usage: python benchmarks/large.py [N …]
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
SIZES = 67, 131, 259, 515
SPANS = 6
"""Number of spans in the scale."""

MODES = "kernel", "smooth", "level"


def make(path: Path, size: int) -> None:
    """A panel with waves of four spans and noise, a fiftieth and a hundredth of a span high, on uneven spans."""
    import numpy as np

    from mracad.bspline.knots import KnotVector
    from mracad.bspline.surface import Net
    from mracad.occ.step import write_step
    from tests.edit import panels

    rng, step = np.random.default_rng(3), panels.SIZE / (size - 3)
    u, v = (
        KnotVector.clamped(np.append(0.0, np.cumsum(c)) * (panels.SIZE / c.sum()), 3)
        for c in rng.uniform(0.7, 1.3, (2, size - 3))
    )
    x, y = np.meshgrid(u.greville(), v.greville(), indexing="ij")
    waves = 0.02 * step * np.sin(2 * np.pi * x / (4 * step)) * np.cos(2 * np.pi * y / (4 * step))
    poles = np.stack([x, y, panels.truth(x, y) + waves], axis=-1) + 0.01 * step * rng.standard_normal((size, size, 3))
    frame = ((0.0, panels.SIZE),) * 2
    write_step(panels.document({(0, 0): panels.Patch(Net(u, v, poles), "", frame)}), path)


def kernel(path: Path, size: int) -> None:
    """Read and write by the kernel alone."""
    from phases import kernel_read, kernel_write

    kernel_write(kernel_read(str(path)), str(path.with_suffix(".out")))


def edit(path: Path, mode: str, size: int) -> None:
    """Read, edit, write."""
    from mracad.edit.level import level
    from mracad.edit.smooth import smooth
    from mracad.job.document import run
    from mracad.occ.step import read_step, write_step
    from mracad.spec.steps import Level, Smooth
    from tests.edit import panels

    scale = f"{SPANS * panels.SIZE / (size - 3)}mm"
    document = read_step(path)
    edits: dict[str, tuple[Any, Any]] = {"smooth": (smooth, Smooth(scale=scale)), "level": (level, Level(scale=scale))}
    report = run(document, *edits[mode])
    assert report.edit.displacement.offsets, "nothing moved"
    with path.with_suffix(".out").open("wb") as stream:
        write_step(document, stream)


def measured(path: Path, mode: str, size: int) -> tuple[float, float]:
    """CPU time, s, and peak memory, MB, of a process."""
    command = [sys.executable, __file__, "--" + mode, str(path), str(size)]
    told = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    cpu, memory = told.split()[-2:]
    return float(cpu), float(memory)


def main(arguments: list[str]) -> None:
    """Make the models and measure each in processes of its own."""
    import numpy as np

    sys.path[:0] = [str(ROOT)]
    if arguments and arguments[0].startswith("--"):
        mode, path, size = arguments[0][2:], Path(arguments[1]), int(arguments[2])
        kernel(path, size) if mode == "kernel" else edit(path, mode, size)
        memory = Path("/proc/self/status").read_text().split("VmHWM:")[1].split()[0]
        print(time.process_time(), int(memory) / 1024)
        return
    sizes = [int(each) for each in arguments] or SIZES
    times: dict[str, list[float]] = {mode: [] for mode in MODES}
    with tempfile.TemporaryDirectory() as folder:
        for size in sizes:
            path = Path(folder) / f"{size}.step"
            make(path, size)
            line, least = [], 1.0
            for mode in MODES:
                cpu, memory = measured(path, mode, size)
                times[mode].append(cpu)
                least = memory if mode == "kernel" else least
                line.append(
                    f"{mode} {cpu:.1f} s, {memory:.0f} MB" + (f" ({memory / least:.1f})" if mode != "kernel" else "")
                )
            print(f"{size}² control points, {path.stat().st_size / 1e6:.1f} MB: " + "; ".join(line), flush=True)
    for mode in MODES if len(sizes) > 1 else ():
        slopes = np.diff(np.log(times[mode])) / np.diff(2 * np.log(sizes))
        print(f"{mode}: exponents from size to size {', '.join(f'{each:.2f}' for each in slopes)}")


if __name__ == "__main__":
    main(sys.argv[1:])
