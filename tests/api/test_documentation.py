"""The Python in the documentation runs, in the folder of the samples."""

import re
import shutil
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"


@pytest.mark.parametrize("page", ["python.md"])
def test_the_blocks_of_a_page_run_one_after_the_other(page, samples, tmp_path, monkeypatch):
    shutil.copy(samples / "assembly.step", tmp_path)
    monkeypatch.chdir(tmp_path)
    names = {}
    for block in re.findall(r"```python\n(.*?)```", (DOCS / page).read_text(), re.DOTALL):
        exec(block, names)
    assert (tmp_path / "fair.step").exists() and (tmp_path / "pad.mra").exists()
