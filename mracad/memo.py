"""Results that are kept: few of each kind, told apart by value, read-only, forgotten between the files of a batch."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, wraps
from typing import Any, TypeVar, cast

import numpy as np

Function = TypeVar("Function", bound=Callable[..., Any])

_CACHES: list[Any] = []


def kept(most: int) -> Callable[[Function], Function]:
    """Decorate a function so that the last ``most`` of its results are kept.

    Its arguments must be hashable and equal by value.  The arrays that a result holds are made read-only: whoever asks
    next gets the same ones.
    """

    def wrap(function: Function) -> Function:
        @lru_cache(maxsize=most)
        @wraps(function)
        def once(*arguments: Any) -> Any:
            return _frozen(function(*arguments))

        _CACHES.append(once)
        return cast(Function, once)

    return wrap


def clear() -> None:
    """Forget everything."""
    for cache in _CACHES:
        cache.cache_clear()


def _frozen(value: Any) -> Any:
    """The value, whose arrays are read-only, those within tuples, lists and objects, too."""
    if isinstance(value, np.ndarray):
        value.setflags(write=False)
    for part in value if isinstance(value, tuple | list) else getattr(value, "__dict__", {}).values():
        _frozen(part)
    return value
