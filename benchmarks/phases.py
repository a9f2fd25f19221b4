"""Commands beside the kernel's own reading and writing of the same file, warm, phase by phase: CPU time and memory.

Usage: python benchmarks/phases.py [FILE…]

By default the models of less than 4 MB in the folder MRACAD_CORPUS, else the samples.  In one process, after a first
run of everything: ``smooth --scale 2%`` by phases over the kernel's reading and writing; ``info``, ``check`` and
``compare`` (of what was written with the file) over its reading.  As commands, each in a process of its own: CPU time
with start-up, and peak memory, both over those of the kernel.  The best of up to three runs counts; the cache is off.
"""

from __future__ import annotations

import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

RUNS = 3
PATIENCE = 4.0
"""Seconds after which nothing is repeated."""

LARGE = 4e6
"""Size of the smallest file that is left out by default, bytes."""

PHASES = {
    "looking at faces": "view", "checking the input": "check", "checking the result": "check", "writing": "write",
    "reading back": "back",
}  # fmt: skip
"""The phase of each stage; all others are the edit."""

SHOWN = "read", "view", "check", "edit", "write", "back"
COLUMNS = *SHOWN, "off", "on", "info", "check", "compare", "off", "on", "MB off", "MB on"


def kernel_read(path: str) -> Any:
    """A document as the kernel reads it, with everything that mracad reads."""
    from OCP.Interface import Interface_Static
    from OCP.STEPCAFControl import STEPCAFControl_Controller, STEPCAFControl_Reader
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDocStd import TDocStd_Document

    STEPCAFControl_Controller.Init_s()
    Interface_Static.SetCVal_s("read.stepcaf.subshapes.name", "On")
    reader, xcaf = STEPCAFControl_Reader(), TDocStd_Document(TCollection_ExtendedString("BinXCAF"))
    for mode in ("Name", "Color", "Layer", "GDT", "Mat", "Props", "View", "SHUO", "Meta", "ProductMeta"):
        getattr(reader, f"Set{mode}Mode")(True)
    reader.ReadFile(path)
    reader.Transfer(xcaf)
    Interface_Static.SetCVal_s("read.stepcaf.subshapes.name", "Off")
    return xcaf


def kernel_write(xcaf: Any, path: str) -> None:
    """Write it as the kernel does, with everything that mracad writes."""
    from OCP.STEPCAFControl import STEPCAFControl_Writer
    from OCP.STEPControl import STEPControl_AsIs

    writer = STEPCAFControl_Writer()
    for mode in ("Name", "Color", "Layer", "DimTol", "Material", "Props", "SHUO"):
        getattr(writer, f"Set{mode}Mode")(True)
    writer.Transfer(xcaf, STEPControl_AsIs)
    writer.Write(path)


class Clock:
    """CPU seconds by phase, of everything (``on``), and of everything before verification (``off``)."""

    def __init__(self) -> None:
        self.spent: dict[str, float] = defaultdict(float)
        self.phase, self.verifying, self.start = "read", False, time.process_time()

    def __call__(self, stage: str, done: int = 0, total: int = 1) -> None:
        """A stage of the command begins or goes on."""
        now = time.process_time()
        for phase in (self.phase, "on", *(() if self.verifying else ("off",))):
            self.spent[phase] += now - self.start
        self.phase, self.start = PHASES.get(stage, "edit"), now
        self.verifying |= self.phase == "back"


def smoothed(path: Path) -> tuple[dict[str, float], bytes]:
    """Smooth a file: seconds by phase, those up to verification as ``off``, and what is written."""
    from mracad.job.output import Target
    from mracad.job.produce import produce
    from mracad.occ.files import read
    from mracad.spec.recipe import Step
    from mracad.spec.steps import STEPS

    step = Step("smooth", "smooth", STEPS["smooth"](scale="2%"))
    clock = Clock()
    document = read(path)
    made = produce(document, lambda: read(path), [step], [Target(path.name)], progress=clock).made
    clock("end")
    return clock.spent, made[0].data


def best(call: Callable[[], Any]) -> Any:
    """The least of what a call measures, number by number; it is repeated while that takes little time."""
    runs: list[Any] = []
    start = time.perf_counter()
    while not runs or (len(runs) < RUNS and time.perf_counter() - start < PATIENCE):
        runs.append(call())
    return [min(each) for each in zip(*runs, strict=True)]


def seconds(call: Callable[[], Any]) -> float:
    """CPU seconds of a call in a process that has done it before."""
    from mracad import memo

    def timed() -> list[float]:
        memo.clear()
        start = time.process_time()
        call()
        return [time.process_time() - start]

    timed()
    return float(best(timed)[0])


def warm(path: Path) -> list[float]:
    """The kernel's seconds, and the ratios of everything that is measured in this process."""
    from mracad import memo
    from mracad.job import check, compare, info
    from mracad.occ.files import read
    from mracad.occ.load import Text, load
    from mracad.occ.settings import quiet
    from mracad.spec.steps import Check, Compare

    with tempfile.TemporaryDirectory() as folder, quiet():
        xcaf = kernel_read(str(path))
        one = seconds(lambda: kernel_read(str(path)))
        whole = one + seconds(lambda: kernel_write(xcaf, f"{folder}/out.step"))

    def phases() -> list[float]:
        memo.clear()
        spent, _ = smoothed(path)
        return [spent[name] for name in (*SHOWN, "off", "on")]

    new = Text(smoothed(path)[1], path.name)
    looks: list[Callable[[], Any]] = [
        lambda: info.info(read(path)),
        lambda: check.check(read(path), Check(), text=load(path).getvalue()),
        lambda: compare.compare(read(new), Compare(), lambda: read(path)),
    ]
    return [whole, *(each / whole for each in best(phases)), *(seconds(look) / one for look in looks)]


def apart(command: list[str]) -> list[float]:
    """CPU time (s) and peak memory (MB) of a process."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return [usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024]


def cold(path: Path) -> list[float]:
    """Ratios of whole commands to the kernel's reading and writing, each in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        out = f"{folder}/out.step"
        bare = here(f"kernel_write(kernel_read({str(path)!r}), {out!r})")
        smooth = [sys.executable, "-m", "mracad_cli", "smooth", str(path), "--scale=2%", "--overwrite", "-o", out]
        commands = bare, [*smooth, "--verify=off"], smooth
        kernel, *ours = (best(partial(apart, command)) for command in commands)
    return [each[k] / kernel[k] for k in (0, 1) for each in ours]


def here(code: str) -> list[str]:
    """The command that runs some code of this module in a process of its own."""
    folder = str(Path(__file__).parent)
    return [sys.executable, "-c", f"import sys; sys.path.insert(0, {folder!r}); from phases import *; {code}"]


def machine() -> str:
    """What the figures were taken on."""
    from mracad.version import __version__

    kernel, python = version("cadquery-ocp"), platform.python_version()
    return f"{os.cpu_count()} cores {platform.machine()}, Python {python}, kernel {kernel}, mracad {__version__}"


def row(name: str, kernel: str, values: list[float]) -> str:
    """A line of the table."""
    return f"{name[:24]:24s} {kernel:>6s} " + " ".join(f"{value:7.2f}" for value in values)


def main() -> None:
    """Print a line for each file, and the median and the worst of all."""
    os.environ["MRACAD_CACHE"] = "off"
    os.environ["MRACAD_WORKERS"] = "1"  # so that all CPU time is that of this process
    subprocess.run([sys.executable, "-m", "mracad.warm"], check=True)  # as after an installation
    corpus = os.environ.get("MRACAD_CORPUS") or str(Path(__file__).parent.parent / "samples")
    small = [path for path in sorted(Path(corpus).glob("*.st*p")) if path.stat().st_size < LARGE]
    print(machine())
    print(
        f"{'smooth --scale 2%: CPU time over that of the kernel: read + write':>97s}{'over read':>24s}{'commands':>32s}"
    )
    print(f"{'':24s} {'s':>6s} " + " ".join(f"{name:>7s}" for name in COLUMNS), flush=True)
    rows = []
    for path in map(Path, sys.argv[1:] or small):  # this process stays small: its children inherit its peak
        code = f"import json; print(json.dumps(warm(Path({str(path)!r}))))"
        kernel, *ratios = json.loads(subprocess.run(here(code), check=True, stdout=subprocess.PIPE).stdout)
        rows.append(ratios + cold(path))
        print(row(path.stem, f"{kernel:.2f}", rows[-1]), flush=True)
    for name, choose in (("median", statistics.median), ("worst", max)):
        print(row(name, "", [choose(each) for each in zip(*rows, strict=True)]))


if __name__ == "__main__":
    main()
