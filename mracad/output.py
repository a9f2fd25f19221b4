"""Files that appear whole or not at all."""

from __future__ import annotations

import contextlib
import os
import re
import secrets
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import IO, BinaryIO

from mracad.errors import FileError
from mracad.note import ending
from mracad.store import Location, Url, location

PREFIX = ".mracad-"
"""Prefix of the names of temporary files; 32 hexadecimal digits and ``.part`` follow, as in no other file."""

_ABANDONED = 60.0  # seconds: an unlocked temporary file of that age has lost its writer


@contextlib.contextmanager
def beside(target: str | os.PathLike, prefix: str = PREFIX) -> Iterator[Path]:
    """A temporary path in the target's folder, which replaces the target when the block succeeds.

    Nothing is left behind when it fails, unless the process is killed: then :func:`temporary` finds a file.
    It was locked while its writer lived; the next writer into the folder removes it, once a minute has passed.

    Raises
    ------
    FileError
        When the target cannot be written.
    """
    path = Path(target)
    with _writing(path):
        if path.is_dir():
            raise IsADirectoryError("it is a folder")
        _remove_abandoned(path.parent, prefix)
        made = path.parent / f"{prefix}{secrets.token_hex(16)}.part"
        handle = os.open(made, os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o600)
    try:
        with os.fdopen(handle, "rb+") as held:
            with contextlib.suppress(OSError):
                _lock(held)
            yield made
            with _writing(path):
                os.fsync(held.fileno())
        ending()
        with _writing(path):
            made.chmod(_mode(path))
            made.replace(path)
    finally:
        made.unlink(missing_ok=True)


def temporary(folder: Path, prefix: str = PREFIX) -> list[Path]:
    """The temporary files in a folder, by their names, whether their writers live or not."""
    return [p for p in folder.glob(f"{prefix}*") if re.fullmatch(r"[0-9a-f]{32}\.part", p.name[len(prefix) :])]


def put_all(
    files: Mapping[str | os.PathLike | Url, bytes], last: Callable[[], object] = bool, prefix: str = PREFIX
) -> None:
    """Write files whole; if one cannot be written, or ``last`` fails, none is put in place.

    Those in stores are put there one by one before the others: the ones before the first that fails stay.

    Parameters
    ----------
    files : mapping
    last : callable
        Called when all are written and before the first is put in place.

    Raises
    ------
    FileError
        When a file cannot be written.
    """
    remote: list[tuple[Url, bytes]] = []
    with contextlib.ExitStack() as stack:
        for name, data in files.items():
            path = location(name)
            if isinstance(path, Url):
                remote.append((path, data))
                continue
            made = stack.enter_context(beside(path, prefix))
            with _writing(path):
                made.write_bytes(data)
        for url, data in remote:
            ending()
            url.write_bytes(data)
        last()


def put(data: bytes, target: str | os.PathLike | BinaryIO, prefix: str = PREFIX) -> None:
    """Write bytes to a path (whole or not at all) or to a binary stream; raises FileError."""
    if isinstance(target, str | os.PathLike):
        put_all({target: data}, prefix=prefix)
        return
    try:
        target.write(data)
        target.flush()
    except OSError as error:
        raise FileError(
            f"cannot write the output: {error.strerror or error}", "check where standard output goes"
        ) from error


def holds(path: Location, data: bytes) -> bool:
    """Whether a file exists and already has this content."""
    try:
        return (isinstance(path, Url) or path.stat().st_size == len(data)) and path.read_bytes() == data
    except OSError:
        return False


def _remove_abandoned(folder: Path, prefix: str) -> None:
    """Remove temporary files left by killed writers."""
    for left in temporary(folder, prefix):
        with contextlib.suppress(OSError):
            if time.time() - left.stat().st_mtime > _ABANDONED:
                with left.open("rb") as file:
                    _lock(file)
                    left.unlink()


def _lock(file: IO[bytes]) -> None:
    """Lock a file; raises OSError where another process holds it, or this system has no locks."""
    try:
        import fcntl
    except ImportError as error:
        raise OSError("no locks on this system") from error
    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _mode(path: Path) -> int:
    """The permissions of the file to be replaced, or of a new file."""
    if path.exists():
        return path.stat().st_mode & 0o777
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask


@contextlib.contextmanager
def _writing(path: Path) -> Iterator[None]:
    """Turn an OSError in the block into a FileError for a file that cannot be written."""
    try:
        yield
    except OSError as error:
        hint = "choose another place for the output"
        raise FileError(f"cannot write '{path}': {error.strerror or error}", hint) from error
