"""What type checkers and ``help`` know of the public names follows from the structs of options."""

import subprocess
import sys
from pathlib import Path

import mracad
from mracad.api.stub import stub


def test_the_types_are_those_of_the_structs():
    assert Path(mracad.__file__).with_suffix(".pyi").read_text() == stub(), "run make docs"


def test_importing_loads_next_to_nothing():
    probe = "import sys; before = set(sys.modules); import mracad; print(*set(sys.modules) - before)"
    loaded = subprocess.run([sys.executable, "-c", probe], check=True, capture_output=True, text=True).stdout.split()
    assert "mracad" in loaded and {name for name in loaded if name.startswith("mracad")} == {"mracad", "mracad.version"}
    assert {name.partition(".")[0] for name in loaded} <= {"mracad", *sys.stdlib_module_names}
