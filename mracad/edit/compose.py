"""Composing: the details of a model put on its coarse shape, which may have been edited elsewhere.

On the coarse surfaces from which they were taken, details are added as they are, which gives the input.  On others they
are carried by the frames of the surfaces (:mod:`mracad.edit.carry`); the solver then finds the nearest admissible
displacement, because frames on the two sides of a seam differ a little.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from msgspec import structs

from mracad.bspline.surface import Net
from mracad.edit.carry import SAME, Piece, Way
from mracad.edit.detailed import Detailed, detailed
from mracad.edit.details import Detail, Details
from mracad.edit.mra import load
from mracad.edit.result import Edit
from mracad.errors import EditError
from mracad.model.brep import Model, Surface
from mracad.spec.select import Scope
from mracad.spec.select import scope as scope_of
from mracad.spec.steps import Compose

Array = np.ndarray

PLAIN = "coupled", "as-is", 1.0
"""Edges, continuity and amount with which details are simply put back."""

PLACES = 3
"""Number of points along u and along v by which surfaces are distinguished."""

ELSEWHERE = 100.0
"""Surfaces count as renumbered if others fit better by this factor, in squared distances."""


def compose(
    model: Model,
    options: Compose,
    *,
    scope: Scope | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Edit:
    """Put details on the NURBS faces of a model; parameters and errors as for :func:`mracad.edit.whole.edited`.

    Raises
    ------
    FileError
        For a file that is not one of details.
    EditError
        If no details belong to a face of the model.
    """
    scope = scope or scope_of(model, options)
    details = load(options.details)
    pieces = matched(model, details)
    if not pieces and details.surfaces:
        message = f"{model.name}: no face fits the details in {options.details}"
        raise EditError(message, f"give the model that was made with them of {details.model}")
    bare = {i for surface in model.surfaces if surface.index not in pieces for i in surface.faces}
    refine = options.refine == "auto"
    same = all(piece.belongs(model.surfaces[i].net) for i, piece in pieces.items())
    if same:
        options = structs.replace(options, refine="never")  # nothing needs more knots
    restored = same and _whole(model, options, scope, pieces)
    wish = Detailed(pieces, refine, restored)
    edit = detailed(model, options, wish, scope, progress, bare)
    return replace(edit, notes=_notes(model, edit, wish, len(details.surfaces)))


def _whole(model: Model, options: Compose, scope: Scope, pieces: Mapping[int, Piece]) -> bool:
    """Whether all details are put back, with nothing held."""
    faces = {face for i in pieces for face in model.surfaces[i].faces}
    held = scope.held or scope.edges or scope.zones or options.max_deviation is not None
    return faces <= scope.chosen and not held and (options.edges, options.keep, options.amount) == PLAIN


def _notes(model: Model, edit: Edit, wish: Detailed, count: int) -> tuple[str, ...]:
    """How details were placed on the surfaces that changed, and how many have no face."""
    changed = edit.displacement.offsets.items()
    ways = Counter(wish.way(i, offset.over(model.surfaces[i].net)) for i, offset in changed)
    said: dict[Way, str] = {
        "added": "added as they were",
        "carried": "carried by a surface that has changed",
        "projected": "projected on other knots",
    }
    parts = [f"{ways[way]} {words}" for way, words in said.items() if ways[way]]
    lost = count - len(wish.pieces)
    parts += [f"{lost} without a face here"] if lost > 0 else []
    return (f"details of {count} surface{'s' * (count != 1)}: {', '.join(parts)}",) if parts else ()


def matched(model: Model, details: Details) -> dict[int, Piece]:
    """The details of each surface of a model, by index: first those in their old place; then those with the same faces
    and as many control points, if these were not renumbered; then the nearest."""
    surfaces, every = model.surfaces, details.surfaces
    if not (surfaces and every):
        return {}
    own, there = _places([each.net for each in surfaces]), _places([each.net for each in every])
    apart = ((own[:, None] - there[None]) ** 2).mean(axis=2)
    size = max(float(np.ptp(each.net.poles, axis=(0, 1)).max()) for each in every)
    found: dict[int, int] = {}
    for i, near in enumerate(apart <= (SAME * size) ** 2):
        here = np.flatnonzero(near).tolist()  # copies of a part are in one place
        if here:
            taken = set(found.values())
            found[i] = min(here, key=lambda k: (every[k].faces != surfaces[i].faces, k in taken))
    rest = [i for i in range(len(surfaces)) if i not in found]
    others = [k for k in range(len(every)) if k not in found.values()]
    found |= _assigned(surfaces, every, rest, others, apart)
    return {i: _piece(every[k]).placed(surfaces[i].net) for i, k in found.items()}


def _assigned(
    surfaces: Sequence[Surface], every: Sequence[Detail], rest: Sequence[int], others: Sequence[int], apart: Array
) -> dict[int, int]:
    """Details for surfaces that are not in their old place."""
    from scipy.optimize import linear_sum_assignment

    if not (rest and others):
        return {}
    unlike = np.array([[_shape(surfaces[i].net) != _shape(every[k].net) for k in others] for i in rest])
    cost = apart[np.ix_(rest, others)]
    rows, columns = linear_sum_assignment(cost + unlike * (cost.sum() + 1.0))
    nearest = {rest[i]: others[k] for i, k in zip(rows, columns, strict=True)}
    home = {surfaces[i].faces: i for i in rest}
    same = {home[every[k].faces]: k for k in others if every[k].faces in home}
    alike = len(same) == len(others) and all(_shape(surfaces[i].net) == _shape(every[k].net) for i, k in same.items())
    far, near = (sum(apart[i, k] for i, k in each.items()) for each in (same, nearest))
    return same if alike and far <= ELSEWHERE * near else nearest


def _shape(net: Net) -> tuple[int, ...]:
    return net.u.degree, net.v.degree, net.u.count, net.v.count


def _places(nets: Sequence[Net]) -> Array:
    """Points of each surface, ``(surfaces, coordinates)``."""
    share = np.linspace(0.0, 1.0, PLACES)
    at = [[k.domain[0] + share * k.period for k in (net.u, net.v)] for net in nets]
    return np.array([net.grid(u, v).ravel() for net, (u, v) in zip(nets, at, strict=True)])


def _piece(detail: Detail) -> Piece:
    return Piece(detail.net, detail.motion, detail.wavelength)
