"""Options that name files: which part of their text is a path, and the types of such fields."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated


@dataclass(frozen=True)
class Naming:
    """How the text of an option names a file: the prefix before the path, the extension that a path must have, and
    whether a text of digits is a number instead."""

    prefix: str = ""
    ending: str = ""
    or_number: bool = False

    def file(self, text: str) -> str | None:
        """The path in a text; None where it names no file."""
        named = text.startswith(self.prefix) and text.endswith(self.ending)
        return text[len(self.prefix) :] if named and not (self.or_number and text.isdecimal()) else None

    def renamed(self, text: str, files: Mapping[str, str]) -> str:
        """The text with its path replaced, if ``files`` contains it."""
        file = self.file(text)
        return text if file is None else self.prefix + files.get(file, file)


File = Annotated[str, Naming()]
"""The type of a field that names a file."""

CountText = Annotated[str, Naming(or_number=True)]
"""The type of a field that is a number, or names a file with the number in it."""
