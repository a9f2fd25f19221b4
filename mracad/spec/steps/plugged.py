"""Edits of other packages: those that their entry points ``mracad.edits`` name."""

from __future__ import annotations

import sys
import warnings
from glob import glob

from mracad.spec.steps.base import Selection

GROUP = "mracad.edits"


def plugged() -> dict[str, type[Selection]]:
    """The structs of options, by the names of their commands; one that cannot be loaded is a warning."""
    found: dict[str, type[Selection]] = {}
    if not _any():
        return found
    from importlib.metadata import entry_points  # slow to import

    for entry in entry_points(group=GROUP):
        try:
            struct = entry.load()
            if not issubclass(struct, Selection) or struct.function.partition(":")[2] != entry.name:
                raise TypeError(f"{entry.value} is no struct of options whose function is called {entry.name}")
        except Exception as error:  # whatever another package does must not stop this one
            warnings.warn(f"the edit {entry.name} of another package cannot be used: {error}", stacklevel=2)
        else:
            found[entry.name] = struct
    return found


def _any() -> bool:
    """Whether a package has such entry points."""
    files = (file for folder in sys.path for file in glob(f"{folder or '.'}/*.*-info/entry_points.txt"))
    for file in files:
        with open(file, errors="replace") as stream:
            if f"[{GROUP}]" in stream.read():
                return True
    return False
