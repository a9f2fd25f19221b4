"""Multiresolution editing for CAD models.

>>> import mracad
>>> document = mracad.read("panel.step")
>>> model = mracad.snapshot(document)
>>> edit = mracad.smooth(model, mracad.Smooth(scale="5mm"))
>>> mracad.apply(document, model, edit.displacement)
>>> mracad.write(document, "smooth.step")

Names are loaded on first use, so importing the package does not load the CAD kernel.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from mracad.version import __version__

if TYPE_CHECKING:
    from mracad.edit.compose import compose
    from mracad.edit.details import Details
    from mracad.edit.feature.edits import move, repeat
    from mracad.edit.level import level
    from mracad.edit.mra import load as load_details
    from mracad.edit.mra import save as save_details
    from mracad.edit.smooth import smooth
    from mracad.edit.transfer import transfer
    from mracad.errors import MracadError
    from mracad.inspect.deviation import deviations
    from mracad.inspect.seams import seams
    from mracad.inspect.spectrum import spectra
    from mracad.job.document import run
    from mracad.job.look import snapshot
    from mracad.model.brep import Model
    from mracad.model.displacement import Displacement
    from mracad.occ.apply import apply
    from mracad.occ.check import check
    from mracad.occ.files import read, write
    from mracad.spec.pictures import Picture
    from mracad.spec.steps import Compose, Level, Move, Repeat, Smooth, Transfer
    from mracad.view.picture import render

_HOMES = {
    "Details": "edit.details",
    "Displacement": "model.displacement",
    "Model": "model.brep",
    "MracadError": "errors",
    "Picture": "spec.pictures",
    "apply": "occ.apply",
    "check": "occ.check",
    "deviations": "inspect.deviation",
    "load_details": "edit.mra:load",
    "read": "occ.files",
    "read_back": "job.produce",
    "render": "view.picture",
    "run": "job.document",
    "save_details": "edit.mra:save",
    "seams": "inspect.seams",
    "snapshot": "job.look",
    "spectra": "inspect.spectrum",
    "write": "occ.files",
}

__all__ = [
    "Compose",
    "Details",
    "Displacement",
    "Level",
    "Model",
    "Move",
    "MracadError",
    "Picture",
    "Repeat",
    "Smooth",
    "Transfer",
    "__version__",
    "apply",
    "check",
    "compose",
    "deviations",
    "level",
    "load_details",
    "move",
    "read",
    "read_back",
    "render",
    "repeat",
    "run",
    "save_details",
    "seams",
    "smooth",
    "snapshot",
    "spectra",
    "transfer",
    "write",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    value = _step(name)
    if value is None:
        if name not in _HOMES:
            raise AttributeError(f"module 'mracad' has no attribute {name!r}")
        module, _, attribute = _HOMES[name].partition(":")
        value = getattr(import_module(f"mracad.{module}"), attribute or name)
    globals()[name] = value
    return value


def _step(name: str) -> Any:
    """The options of an edit, or its function."""
    from mracad.spec.steps import STEPS, Selection

    edits = {use: struct for use, struct in STEPS.items() if issubclass(struct, Selection)}
    if name in edits:
        return getattr(import_module(edits[name].function.partition(":")[0]), name)
    return next((struct for struct in edits.values() if struct.__name__ == name), None)
