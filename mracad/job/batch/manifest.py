"""What a batch has done, in files that survive kills: one JSON line per output, only ever appended to.

A line is written before its output is put in place, and holds the hash of the output's content.  So whenever a kill
comes, an output counts as done exactly if it is whole and was made from the same input in the same way.

A folder has one such file.  Objects in a store cannot be appended to, so there each batch writes short files of its
own, the last of them anew with every line.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import time
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType, TracebackType

from mracad.errors import FileError
from mracad.output import holds, put_all, temporary
from mracad.store import Location, Url, location

NAME = "manifest.jsonl"

OBJECTS = "manifest.*.jsonl"
"""Names of its parts in a store."""

TOGETHER = 100
"""Lines in one object."""

UNFINISHED = ".mracad-batch-"
"""Prefix of the names of files that a batch is still writing."""


class Manifest:
    """The manifest of an output folder, held by one batch at a time.

    Raises
    ------
    FileError
        When it cannot be written, or another batch is writing into the folder.
    """

    def __init__(self, folder: Location) -> None:
        self.folder = folder
        self._known: dict[str, dict[str, str]] = {}
        self._lines: _Lines | _Objects = _Objects(folder) if isinstance(folder, Url) else _Lines(folder)
        for line in self._lines.text.splitlines():
            with contextlib.suppress(ValueError, KeyError, TypeError):  # the last line may be torn
                entry = json.loads(line)
                self._known[entry["output"]] = {"key": entry["key"], "sha256": entry["sha256"]}

    def __enter__(self) -> Manifest:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._lines.close()

    def made(self, output: str) -> bool:
        """Whether a batch has made this output, with any key."""
        return output in self._known

    def done(self, output: str, key: str) -> bool:
        """Whether the output exists, unchanged since it was made with this key."""
        entry = self._known.get(output)
        if entry is None or entry["key"] != key:
            return False
        try:
            return digest((self.folder / output).read_bytes()) == entry["sha256"]
        except OSError:
            return False

    def write(
        self,
        output: str,
        key: str,
        data: bytes,
        beside: Mapping[str, bytes] = MappingProxyType({}),
        *,
        if_changed: bool = False,
    ) -> None:
        """Record an output, and write it and the files that belong to it, all or none; raises FileError.

        Parameters
        ----------
        output : str
            Its path relative to the folder.
        key : str
            A hash of everything that the output depends on.
        data : bytes
        beside : mapping
            Contents of files that belong to it, by their paths, absolute or relative to the folder.
        if_changed : bool
            Do not touch a file that already has this content.
        """
        entry = {"output": output, "key": key, "sha256": digest(data)}
        self._lines.add(json.dumps(entry).encode() + b"\n")
        self._known[output] = entry
        self.put({output: data, **beside}, if_changed=if_changed)

    def put(self, contents: Mapping[str, bytes], *, if_changed: bool = False) -> None:
        """Write files that belong to outputs, by their paths, absolute or relative to the folder."""
        places = {location(name, self.folder): content for name, content in contents.items()}
        for place in places:
            with contextlib.suppress(OSError):  # writing reports it better
                place.parent.mkdir(parents=True, exist_ok=True)
        put_all({p: c for p, c in places.items() if not (if_changed and holds(p, c))}, prefix=UNFINISHED)


class _Lines:
    """The lines of a folder, in a file that is locked."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / NAME
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._file = self._path.open("a+b")
        except OSError as error:
            raise FileError(f"cannot write '{self._path}': {error.strerror}", "choose another folder") from error
        _lock(self._file.fileno(), folder)
        for below, _, _ in os.walk(folder):
            for left in temporary(Path(below), UNFINISHED):
                left.unlink(missing_ok=True)
        self._file.seek(0)
        self.text = self._file.read()
        if self.text and not self.text.endswith(b"\n"):
            self._file.write(b"\n")

    def add(self, line: bytes) -> None:
        try:
            self._file.write(line)
            self._file.flush()
            os.fsync(self._file.fileno())
        except OSError as error:
            raise FileError(f"cannot write '{self._path}': {error.strerror}", "free some disk space") from error

    def close(self) -> None:
        self._file.close()


class _Objects:
    """The lines of a folder in a store, in objects that are named after the time."""

    def __init__(self, folder: Url) -> None:
        folder.check()
        self._folder = folder
        self.text = b"\n".join(url.read_bytes() for url in (folder / OBJECTS).files().values())
        self._begin()

    def add(self, line: bytes) -> None:
        if len(self._own) == TOGETHER:
            self._begin()
        self._own.append(line)
        self._place.write_bytes(b"".join(self._own))

    def close(self) -> None:
        pass

    def _begin(self) -> None:
        self._own: list[bytes] = []
        self._place = self._folder / OBJECTS.replace("*", f"{time.time_ns():020}")


def digest(data: bytes) -> str:
    """The SHA-256 of some bytes."""
    return hashlib.sha256(data).hexdigest()


def _lock(handle: int, folder: Path) -> None:
    """Keep other batches out until the file is closed or the process ends."""
    try:
        import fcntl
    except ImportError:
        return
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        raise FileError(f"another batch is writing into '{folder}'", "wait for it, or choose another folder") from error
