"""The house stays in order: no module grows beyond what one reads at a sitting."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
MOST = 350
"""Lines of a module."""


@pytest.mark.parametrize("folder", ["mracad", "cli"])
def test_modules_are_short(folder):
    lines = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in (ROOT / folder).rglob("*.py")}
    assert lines and {str(path.relative_to(ROOT)): n for path, n in lines.items() if n > MOST} == {}


def test_the_picture_of_the_rooms_is_that_of_the_imports():
    drawn = subprocess.run([sys.executable, ROOT / "docs" / "house.py"], capture_output=True, text=True, check=True)
    assert drawn.stdout == (ROOT / "docs" / "house.svg").read_text(encoding="utf-8")
