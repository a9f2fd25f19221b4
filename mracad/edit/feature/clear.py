"""What copies that fill the ground keep clear of: its borders, and what is held.

A border is any edge over which a copy cannot go on smoothly: free edges, creases, edges to faces that stay, edges that
are held, and poles.  The ground falls into parts, which borders separate and smooth seams join.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from mracad.bspline.knots import KnotVector
from mracad.edit.feature.ground import Ground
from mracad.edit.feature.patch import Patch
from mracad.edit.feature.spread import NOWHERE, Spots
from mracad.model.brep import Face, Trim
from mracad.seam.interface import Joints
from mracad.seam.trace import EVENLY, trace_of
from mracad.seam.zones import Zoned
from mracad.spec.places import Zone
from mracad.wavelet.ladder import arc_lengths

Array = np.ndarray

MOST = 4000
"""Points on one edge, at most."""

PIECES = 8
"""Pieces of a span in which regions are looked for, at most."""


def smooth(joined: Joints) -> frozenset[int]:
    """Edges over which copies go on smoothly."""
    tangent = {edge for seam in joined.exact if seam.joint.order for edge in (seam.edge, seam.twin)}
    loose = {edge for seam in joined.loose if seam.order for edge in (seam.edge, seam.twin)}
    stays = {edge for seam in joined.loose if not seam.order for edge in (seam.edge, seam.twin)}
    return frozenset((tangent | loose | set(joined.closing)) - stays)


def parts(ground: Ground, joined: Joints) -> Array:
    """The part of the ground that each face of the model belongs to, ``(faces,)``: its least face, or -1."""
    leader = np.full(len(ground.model.faces), -1)
    chosen = sorted(ground.chosen)
    leader[chosen] = chosen
    met = list(_met(ground, joined))
    changed = True
    while changed:
        changed = False
        for faces in met:
            least = min(int(leader[f]) for f in faces)
            changed |= any(leader[f] != least for f in faces)
            leader[list(faces)] = least
    return leader


def _met(ground: Ground, joined: Joints) -> Iterator[set[int]]:
    """Faces on both sides of smooth seams."""
    over = smooth(joined)
    ends = [(seam.edge, seam.twin) for seam in joined.exact] + [(seam.edge, seam.twin) for seam in joined.loose]
    for edges in ends:
        if edges[0] in over:
            yield {side.face for edge in edges for side in ground.model.edges[edge].sides} & ground.chosen


def borders(ground: Ground, joined: Joints, of: Array, step: float) -> Spots:
    """Points on borders no more than about ``step`` (mm) apart, and in what is held; ``of`` is by face."""
    over = smooth(joined)
    found = []
    for patch in ground.patches.values():
        for face in patch.faces:
            rims = [trim for trim in face.trims if trim.edge not in over]
            found += [_spots(patch, face, of, _along(ground, patch, face, trim, step)) for trim in rims]
        held = _held(ground, patch, joined.zones, step)
        if len(held):
            owner = ground.faces(np.full(len(held), patch.index), held)
            found += [_spots(patch, face, of, held[owner == face.index]) for face in patch.faces]
    return NOWHERE.and_(*found)


def along(ground: Ground, of: Array, edge: int, step: float) -> Spots:
    """Points along an edge (its index), seen from all faces of the ground beside it."""
    sides = [(p, f, t) for p in ground.patches.values() for f in p.faces for t in f.trims if t.edge == edge]
    return NOWHERE.and_(*(_spots(p, f, of, _along(ground, p, f, trim, step)) for p, f, trim in sides))


def _spots(patch: Patch, face: Face, of: Array, uv: Array) -> Spots:
    points, _, _, normals = patch.evaluate(uv)
    poles = np.linalg.norm(normals, axis=1) < 0.5
    if poles.any():
        normals[poles] = np.nan_to_num(patch.signs(uv[poles])[:, None] * patch.net.normals(uv[poles]))
    surface, own, part = (np.full(len(uv), x) for x in (patch.index, face.index, of[face.index]))
    return Spots(surface, own, part, uv, points, normals)


def _along(ground: Ground, patch: Patch, face: Face, trim: Trim, step: float) -> Array:
    """Parameters of points along a border."""
    trace = trace_of(ground.model, face, trim)
    points = np.asarray(patch.net.evaluate(trace.evenly))
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    pieces = np.maximum(np.ceil(steps * min(1 / step, MOST / max(steps.sum(), 1e-300))).astype(int), 1)
    share = [low + (high - low) * np.arange(n) / n for (low, high), n in zip(pairwise(EVENLY), pieces, strict=True)]
    return trace.places(np.append(np.concatenate(share), 1.0))


def _held(ground: Ground, patch: Patch, zones: tuple[Zone, ...], step: float) -> Array:
    """Parameters of points in regions that nothing may move."""
    if not zones:
        return np.empty((0, 2))
    surface = ground.model.surfaces[patch.index]
    middles = (
        np.interp(_shares(k, arc_lengths(patch.net, axis).max() / step), np.arange(k.spans + 1), k.breaks)
        for axis, k in enumerate(patch.knots)
    )
    fine = surface.net.refined(*(np.setdiff1d(x, k.breaks) for x, k in zip(middles, patch.knots, strict=True)))
    return Zoned.of(fine, [ground.model.faces[i] for i in surface.faces], zones).within


def _shares(knots: KnotVector, pieces: float) -> Array:
    """Places of equal parts of spans, in spans."""
    count = int(np.clip(np.ceil(pieces), 1, PIECES))
    return np.arange(knots.spans * count + 1) / count
