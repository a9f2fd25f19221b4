"""Evidence in words: the one place where findings, faults and what was not mended become sentences."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from mracad.inspect.faults import Fault, FaultKind
from mracad.inspect.mended import Mending
from mracad.inspect.verdict import Finding

if TYPE_CHECKING:
    from mracad.job.document import Report


SHOWN = 6
"""Largest number of faces named in one line."""


def numbers(faces: Sequence[int]) -> str:
    """``#3 #7 …`` from face indices."""
    return " ".join(f"#{face + 1}" for face in faces[:SHOWN]) + (" …" if len(faces) > SHOWN else "")


def of_finding(finding: Finding) -> str:
    """A finding in one line."""
    return _SENTENCES.get(finding.rule, _failure)(finding)


def placed(finding: Finding) -> str:
    """A finding in one line, with its place."""
    at = "" if finding.where is None else " at " + " ".join(f"{x:.6g}" for x in finding.where)
    return of_finding(finding) + at


def _faces(faces: Sequence[int]) -> str:
    return " and ".join(f"#{face + 1}" for face in dict.fromkeys(faces))


def _paired(finding: Finding) -> str:
    """A face of the new document, with its number in the reference where that differs."""
    (face,), was = finding.faces, finding.figures["was_face"]
    assert isinstance(was, int)
    return f"#{face + 1}" if face == was else f"#{face + 1} (was #{was + 1})"


def _seam(finding: Finding) -> str:
    edge = "" if finding.edge is None else f"edge#{finding.edge + 1} "
    return f"{edge}between {_faces(finding.faces)}"


def _failure(finding: Finding) -> str:
    """A failure in the kernel's own check."""
    of = f" of #{finding.faces[0] + 1}" if finding.faces else ""
    return f"{finding.rule} in a {finding.figures['kind']}{of}"


def _place(finding: Finding) -> str:
    """A product, one of its components or one of its faces."""
    product, component, face = (finding.figures[name] for name in ("product", "component", "face"))
    assert face is None or isinstance(face, int)
    within = " inside" if finding.figures["inside"] else ""
    return f"{product}{f'/{component}' if component else ''}{within if face is None else f' #{face + 1}'}"


def _hex(colour: object) -> object:
    return colour or "without colour"


def _counted(noun: str) -> Callable[[Finding], str]:
    return lambda f: f"{f.figures['now']} {noun}, were {f.figures['was']}"


_SENTENCES: dict[str, Callable[[Finding], str]] = {
    # of a check
    "entity": lambda f: f"{f.figures['says']}",
    "lost-faces": lambda f: (
        f"face not loaded: {f.figures['says']}"
        if "says" in f.figures
        else f"{f.figures['count']} faces could not be loaded"
    ),
    "same-sense": lambda f: f"the same_sense of {_faces(f.faces)} in the file is wrong",
    "free-edge": lambda f: f"edge#{(f.edge or 0) + 1} of {_faces(f.faces)} is a free edge",
    "flipped-face": lambda f: f"{_faces(f.faces)} faces the opposite way to its neighbours",
    "unsewn": lambda f: f"{_faces(f.faces)} are not sewn, gap {f.figures['gap']:.3g} mm",
    "gap": lambda f: f"gap {f.figures['gap']:.3g} mm {_seam(f)}",
    "angle": lambda f: f"angle {f.figures['angle']:.2g}° {_seam(f)}",
    "smooth-seams": lambda f: f"{f.figures['now']} seams are smooth, {f.figures['expected']} were expected",
    "not-smooth": lambda f: f"{_seam(f)} turns by {f.figures['angle']:.4g}°",
    "crossing": lambda f: _faces(f.faces) + (" crosses itself" if len(set(f.faces)) == 1 else " cross"),
    "edge-tolerance": lambda f: f"edge#{(f.edge or 0) + 1} has a tolerance of {f.figures['tolerance']:.3g} mm",
    "vertex-tolerance": lambda f: f"a vertex has a tolerance of {f.figures['tolerance']:.3g} mm",
    "thin-wall": lambda f: f"wall of {f.figures['thickness']:.4g} mm at {_faces(f.faces)}",
    "no-mesh": lambda f: f"{_faces(f.faces)} cannot be meshed",
    "hole": lambda f: "hole at " + " ".join(f"#{face + 1}" for face in f.faces),
    # of a comparison: faces
    "face-lost": lambda f: f"{_faces(f.faces)} ({f.figures['kind']}) is gone",
    "face-added": lambda f: f"{_faces(f.faces)} ({f.figures['kind']}) is new",
    "face-kind": lambda f: f"{_paired(f)} is {f.figures['now']}, was {f.figures['was']}",
    "face-split": lambda f: f"#{(f.figures['was_face'] or 0) + 1} is now in {len(f.faces)} parts: {_faces(f.faces)}",  # type: ignore[operator]
    "face-merged": lambda f: f"{_faces(f.faces)} is one face, was in {f.figures['was']} parts",
    "deviates": lambda f: f"{_paired(f)} deviates by {f.figures['by']:.6g} mm",
    "outline": lambda f: f"{_paired(f)} outline moved by {f.figures['by']:.6g} mm",
    "outline-tolerance": lambda f: (
        f"outlines differ by up to {f.figures['by']:.3g} mm on {f.figures['count']} faces, within the tolerance of "
        "their edges"
    ),
    # seams
    "seam-lost": lambda f: f"seam {_seam(f)} is gone",
    "seam-added": lambda f: f"seam {_seam(f)} is new",
    "seam-pieces": lambda f: f"{f.figures['now']} edges between {_faces(f.faces)}, were {f.figures['was']}",
    "crease": lambda f: f"{_seam(f)} is no longer smooth: {f.figures['now']:.4g}°, was {f.figures['was']:.4g}°",
    "seam-laid-anew": lambda f: (
        f"{_seam(f)} measures {f.figures['now']:.4g}°, was {f.figures['was']:.4g}°: its curves have moved on "
        "the same faces"
    ),
    "gap-growth": lambda f: f"gap {_seam(f)} is {f.figures['now']:.4g} mm, was {f.figures['was']:.4g} mm",
    "angle-growth": lambda f: f"angle {_seam(f)} is {f.figures['now']:.4g}°, was {f.figures['was']:.4g}°",
    # counts and sizes
    **{
        name: _counted(name.replace("-", " "))
        for name in ("solids", "shells", "faces", "open-shells", "free-edges", "edges")
    },
    "volume-change": lambda f: f"volume {f.figures['now']:.9g} mm³, was {f.figures['was']:.9g} mm³",
    # structure and attributes
    "assembly": lambda f: f"{f.figures['change']}: {f.figures['path']}{_of_product(f)}",
    "placement": lambda f: f"{f.figures['path']}{_of_product(f)} has another placement",
    "usages": _counted("usages"),
    "product": lambda f: f"{f.figures['change']}: {f.figures['product']}",
    "face-name": lambda f: f"{_paired(f)} is named '{f.figures['now']}', was '{f.figures['was']}'",
    "face-colour": lambda f: f"{_paired(f)} is {_hex(f.figures['now'])}, was {_hex(f.figures['was'])}",
    "colours": lambda f: f"{f.figures['change']}: {_place(f)} {f.figures['of']} {f.figures['colour']}",
    "layers": lambda f: f"{f.figures['change']}: {f.figures['layer']} {_place(f)}",
    "materials": lambda f: f"{f.figures['change']}: {_place(f)} {f.figures['density']}",
    **{name: _counted(name) for name in ("dimensions", "tolerances", "datums")},
    "not-held": lambda f: f"not held by {f.figures['format']}: {f.figures['what']}",
}


def _of_product(finding: Finding) -> str:
    product = finding.figures["product"]
    return f" ({product})" if product else ""


def of_fault(fault: Fault) -> str:
    """A fault of a file in one line."""
    where = _faces(fault.faces[:2]) + (" …" if len(fault.faces) > 2 else "")
    where = where or ("it" if fault.reason is FaultKind.UNREAD else "somewhere")
    change = 100 * abs(fault.value - fault.was) / abs(fault.was) if fault.was else 0.0
    share = f"{change:.3g} %" if fault.was else f"{fault.value:.3g}"
    return _FAULTS[fault.reason].format(f=fault, where=where, share=share)


_FAULTS = {
    FaultKind.UNREAD: "{where} cannot be read back: {f.status}",
    FaultKind.INVALID: "{f.status} in {where}",
    FaultKind.SOLIDS: "{f.value:.0f} solids (were {f.was:.0f})",
    FaultKind.SHELLS: "{f.value:.0f} shells (were {f.was:.0f})",
    FaultKind.FACES: "{f.value:.0f} faces (were {f.was:.0f})",
    FaultKind.FREE_EDGES: "{f.value:.0f} free edges (were {f.was:.0f})",
    FaultKind.LOST: "{where} is lost",
    FaultKind.AREA: "the area of {where} changes by {share}",
    FaultKind.VOLUME: "the volume changes by {share}",
    FaultKind.BOX: "the bounding box changes by {f.value:.3g} mm",
    FaultKind.TOLERANCE: "a tolerance of {f.value:.3g} mm at {where} (largest {f.was:.3g} mm)",
    FaultKind.SEAM: "no seam between {where}",
    FaultKind.GAP: "a gap of {f.value:.3g} mm between {where} (was {f.was:.3g} mm)",
    FaultKind.ANGLE: "an angle of {f.value:.2g}° between {where} (was {f.was:.2g}°)",
    FaultKind.OPEN: "the mesh is open at {where}",
}


def notes(report: Report) -> list[str]:
    """The notes of an edit, one line each."""
    reasons = {treatment.edge: str(treatment.reason) for treatment in report.edit.edges if treatment.reason}
    mending = [_mending(each, reasons.get(-1 if each.edge is None else each.edge, "")) for each in report.unmended]
    return [*report.edit.notes, *mending]


def _mending(mending: Mending, reason: str) -> str:
    """How many defects were mended; ``reason`` is why the worst remaining edge did not move."""
    gaps, m = mending.what == "close-gaps", mending
    if not m.defects:
        if gaps:
            text = f"close-gaps: no gap between edited faces is wider than {m.least:g} mm"
            return f"{text} (the widest: {m.next or 0.0:.2g} mm)"
        text = f"fit-g1: no seam between edited faces has an angle of {m.least}° to {m.most:g}°"
        return text if m.next is None else f"{text} (the smallest above that: {m.next:.3g}°)"
    text = f"{m.what}: {'closed' if gaps else 'made tangent'} {m.defects - m.left} of {m.defects} "
    text += ("gap" if gaps else "seam") + "s" * (m.defects > 1)
    text += f", {m.mostly} more except at their ends" if m.mostly else ""
    rest = f"a gap of {m.after:.3g} mm" if gaps else f"an angle of {m.after:.3g}°"
    return f"{text}; edge#{(m.edge or 0) + 1} keeps {rest}" + (f" ({reason})" if reason else "")
