"""Files in and out of a command: checked before the work starts, written whole or not at all."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mracad import note
from mracad.errors import FileError, UsageError
from mracad.formats import FORMATS, by_ending
from mracad_cli.render import read_back, say

if TYPE_CHECKING:
    from mracad.job.produce import Made, Target
    from mracad.occ.document import Document
    from mracad.occ.load import Text


def load(source: str) -> Text:
    """The bytes of a file, or of standard input for ``-``."""
    from mracad.occ.load import load as load_file

    return load_file(sys.stdin.buffer if source == "-" else source)


def read(source: str | Text, input_unit: str | None, encoding: str | None) -> Document:
    """Read a model, or standard input for ``-``; say what is lost on the way."""
    from mracad.occ.files import read as read_file

    text = load(source) if isinstance(source, str) else source
    note.doing("reading", text.name)
    document = read_file(text, input_unit, encoding)
    for warning in document.warnings:
        say(f"warning: {warning}", file=sys.stderr)
    return document


def check_reports(*paths: str | None, overwrite: bool) -> None:
    """Refuse reports that could not be written, and two that would be the same file."""
    given = [Path(path) for path in paths if path]
    for number, path in enumerate(given):
        if path.resolve() in [other.resolve() for other in given[:number]]:
            raise UsageError(f"{path} is named twice", "give each file that is written a name of its own")
        check_target(path, overwrite)


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


def deliver(files: Mapping[str, str | bytes | None], lines: Iterable[str], *, stream: bytes | None = None) -> None:
    """End a command: print what it says, and let its files take their places; all of this or nothing.

    Parameters
    ----------
    files : mapping
        Contents by path; texts are written as UTF-8, what is None is left out.
    lines : iterable of str
        What is printed.
    stream : bytes, optional
        A model for standard output; the lines go to standard error then.

    Raises
    ------
    FileError
        When a file cannot be written.
    """
    from mracad.output import put_all

    said = list(lines)

    def tell() -> None:
        if stream is not None:
            sys.stdout.buffer.write(stream)
        say(*said, file=sys.stdout if stream is None else sys.stderr)
        sys.stdout.flush()

    contents = {path: content for path, content in files.items() if content is not None}
    put_all({p: c.encode(errors="surrogateescape") if isinstance(c, str) else c for p, c in contents.items()}, tell)


def depfile_text(outputs: Iterable[str], inputs: Iterable[str]) -> str:
    """A rule for make: what the outputs depend on; and one for each input, so that make bears with its absence."""
    targets, needs = ([_for_make(path) for path in paths] for paths in (outputs, inputs))
    return f"{' '.join(targets)}: {' '.join(needs)}\n" + "".join(f"\n{need}:\n" for need in needs)


def _for_make(path: str) -> str:
    return path.replace("$", "$$").replace("#", "\\#").replace(" ", "\\ ")


class Outputs:
    """The outputs of a command: made first, and put in their places at its end with what it says."""

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
        verify: str,
        needed: bool = True,
        beside: Iterable[str | None] = (),
    ) -> None:
        self.paths, self.schema = paths, (schema or "").upper()
        self.overwrite, self.if_changed = overwrite or if_changed, if_changed
        self.chord, self.angle, self.ascii_stl = chord, angle, ascii_stl
        self.verify = verify == "on"
        self.made: dict[str, Made] = {}
        if needed and not paths:
            raise UsageError("no output is named", "name a file with -o OUT.step, or - for standard output")
        if paths.count("-") > 1:
            raise UsageError("- is named twice", "give each -o once")
        self.formats = {path: FORMATS[format] if path == "-" else by_ending(path) for path in paths}
        check_reports(*self.files(), *beside, overwrite=self.overwrite)

    def targets(self) -> list[Target]:
        """How each output is written."""
        from mracad.job.produce import Target

        return [
            Target(self._name(path), format.name, self.schema, self.chord, self.angle, self.ascii_stl)
            for path, format in self.formats.items()
        ]

    def take(self, made: Sequence[Made]) -> None:
        """Keep the content of every output, in their order; nothing is written yet."""
        self.made = dict(zip(self.formats, made, strict=True)) if made else {}

    def deliver(self, files: Mapping[str, str | None], lines: Iterable[str]) -> None:
        """End the command: what was made, texts beside it and the lines of the result, all or nothing."""
        from mracad.output import holds

        for path, made in self.made.items():
            if made.written.lost:
                say(f"warning: {self._name(path)} lacks {', '.join(map(str, made.written.lost))}", file=sys.stderr)
        data = {path: made.data for path, made in self.made.items()}
        stream = data.pop("-", b"" if "-" in self.paths else None)
        changed = {p: d for p, d in data.items() if not (self.if_changed and holds(Path(p), d))}
        deliver({**changed, **files}, lines, stream=stream)

    def files(self) -> list[str]:
        """The outputs that are files."""
        return [path for path in self.paths if path != "-"]

    def sizes(self) -> str:
        """What was made: names, sizes, and the faces that are in parts."""
        made = self.made.items()
        return ", ".join(", ".join([self._name(p), _size(len(m.data)), *map(str, m.written.cut)]) for p, m in made)

    def body(self) -> dict[str, Any]:
        """What was made, for a report; faces count from 1."""
        made = {self._name(path): each for path, each in self.made.items()}
        return {
            "written": list(made),
            "lost": {name: [asdict(lost) for lost in each.written.lost] for name, each in made.items()},
            "cut": {
                name: [{"face": cut.face + 1, "parts": cut.parts} for cut in each.written.cut]
                for name, each in made.items()
            },
            "read_back": {name: read_back(each.read_back) for name, each in made.items()},
        }

    @staticmethod
    def _name(path: str) -> str:
        return "standard output" if path == "-" else Path(path).name


def _size(count: int) -> str:
    return f"{count / 1e6:.1f} MB" if count >= 1e5 else f"{count / 1e3:.1f} kB"
