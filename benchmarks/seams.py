"""CPU time and memory of quilts: square panels of patches with waves and noise, sewn, all seams moving.

Usage: python benchmarks/seams.py [SIDE×SPANS …]
       python benchmarks/seams.py --solve [SIDE×SPANS …]

Each quilt has SIDE × SIDE patches of SPANS spans each way, of 100 mm, and is smoothed at seven spans.  In a process
that has smoothed a small one, by phase: reading, viewing, the edit, checking and measuring in memory, writing, reading
back and judging; the edit by parts; peak memory beside that of the kernel's own reading and writing.  From two quilts
of the same spans on: the exponent of time in the number of faces.

With ``--solve``: one filter of all patches in one group, beside the elimination of its whole system by SuperLU (up to
49 patches of 57 spans: more takes 3 GB and minutes).
"""

from __future__ import annotations

import importlib
import math
import os
import re
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
DEFAULT = "2×57", "4×57", "5×5", "10×5", "16×5"
SOLVED = "4×57", "7×57", "22×5"
FEW, SIZE = 12, 100.0
WHOLE = 200_000
"""Largest number of control points for which the whole system is also eliminated."""

PARTS = {
    "surfaces": ["mracad.edit.target:sheets"],
    "joints": ["mracad.seam.interface:joints"],
    "problems": ["mracad.edit.pose:pose"],
    "solving": [f"mracad.seam.solve:Problem.{name}" for name in ("filtered", "nearest", "_factored")],
    "judging": ["mracad.edit.watch:Tried.changes", "mracad.inspect.survey:surveys"],
}
"""Functions of the edit whose time, without that of each other, is shown."""


def quilt(name: str) -> tuple[int, int, str]:
    """Patches along a side, spans and scale."""
    side, spans = map(int, re.split("[x×]", name))
    return side, spans, f"{7 * SIZE / spans:.3g}mm"


def peak() -> float:
    """The peak memory of this process, MB (Linux)."""
    status = Path("/proc/self/status").read_text()
    return int(status.split("VmHWM:")[1].split()[0]) / 1024


def timed(call: Callable[[], Any]) -> tuple[Any, float]:
    """The result of a call, and its CPU seconds."""
    start = time.process_time()
    return call(), time.process_time() - start


def make(path: Path, side: int, spans: int) -> None:
    """Write a quilt; on few spans waves are flat and noise is large, or some faces would have to keep their shape."""
    from mracad.occ.step import write_step
    from tests.edit import panels

    clean, net = panels.whole(spans, 1.0 if spans < FEW else 0.05, patches=(side, side))
    if spans < FEW:
        net = net.with_poles(clean.poles * [1.0, 1.0, 0.1] + (net.poles - clean.poles) * [0.1, 0.1, 1.0])
    write_step(panels.document(panels.cut(net, (side, side))), path)


class Parts:
    """CPU seconds of functions, without those of each other."""

    def __init__(self) -> None:
        self.spent: dict[str, float] = defaultdict(float)
        self.inner: list[float] = []
        for part, functions in PARTS.items():
            for function in functions:
                self.watch(part, function)

    def watch(self, part: str, function: str) -> None:
        """Measure a function, wherever it is known."""
        module, _, name = function.partition(":")
        owner: Any = importlib.import_module(module)
        *within, name = name.split(".")
        for each in within:
            owner = getattr(owner, each)
        plain = getattr(owner, name)

        def watched(*given: Any, **named: Any) -> Any:
            self.inner.append(0.0)
            start = time.process_time()
            try:
                return plain(*given, **named)
            finally:
                spent = time.process_time() - start
                self.spent[part] += spent - self.inner.pop()
                if self.inner:
                    self.inner[-1] += spent

        for known in [owner, *(m for key, m in sys.modules.items() if key.startswith("mracad.edit"))]:
            if known.__dict__.get(name) is plain:
                setattr(known, name, watched)


def measure(path: Path, scale: str) -> None:
    """Print the figures of one quilt, and on a last line the seconds that must be linear in the number of faces."""
    from mracad.inspect import accept
    from mracad.job.document import run
    from mracad.occ.facts import facts
    from mracad.occ.step import read_step, write_step
    from mracad.occ.view import view
    from mracad.spec.steps import Smooth

    smooth = importlib.import_module("mracad.edit.smooth").smooth
    with tempfile.TemporaryDirectory() as folder:
        first, out = Path(folder) / "first.step", Path(folder) / "out.step"
        make(first, 2, quilt(path.stem)[1])
        run(read_step(first), smooth, Smooth(scale=scale))
        parts = Parts()
        spent: dict[str, float] = {}
        document, spent["read"] = timed(lambda: read_step(path))
        _, spent["view"] = timed(lambda: view(document))
        took: list[float] = []

        def edit(*given: Any, **named: Any) -> Any:
            found, seconds = timed(lambda: smooth(*given, **named))
            took.append(seconds)
            return found

        report, job = timed(lambda: run(document, edit, Smooth(scale=scale)))
        spent["edit"] = sum(took)
        spent["check"] = job - spent["edit"] - spent["view"]
        with out.open("wb") as stream:
            _, spent["write"] = timed(lambda: write_step(document, stream))
        back, spent["read back"] = timed(lambda: read_step(out))
        slack = accept.Slack({tuple(sorted(each.faces)) for each in report.edit.edges if len(each.faces) == 2})
        known, seconds = timed(lambda: (facts(document), facts(back)))
        _, judged = timed(lambda: accept.read_back(known[1], *accept.judge(known[0], known[1], slack)))
        spent["judged"] = seconds + judged
    moved = sum(edge.how == "coupled" for edge in report.edit.edges)
    edited = len(report.edit.faces("edited"))
    points = report.control_points[0]
    print(f"  {edited} of {len(report.edit.outcomes)} faces edited, {moved} seams moved, {points} control points")
    print("  " + ", ".join(f"{name} {seconds:.2f}" for name, seconds in spent.items()) + " s")
    rest = spent["edit"] - sum(parts.spent.values())
    print("  edit: " + ", ".join(f"{part} {parts.spent[part]:.2f}" for part in PARTS) + f", rest {rest:.2f} s")
    beyond = spent["view"] + spent["edit"] + spent["check"]
    print(f"  beyond reading, writing and verification {beyond:.2f} s; {peak():.0f} MB")
    print(len(report.edit.outcomes), *(f"{each:.4f}" for each in (beyond, sum(spent.values()), peak())))


def measure_kernel(path: Path) -> None:
    """Print the kernel's peak memory of reading and writing."""
    from benchmarks.phases import kernel_read, kernel_write

    kernel_write(kernel_read(str(path)), str(path.with_suffix(".out")))
    print(peak())


def group(model: Any) -> Any:
    """All faces as one problem, with free edges not held."""
    from mracad.model.cells import quadrature
    from mracad.seam.conditions import matched, rows
    from mracad.seam.domains import problem
    from mracad.seam.energy import forms
    from mracad.seam.interface import joints
    from mracad.seam.metric import planar, seen
    from mracad.seam.solve import Space
    from mracad.seam.wishes import Wishes

    joined = joints(model, set(range(len(model.faces))), Wishes("g1"))
    spaces = {}
    nets = matched({surface.index: surface.net for surface in model.surfaces}, joined.exact)
    for i, net in nets.items():
        form = forms(net, planar(net), quadrature(net, [model.faces[k] for k in model.surfaces[i].faces]))
        points = seen(net, form)
        spaces[i] = Space(net, form, points, points)
    return problem(spaces, rows(nets, joined.exact)[0])


def measure_solve(source: Path) -> None:
    """The filter of all faces in one group."""
    import numpy as np

    from mracad.occ.step import read_step
    from mracad.occ.view import view
    from mracad.seam import constrained
    from mracad.seam.solve import Effort, Problem

    whole, assembly = timed(lambda: group(view(read_step(source))))
    stiffness = (7 * SIZE / quilt(source.stem)[1] / (2 * np.pi)) ** 4
    found, own = timed(lambda: whole.filtered(stiffness))
    memory = peak()
    off = float(np.abs(whole.rows @ found).max() / np.abs(found).max())
    line = f"solve {own:.2f} s, {memory:.0f} MB, |Lδ| / |δ| {off:.0e}"
    if len(found) <= WHOLE:
        constrained.MANY = sys.maxsize  # multipliers for all conditions
        again = Problem(whole.spaces, whole.rows, effort=Effort(direct=sys.maxsize))
        other, peer = timed(lambda: again.filtered(stiffness))
        apart = float(np.abs(found - other).max() / np.abs(other).max())
        line += f"; SuperLU {peer:.2f} s, {peak():.0f} MB: {own / peer:.2f} of its time, {apart:.0e} apart"
    print(f"  {len(whole.spaces)} faces: read and assembled {assembly:.2f} s, {line}")


def child(*words: str | Path) -> str:
    """What this file prints in a process of its own."""
    return subprocess.run(
        [sys.executable, __file__, *map(str, words)], check=True, stdout=subprocess.PIPE, text=True
    ).stdout


def main(arguments: list[str]) -> None:
    """Make the quilts and measure each in processes of its own."""
    os.environ["MRACAD_WORKERS"] = "1"  # so that all CPU time is that of one process
    sys.path[:0] = [str(ROOT)]
    if arguments[:1] == ["--one"]:
        measure(Path(arguments[1]), arguments[2])
        return
    if arguments[:1] == ["--kernel"]:
        measure_kernel(Path(arguments[1]))
        return
    if arguments[:1] == ["--filter"]:
        measure_solve(Path(arguments[1]))
        return
    solving = arguments[:1] == ["--solve"]
    known: dict[int, list[list[float]]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for name in arguments[solving:] or (SOLVED if solving else DEFAULT):
            side, spans, scale = quilt(name)
            source = Path(folder) / f"{side}x{spans}.step"
            make(source, side, spans)
            size = source.stat().st_size / 1e6
            print(f"{side} × {side} patches of {spans} spans, {size:.1f} MB, smoothed at {scale}", flush=True)
            if solving:
                print(child("--filter", source), end="", flush=True)
                continue
            *lines, last = child("--one", source, scale).splitlines()
            figures, kernel = [float(word) for word in last.split()], float(child("--kernel", source).split()[-1])
            print(*lines, sep="\n", end=f", {figures[-1] / kernel:.2f} × the kernel's\n", flush=True)
            known.setdefault(spans, []).append(figures)
    for spans, every in known.items():
        if len(every) > 1:
            (few, *less, _), (many, *more, _) = min(every), max(every)
            beyond, whole = (math.log(b / a) / math.log(many / few) for a, b in zip(less, more, strict=True))
            print(f"{spans} spans: exponent of time in the number of faces {beyond:.2f}, with the kernel {whole:.2f}")


if __name__ == "__main__":
    main(sys.argv[1:])
