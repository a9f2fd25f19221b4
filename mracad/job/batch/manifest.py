"""What a batch has done, in a file that survives kills: one JSON line per output, only ever appended to.

A line is written before its output is put in place, and holds the hash of the output's content.  So whenever a kill
comes, an output counts as done exactly if it is whole and was made from the same input in the same way.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType, TracebackType

from mracad.errors import FileError
from mracad.output import holds, put_all, temporary

NAME = "manifest.jsonl"

UNFINISHED = ".mracad-batch-"
"""Prefix of the names of files that a batch is still writing."""


class Manifest:
    """The manifest of an output folder, held by one batch at a time.

    Raises
    ------
    FileError
        When it cannot be written, or another batch is writing into the folder.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._known: dict[str, dict[str, str]] = {}
        path = folder / NAME
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._file = path.open("a+b")
        except OSError as error:
            raise FileError(f"cannot write '{path}': {error.strerror}", "choose another folder") from error
        _lock(self._file.fileno(), folder)
        for below, _, _ in os.walk(folder):
            for left in temporary(Path(below), UNFINISHED):
                left.unlink(missing_ok=True)
        self._file.seek(0)
        text = self._file.read()
        for line in text.splitlines():
            with contextlib.suppress(ValueError, KeyError, TypeError):  # the last line may be torn
                entry = json.loads(line)
                self._known[entry["output"]] = {"key": entry["key"], "sha256": entry["sha256"]}
        if text and not text.endswith(b"\n"):
            self._file.write(b"\n")

    def __enter__(self) -> Manifest:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

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
        try:
            self._note(output, key, data)
        except OSError as error:
            raise FileError(f"cannot write '{self._file.name}': {error.strerror}", "free some disk space") from error
        self.put({output: data, **beside}, if_changed=if_changed)

    def put(self, contents: Mapping[str, bytes], *, if_changed: bool = False) -> None:
        """Write files that belong to outputs, by their paths, absolute or relative to the folder."""
        places = {self.folder / name: content for name, content in contents.items()}
        for place in places:
            with contextlib.suppress(OSError):  # writing reports it better
                place.parent.mkdir(parents=True, exist_ok=True)
        put_all({p: c for p, c in places.items() if not (if_changed and holds(p, c))}, prefix=UNFINISHED)

    def _note(self, output: str, key: str, data: bytes) -> None:
        entry = {"output": output, "key": key, "sha256": digest(data)}
        self._file.write(json.dumps(entry).encode() + b"\n")
        self._file.flush()
        os.fsync(self._file.fileno())
        self._known[output] = entry


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
