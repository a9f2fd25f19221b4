"""Pictures as text and as JSON: what was drawn, and the range of the numbers in it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from mracad.spec.pictures import Picture, size_of
from mracad_cli.say import size

if TYPE_CHECKING:
    from mracad.view.picture import Rendered


def line(name: str, picture: Picture, drawn: Rendered, output: str, seconds: float) -> str:
    """What was drawn, in one line."""
    width, height = size_of(picture.size)
    what = picture.show
    if drawn.title:
        what = f"{drawn.title} {drawn.lowest:.3g} to {drawn.highest:.3g} {drawn.unit} in the pixels".replace(" -", " −")
    if drawn.rings is not None:
        what = f"{drawn.rings or 'no'} feature{'s' * (drawn.rings != 1)}"
    views = ", ".join(picture.views)
    where = "standard output" if output == "-" else output
    return f"{name}: {what}; {views}, {width} × {height}; wrote {where}, {size(len(drawn.data))}, {seconds:.1f} s"


def body(name: str, warnings: tuple[str, ...], picture: Picture, drawn: Rendered, output: str) -> dict[str, Any]:
    """The same for JSON."""
    width, height = size_of(picture.size)
    span = {"title": drawn.title, "unit": drawn.unit, "lowest": drawn.lowest, "highest": drawn.highest}
    return {
        "file": name,
        "show": picture.show,
        "views": list(picture.views),
        "features": drawn.rings,
        "size": [width, height],
        "map": span if drawn.title else None,
        "written": output,
        "warnings": (*warnings, *filter(None, [drawn.note])),
    }
