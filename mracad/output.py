"""Files that appear whole or not at all."""

from __future__ import annotations

import contextlib
import os
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import IO, BinaryIO

from mracad import guard
from mracad.errors import FileError

_ABANDONED = 60.0  # seconds: an unlocked temporary file of that age has no writer any more


@contextlib.contextmanager
def beside(target: str | os.PathLike, prefix: str = ".mracad-") -> Iterator[Path]:
    """A temporary path in the target's folder, which takes the target's place when the block ends well.

    Nothing is left behind when it does not, unless the process is killed: then a file whose name begins with
    ``prefix``.  It was locked while its writer lived; the next one to write into the folder, a minute later or more,
    removes it.

    Raises
    ------
    FileError
        When the target cannot be written.
    """
    path = Path(target)
    try:
        if path.is_dir():
            raise IsADirectoryError("it is a folder")
        _remove_abandoned(path.parent, prefix)
        handle, name = tempfile.mkstemp(prefix=prefix, suffix=path.suffix, dir=path.parent)
    except OSError as error:
        raise _unwritable(path, error) from error
    temporary = Path(name)
    try:
        with os.fdopen(handle, "rb+") as held:
            with contextlib.suppress(OSError):
                _lock(held)
            yield temporary
            os.fsync(held.fileno())
        guard.ending()
        temporary.chmod(_mode(path))
        temporary.replace(path)
    except FileError:
        raise
    except OSError as error:
        raise _unwritable(path, error) from error
    finally:
        temporary.unlink(missing_ok=True)


def put(data: bytes, target: str | os.PathLike | BinaryIO, prefix: str = ".mracad-") -> None:
    """Write bytes to a path (whole or not at all) or to a binary stream; raises FileError."""
    if isinstance(target, str | os.PathLike):
        with beside(target, prefix) as temporary:
            temporary.write_bytes(data)
        return
    try:
        target.write(data)
        target.flush()
    except OSError as error:
        raise FileError(f"cannot write the output: {error.strerror or error}", "check where it leads") from error


def holds(path: Path, data: bytes) -> bool:
    """Whether a file exists and has this content already."""
    try:
        return path.stat().st_size == len(data) and path.read_bytes() == data
    except OSError:
        return False


def _remove_abandoned(folder: Path, prefix: str) -> None:
    """Remove the temporary files that killed writers left."""
    for left in folder.glob(f"{prefix}*"):
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
    """The permissions of the file that is replaced, or those that a new file gets."""
    if path.exists():
        return path.stat().st_mode & 0o777
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask


def _unwritable(path: Path, error: OSError) -> FileError:
    return FileError(f"cannot write '{path}': {error.strerror or error}", "choose another place for the output")
