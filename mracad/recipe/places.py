"""Where the steps and keys of a recipe stand in its text, for messages."""

from __future__ import annotations

import re

from mracad.options import dashed


def places_of_steps(text: str, name: str) -> list[dict[str, str]]:
    """For each ``[[step]]``, the place of the step and of each of its keys."""
    found: list[dict[str, str]] = []
    inside = False
    for number, line in enumerate(_without_long_strings(text).splitlines(), 1):
        if line.lstrip().startswith("["):
            inside = bool(re.match(r"\s*\[\[\s*[\"']?step[\"']?\s*\]\]", line))
            if inside:
                found.append({"": f"{name}:{number}"})
        elif inside and (match := re.match(r"\s*[\"']?([\w-]+)[\"']?\s*=", line)):
            found[-1].setdefault(dashed(match[1]), f"{name}:{number}")
    return found


def place_of(text: str, key: str, name: str) -> str:
    """The place of a key or table at the top of a recipe."""
    lines = _without_long_strings(text).splitlines()
    pattern = rf"\s*\[?\[?\s*[\"']?{re.escape(key)}[\"']?\s*(=|\]|\.)"
    return f"{name}:{next((i for i, line in enumerate(lines, 1) if re.match(pattern, line)), 1)}"


def _without_long_strings(text: str) -> str:
    """A TOML text whose strings of several lines are only their line ends."""
    return re.sub(r'"""[\s\S]*?"""|\'\'\'[\s\S]*?\'\'\'', lambda match: "\n" * match[0].count("\n"), text)
