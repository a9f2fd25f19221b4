"""Checks of whole documents, layer by layer: measured by the kernel, judged on plain data."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, field
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from mracad.errors import CrashError, FileError
from mracad.formats import by_content
from mracad.inspect import check as layers
from mracad.inspect.approach import crossing_faces
from mracad.inspect.check import SeamLimits
from mracad.inspect.seams import seams
from mracad.inspect.verdict import Finding, Layer, Verdict
from mracad.job import guard
from mracad.job.judge import Judged, Original
from mracad.model.facts import Triangles, Validity
from mracad.spec.quantity import length
from mracad.spec.steps import Check

if TYPE_CHECKING:
    from mracad.inspect.seams import SeamMeasure
    from mracad.model.brep import Model
    from mracad.model.facts import Stated
    from mracad.occ.document import Document


def check(document: Document, options: Check, original: Original | None = None, *, text: bytes | None = None) -> Judged:
    """Check a document.

    Parameters
    ----------
    document : Document
    options : Check
    original : callable, optional
        Not used; steps that judge are all called with it.
    text : bytes, optional
        Content of the file that the document was read from: then every layer is checked.  Without it the file itself is
        not judged, and slow layers are checked only if ``options.fail_on`` names them.
    """
    expected, freeform = expectation(options.expect) if options.expect else (None, False)

    from mracad.occ.view import view

    model = view(document)
    gap, tolerance, wall = (
        None if given is None else length(given, model.diagonal, name)
        for given, name in (
            (options.max_gap, "max-gap"),
            (options.max_tolerance, "max-tolerance"),
            (options.min_wall, "min-wall"),
        )
    )
    along = SeamLimits(options.kink, gap, options.max_angle, expected, freeform)
    limits = CheckLimits(along, tolerance, wall, options.layer_limit)
    slow = SLOW if text is not None else SLOW.intersection(options.fail_on)
    verdict = _layered(text, document, model, limits, slow)
    failed = tuple(failing(verdict, options.fail_on))
    return Judged(verdict.noting(failed), failed)


def expectation(text: str) -> tuple[int, bool]:
    """How many seams should be smooth, and whether only those of NURBS faces count.

    Parameters
    ----------
    text : str
        The number, or the path of a report.  That of a check counts all seams, that of an edit only those of NURBS
        faces.

    Raises
    ------
    FileError
        When the report cannot be read, or does not mention seams.
    """
    if text.isdecimal():
        return int(text), False
    hint = "name a JSON report that mracad check or an edit wrote, or give the number of smooth seams"
    try:
        found = _smooth(json.loads(Path(text).read_bytes()))
    except (OSError, ValueError) as error:
        raise FileError(f"cannot read the report '{text}': {error}", hint) from error
    if found is None:
        raise FileError(f"the report '{text}' does not mention seams", hint)
    return found


def _smooth(report: object) -> tuple[int, bool] | None:
    """What :func:`expectation` finds in a report; for several steps, in that of the last one that has it."""
    match report:
        case {"layers": [*layers]}:
            counts = [x["figures"]["smooth"] for x in layers if x["name"] == "seams"]
            return (counts[0], False) if counts else None
        case {"seams": {"each": [*each]}}:
            return sum(seam.get("after", seam)["smooth"] for seam in each), True
        case {"steps": [*steps]}:
            return next(filter(None, map(_smooth, reversed(steps))), None)
    return None


_DECISIVE = ("load", "brep", "shells")  # what makes a model invalid
_CHORD = 2e-4  # of the diagonal: distance of meshes from surfaces
_BEYOND = {"gap", "angle", "smooth-seams", "edge-tolerance", "vertex-tolerance", "thin-wall"}  # against given limits


@dataclass(frozen=True)
class CheckLimits:
    """What a check allows; None for no limit.  Lengths are millimetres, angles degrees.

    Attributes
    ----------
    seams : SeamLimits
    tolerance : float or None
        Largest tolerance of edges and vertices.
    wall : float or None
        Least thickness of walls; they are not measured when None.
    layer_seconds : float or None
        Time limit of each layer.
    """

    seams: layers.SeamLimits = field(default_factory=layers.SeamLimits)
    tolerance: float | None = None
    wall: float | None = None
    layer_seconds: float | None = None


Made = TypeVar("Made")
SLOW = frozenset({"self-intersection", "mesh"})
"""Slow layers."""


def _layered(
    text: bytes | None, document: Document, model: Model, allowed: CheckLimits, slow: Collection[str]
) -> Verdict:
    """Every layer; the slow ones only if they are in ``slow``."""
    from mracad.occ.check import check as kernel_check
    from mracad.occ.check import looks
    from mracad.occ.stated import stated, unloaded
    from mracad.occ.triangles import facets

    name = document.name
    is_step = text is not None and by_content(text, name).name == "step"
    file = stated(text, name) if text is not None and is_step else None
    why = "not written yet" if text is None else "only STEP files are looked at as parsed"
    measures = seams(model, every=True)
    flipped = layers.turned(file.uses) if file else set()
    told = _matched(file, document, model.diagonal) if file else {}
    known = {told[face] for face in flipped if face in told}
    senses = file.senses if file else ()
    inward = {face for place, face in told.items() if senses[place] == model.faces[face].reversed} - known
    unseen = "" if known or not flipped else f"; {len(flipped)} faces of the file were turned round"
    validity = limited("brep", lambda: kernel_check(document), allowed, returns=Validity)
    brep = validity if isinstance(validity, Layer) else layers.brep(validity, inward)
    validity = kernel_check(document, faces=()) if isinstance(validity, Layer) else validity
    chord = _CHORD * model.diagonal
    mesh = cache(partial(facets, document, chord))
    open_faces = {edge.sides[0].face for edge in model.edges if edge.free}
    found = [
        _file(file, document) if file else Layer("file", "skipped", why),
        _load(len(model.faces), file.faces, unseen, lambda: unloaded(text or b"", name))
        if file
        else Layer("load", "skipped", why),
        brep,
        layers.shells(model, validity, known | layers.turned(looks(document))),
        layers.seams(model, measures, allowed.seams),
        limited("self-intersection", lambda: _crossed(document, model, mesh, measures), allowed, slow),
        layers.tolerances(model, validity, allowed.tolerance),
        limited("walls", lambda: _walls(document, allowed.wall), allowed),
        limited("mesh", lambda: layers.mesh(mesh(), open_faces), allowed, slow),
    ]
    return Verdict(name, tuple(found), _valid(found, validity.solids))


def _matched(file: Stated, document: Document, diagonal: float) -> dict[int, int]:
    """For each face of the file, its index in the document, matched by vertices."""
    from scipy.spatial import cKDTree

    from mracad.occ.check import centres

    old, new = np.array(file.centres) * document.units.mm, np.array(centres(document))
    near = 1e-6 * diagonal
    if not len(old):
        return {}
    old, new = (np.where(np.isfinite(points), points, 1e30) for points in (old, new))
    there, back = cKDTree(new).query_ball_point(old, near), cKDTree(old).query_ball_point(new, near)
    return {i: found[0] for i, found in enumerate(there) if len(found) == 1 and len(back[found[0]]) == 1}


def failing(verdict: Verdict, rules: Iterable[str]) -> list[Layer]:
    """The layers for which a check fails, by the rules that were asked for; limits always count."""
    wanted = set(rules)
    chosen = []
    for layer in verdict.layers:
        kinds = {finding.rule for finding in layer.findings}
        asked = layer.name in wanted and layer.status == "fail"
        asked |= ("free-edges" in wanted and "free-edge" in kinds) or ("unsewn" in wanted and "unsewn" in kinds)
        asked |= "invalid" in wanted and verdict.valid is False and layer.status == "fail" and layer.name in _DECISIVE
        asked |= "unknown" in wanted and verdict.valid is None and layer.name == "brep"
        if asked or kinds & _BEYOND:
            chosen.append(layer)
    return chosen


def _valid(found: list[Layer], solids: int) -> bool | None:
    by_name = {layer.name: layer for layer in found}
    shells = by_name["shells"]
    flipped = any(finding.rule == "flipped-face" for finding in shells.findings)
    if by_name["load"].status == "fail" or by_name["brep"].status == "fail" or flipped:
        return False
    if solids and shells.figures["open_shells"] == shells.figures["shells"]:
        return False
    return None if by_name["brep"].status != "pass" else True


def _file(file: Stated, document: Document) -> Layer:
    return Layer(
        "file",
        "fail" if file.broken else "pass",
        f"{document.schema or 'unknown schema'}, unit {document.unit}, {file.entities} entities",
        tuple(Finding("entity", figures={"says": line}) for line in file.broken),
        {"entities": file.entities, "schema": document.schema, "unit": document.unit},
    )


def limited(
    name: str,
    make: Callable[[], Made],
    limits: CheckLimits,
    slow: Collection[str] | None = None,
    returns: type = Layer,
) -> Made | Layer:
    """What is made for a layer, in a child process if it has a time limit, so that a crash is contained; a layer that
    says so if there is nothing, or it is not in ``slow``."""
    if slow is not None and name not in slow:
        return Layer(name, "skipped", "not asked for")
    if limits.layer_seconds is None:
        return make()
    try:
        return guard.run(make, returns, limits.layer_seconds)
    except guard.TimeLimitError:
        return Layer(name, "time limit", f"more than {limits.layer_seconds:g} s")
    except CrashError as error:
        return Layer(name, "skipped", error.message)


def _load(faces: int, stated: int, unseen: str, unloaded: Callable[[], list[str]]) -> Layer:
    text = f"{faces} faces of {stated}{unseen}"
    lost: tuple[Finding, ...] = ()
    if faces < stated:
        lost = tuple(Finding("lost-faces", figures={"says": line}) for line in unloaded())
        lost = lost or (Finding("lost-faces", figures={"count": stated - faces}),)
    return Layer("load", "fail" if lost else "pass", text, lost, {"faces": faces, "stated": stated})


def _crossed(document: Document, model: Model, meshed: Callable[[], Triangles], measures: list[SeamMeasure]) -> Layer:
    """Faces that cross, on a mesh and again on a finer one: crossings on the coarser one alone are its own error."""
    from mracad.occ.triangles import facets

    touching = {tuple(sorted(m.faces)) for m in measures if not m.sewn}
    chord = _CHORD * model.diagonal
    first = crossing_faces(meshed(), model, chord)
    first = {faces: where for faces, where in first.items() if faces not in touching}
    if first:
        fine = facets(document, chord / 2, {face for pair in first for face in pair})
        again = crossing_faces(fine, model, chord / 2)
        first = {faces: where for faces, where in first.items() if faces in again}
    findings = [Finding("crossing", faces, where=where) for faces, where in sorted(first.items())]
    text = f"{len(findings)} crossings" if findings else "none found"
    return Layer("self-intersection", "fail" if findings else "pass", text, tuple(findings))


def _walls(document: Document, least: float | None) -> Layer:
    """The thinnest wall of the solids."""
    from mracad.occ.measure import KernelGauge
    from mracad.occ.topology import has_solids

    if least is None:
        return Layer("walls", "skipped", "no least thickness was given")
    parts = [part for part in document.parts if has_solids(part.shape)]
    gauge = KernelGauge(document)
    found = [(index, *gauge.thinnest(index, part)) for part in parts for index in part.numbers]
    if not found:
        return Layer("walls", "skipped", "no solids")
    findings = tuple(
        Finding("thin-wall", (index,), where=where, figures={"thickness": thickness})
        for index, thickness, where in found
        if thickness < least
    )
    thinnest = min(thickness for _, thickness, _ in found)
    return Layer("walls", "fail" if findings else "pass", f"thinnest {thinnest:.4g} mm", findings, {"least": thinnest})
