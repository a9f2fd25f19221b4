"""Time and memory of a model whose seams all move: panels of 16, 49 and 100 patches of 60 × 60 control points.

For every panel: the solve of all patches in one group, compared with the elimination of its whole system by SuperLU (up
to 49 patches: more takes 3 GB and minutes), and the whole job compared with reading and writing.  All times are CPU
seconds.

Usage: python benchmarks/seams.py [SIDE[×SPANS] …], of panels of SIDE × SIDE patches of SPANS spans (57) each way
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
SPANS = 57
SCALE = 12.0
WHOLE = 7
"""Largest number of patches along a side for which the whole system is also eliminated."""


def peak() -> float:
    """The peak memory of this process, MB (Linux)."""
    status = Path("/proc/self/status").read_text()
    return int(status.split("VmHWM:")[1].split()[0]) / 1024


def timed(call: Callable[[], Any]) -> tuple[Any, float]:
    """The result of a call, and its CPU seconds."""
    start = time.process_time()
    return call(), time.process_time() - start


def make_panel(path: Path, side: int, spans: int) -> None:
    """A noisy panel of ``side × side`` patches."""
    from mracad.occ.step import write_step
    from tests.edit import panels

    _, noisy = panels.whole(spans, 0.05, patches=(side, side))
    write_step(panels.document(panels.cut(noisy, (side, side))), path)


def group(model: Any) -> Any:
    """All faces as one problem, with free edges not held."""
    from mracad.model.cells import quadrature
    from mracad.seam.conditions import matched, rows
    from mracad.seam.energy import forms
    from mracad.seam.interface import joints
    from mracad.seam.metric import planar, seen
    from mracad.seam.solve import Problem, Space
    from mracad.seam.wishes import Wishes

    joined = joints(model, set(range(len(model.faces))), Wishes("g1"))
    spaces = {}
    nets = matched({surface.index: surface.net for surface in model.surfaces}, joined.exact)
    for i, net in nets.items():
        form = forms(net, planar(net), quadrature(net, [model.faces[k] for k in model.surfaces[i].faces]))
        points = seen(net, form)
        spaces[i] = Space(net, form, points, points)
    return Problem(spaces, rows(nets, joined.exact)[0])


def measure_solve(source: Path, side: int) -> None:
    """The filter of all faces in one group."""
    import numpy as np

    from mracad.occ.step import read_step
    from mracad.occ.view import view
    from mracad.seam import solve

    problem, assembly = timed(lambda: group(view(read_step(source))))
    stiffness = (SCALE / (2 * np.pi)) ** 4
    found, own = timed(lambda: problem.filtered(stiffness))
    memory = peak()
    off = float(np.abs(problem.rows @ found).max() / np.abs(found).max())
    line = f"solve {own:.2f} s, {memory:.0f} MB, |Lδ| / |δ| {off:.0e}"
    if side <= WHOLE:
        solve.DIRECT = sys.maxsize
        again = solve.Problem(problem.spaces, problem.rows)
        whole, peer = timed(lambda: again.filtered(stiffness))
        apart = float(np.abs(found - whole).max() / np.abs(whole).max())
        line += f"; SuperLU {peer:.2f} s, {peak():.0f} MB: {own / peer:.2f} of its time, {apart:.0e} apart"
    print(f"  {len(problem.spaces)} faces: read and assembled {assembly:.2f} s, {line}", flush=True)


def measure_job(source: Path) -> None:
    """Reading, the whole job, writing."""
    from mracad.edit.smooth import smooth
    from mracad.job.document import run
    from mracad.occ.step import read_step, write_step
    from mracad.spec.steps import Smooth

    document, read = timed(lambda: read_step(source))
    report, whole = timed(lambda: run(document, smooth, Smooth(scale=f"{SCALE}mm")))
    with (source.parent / "out.step").open("wb") as stream:
        _, write = timed(lambda: write_step(document, stream))
    seams = sum(edge.how == "coupled" for edge in report.edit.edges)
    print(
        f"  {seams} seams moved: read {read:.2f} s, job {whole:.2f} s ({whole / (read + write):.1f} times reading and "
        f"writing), write {write:.2f} s, {peak():.0f} MB",
        flush=True,
    )


def main(arguments: list[str]) -> None:
    """Make the models and measure each in processes of its own."""
    sys.path[:0] = [str(ROOT)]
    if arguments[:1] == ["--solve"]:
        measure_solve(Path(arguments[1]), int(arguments[2]))
        return
    if arguments[:1] == ["--job"]:
        measure_job(Path(arguments[1]))
        return
    with tempfile.TemporaryDirectory() as folder:
        for panel in arguments or ["4", "7", "10"]:
            side, spans = map(int, (panel.replace("x", "×") + f"×{SPANS}").split("×")[:2])
            source = Path(folder) / f"{side}.step"
            make_panel(source, side, spans)
            print(f"{side} × {side} patches of {spans} spans", flush=True)
            for mode in ("--solve", "--job"):
                subprocess.run([sys.executable, __file__, mode, str(source), str(side)], check=True)


if __name__ == "__main__":
    main(sys.argv[1:])
