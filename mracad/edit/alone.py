"""Surfaces edited alone: each searched for once, several at a time where that takes long."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields
from typing import Any

import numpy as np

from mracad.bspline.surface import Net
from mracad.edit.attempt import attempt
from mracad.edit.congruent import Congruent
from mracad.edit.moved import Moved, closely
from mracad.edit.pose import Scene, beside_rims
from mracad.edit.target import Sheet, Wish
from mracad.edit.watch import Tried
from mracad.processes import Ahead

Array = np.ndarray

PRICE = 0.05
"""Share of the wanted change that doubling the control points of a surface must add to be worth it."""

MOST = 9.0, 2000
"""Largest factor by which the control points of a surface alone are multiplied, beyond a number that is small."""


class Alone:
    """The results of the surfaces of a scene alone; for a ``with`` statement."""

    def __init__(self, scene: Scene, wish: Wish) -> None:
        self._scene = scene
        self._congruent = Congruent(scene, wish)
        self._found = Ahead(lambda i: _told(_searched(scene, wish, i)))

    def __enter__(self) -> Alone:
        self._found.__enter__()
        return self

    def __exit__(self, *raised: Any) -> None:
        self._found.__exit__(*raised)

    def expect(self, surfaces: Iterable[int]) -> None:
        """Tell surfaces of which the results will probably be asked for, in their order."""
        self._found.expect(self._congruent.firsts(surfaces))

    def __call__(self, i: int) -> Moved:
        """The best result for a surface, which is asked for once; that of a congruent one if it was tried before."""
        moved = self._congruent.result(i) or _heard(self._scene.sheets[i], *self._found(i))
        self._congruent.keep(moved)
        return moved


def _searched(scene: Scene, wish: Wish, i: int) -> Moved:
    """The best result for a surface alone, with more control points beside its rims where they pay."""
    joined, sheet = scene.joints.among({i}), scene.sheets[i]
    plain = attempt(scene, wish, [i], joined)[i]
    if not plain.gaining:
        return plain
    count = _points(beside_rims(sheet, joined) if scene.refine else sheet.net)
    size = count / _points(sheet.net)
    least = plain.share + PRICE * (size - 1.0)
    if size == 1.0 or (size > MOST[0] and count > MOST[1]) or least >= 1.0:
        return plain
    finer = attempt(scene, wish, [i], joined, {i}, least)[i]
    if finer.share > least:
        return finer
    return plain if plain.amount else finer.undone()


def _points(net: Net) -> int:
    return net.u.count * net.v.count


def _told(moved: Moved) -> tuple[Net, Array, dict[str, Any]]:
    """A result as one process sends it to another that has the surface: without measurements."""
    others = {each.name: getattr(moved, each.name) for each in fields(moved) if each.name not in ("sheet", "tried")}
    return moved.net, moved.tried.parts[0], others


def _heard(sheet: Sheet, net: Net, part: Array, others: dict[str, Any]) -> Moved:
    return Moved(sheet, Tried(closely(sheet, net), [net], [part]), **others)
