"""Bounded caches: keyed by value, with read-only results, cleared between the files of a batch."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, wraps
from typing import Any, TypeVar, cast

import numpy as np

Function = TypeVar("Function", bound=Callable[..., Any])

_CACHES: list[Any] = []
_PLAIN = {bool, int, float, str, bytes, type(None)}


def kept(most: int) -> Callable[[Function], Function]:
    """Decorate a function so that its last ``most`` results are cached.

    Its arguments must be hashable and compare by value.  Arrays in a result are made read-only, because the next caller
    gets the same ones.
    """

    def wrap(function: Function) -> Function:
        @lru_cache(maxsize=most)
        @wraps(function)
        def once(*arguments: Any) -> Any:
            return _frozen(function(*arguments))

        _CACHES.append(once)
        return cast(Function, once)

    return wrap


class Recent:
    """Texts by key, the most recent ones up to a total length, until all caches are cleared."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._held: dict[str, bytes] = {}
        _CACHES.append(self)

    def find(self, key: str) -> bytes | None:
        """The text of a key."""
        return self._held.get(key)

    def keep(self, key: str, text: bytes) -> None:
        """Keep a text, and no longer the oldest ones where they are too much together."""
        self._held[key] = text
        while sum(map(len, self._held.values())) > self._most:
            del self._held[next(iter(self._held))]

    def cache_clear(self) -> None:
        """Keep nothing."""
        self._held.clear()


def clear() -> None:
    """Clear all caches."""
    for cache in _CACHES:
        cache.cache_clear()


def _frozen(value: Any) -> Any:
    """The value, with all arrays in it made read-only, also those within tuples, lists and objects."""
    if isinstance(value, np.ndarray):
        value.setflags(write=False)
        return value
    for part in value if isinstance(value, (tuple, list)) else getattr(value, "__dict__", {}).values():
        if type(part) not in _PLAIN:
            _frozen(part)
    return value
