"""The options of every step, declared once: command line, recipes, schemas and documentation come from here.

A ``Struct`` per edit or check, listed in ``STEPS``; a field's ``Meta`` carries its help.  This package imports no
numerical library, so that the command line can show its help at once.
"""

from __future__ import annotations

from mracad.options.base import (
    CountText,
    FeatureText,
    File,
    Naming,
    Options,
    PlaceText,
    Selection,
    dashed,
    lengths,
    namings,
    plain_types,
)
from mracad.options.checks import Check, Compare
from mracad.options.features import Featured, Move, Repeat, Single, Transfer
from mracad.options.quantity import Length, band_of, duration, length
from mracad.options.smooth import Fitting, Smooth

__all__ = [
    "STEPS",
    "Check",
    "Compare",
    "CountText",
    "FeatureText",
    "Featured",
    "File",
    "Fitting",
    "Length",
    "Move",
    "Naming",
    "Options",
    "PlaceText",
    "Repeat",
    "Selection",
    "Single",
    "Smooth",
    "Transfer",
    "band_of",
    "dashed",
    "duration",
    "length",
    "lengths",
    "namings",
    "plain_types",
]

STEPS: dict[str, type[Options]] = {
    "smooth": Smooth,
    "move": Move,
    "repeat": Repeat,
    "transfer": Transfer,
    "check": Check,
    "compare": Compare,
}
"""Every step by the name of its command: edits (subclasses of ``Selection``) and checks."""
