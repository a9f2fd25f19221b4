"""Draw the rooms of the house and what they import, from the sources and the layers in pyproject.toml.

Usage: python docs/house.py > docs/house.svg
An arrow that follows from others is left out.
"""

from __future__ import annotations

import ast
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
WIDTH, HEIGHT, GAP, ROW = 128, 34, 26, 92
"""Of boxes, between them, and of a row, pixels."""


def layers() -> list[list[str]]:
    """The rooms, row by row, as the contract on imports has them."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = project["tool"]["importlinter"]["contracts"]
    rows = next(each["layers"] for each in contracts if each["name"] == "Arrows go down")
    return [[room.strip() for room in row.replace(":", "|").split("|")] for row in rows]


def imports(rooms: list[str]) -> dict[str, set[str]]:
    """What modules of each room import of others."""
    found: dict[str, set[str]] = {room: set() for room in rooms}
    for room in rooms:
        place = ROOT / ("cli" if room.startswith("mracad_cli") else "") / room.replace(".", "/")
        for path in place.rglob("*.py") if place.is_dir() else [place.with_suffix(".py")]:
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.ImportFrom) and node.module:
                    named = [node.module, *(f"{node.module}.{name.name}" for name in node.names)]
                    found[room] |= {to for to in rooms for name in named if name == to or name.startswith(to + ".")}
    return {room: to - {room} for room, to in found.items()}


def reduced(arrows: dict[str, set[str]]) -> dict[str, set[str]]:
    """Without arrows that follow from others."""

    def below(room: str) -> set[str]:
        return arrows[room].union(*(below(to) for to in arrows[room]))

    return {room: to - set().union(*(below(other) for other in to)) for room, to in arrows.items()}


def svg(rows: list[list[str]], arrows: dict[str, set[str]]) -> str:
    """The picture."""
    wide = max(map(len, rows)) * (WIDTH + GAP) + GAP
    at = {}
    for down, row in enumerate(rows):
        step = (WIDTH + GAP) * (1.8 if len(row) == 2 and down % 3 == 2 else 1.0)  # arrows past the rows below
        left = (wide - step * (len(row) - 1) - WIDTH) / 2
        at |= {room: (left + k * step, GAP + down * ROW) for k, room in enumerate(row)}
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {wide} {len(rows) * ROW + GAP}" '
        'font-family="sans-serif">',
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        '<path d="M0 0L8 4L0 8z" fill="#667"/></marker></defs>',
        '<rect width="100%" height="100%" fill="#fff"/>',
    ]
    lines += [
        f'<line x1="{x + WIDTH / 2:g}" y1="{y + HEIGHT}" x2="{at[to][0] + WIDTH / 2:g}" y2="{at[to][1] - 1}" '
        'stroke="#667" marker-end="url(#tip)"/>'
        for room, (x, y) in at.items()
        for to in sorted(arrows[room])
    ]
    for room, (x, y) in at.items():
        lines.append(f'<rect x="{x:g}" y="{y}" width="{WIDTH}" height="{HEIGHT}" rx="5" fill="#e8eef6" stroke="#456"/>')
        name = room.removeprefix("mracad.")
        lines.append(f'<text x="{x + WIDTH / 2:g}" y="{y + 22}" text-anchor="middle" font-size="15">{name}</text>')
    return "\n".join([*lines, "</svg>", ""])


if __name__ == "__main__":
    rows = layers()
    print(svg(rows, reduced(imports([room for row in rows for room in row]))), end="")
