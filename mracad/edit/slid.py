"""Edges that slid: brought back onto curved neighbours, and checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from mracad.bspline.surface import Net
from mracad.bspline.vectors import between
from mracad.edit.driver import groups
from mracad.edit.moved import Moved, Result
from mracad.edit.pose import Scene, pose
from mracad.edit.target import stiffness
from mracad.edit.watch import displaced
from mracad.model.brep import Model
from mracad.seam.cause import Cause, Still
from mracad.seam.guide import Slide
from mracad.seam.trace import LOOKS, crossings
from mracad.spec.select import NURBS

Array = np.ndarray

STEPS = 2
"""Newton steps."""

LEFT = 0.4
"""Share of an edge by which one of its ends may move along it."""

MORE = 1e-3
"""Share by which the gap of an edge to its neighbour may grow, if it was already more than allowed."""


def settled(scene: Scene, result: Result) -> tuple[Result, set[int]]:
    """A result with its edges that slid on their neighbours, and the edges for which that fails.

    Parameters
    ----------
    scene : Scene
        The model, and all surfaces that were considered.
    result : Result
    """
    moved = {i: each for i, each in result.moved.items() if each.amount}
    for group in groups(moved, result.joints):
        if any(slide.curved for slide in result.joints.slides if slide.trace.surface in group):
            moved |= _steps(scene, {i: moved[i] for i in group}, result)
    failed = {
        slide.edge
        for slide in result.joints.slides
        if slide.trace.surface in moved and not _holds(scene, slide, moved[slide.trace.surface])
    }
    return replace(result, moved={**result.moved, **moved}), failed


def _steps(scene: Scene, moved: Mapping[int, Moved], result: Result) -> dict[int, Moved]:
    """Surfaces after Newton steps that bring their edges back onto what they slide along."""
    members = {i: scene.sheets[i] for i in moved}
    width = max(sheet.wavelength for sheet in members.values())
    detail = max(sheet.detail for sheet in members.values())
    finer = [i for i, each in moved.items() if each.finer]
    found = pose(scene, members, result.joints.among(members), width, detail, finer=finer)
    nets = {i: space.net for i, space in found.problem.spaces.items()}
    if found.led is None or any((nets[i].u, nets[i].v) != (m.net.u, m.net.v) for i, m in moved.items()):
        return dict(moved)
    delta = np.concatenate([moved[i].offset.reshape(-1, 3) for i in nets])
    for _ in range(STEPS):
        ways, off = found.led.aims(scene.model, _displaced(nets, found.problem.split(delta)), nets)
        delta = found.problem.aimed(delta, stiffness(width), ways, off)
    return {i: moved[i].shifted(part) for i, part in found.problem.split(delta).items()}


def _displaced(nets: Mapping[int, Net], parts: Mapping[int, Array]) -> dict[int, Net]:
    return {i: displaced(net, parts[i]) for i, net in nets.items()}


def _holds(scene: Scene, slide: Slide, moved: Moved) -> bool:
    """Whether an edge lies on its neighbour as closely as required, the face did not fold there, and the ends of the
    edge stay on the edges along which they move."""
    now = displaced(moved.net, moved.offset)
    share = np.unique(np.concatenate([LOOKS, *_between(crossings(slide.trace, (now.u, now.v))), [0.0, 1.0]]))
    before, after = (slide.off(scene.model, net, share).max() for net in (moved.net, now))
    if not after <= max(scene.tolerances.gap, before * (1 + MORE)):
        return False
    places = slide.trace.places(share)
    one, other = (net.normals(places, slide.trace.limits) for net in (moved.net, now))
    if not np.degrees(between(one, other)).max() <= scene.tolerances.growth.fold:
        return False
    motion = moved.net.with_poles(moved.offset)
    for pin in slide.pins:
        far = float(np.linalg.norm(motion.evaluate(pin.uv[None])))
        if pin.path is not None and far > LEFT * pin.path.length:
            return False
    return True


def _between(breaks: Array) -> list[Array]:
    """Places in every piece between two breaks, as arrays."""
    return [breaks[:-1] + part * np.diff(breaks) for part in (0.2, 0.5, 0.8)]


def cannot_slide(model: Model, edge: int) -> Cause:
    """Why an edge that could not slide stays."""
    kinds = [model.faces[side.face].kind for side in model.edges[edge].sides]
    return Cause(Still.UNSLID, next((kind for kind in kinds if kind not in NURBS), kinds[0]))
