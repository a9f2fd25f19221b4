"""Messages between our processes: MessagePack of declared types, so that receiving one never runs code."""

from __future__ import annotations

import inspect
import typing
from collections.abc import Callable
from typing import Any, TypeVar

import msgspec

from mracad.errors import Code, CrashError, EditError, FileError, LimitError, MracadError, UsageError

Value = TypeVar("Value")

DONE, FAILED = b"+", b"-"

_KINDS = {
    Code.USAGE: UsageError,
    Code.FILE: FileError,
    Code.CANNOT_EDIT: EditError,
    Code.LIMIT: LimitError,
    Code.INTERNAL: CrashError,
}


_OUT_OF_MEMORY = (
    "failed to map segment", "cannot map zero-fill pages", "Cannot allocate memory", "bad_alloc",
    "error return without exception set", "Unable to create type object",
)  # fmt: skip
"""Messages of libraries that ran out of memory."""


class Failure(msgspec.Struct, frozen=True, array_like=True):
    """An error in a message; see :class:`mracad.errors.MracadError`."""

    message: str
    hint: str
    code: int


def answer(work: Callable[[], Any]) -> bytes:
    """Do some work; return its packed result or error."""
    try:
        return DONE + msgspec.msgpack.encode(work())
    except BaseException as error:
        return failed(error)


def failed(error: BaseException) -> bytes:
    """A packed error; an unexpected one becomes an internal error."""
    if not isinstance(error, MracadError):
        error = internal(error)
    message, hint = (text.encode(errors="backslashreplace").decode() for text in (error.message, error.hint))
    return FAILED + msgspec.msgpack.encode(Failure(message, hint, int(error.code)))


def internal(error: BaseException) -> MracadError:
    """The MracadError for an unexpected exception."""
    if out_of_memory(error):
        return LimitError("out of memory", "use a smaller model or a machine with more memory")
    text = " ".join(str(error).split())
    return CrashError(f"internal error: {type(error).__name__}: {text}", "please report it with the output of --debug")


def out_of_memory(error: BaseException) -> bool:
    """Whether an error says that memory ran out."""
    return isinstance(error, MemoryError) or any(words in str(error) for words in _OUT_OF_MEMORY)


def unpacked(data: bytes, kind: type[Value]) -> Value:
    """The result in a message of another process; an error in it is raised."""
    if data[:1] == DONE:
        return msgspec.msgpack.decode(data[1:], type=kind)
    failure = msgspec.msgpack.decode(data[1:], type=Failure)
    code = Code(failure.code)
    if code in _KINDS:
        raise _KINDS[code](failure.message, failure.hint)
    raise MracadError(failure.message, failure.hint, code)


def returned(function: Callable[..., Any]) -> Any:
    """The declared return type of a function; Any where it declares none."""
    if not (inspect.isfunction(function) and "return" in function.__annotations__):
        return Any
    return typing.get_type_hints(function)["return"]
