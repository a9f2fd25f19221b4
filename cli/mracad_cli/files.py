"""Files in and out of a command: checked before the work starts, written whole or not at all."""

from __future__ import annotations

import contextlib
import io
import os
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from mracad import guard
from mracad.errors import FileError, UsageError
from mracad.formats import FORMATS, by_ending

if TYPE_CHECKING:
    from mracad.occ.document import Document
    from mracad.occ.files import Lost
    from mracad.occ.load import Text


def load(source: str) -> Text:
    """The bytes of a file, or of standard input for ``-``."""
    from mracad.occ.load import load as load_file

    return load_file(sys.stdin.buffer if source == "-" else source)


def read(source: str | Text, input_unit: str | None) -> Document:
    """Read a model, or standard input for ``-``."""
    from mracad.occ.files import read as read_file

    text = load(source) if isinstance(source, str) else source
    guard.doing("reading", text.name)
    return read_file(text, input_unit)


def check_reports(*paths: str | None, overwrite: bool) -> None:
    """Refuse reports that could not be written."""
    for path in filter(None, paths):
        check_target(Path(path), overwrite)


def check_target(path: Path, overwrite: bool) -> None:
    """Refuse an output that could not be written, or that exists already."""
    if path.is_dir():
        raise FileError(f"cannot write {path}: it is a directory", "name a file in it")
    if not path.parent.is_dir():
        raise FileError(f"cannot write {path}: there is no folder {path.parent}", "create it first")
    if not os.access(path.parent, os.W_OK):
        raise FileError(f"cannot write {path}: the folder is not writable", "choose another one")
    if path.exists() and not overwrite:
        raise UsageError(f"{path} exists", "give --overwrite to replace it")


def write_text(path: Path, text: str) -> None:
    """Write a text file whole or not at all."""
    from mracad.output import put

    put(text.encode(errors="surrogateescape"), path)


def depfile_text(outputs: Iterable[str], inputs: Iterable[str]) -> str:
    """A rule for make: what the outputs depend on; and one for each input, so that make bears with its absence."""
    targets, needs = ([_for_make(path) for path in paths] for paths in (outputs, inputs))
    return f"{' '.join(targets)}: {' '.join(needs)}\n" + "".join(f"\n{need}:\n" for need in needs)


def _for_make(path: str) -> str:
    return path.replace("$", "$$").replace("#", "\\#").replace(" ", "\\ ")


class Outputs:
    """The outputs of a command, and where its text goes (standard error when the model goes to standard output)."""

    def __init__(
        self,
        paths: tuple[str, ...],
        *,
        overwrite: bool,
        if_changed: bool,
        format: str,
        schema: str | None,
        chord: str,
        angle: float,
        ascii_stl: bool,
        needed: bool = True,
    ) -> None:
        self.paths, self.schema = paths, (schema or "").upper()
        self.overwrite, self.if_changed = overwrite or if_changed, if_changed
        self.chord, self.angle, self.ascii_stl = chord, angle, ascii_stl
        self.lost: dict[str, tuple[Lost, ...]] = {}
        self._sizes: list[str] = []
        if needed and not paths:
            raise UsageError("no output is named", "name a file with -o OUT.step, or - for standard output")
        if len(set(paths)) < len(paths):
            raise UsageError("the same output is named twice", "give each -o once")
        self.formats = {path: FORMATS[format] if path == "-" else by_ending(path) for path in paths}
        for path in self.files():
            check_target(Path(path), self.overwrite)

    def check_report(self, path: str) -> None:
        """Refuse a report that could not be written."""
        check_target(Path(path), self.overwrite)

    def write(self, document: Document, title: str) -> None:
        """Write the document to every output; none is replaced unless all could be made."""
        from mracad.occ.files import write
        from mracad.output import beside, holds

        meshed = any(format.kind == "mesh" for format in self.formats.values())
        chord = self._chord(document) if meshed else None
        made: dict[str, bytes] = {}
        for path, format in self.formats.items():
            stream = io.BytesIO()
            lost = write(
                document,
                stream,
                format.name,
                schema=self.schema,
                chord=chord,
                angle=self.angle,
                ascii=self.ascii_stl,
                options_text=title,
            )
            made[path] = stream.getvalue()
            self.lost[self._name(path)] = lost
        with contextlib.ExitStack() as stack:
            for path, data in made.items():
                if path != "-" and not (self.if_changed and holds(Path(path), data)):
                    stack.enter_context(beside(path)).write_bytes(data)
        if "-" in made:
            sys.stdout.buffer.write(made["-"])
            sys.stdout.buffer.flush()
        for name, lost in self.lost.items():
            if lost:
                print(f"warning: {name} lacks {', '.join(map(str, lost))}", file=sys.stderr)
        self._sizes = [f"{self._name(path)}, {_size(len(data))}" for path, data in made.items()]

    def _chord(self, document: Document) -> float:
        """The chord in millimetres; it may be a share of the diagonal."""
        from mracad.occ.view import view
        from mracad.options import length

        return length(self.chord, view(document).diagonal, "chord")

    def say(self, line: str) -> None:
        """Print a line of the result."""
        print(line, file=sys.stderr if "-" in self.paths else sys.stdout)

    def files(self) -> list[str]:
        """The outputs that are files."""
        return [path for path in self.paths if path != "-"]

    def records(self) -> list[str]:
        """The files beside the outputs that say how they were made."""
        return [f"{path}.toml" for path in self.files()]

    def names(self) -> list[str]:
        return [self._name(path) for path in self.paths]

    def sizes(self) -> str:
        return ", ".join(self._sizes)

    @staticmethod
    def _name(path: str) -> str:
        return "standard output" if path == "-" else Path(path).name


def _size(count: int) -> str:
    return f"{count / 1e6:.1f} MB" if count >= 1e5 else f"{count / 1e3:.1f} kB"
