"""Length units of STEP files, and the in-memory unit that makes their conversion exact.

The kernel multiplies every length it reads by (file unit / memory unit) and divides by it on writing.  Numbers return
bit-identical when that factor is a power of two, so the memory unit is the file's unit divided by the power of two
that brings it closest to a millimetre.
"""

from __future__ import annotations

import math
import re
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
# dimensions and tolerances, which the kernel writes as it holds them in memory, whatever the unit of the output is
_TOLERANCES = re.compile(rb"\b(GEOMETRIC_TOLERANCE|DIMENSIONAL_SIZE|DIMENSIONAL_LOCATION)\b")
_SAME = 1e-9  # relative difference below which two factors are the same unit


@dataclass(frozen=True)
class Units:
    """How a file's numbers are held in memory.

    The default, plain millimetres for memory and output, serves files that mix units, use one that cannot be written,
    or hold dimensions and tolerances.

    Attributes
    ----------
    name : str
        The file's length unit, a key of ``UNITS``.
    exponent : int
        One file unit is ``2**exponent`` memory units.
    memory_mm : float
        The memory unit in mm, as geometry has it.
    kernel_mm : float
        The memory unit in mm, as the kernel must be told on reading; differs from ``memory_mm`` only where the file
        states a wrong unit.
    """

    name: str = "mm"
    exponent: int = 0
    memory_mm: float = 1.0
    kernel_mm: float = 1.0


def named(unit: str) -> str:
    """The key of ``UNITS`` that ``unit`` means; raises UsageError."""
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
        The unit that its numbers are in whatever the file says.

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
    if _TOLERANCES.search(text):
        return Units(kernel_mm=stated / UNITS[name][0])
    exponent = round(math.log2(UNITS[name][0]))
    return Units(name, exponent, math.ldexp(UNITS[name][0], -exponent), math.ldexp(stated, -exponent))


def metres(mm: float) -> float:
    """The number that the kernel, which stores its unit in metres, turns into exactly ``mm`` (or the next to it)."""
    near = mm / 1000.0
    return min((near, math.nextafter(near, 0.0), math.nextafter(near, math.inf)), key=lambda m: abs(m * 1000.0 - mm))


def _factors(model: StepData_StepModel, text: bytes) -> list[float]:
    """Millimetres per unit of every unit context in the file, ascending, as the kernel itself computes them."""
    found = []
    for match in re.finditer(rb"#(\d+)\s*=\s*\([^;]*?\bGLOBAL_UNIT_ASSIGNED_CONTEXT\b", text):
        number = model.NextNumberForLabel(f"#{match[1].decode()}", 0, True)
        units = getattr(model.Value(number), "GlobalUnitAssignedContext", None) if number else None
        if units is not None:
            context = STEPConstruct_UnitContext()
            context.ComputeFactors(units(), StepData_Factors())
            if context.LengthDone():
                found.append(context.LengthFactor())
    return sorted(found)
