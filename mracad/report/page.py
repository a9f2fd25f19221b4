"""A page: what it holds, and its HTML."""

from __future__ import annotations

import base64
import json
import re
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from mracad.errors import needing
from mracad.report.table import Table
from mracad.spec.pictures import VIEWS
from mracad.store import Location, head

if TYPE_CHECKING:
    from jinja2 import Environment

    from mracad.report.mesh import Mesh

PNG, SVG = "image/png", "image/svg+xml"
"""Kinds of pictures."""

_ROW = re.compile(rb'<script type="application/json" id="row">(.*?)</script>')
_HEAD = 1 << 17  # bytes of a page that hold its row
_UNSEEN = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff]")


@dataclass(frozen=True)
class Figure:
    """A picture, and what it shows.

    Attributes
    ----------
    caption : str
    data : bytes
    kind : {"image/png", "image/svg+xml"}
    wide : bool
        Whether it takes the width of the page.
    """

    caption: str
    data: bytes
    kind: str = PNG
    wide: bool = False

    @property
    def uri(self) -> str:
        return f"data:{self.kind};base64,{_base64(self.data)}"


@dataclass(frozen=True)
class Verdict:
    """What was decided.

    Attributes
    ----------
    title : str
    answer : str
    good : bool or None
        None where it is not known.
    layers : sequence of mapping
        As in the report that is JSON: name, status, text, findings, notes.
    """

    title: str
    answer: str
    good: bool | None
    layers: Sequence[Any] = ()


@dataclass(frozen=True)
class Page:
    """What a report says.

    Attributes
    ----------
    title, kind : str
        The model's name; what kind of report it is.
    asked : sequence of (str, str)
        What was asked, by name.
    lines : sequence of str
        What the command line said.
    verdicts : sequence of Verdict
    still : Figure
        The model where it cannot be turned, and on paper.
    mesh : Mesh or None
        The model to turn; None if it has too many faces for that.
    figures : sequence of Figure
    tables : sequence of Table
    reference : str
        What deviation is measured from.
    row : mapping
        What an index says of the page, JSON-ready; empty for pages in no index.
    """

    title: str
    kind: str
    asked: Sequence[tuple[str, str]]
    lines: Sequence[str]
    verdicts: Sequence[Verdict]
    still: Figure
    mesh: Mesh | None
    figures: Sequence[Figure] = ()
    tables: Sequence[Table] = ()
    reference: str = ""
    row: Mapping[str, Any] = field(default_factory=dict)


def html(page: Page, template: str = "page.html") -> bytes:
    """A page as one HTML file that needs nothing else; the same bytes for the same content.

    ``"frame.html"`` holds the model alone.
    """
    mesh = page.mesh
    return rendered(
        template,
        page,
        mesh=_base64(mesh.data) if mesh else "",
        shades=_base64(mesh.shades.data) if mesh and mesh.shades else "",
        three=_base64(_three()),
        model=_data("model.js"),
        licence=_data("three.LICENSE"),
        views={name: ",".join(f"{x:g}" for x in VIEWS[name]) for name in ("iso", "front", "right", "top")},
    )


def rendered(name: str, page: object, **more: object) -> bytes:
    """A template filled in, with the style and the script of tables."""
    common = {each.partition(".")[0]: _data(each) for each in ("style.css", "tables.js")}
    return _environment().get_template(name).render(page=page, **common, **more).encode()


def row_of(path: Location) -> dict[str, Any]:
    """What an index says of a page that was written; empty where there is none."""
    try:
        found = _ROW.search(head(path, _HEAD))
        return dict(json.loads(found[1])) if found else {}
    except (OSError, ValueError):
        return {}


@cache
def _environment() -> Environment:
    with needing("view", "cannot make a report"):
        from jinja2 import Environment, FunctionLoader, StrictUndefined

    return Environment(
        autoescape=True, loader=FunctionLoader(_data), undefined=StrictUndefined, finalize=_clean, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip


def _clean(value: Any) -> Any:
    """Text with characters that HTML cannot hold written as in JSON; markup is left as it is."""
    return _UNSEEN.sub(lambda match: f"\\u{ord(match[0]):04x}", value) if type(value) is str else value


def _data(name: str) -> str:
    return (files("mracad.report") / "data" / name).read_text(encoding="utf-8")


@cache
def _three() -> bytes:
    return zlib.compress(_data("three.module.min.js").encode(), 9)


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode()
