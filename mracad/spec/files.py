"""Options that name files: which part of their text is a path, and the types of such fields."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated


def keys_apart(text: str) -> tuple[str, str]:
    """A text without the ``,key:value`` at its end, and these."""
    size = len(text)
    while match := re.search(r"\s*,\s*[a-z]+\s*:[^,:]*$", text[:size]):
        size = match.start()
    return text[:size], text[size:]


@dataclass(frozen=True)
class Naming:
    """How the text of an option names a file: the prefix before the path, the extensions that a path may have,
    whether a text of digits is a number instead, and whether ``,key:value`` may follow the path."""

    prefix: str = ""
    ending: str | tuple[str, ...] = ""
    or_number: bool = False
    keyed: bool = False

    def file(self, text: str) -> str | None:
        """The path in a text; None where it names no file."""
        text = keys_apart(text)[0] if self.keyed else text
        named = text.startswith(self.prefix) and text.lower().endswith(self.ending)
        return text[len(self.prefix) :] if named and not (self.or_number and text.isdecimal()) else None

    def renamed(self, text: str, files: Mapping[str, str]) -> str:
        """The text with its path replaced, if ``files`` contains it."""
        file = self.file(text)
        return text if file is None else text.replace(file, files.get(file, file), 1)


File = Annotated[str, Naming()]
"""The type of a field that names a file."""

CountText = Annotated[str, Naming(or_number=True)]
"""The type of a field that is a number, or names a file with the number in it."""
