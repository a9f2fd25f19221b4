"""The files of a batch, from what names them."""

from __future__ import annotations

import glob
import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from mracad.errors import FileError, UsageError
from mracad.formats import FORMATS, READABLE, by_extension


@dataclass(frozen=True)
class Item:
    """One file of a batch, its output relative to the output folder, and the format of the output."""

    source: str
    output: str
    format: str = "step"


def find(words: Iterable[str], folder: Path, format: str = "") -> list[Item]:
    """The files of a batch from paths, folders (all models below them) and patterns.

    Outputs have the names of their inputs, with the extension of ``format`` if given.  Files of a folder keep their
    place below it; files of a pattern keep their place below the folder before its first wildcard.  Hidden files and
    the output folder are left out.

    Raises
    ------
    FileError
        When there is no file, or a folder or pattern holds no model.
    UsageError
        When two inputs would be written to the same output, or one to itself.
    """
    found: dict[str, str] = {}
    own = folder.resolve()
    for word in words:
        for source, output in _expanded(word, own):
            if format:
                output = str(Path(output).with_suffix(FORMATS[format].extensions[0]))
            other = found.setdefault(output, source)
            if Path(other).resolve() != Path(source).resolve():
                raise UsageError(
                    f"'{other}' and '{source}' would both be written to '{folder / output}'",
                    "give the folder that holds both, or one batch each",
                )
            if Path(source).resolve() == own / output:
                raise UsageError(f"'{source}' would be replaced by its own output", "choose another folder with -O")
    if not found:
        raise FileError("no input files are named", "give files, folders or patterns")
    return [Item(source, output, format or _format(output)) for output, source in found.items()]


def _format(output: str) -> str:
    """The format in which a file is written: that of its input by its extension, else STEP."""
    return by_extension(output).name if Path(output).suffix.lower() in READABLE else "step"


def _expanded(word: str, own: Path) -> list[tuple[str, str]]:
    """The files that a word on the command line names, except those in the output folder, each with its output."""
    base = Path(word)
    if base.is_dir():
        files = [path for path in base.rglob("*") if path.suffix.lower() in READABLE]
    elif glob.has_magic(word) and not base.exists():
        base = Path(*itertools.takewhile(lambda part: not glob.has_magic(part), base.parts))
        files = [Path(path) for path in glob.glob(word, recursive=True)]
    else:
        return [(word, base.name)]
    inside = base.resolve() in own.parents
    pairs = [
        (str(path), str(place))
        for path, place in ((path, path.relative_to(base)) for path in sorted(files))
        if not any(part.startswith(".") for part in place.parts)
        and not (inside and path.resolve().is_relative_to(own))
        and not path.is_dir()
    ]
    if not pairs:
        raise FileError(f"no models in '{word}'", f"models end in {', '.join(sorted(READABLE))}")
    return pairs
