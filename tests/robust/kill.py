"""Kills at random moments of a writer: ``python -m tests.robust.kill COUNT`` (see ``make fuzz``)."""

from __future__ import annotations

import itertools
import os
import random
import signal
import sys
import tempfile
import time
from pathlib import Path

from mracad.occ.step import read_step, write_step

SAMPLES = Path(__file__).parents[2] / "samples"
END = b"END-ISO-10303-21;\n"


def kills(count: int, seed: int = 0) -> str:
    """What was found after some kill: the output missing or partial; ``""`` when it was whole every time."""
    rng = random.Random(seed)
    document = read_step(SAMPLES / "assembly.step")
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "out.step")
        out.write_bytes(b"ISO-10303-21;\n" + END)
        for number in range(count):
            writer = os.fork()
            if not writer:
                for turn in itertools.count():
                    write_step(document, out, options_text=f"turn {turn}")
            time.sleep(rng.uniform(0.0, 0.4))
            os.kill(writer, signal.SIGKILL)
            os.waitpid(writer, 0)
            if not out.exists():
                return f"missing after kill {number}"
            text = out.read_bytes()
            if not (text.startswith(b"ISO-10303-21;") and text.endswith(END)):
                return f"{len(text)} bytes after kill {number}"
        return "" if b"turn " in out.read_bytes() else "nothing was written"


if __name__ == "__main__":
    found = kills(int(sys.argv[1]))
    print(found or f"{sys.argv[1]} kills: the output was whole every time")
    raise SystemExit(bool(found))
