"""The gallery shows what its commands draw."""

import re
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

DOCS = Path(__file__).parent.parent / "docs"


def test_the_gallery_is_that_of_its_commands():
    found = spec_from_file_location("pictures", DOCS / "pictures.py")
    pictures = module_from_spec(found)
    found.loader.exec_module(pictures)
    assert (DOCS / "gallery.md").read_text() == pictures.page(), "run make pictures"


def test_every_picture_of_the_documentation_is_there():
    pages = [*DOCS.glob("*.md"), DOCS.parent / "README.md"]
    named = [(page.parent / name) for page in pages for name in re.findall(r"!\[[^\]]*\]\(([^)]+)\)", page.read_text())]
    assert len(named) > 10 and all(path.exists() for path in named)
