"""Batches in processes of their own."""

from __future__ import annotations

import ctypes
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from tests.occ.shapes import bspline, face_on, save, wavy_poles

FAULTS = Path(__file__).parent / "faults"
RECIPE = '[[step]]\nuse = "smooth"\nscale = "20%"\n\n[[step]]\nuse = "check"\n'


def recipe(folder: Path, text: str = RECIPE) -> Path:
    """A recipe in a file."""
    path = folder / "recipe.toml"
    path.write_text(text)
    return path


def models(folder: Path, count: int) -> Path:
    """A folder of small different models."""
    folder.mkdir()
    first = save(face_on(bspline(wavy_poles(14, 12))), folder / "part000.step").read_text()
    for number in range(1, count):
        (folder / f"part{number:03}.step").write_text(first.replace("HEADER;", f"HEADER; /* {number} */", 1))
    return folder


def shams(folder: Path, count: int) -> Path:
    """A folder of files for work that is a sham."""
    folder.mkdir()
    for number in range(count):
        (folder / f"part{number:03}.step").write_text(f"number {number}")
    return folder


def environment(sham: float | None = None) -> dict[str, str]:
    """That of a process in which files can do harm."""
    found = {**os.environ, "PYTHONPATH": os.pathsep.join([str(FAULTS), *filter(None, sys.path)])}
    return found | ({"SHAM": str(sham)} if sham is not None else {})


def start(*words: object, sham: float | None = None) -> subprocess.Popen[str]:
    """Start ``mracad batch``."""
    return subprocess.Popen(
        [sys.executable, "-m", "mracad_cli", "batch", *map(str, words)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment(sham),
        preexec_fn=_without_privileges,
    )


def batch(*words: object, sham: float | None = None) -> tuple[int, str, str]:
    """Exit code, standard output and standard error of ``mracad batch``."""
    process = start(*words, sham=sham)
    out, err = process.communicate()
    return process.returncode, out, err


def kills(words: Sequence[object], folder: Path, count: int, files: int, sham: float | None = None) -> list[int]:
    """Kill a batch again and again, each time a random number of outputs later; the outputs there at each kill."""
    chance, done = random.Random(6), [0]
    for _ in range(count):
        process = start(*words, folder, sham=sham)
        enough = done[-1] + chance.randint(1, max(1, (files - done[-1]) // 4))
        while process.poll() is None and made(folder) < enough:
            time.sleep(0.002)
        time.sleep(chance.uniform(0, 0.02))
        process.kill()
        process.communicate()
        done.append(made(folder))
    return done[1:]


def made(folder: Path) -> int:
    """How many outputs there are."""
    return len(list(folder.glob("[!.]*.step")))


def outputs(folder: Path) -> dict[str, bytes]:
    """All files in a folder but the manifest."""
    return {path.name: path.read_bytes() for path in folder.rglob("*") if path.is_file() and path.suffix != ".jsonl"}


def _without_privileges() -> None:
    """Let interrupts count, and permissions for the superuser too (Linux: CAP_DAC_OVERRIDE, CAP_DAC_READ_SEARCH)."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if sys.platform == "linux" and os.geteuid() == 0:
        for capability in (1, 2):
            ctypes.CDLL(None).prctl(24, capability, 0, 0, 0)
