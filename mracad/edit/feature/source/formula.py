"""Formulas of x and y: parsed to a tree, of which only known operations, names and functions are computed."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Mapping

import numpy as np

from mracad.edit.feature.detail import taper
from mracad.edit.feature.source.relief import Relief
from mracad.errors import UsageError
from mracad.spec.sources import Formula

Array = np.ndarray

CELLS = 769
"""Cells across the window; their number is odd, so that one is in its middle."""

LONGEST = 1000
"""Longest formula, in characters."""

_BINARY: Mapping[type[ast.operator], Callable[[Array, Array], Array]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
}
_UNARY: Mapping[type[ast.unaryop], Callable[[Array], Array]] = {ast.UAdd: operator.pos, ast.USub: operator.neg}

_ONE = ["sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "floor", "ceil", "sign"]
FUNCTIONS: Mapping[str, tuple[int, Callable[..., Array]]] = {
    **{name: (1, getattr(np, name)) for name in _ONE},
    "abs": (1, np.abs),
    "asin": (1, np.arcsin),
    "acos": (1, np.arccos),
    "atan": (1, np.arctan),
    "atan2": (2, np.arctan2),
    "hypot": (2, np.hypot),
    "min": (2, np.minimum),
    "max": (2, np.maximum),
}
"""The functions of formulas, with the number of their arguments."""


def relief(given: Formula, width: float | None) -> Relief:
    """The relief of a formula, which fades out over ``width`` (mm; by default a quarter of its radius) beyond it.

    Raises
    ------
    UsageError
        For a text that is no formula, or one without a value somewhere.
    """
    width = given.radius / 4 if width is None else width
    side = given.radius + width
    at = side * (2 * (np.arange(CELLS) + 0.5) / CELLS - 1)
    x, y = np.meshgrid(at, at, indexing="ij")
    window = taper((np.hypot(x, y) - given.radius) / max(width, 1e-9))
    with np.errstate(all="ignore"):
        heights = np.broadcast_to(evaluated(given.text, x, y), x.shape)
    bad = np.argwhere(~_high(heights) & (window > 0))
    if len(bad):
        raise _nowhere(given.text, at[bad], side)
    return Relief(np.where(window > 0, heights, 0.0) * window, 2 * side / CELLS, window, disc=side)


def _high(heights: Array) -> Array:
    """Which numbers are heights."""
    return np.asarray(np.abs(heights) < 1e6)


def _nowhere(text: str, places: Array, side: float) -> UsageError:
    """The error for a formula without heights at some places ``(q, 2)``; names that nearest to the middle."""
    away = np.hypot(*places.T)
    place = places[np.argmin(away)]
    with np.errstate(all="ignore"):
        for digits in range(4, 18):
            shown = [f"{number:.{digits}g}" for number in place]
            if not _high(evaluated(text, *np.array(shown, float)[:, None])).all():
                break
    hint = f"give one that has a height everywhere up to {side:.4g} mm from the middle, where its taper ends"
    if away.min() > side / 20:
        hint += ", or a smaller radius"
    return UsageError(f"formula: {text!r} has no height at x = {shown[0]}, y = {shown[1]} mm", hint)


def evaluated(text: str, x: Array, y: Array) -> Array:
    """The values of a formula; raises UsageError with the place of an error."""
    hint = f"use x, y, pi, e, + - * / % **, {', '.join(FUNCTIONS)}"
    if len(text) > LONGEST:
        raise UsageError(f"formula: it is longer than {LONGEST} characters", "write a shorter one")
    try:
        tree = ast.parse(text, mode="eval").body
        return _value(tree, {"x": x, "y": y, "pi": np.array(np.pi), "e": np.array(np.e)})
    except _Unknown as error:
        place = error.node.col_offset + 1
        raise UsageError(f"formula: {text!r}, character {place}: {error.why}", hint) from error
    except SyntaxError as error:
        place = error.offset or 1
        raise UsageError(f"formula: {text!r}, character {place}: not a formula", hint) from error
    except (RecursionError, MemoryError, ValueError) as error:
        raise UsageError(f"formula: {text[:40]!r}… is not a formula", hint) from error


class _Unknown(Exception):
    """Something in a formula that it must not contain."""

    def __init__(self, node: ast.expr, why: str) -> None:
        self.node, self.why = node, why


def _value(node: ast.expr, names: Mapping[str, Array]) -> Array:
    """The value of a tree of known parts."""
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            return np.asarray(_number(node, value))
        case ast.Name(id=name) if name in names:
            return names[name]
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
            return _BINARY[type(op)](_value(left, names), _value(right, names))
        case ast.BinOp(op=ast.BitXor()):
            raise _Unknown(node, "powers are written with **, not ^")
        case ast.UnaryOp(op=sign, operand=operand) if type(sign) in _UNARY:
            return _UNARY[type(sign)](_value(operand, names))
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if name in FUNCTIONS:
            count, function = FUNCTIONS[name]
            if len(args) != count:
                raise _Unknown(node, f"{name} takes {count} argument{'s' if count > 1 else ''}")
            return function(*(_value(arg, names) for arg in args))
    shown = ast.unparse(node)
    raise _Unknown(node, f"{shown if len(shown) < 30 else shown[:27] + '…'} is not known")


def _number(node: ast.expr, value: float) -> float:
    try:
        return float(value)
    except OverflowError as error:
        raise _Unknown(node, "the number is too large") from error
