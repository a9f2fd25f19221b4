"""Verdicts on whole documents: measured by the kernel, judged on plain data."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mracad import guard
from mracad.audit import check as layers
from mracad.audit import compare as audit
from mracad.audit.continuity import key, seams, summary
from mracad.audit.crossing import crossings
from mracad.audit.verdict import Finding, Layer, Verdict
from mracad.errors import Code, MracadError
from mracad.formats import by_content

if TYPE_CHECKING:
    from mracad.audit.continuity import SeamMeasure, SeamSummary
    from mracad.occ.document import Document
    from mracad.occ.stated import Stated


def compare(ref: Document, new: Document, limits: audit.Limits | None = None, ignore: Iterable[str] = ()) -> Verdict:
    """Judge a new version of a document by a reference.

    Parameters
    ----------
    ref, new : Document
    limits : Limits, optional
        What may differ; by default faces may deviate by a millionth of a millimetre.
    ignore : iterable of str
        Names of layers (see :data:`mracad.audit.compare.LAYERS`) that are left out.
    """
    return audit.compare(_measured(ref), _measured(new), limits or audit.Limits(1e-6), ignore)


def diagonal(document: Document) -> float:
    """Diagonal of the bounding box of a document, mm."""
    from mracad.occ.view import view

    return view(document).diagonal


def _measured(document: Document) -> audit.Subject:
    from mracad.occ.check import check
    from mracad.occ.contents import contents
    from mracad.occ.measure import Gauge, face_masses, mass
    from mracad.occ.view import view

    return audit.Subject(
        model=view(document),
        contents=contents(document),
        mass=mass(document),
        faces=face_masses(document),
        validity=check(document),
        gauge=Gauge(document),
    )


_DECISIVE = ("load", "brep", "shells")  # what makes a model invalid
_BEYOND = {"gap", "angle", "edge-tolerance", "vertex-tolerance", "thin-wall"}  # findings against limits that were given


@dataclass(frozen=True)
class CheckLimits:
    """What a check allows; None for no limit.  Lengths are millimetres, angles degrees.

    Attributes
    ----------
    gap, angle : float or None
        Along seams; angles only of those below ``kink``, which are meant to be smooth.
    tolerance : float or None
        Of edges and vertices.
    wall : float or None
        Least thickness; not measured when None.
    layer_seconds : float or None
        Time for each layer.
    """

    gap: float | None = None
    angle: float | None = None
    kink: float = 1.0
    tolerance: float | None = None
    wall: float | None = None
    layer_seconds: float | None = None


SLOW = frozenset({"self-intersection", "mesh"})
"""Layers that take long."""


def check(
    text: bytes | None, name: str, document: Document, limits: CheckLimits, slow: Collection[str] = SLOW
) -> Verdict:
    """Check a document, layer by layer.

    Parameters
    ----------
    text : bytes or None
        The file that it was read from; None for a document that has changed since.
    name : str
        Its name.
    document : Document
    limits : CheckLimits
    slow : collection of str
        Those of :data:`SLOW` to be looked at.
    """
    from mracad.occ.check import check as kernel_check
    from mracad.occ.check import looks
    from mracad.occ.stated import stated, unloaded
    from mracad.occ.triangles import triangles
    from mracad.occ.view import view

    model = view(document)
    is_step = text is not None and by_content(text, name).name == "step"
    file = stated(text, name) if text is not None and is_step else None
    why = "not written yet" if text is None else "only STEP files are looked at as parsed"
    measures = seams(model, every=True)
    flipped = layers.turned(file.uses) if file else set()
    told = _told(file, document) if file else {}
    known = {told[face] for face in flipped if face in told}
    senses = file.senses if file else ()
    inward = {face for place, face in told.items() if senses[place] == model.faces[face].reversed} - known
    unseen = "" if known or not flipped else f"; {len(flipped)} faces of the file were turned round"
    brep = _limited("brep", lambda: layers.brep(kernel_check(document), inward), limits)
    validity = kernel_check(document, faces=None if brep.status in ("pass", "fail") else ())
    open_faces = {edge.sides[0].face for edge in model.edges if edge.free}
    totals = summary(measures, frozenset(key(m) for m in measures if m.angle < limits.kink))
    found = [
        _file(file, document) if file else Layer("file", "skipped", why),
        _load(len(model.faces), file.faces, unseen, lambda: unloaded(text or b"", name))
        if file
        else Layer("load", "skipped", why),
        brep,
        layers.shells(model, validity, known | layers.turned(looks(document))),
        layers.seams(measures, limits.kink, limits.gap, limits.angle, _seam_text(totals)),
        _limited("self-intersection", lambda: _crossed(document, measures), limits, slow),
        layers.tolerances(model, validity, limits.tolerance),
        _limited("walls", lambda: _walls(document, limits.wall), limits),
        _limited("mesh", lambda: layers.mesh(triangles(document), open_faces), limits, slow),
    ]
    return Verdict(name, tuple(found), _valid(found, validity.solids))


def _told(file: Stated, document: Document) -> dict[int, int]:
    """Which face of the document each one in the file is, as far as its vertices tell."""
    from scipy.spatial import cKDTree

    from mracad.occ.check import centres

    old, new = np.array(file.centres) * document.units.mm, np.array(centres(document))
    near = 1e-6 * diagonal(document)
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
        tuple(Finding(line, "entity") for line in file.broken),
        {"entities": file.entities, "schema": document.schema, "unit": document.unit},
    )


def _limited(name: str, make: Callable[[], Layer], limits: CheckLimits, slow: Collection[str] | None = None) -> Layer:
    """A layer that may take only so long, and whose crash is not the end; skipped when it is not in ``slow``."""
    if slow is not None and name not in slow:
        return Layer(name, "skipped", "not asked for")
    if limits.layer_seconds is None:
        return make()
    try:
        return guard.run(make, Layer, limits.layer_seconds)
    except MracadError as error:
        if error.code == Code.LIMIT:
            return Layer(name, "time limit", f"more than {limits.layer_seconds:g} s")
        return Layer(name, "skipped", error.message)


def _load(faces: int, stated: int, unseen: str, unloaded: Callable[[], list[str]]) -> Layer:
    text = f"{faces} faces of {stated}{unseen}"
    lost: tuple[Finding, ...] = ()
    if faces < stated:
        lost = tuple(Finding(f"face not loaded: {line}", "lost-faces") for line in unloaded())
        lost = lost or (Finding(f"{stated - faces} faces could not be loaded", "lost-faces"),)
    return Layer("load", "fail" if lost else "pass", text, lost, {"faces": faces, "stated": stated})


def _seam_text(totals: SeamSummary) -> str:
    text = f"{totals.smooth} smooth of {totals.seams}, angle ≤ {totals.angle:.2g}°, gap ≤ {totals.gap:.3g} mm"
    return text + (f", {totals.unsewn} not sewn" if totals.unsewn else "")


def _crossed(document: Document, measures: list[SeamMeasure]) -> Layer:
    """Faces that cross, on a mesh and again on a finer one: what the coarser alone shows is its own error."""
    from mracad.occ.triangles import triangles

    touching = {frozenset(m.faces) for m in measures if not m.sewn}

    def crossing(chord: float | None) -> dict[tuple[int, int], tuple[float, float, float]]:
        mesh = triangles(document, chord)
        pairs, places = crossings(mesh.points, mesh.corners, mesh.parts)
        found: dict[tuple[int, int], tuple[float, float, float]] = {}
        for (a, b), (x, y, z) in zip(np.sort(mesh.faces[pairs], axis=1).tolist(), places.tolist(), strict=True):
            if frozenset((a, b)) not in touching:
                found.setdefault((a, b), (x, y, z))
        return found

    first = crossing(None)
    if first:
        again = crossing(1e-4 * diagonal(document))
        first = {faces: where for faces, where in first.items() if faces in again}
    findings = [
        Finding(f"#{a + 1} crosses itself" if a == b else f"#{a + 1} and #{b + 1} cross", "crossing", (a, b), where=w)
        for (a, b), w in sorted(first.items())
    ]
    text = f"{len(findings)} crossings" if findings else "none found"
    return Layer("self-intersection", "fail" if findings else "pass", text, tuple(findings))


def _walls(document: Document, least: float | None) -> Layer:
    """The thinnest wall of the solids."""
    from mracad.occ.measure import Gauge
    from mracad.occ.topology import has_solids

    if least is None:
        return Layer("walls", "skipped", "no least thickness was given")
    parts = [part for part in document.parts if has_solids(part.shape)]
    gauge = Gauge(document)
    found = [
        (index, *gauge.thinnest(index, part))
        for part in parts
        for index in range(part.first, part.first + part.faces.Extent())
    ]
    if not found:
        return Layer("walls", "skipped", "no solids")
    findings = tuple(
        Finding(f"wall of {thickness:.4g} mm at #{index + 1}", "thin-wall", (index,), where=where)
        for index, thickness, where in found
        if thickness < least
    )
    thinnest = min(thickness for _, thickness, _ in found)
    return Layer("walls", "fail" if findings else "pass", f"thinnest {thinnest:.4g} mm", findings, {"least": thinnest})
