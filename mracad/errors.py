"""Errors: what went wrong, what to do about it, and the exit code."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from enum import IntEnum


class Code(IntEnum):
    """Exit codes of the command line (``docs/commands.md``)."""

    FAILED_CHECK = 1
    USAGE = 2
    FILE = 3
    CANNOT_EDIT = 4
    LIMIT = 5
    INTERNAL = 70
    INTERRUPTED = 130


MEANINGS = {
    0: "Done.",
    Code.FAILED_CHECK: "A check or a comparison failed.",
    Code.USAGE: "An option, a recipe or a default is wrong.",
    Code.FILE: "A file cannot be read or written.",
    Code.CANNOT_EDIT: "The edit cannot be done on this model.",
    Code.LIMIT: "A limit of time or memory was exceeded.",
    Code.INTERNAL: "An internal error, or a crash of the CAD kernel.",
    Code.INTERRUPTED: "Interrupted.",
}
"""What exit codes mean."""


class MracadError(Exception):
    """A failure that the user can act on.

    Parameters
    ----------
    message : str
        One line: what is wrong, and where.
    hint : str
        One line: what to do about it.
    code : Code
        The exit code of the command line.
    """

    def __init__(self, message: str, hint: str = "", code: Code = Code.INTERNAL) -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint
        self.code = code

    def __str__(self) -> str:
        return f"{self.message}; {self.hint}" if self.hint else self.message

    def __reduce__(self) -> tuple[object, ...]:
        return _again, (type(self), self.message, self.hint, self.code)


@contextmanager
def needing(extra: str, what: str) -> Iterator[None]:
    """Name the extra that ``what`` needs where a package that is imported in the block is not installed.

    Raises
    ------
    UsageError
    """
    try:
        yield
    except ModuleNotFoundError as error:
        missing = (error.name or "a package").partition(".")[0]
        raise UsageError(f"{what}: {missing} is not installed", f"pip install 'mracad[{extra}]'") from error


def _again(kind: type[MracadError], message: str, hint: str, code: Code) -> MracadError:
    """An error rebuilt in another process."""
    error = kind.__new__(kind)
    MracadError.__init__(error, message, hint, code)
    return error


class UsageError(MracadError, ValueError):
    """A malformed value, an unknown option, face or step.

    Parameters
    ----------
    option : str
        The option that is wrong, if known.
    """

    option = ""

    def __init__(self, message: str, hint: str = "", option: str = "") -> None:
        super().__init__(message, hint, Code.USAGE)
        self.option = option


class FileError(MracadError, OSError):
    """An input or output that is missing, unreadable, unwritable or unsupported."""

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message, hint, Code.FILE)


class EditError(MracadError):
    """An edit that cannot be done as asked on this model."""

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message, hint, Code.CANNOT_EDIT)


class LimitError(MracadError):
    """Work that exceeded its limit of time or memory."""

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message, hint, Code.LIMIT)


class CrashError(MracadError):
    """Work that crashed, or ended in an unexpected error."""

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message, hint, Code.INTERNAL)
