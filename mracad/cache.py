"""A cache on disk: entries by key in one folder of the user, bounded in size, the least recently used removed first.

``MRACAD_CACHE`` names the folder, or is ``off``.  By default it is in the user's folder for caches, and off where
``CI`` is set.  An entry that is damaged is none, and a cache that cannot be written does no harm.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import sys
import tempfile
from pathlib import Path

from mracad.errors import MracadError
from mracad.output import put

BOUND = 1 << 30
"""Largest total size of the entries, bytes; no entry is larger than an eighth of it."""

_OFF = ("", "off", "0")
SEAL = hashlib.sha256().digest_size


def folder() -> Path | None:
    """The folder of the cache, which need not exist; None if it is off."""
    chosen = os.environ.get("MRACAD_CACHE", "off" if os.environ.get("CI") else None)
    if chosen is not None:
        return None if chosen in _OFF else Path(chosen).absolute()
    home = {"darwin": "~/Library/Caches", "win32": os.environ.get("LOCALAPPDATA", "~/AppData/Local")}
    base = os.environ.get("XDG_CACHE_HOME") or home.get(sys.platform, "~/.cache")
    return Path(base).expanduser().absolute() / "mracad"


def trouble() -> str:
    """Why no entry can be stored; ``""`` if it can, or the cache is off."""
    where = folder()
    if where is None:
        return ""
    try:
        while not where.exists():
            where = where.parent
        Path(tempfile.mkdtemp(dir=where)).rmdir()
    except OSError as error:
        return str(error.strerror)
    return ""


def size() -> tuple[int, int]:
    """Number of entries, and their total size in bytes."""
    found = _entries()
    return len(found), sum(each[1] for each in found)


def find(key: str) -> Path | None:
    """The file of an entry, :func:`sealed`, if there is one and it is whole."""
    where = folder()
    if where is None:
        return None
    path = where / key
    with contextlib.suppress(OSError):
        data = path.read_bytes()
        if sealed(data[:-SEAL]) == data:
            os.utime(path)
            return path
        path.unlink()
    return None


def sealed(data: bytes) -> bytes:
    """Data with a seal of ``SEAL`` bytes at its end, by which damage is seen."""
    return data + hashlib.sha256(data).digest()


def keep(key: str, data: bytes) -> None:
    """Store an entry, which is :func:`sealed`, if the cache is on and can be written."""
    where = folder()
    if where is None or len(data) > BOUND // 8:
        return
    with contextlib.suppress(OSError, MracadError):
        where.mkdir(mode=0o700, parents=True, exist_ok=True)
        put(data, where / key)
        _trim()


def _entries() -> list[tuple[float, int, Path]]:
    """When each entry was last used, its size, and its file; the oldest first."""
    where, found = folder(), []
    if where is not None and where.is_dir():
        for each in os.scandir(where):
            with contextlib.suppress(OSError):
                about = each.stat()
                found.append((about.st_mtime, about.st_size, Path(each.path)))
    return sorted(found)


def _trim() -> None:
    """Remove the least recently used entries until the rest is within the bound."""
    found = _entries()
    total = sum(each[1] for each in found)
    for _, each, path in found:
        if total <= BOUND:
            break
        path.unlink(missing_ok=True)
        total -= each
