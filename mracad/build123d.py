"""Edits as operations of build123d, in algebra and in builder mode.

>>> from mracad.build123d import fair, repeat_feature
>>> part = fair(part, scale=5)  # algebra
>>> with BuildPart() as builder:
...     insert(part)
...     fair(scale=5)  # what the builder has so far

Options are those of the edits (``help(mracad.smooth)``); ``smooth`` is called ``fair``, and names that build123d has
for other things are longer: ``repeat_feature``, ``move_feature``, ``transfer_detail``, ``offset_faces``,
``sweep_points``, ``coarsen`` (level) and ``restore_details`` (compose).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from build123d import Builder, Mode

from mracad.api.edits import edit
from mracad.api.verbs import verbs


def _operation(use: str, name: str) -> Callable[..., Any]:
    """An edit as an operation of build123d: without a shape, of the builder whose block it is in."""
    change = edit(use)

    def operation(objects: Any = None, /, **options: Any) -> Any:
        if objects is not None:
            return change(objects, **options)
        builder = Builder._get_context(name)
        if builder is None:
            raise ValueError(f"{name} needs a shape, or a builder around it")
        result = change(builder._obj, **options)
        builder._add_to_context(result, mode=Mode.REPLACE)
        return result

    operation.__name__ = operation.__qualname__ = name
    operation.__module__, operation.__doc__ = __name__, change.__doc__
    return operation


for _use, _name in {**verbs(), "smooth": "fair"}.items():
    globals()[_name] = _operation(_use, _name)


def __getattr__(name: str) -> Any:  # so that type checkers know of the names above
    raise AttributeError(f"module 'mracad.build123d' has no attribute {name!r}")
