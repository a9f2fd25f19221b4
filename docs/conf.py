"""The documentation as a site: `make site`.

Pages are those of the project, in their folders, as they are read there.
"""

from __future__ import annotations

from typing import Any

project = "mracad"
html_title = "mracad"
html_theme = "furo"
html_copy_source = False
extensions = ["myst_parser"]
myst_heading_anchors = 4
root_doc = "docs/index"
include_patterns = ["docs/*.md", "docs/start/*.md", "*.md", "samples/README.md", "samples/plugin/README.md"]
exclude_patterns = [".*", "build", "dist"]

CONTENTS = {
    "Start": [
        "install",
        "start/surfaces",
        "start/scans",
        "start/textures",
        "start/ci",
        "start/cadquery",
        "start/research",
    ],
    "Whole faces": ["edits", "spectrum", "mra"],
    "Details": ["features", "example", "gallery"],
    "Looking": ["checks", "pictures", "report"],
    "Many models": ["recipes", "batch", "shell"],
    "Python": ["python", "wavelets"],
    "Reference": ["commands", "steps", "formats"],
    "Background": ["mathematics", "limits", "figures", "design"],
    "The project": ["/README", "/samples/README", "/samples/plugin/README", "/CHANGELOG", "/CONTRIBUTING", "/SECURITY"],
}


def setup(app: Any) -> None:
    """Let the first page hold the table of contents, which is for the site alone."""
    app.connect("source-read", with_contents)


def with_contents(app: Any, name: str, source: list[str]) -> None:
    """Add the contents to the first page."""
    if name == root_doc:
        for caption, pages in CONTENTS.items():
            source[0] += "\n".join(["", "```{toctree}", ":hidden:", f":caption: {caption}", "", *pages, "```", ""])
