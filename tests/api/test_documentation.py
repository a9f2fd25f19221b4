"""The Python in the documentation runs, in the folder of the samples."""

import re
import shutil
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"


def ran(page):
    """What the blocks of a page define when they run one after the other."""
    names = {}
    for block in re.findall(r"```python\n(.*?)```", (DOCS / page).read_text(), re.DOTALL):
        exec(block, names)
    return names


def test_the_page_of_python(samples, tmp_path, monkeypatch):
    shutil.copy(samples / "assembly.step", tmp_path)
    monkeypatch.chdir(tmp_path)
    ran("python.md")
    assert (tmp_path / "fair.step").exists() and (tmp_path / "pad.mra").exists()


def test_the_page_of_wavelets(samples, monkeypatch):
    monkeypatch.chdir(samples)
    names = ran("wavelets.md")
    assert names["figure"].axes and len(names["low"]) == 6
