"""The site is built from the pages, and fails where a link leads nowhere; generated pages are as their sources say."""

import shutil
import subprocess
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest

pytest.importorskip("sphinx")

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"


def built(source, folder):
    words = ["-q", "-W", "--keep-going", "-c", source / "docs", "-d", folder / "read", source, folder / "site"]
    return subprocess.run([sys.executable, "-m", "sphinx", *map(str, words)], capture_output=True, text=True)


def test_the_site_is_built_without_a_warning(tmp_path):
    done = built(ROOT, tmp_path)
    assert done.returncode == 0, done.stderr
    pages = {path.relative_to(DOCS).with_suffix("") for path in DOCS.rglob("*.md")}
    assert pages == {
        path.relative_to(tmp_path / "site/docs").with_suffix("") for path in tmp_path.glob("site/docs/**/*.html")
    }
    assert 'href="start/surfaces.html"' in (tmp_path / "site/docs/index.html").read_text()


def test_a_link_that_leads_nowhere_fails(tmp_path):
    (tmp_path / "docs").mkdir()
    shutil.copy(DOCS / "conf.py", tmp_path / "docs")
    (tmp_path / "docs" / "index.md").write_text("# One\n\n[page](two.md) [place](index.md#two) [file](../three.toml)\n")
    done = built(tmp_path, tmp_path)
    assert done.returncode and all(f"'{name}'" in done.stderr for name in ("two.md", "two", "../three.toml"))


def test_the_page_of_commands_is_that_of_their_declarations():
    found = spec_from_file_location("commands", DOCS / "commands.py")
    commands = module_from_spec(found)
    found.loader.exec_module(commands)
    assert (DOCS / "commands.md").read_text() == commands.page(), "run make docs"
