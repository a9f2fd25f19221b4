"""Where files are: paths on this machine, and URLs of object stores and other file systems, which fsspec reaches."""

from __future__ import annotations

import glob
import importlib
import itertools
import logging
import os
import re
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any, TypeAlias
from urllib.parse import unquote, urlsplit

from mracad.errors import FileError, UsageError, needing

_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]+)://")

_PACKAGES = {"s3": "s3fs", "s3a": "s3fs", "gs": "gcsfs", "gcs": "gcsfs"}
"""What the extra ``stores`` brings, by protocol."""

_WHOLE = frozenset({*_PACKAGES, "abfs", "abfss", "az", "oss", "memory"})
"""Protocols of object stores: objects appear whole, buckets are not made, folders need not be."""

_CHECK = "check its path and permissions"

_SILENT = logging.NullHandler()
"""For gcsfs, which would tell of every attempt on standard error, with tracebacks."""

_READ_ONLY = frozenset({"http", "https"})


@dataclass(frozen=True)
class Url:
    """A file or a folder in a store, with the names of :class:`pathlib.Path`.

    Every method raises FileError where the store cannot be reached or refuses, and UsageError where a package is
    missing or nobody knows the protocol.
    """

    text: str

    def __str__(self) -> str:
        return self.text

    def __truediv__(self, name: str) -> Url:
        return Url(f"{self.text.rstrip('/')}/{name}")

    @property
    def protocol(self) -> str:
        return self.text.partition("://")[0].lower()

    @property
    def name(self) -> str:
        if self.protocol in _READ_ONLY:
            return unquote(PurePosixPath(urlsplit(self.text).path).name)
        return PurePosixPath(self.text).name

    @property
    def stem(self) -> str:
        return PurePosixPath(self.name).stem

    @property
    def suffix(self) -> str:
        return PurePosixPath(self.name).suffix

    @property
    def parent(self) -> Url:
        return Url(self.text.rstrip("/").rpartition("/")[0])

    @property
    def base(self) -> Url:
        """The folder before the first wildcard; itself where there is none."""
        return Url("/".join(itertools.takewhile(lambda part: not glob.has_magic(part), self.text.split("/"))))

    def with_name(self, name: str) -> Url:
        return self.parent / name

    def resolve(self) -> Url:
        return Url(self.text.rstrip("/"))

    def mkdir(self, parents: bool = False, exist_ok: bool = False) -> None:
        """Do nothing: folders in stores come with their files."""

    def exists(self) -> bool:
        return self._kind() is not None

    def is_dir(self) -> bool:
        return self._kind() == "directory"

    def read_bytes(self, size: int | None = None) -> bytes:
        """The content, or its first ``size`` bytes."""
        with self._reached("read") as (system, path):
            return bytes(system.cat_file(path, end=size))

    def write_bytes(self, data: bytes) -> None:
        """Put a file in place, whole or not at all."""
        with self._reached("write") as (system, path):
            if self.protocol in _WHOLE:
                system.pipe_file(path, data)
                return
            folder = system._parent(path)
            system.makedirs(folder, exist_ok=True)
            made = f"{folder}/.mracad-{secrets.token_hex(16)}.part"
            try:
                system.pipe_file(made, data)
                system.mv(made, path)
            except BaseException:
                with suppress(Exception):
                    system.rm_file(made)
                raise

    def check(self, what: str = "write") -> None:
        """Refuse a place whose bucket or folder does not exist, or one for reading only, as far as that can be told."""
        with self._reached(what) as (system, path):
            if self.protocol in _READ_ONLY:
                raise NotImplementedError
            above = path.lstrip("/").partition("/")[0] if self.protocol in _WHOLE else system._parent(path)
            with suppress(PermissionError):  # who may write objects need not be allowed to see their bucket
                if above and self.protocol != "memory":
                    system.info(above)

    def files(self) -> dict[str, Url]:
        """The files in a folder, or those of a pattern, by their places below the folder before the pattern."""
        base = self.base
        with self._reached("read") as (system, path):
            look = system.find if base == self else system.glob
            found = [name for name, info in look(path, detail=True).items() if info["type"] == "file"]
            root = system._strip_protocol(base.text).rstrip("/")
        places = [name.removeprefix(root).lstrip("/") for name in sorted(found)]
        return {place: base / place for place in places}

    def _kind(self) -> str | None:
        """Whether it is a file or a directory; None if it does not exist."""
        with self._reached("read") as (system, path):
            try:
                return str(system.info(path)["type"])
            except FileNotFoundError:
                return None

    @contextmanager
    def _reached(self, what: str) -> Iterator[tuple[Any, str]]:
        """The file system and the path in it; its errors as a FileError."""
        with needing("stores", f"cannot {what} '{self}'"):
            import fsspec

            logging.getLogger("gcsfs").addHandler(_SILENT)
            if self.protocol in _PACKAGES:
                importlib.import_module(_PACKAGES[self.protocol])
        try:
            system, path = fsspec.url_to_fs(self.text)
            system.invalidate_cache()
            yield system, path
        except ImportError as error:
            why = f"a package for {self.protocol}:// is not installed"
            raise UsageError(f"cannot {what} '{self}': {why}", str(error)) from error
        except Exception as error:
            if isinstance(error, ValueError) and "Protocol not known" in str(error):
                hint = f"give a path, or a URL such as {', '.join(f'{each}://' for each in ('s3', 'gs', 'https'))}"
                raise UsageError(f"cannot {what} '{self}': no store is called {self.protocol}", hint) from error
            raise FileError(f"cannot {what} '{self}': {self._reason(error, what)}", _hint(error)) from error

    def _reason(self, error: Exception, what: str) -> str:
        """What a store says, in one line."""
        said = " ".join(str(error).split())
        if isinstance(error, FileNotFoundError) and what == "write":
            return f"there is no such {'bucket' if self.protocol in _WHOLE else 'folder'}"
        if isinstance(error, FileNotFoundError) and ("/" in said or not said):  # only its name
            return "there is no such file"
        if isinstance(error, NotImplementedError):
            return "this store is for reading only"
        return said or type(error).__name__


Location: TypeAlias = Path | Url


def is_url(text: str) -> bool:
    """Whether a text is a URL, not a path."""
    return bool(_SCHEME.match(text)) and not text.startswith("file://")


def location(text: str | os.PathLike[str] | Url, folder: Location | None = None) -> Location:
    """A path or a URL; a relative path is taken from a folder, if one is given."""
    if isinstance(text, Url):
        return text
    name = os.fspath(text)
    if is_url(name):
        return Url(name)
    name = unquote(name[len("file://") :]) if name.startswith("file://") else name
    return folder / name if folder and not Path(name).is_absolute() else Path(name)


def read(place: str | os.PathLike[str]) -> bytes:
    """The content of a file; raises FileError."""
    where = location(place)
    if isinstance(where, Url):
        return where.read_bytes()
    try:
        return where.read_bytes()
    except OSError as error:
        if isinstance(error, FileNotFoundError):
            raise missing(where) from error
        why = "it is a folder" if isinstance(error, IsADirectoryError) else error.strerror or str(error)
        raise FileError(f"cannot read '{where}': {why}", _CHECK) from error


def missing(path: Path) -> FileError:
    """The error for a file that does not exist."""
    return FileError(f"cannot read '{path}': there is no such file", _CHECK)


def head(where: Location, size: int) -> bytes:
    """The first bytes of a file; raises OSError."""
    if isinstance(where, Url):
        return where.read_bytes(size)
    with where.open("rb") as file:
        return file.read(size)


def _hint(error: Exception) -> str:
    """What to do about the error of a store."""
    told = f"{type(error).__name__} {error}".lower()
    if isinstance(error, FileNotFoundError):
        return "check its name"
    if isinstance(error, NotImplementedError):
        return "write to s3://, gs:// or a path"
    if isinstance(error, PermissionError) or any(word in told for word in ("credential", "unauthorized", "forbidden")):
        return "give credentials where the tools of that store look for them"
    return "check the network and the address of the store"
