"""The bytes of an input, with its name."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import BinaryIO

from mracad.store import location, read


class Text(io.BytesIO):
    """The content of a file.

    Attributes
    ----------
    name : str
        Name of the file, without its folder; bytes that are not Unicode, which the kernel rejects, are replaced.
    """

    def __init__(self, data: bytes, name: str) -> None:
        super().__init__(data)
        self.name = name.encode(errors="replace").decode()


def load(source: str | os.PathLike | BinaryIO) -> Text:
    """Read a whole file or stream; raises FileError if that is not possible."""
    if isinstance(source, Text):
        return source
    if not isinstance(source, str | os.PathLike):
        return Text(source.read(), Path(str(getattr(source, "name", "stdin"))).name.strip("<>"))
    return Text(read(source), location(source).name)
