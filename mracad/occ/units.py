"""Length units of files.

The kernel works in millimetres: it multiplies every length that it reads by the file's unit, and divides by it on
writing.  With x = fl(a f) in memory, fl(fl(x / f) f) = x for every a and f in double precision (where quotients are
spaced more closely than x requires, the product rounds back to x; where they are not, a is the nearest quotient).  So
numbers that were not changed read back bit-identical.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass

from OCP.STEPConstruct import STEPConstruct_UnitContext
from OCP.StepData import StepData_Factors, StepData_StepModel

from mracad.errors import UsageError

#: Unit to (millimetres, the kernel's name for it): the units that it can write.
UNITS = {
    "mm": (1.0, "MM"),
    "cm": (10.0, "CM"),
    "m": (1000.0, "M"),
    "km": (1e6, "KM"),
    "um": (1e-3, "UM"),
    "in": (25.4, "INCH"),
    "ft": (304.8, "FT"),
    "mi": (1609344.0, "MI"),
    "mil": (0.0254, "MIL"),
    "uin": (2.54e-5, "UIN"),
}
_ALIASES = {"inch": "in", "foot": "ft", "feet": "ft", "metre": "m", "meter": "m", "micron": "um", "µm": "um"}
# dimensions and tolerances, which the kernel writes in memory units whatever the unit of the output
_TOLERANCES = b"GEOMETRIC_TOLERANCE", b"DIMENSIONAL_SIZE", b"DIMENSIONAL_LOCATION"
_CONTEXT = b"GLOBAL_UNIT_ASSIGNED_CONTEXT"
_ENTITY = re.compile(rb"#(\d+)\s*=\s*\(")
_SAME = 1e-9  # relative difference below which two factors are the same unit


@dataclass(frozen=True)
class Units:
    """The length unit of a file.

    The default, millimetres, is used for files that mix units, use one that cannot be written, or hold dimensions and
    tolerances.

    Attributes
    ----------
    name : str
        The unit in which the file is written again, a key of ``UNITS``.
    mm : float
        Millimetres in one unit, as the kernel computes them.
    kernel_mm : float
        Millimetres in the unit that the kernel must use on reading; differs from 1 only if the file states the wrong
        unit.
    """

    name: str = "mm"
    mm: float = 1.0
    kernel_mm: float = 1.0


def named(unit: str) -> str:
    """The key of ``UNITS`` for the name of a unit; raises UsageError."""
    key = unit.strip().lower()
    key = _ALIASES.get(key, key)
    if key not in UNITS:
        raise UsageError(f"unknown length unit '{unit}'", "use one of " + ", ".join(UNITS))
    return key


def of_file(model: StepData_StepModel, text: bytes, override: str | None = None) -> Units:
    """The units of a STEP file.

    Parameters
    ----------
    model : StepData_StepModel
        The file as loaded.
    text : bytes
        Its text.
    override : str, optional
        The unit of its numbers, instead of the one that the file states.

    Raises
    ------
    UsageError
        For an unknown unit, or an override of a file that mixes units.
    """
    name = None if override is None else named(override)
    factors = _factors(model, text) or [1.0]
    stated = factors[0]
    if max(factors) > stated * (1 + _SAME):
        if name:
            raise UsageError("the file mixes several length units", "leave its units as they are")
        return Units()
    if not name:
        name = next((key for key, (mm, _) in UNITS.items() if abs(stated / mm - 1) < _SAME), None)
    if not name:
        return Units()
    mm = UNITS[name][0] if override else stated
    kernel_mm = stated / mm
    stated_in_memory = any(True for word in _TOLERANCES for _ in _places(word, text))
    return Units(kernel_mm=kernel_mm) if stated_in_memory else Units(name, mm, kernel_mm)


def metres(mm: float) -> float:
    """The number of metres that the kernel, which stores its unit in metres, converts to exactly ``mm`` (or nearly)."""
    near = mm / 1000.0
    return min((near, math.nextafter(near, 0.0), math.nextafter(near, math.inf)), key=lambda m: abs(m * 1000.0 - mm))


def _places(word: bytes, text: bytes) -> Iterator[int]:
    """Where a whole word is in a text; the word as such is found much faster than an expression."""
    whole, place = re.compile(rb"\b" + word + rb"\b"), text.find(word)
    while place >= 0:
        if whole.match(text, place):
            yield place
        place = text.find(word, place + len(word))


def _factors(model: StepData_StepModel, text: bytes) -> list[float]:
    """Millimetres per unit of every unit context in the file, ascending, as the kernel itself computes them."""
    found = []
    for place in _places(_CONTEXT, text):
        match = _ENTITY.search(text, text.rfind(b";", 0, place) + 1, place)
        if match is None:
            continue
        number = model.NextNumberForLabel(f"#{match[1].decode()}", 0, True)
        units = getattr(model.Value(number), "GlobalUnitAssignedContext", None) if number else None
        if units is not None:
            context = STEPConstruct_UnitContext()
            context.ComputeFactors(units(), StepData_Factors())
            if context.LengthDone():
                found.append(context.LengthFactor())
    return sorted(found)
