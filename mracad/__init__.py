"""Multiresolution editing for CAD models.

>>> import mracad
>>> fair = mracad.smooth("panel.step", scale="25mm")
>>> written = fair.write("smooth.step")

Names are loaded on first use, so importing the package does not load the CAD kernel.
"""

from importlib import import_module
from typing import Any

from mracad.version import __version__  # noqa: F401

_HOMES = {
    "Document": "document",
    "check": "looks",
    "compare": "looks",
    "info": "looks",
    "read": "document",
    "render": "looks",
    "report_of": "past",
    "snapshot": "looks",
    "spectrum": "looks",
    "write": "write",
}
_ERRORS = "CrashError", "EditError", "FileError", "LimitError", "MracadError", "UsageError"


def __getattr__(name: str) -> Any:
    if name in _ERRORS:
        value = getattr(import_module("mracad.errors"), name)
    elif name in _HOMES:
        value = getattr(import_module(f"mracad.api.{_HOMES[name]}"), name)
    elif name == "__all__":
        value = ["__version__", *_ERRORS, *_HOMES, *_edits()]
    elif name[:1] != "_" and name in _edits():
        value = import_module("mracad.api.edits").edit(name)
    else:
        raise AttributeError(f"module 'mracad' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__getattr__("__all__")})


def _edits() -> list[str]:
    """The names of the edits."""
    from mracad.spec.steps import STEPS, Selection

    return [use for use, struct in STEPS.items() if issubclass(struct, Selection)]
