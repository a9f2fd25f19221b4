"""Reports of models as HTML pages, made of the values that are also the report as JSON."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from mracad.report.figures import alone, both, reference_name, still
from mracad.report.mesh import mesh
from mracad.report.page import SVG, Figure, Page, Verdict
from mracad.report.table import Column, Table
from mracad_cli.render import info, json, text

if TYPE_CHECKING:
    from mracad.inspect.spectrum import Spectrum
    from mracad.inspect.verdict import Verdict as Differences
    from mracad.occ.document import Document

SCALE = "2%"
"""Scale at which detail is looked for, as in info."""

FACES = (
    Column("Face", "face", "#"),
    Column("Type", "kind"),
    Column("Name", "name"),
    Column("Product", "product"),
    Column("Degree", "degree"),
    Column("Net", "net"),
    Column("Area, mm²", "area"),
    Column("Detail, mm rms", "detail"),
    Column("Shortest wave, mm", "shortest_wavelength"),
    Column("Smoothing", "smoothing"),
    Column("Reason", "reason"),
)
"""What is said of faces."""

SEAMS = (
    Column("Edge", "edge", "#"),
    Column("Faces", "faces", "#"),
    Column("Gap, mm", "gap"),
    Column("Angle, °", "angle"),
    Column("Mean angle, °", "mean_angle"),
    Column("Curvature jump, 1/mm", "bend"),
    Column("Relative jump", "relative_bend"),
    Column("Smooth", "smooth"),
    Column("Sewn", "sewn"),
)
"""What is said of seams."""


@dataclass(frozen=True)
class Told:
    """What a report tells.

    ``body`` is the report as JSON, ``spectra`` those of all NURBS faces.
    """

    document: Document
    reference: Document | None
    body: dict[str, Any]
    lines: Sequence[str]
    spectra: Sequence[Spectrum]


def told(
    document: Document, reference: Document | None, source: bytes, progress: Callable[[str, int, int], None]
) -> Told:
    """Look at a document, check it, and compare it with a reference if there is one."""
    from mracad.inspect.spectrum import spectra
    from mracad.job import check, compare
    from mracad.job.info import info as look
    from mracad.spec.steps import Check, Compare

    seen = look(document, SCALE, "g1", sized=True, progress=progress)
    progress("checking", 0, 1)
    checked = check.check(document, Check(), text=source)
    progress("comparing", 0, 1)
    compared = compare.compare(document, Compare(reference=""), lambda: reference) if reference else None
    progress("measuring waves", 0, 1)
    faces = [face.index for face in seen.model.faces if face.surface is not None]
    body = info.body(seen) | {"warnings": document.warnings, "check": json.verdict(checked.verdict, checked.failed)}
    lines = info.summary(seen)
    if compared and reference:
        found = compared.verdict.noting()  # no limits were given
        body["compare"] = _unjudged(found)
        lines += [f"compared with {reference.name}: {_differing(body['compare'])}", *text.layer_lines(found)]
    return Told(document, reference, body, lines, spectra(seen.model, faces))


def line(report: Told, output: str, size: int) -> str:
    """What was written, in one line."""
    body = report.body
    said = [
        f"{body['file']}: {text.plural(len(body['faces']), 'face')}",
        f"valid: {text.verdict(body['check']['valid'])}",
    ]
    if report.reference:
        said.append(f"compared with {report.reference.name}: {_differing(body['compare'])}")
    return "; ".join([*said, f"wrote {output}, {text.size(size)}"])


def page(report: Told) -> Page:
    """The page of a report."""
    body, document, reference = report.body, report.document, report.reference
    columns = [each for each in FACES if each.key != "product" or len(body["products"]) > 1]
    names = [document.name, *([reference.name] if reference else [])]
    verdicts = [_valid(body["check"])]
    if "compare" in body:
        found = body["compare"]
        verdicts.append(Verdict("comparison", _differing(found), found["equal"] or None, found["layers"]))
    compared = both(document, reference) if reference else []
    figures = [*compared, *alone(document, "zebra" if compared else ""), *_plots(document.name, report.spectra)]
    return Page(
        title=document.name,
        kind="Model compared" if reference else "Model report",
        asked=[
            ("Command", "mracad report"),
            *zip(("Model", "Reference"), names, strict=False),
            *_facts(body),
            *_versions(),
        ],
        lines=[*report.lines, *(f"warning: {each}" for each in body["warnings"])],
        verdicts=verdicts,
        still=still(document),
        mesh=mesh(document, {face["face"] - 1: _called(face) for face in body["faces"]}, reference),
        reference=reference_name(document, reference),
        figures=figures,
        tables=[
            Table("faces", "Faces", columns, _measured(body["faces"])),
            Table("seams", "Seams", SEAMS, body["seams"]["each"]),
        ],
    )


def _unjudged(found: Differences) -> dict[str, Any]:
    """A comparison without limits: nothing passes or fails, the models are equal or not."""
    body = json.verdict(found, ())
    equal = all(layer.status != "noted" for layer in found.layers)
    return {"file": body["file"], "equal": equal, "valid": body["valid"], "layers": body["layers"]}


def _valid(body: Mapping[str, Any]) -> Verdict:
    return Verdict("valid", text.verdict(body["valid"]), body["valid"], body["layers"])


def _differing(body: Mapping[str, Any]) -> str:
    """The deviation, and in what else a model differs from its reference."""
    found = {layer["name"]: layer["text"] for layer in body["layers"] if layer["status"] == "noted"}
    moved = found.pop("deviation", "")
    said = [f"deviation {moved}"] if moved else []
    said += [f"{'also ' if moved else ''}differs in {', '.join(found)}"] if found else []
    return "; ".join(said) or "no differences"


def _measured(faces: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Faces without the waves of those that have none."""
    return [
        face | {"detail": face["detail"] if wave else None, "shortest_wavelength": wave or None}
        for face in faces
        for wave in (face["shortest_wavelength"],)
    ]


def _facts(body: Mapping[str, Any]) -> list[tuple[str, str]]:
    return [
        ("Schema", body["schema"] or "unknown"),
        ("Unit of the file", body["unit"]),
        ("Diagonal", text.mm(body["diagonal"])),
    ]


def _versions() -> list[tuple[str, str]]:
    from mracad.spec.recipe import versions

    return [(name, version) for name, version in versions().items()]


def _called(face: Mapping[str, Any]) -> str:
    return " · ".join(filter(None, [face["kind"], face["name"] or face["product"]]))


def _plots(name: str, spectra: Sequence[Spectrum]) -> list[Figure]:
    """Heights of waves by wavelength, if there are any."""
    from mracad_cli.render.plot import picture

    if not spectra:
        return []
    caption = "Height of waves by wavelength: the model in black, each face in grey"
    return [Figure(caption, picture(name, spectra, {}, "svg"), SVG, wide=True)]
