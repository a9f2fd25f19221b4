"""The files of a batch, from what names them."""

from __future__ import annotations

import glob
import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path, PurePath, PurePosixPath

from mracad.errors import FileError, UsageError
from mracad.formats import FORMATS, READABLE, by_extension
from mracad.store import Location, Url, location


@dataclass(frozen=True)
class Item:
    """One file of a batch, its output relative to the output folder, and the format of the output."""

    source: str
    output: str
    format: str = "step"


def find(words: Iterable[str], folder: Location, format: str = "") -> list[Item]:
    """The files of a batch from paths, folders (all models below them) and patterns, here or in stores.

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
            if location(other).resolve() != location(source).resolve():
                raise UsageError(
                    f"'{other}' and '{source}' would both be written to '{folder / output}'",
                    "give the folder that holds both, or one batch each",
                )
            if location(source).resolve() == own / output:
                raise UsageError(f"'{source}' would be replaced by its own output", "choose another folder with -O")
    if not found:
        raise FileError("no input files are named", "give files, folders or patterns")
    return [Item(source, output, format or _format(output)) for output, source in found.items()]


def _format(output: str) -> str:
    """The format in which a file is written: that of its input by its extension, else STEP."""
    return by_extension(output).name if Path(output).suffix.lower() in READABLE else "step"


def _expanded(word: str, own: Location) -> list[tuple[str, str]]:
    """The files that a word on the command line names, except those in the output folder, each with its output."""
    named = location(word)
    base, files = _stored(named) if isinstance(named, Url) else _local(named)
    if files is None:
        return [(word, named.name)]
    inside = base.resolve() != own and _inside(own, base.resolve())
    pairs = [
        (str(path), str(place))
        for place, path in sorted(files.items())
        if not any(part.startswith(".") for part in place.parts) and not (inside and _inside(path.resolve(), own))
    ]
    if not pairs:
        raise FileError(f"no models in '{word}'", f"models end in {', '.join(sorted(READABLE))}")
    return pairs


def _local(named: Path) -> tuple[Location, dict[PurePath, Location] | None]:
    """The files in a folder or of a pattern, by their places below a folder, with that folder; None for one file."""
    word, base = str(named), named
    if named.is_dir():
        files = [path for path in named.rglob("*") if path.suffix.lower() in READABLE]
    elif glob.has_magic(word) and not named.exists():
        base = Path(*itertools.takewhile(lambda part: not glob.has_magic(part), named.parts))
        files = [Path(path) for path in glob.glob(word, recursive=True)]
    else:
        return named, None
    return base, {path.relative_to(base): path for path in files if not path.is_dir()}


def _stored(named: Url) -> tuple[Location, dict[PurePath, Location] | None]:
    """The same in a store."""
    pattern = glob.has_magic(named.text)
    if named.exists() if pattern else not named.is_dir():
        return named, None
    found = {PurePosixPath(place): url for place, url in named.files().items()}
    if not found:
        named.check("read")
    return named.base, {place: url for place, url in found.items() if pattern or place.suffix.lower() in READABLE}


def _inside(place: Location, folder: Location) -> bool:
    """Whether a file or folder is in a folder, or is that."""
    if isinstance(place, Url) or isinstance(folder, Url):
        return f"{place}/".startswith(f"{folder}/")
    return place.is_relative_to(folder)
