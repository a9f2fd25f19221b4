"""What type checkers and ``help`` know of the public names follows from the structs of options."""

import subprocess
import sys
import time
from pathlib import Path

import mracad
from mracad.api.stub import stub


def test_the_types_are_those_of_the_structs():
    assert Path(mracad.__file__).with_suffix(".pyi").read_text() == stub(), "run make docs"


def test_importing_is_quick():
    took = []
    for _ in range(3):
        start = time.perf_counter()
        subprocess.run([sys.executable, "-c", "pass"], check=True)
        bare = time.perf_counter() - start
        subprocess.run([sys.executable, "-c", "import mracad"], check=True)
        took.append(time.perf_counter() - start - 2 * bare)
    assert min(took) < 0.05
