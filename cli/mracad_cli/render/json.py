"""Reports as JSON-ready dictionaries: faces and edges count from 1, lengths are millimetres."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import msgspec
from msgspec import structs

from mracad.inspect.verdict import Figure, Finding, Layer, Verdict
from mracad.job.words import notes, of_finding

if TYPE_CHECKING:
    from mracad.edit.result import FaceOutcome
    from mracad.inspect.faults import Fault, ReadBack
    from mracad.inspect.seams import SeamMeasure
    from mracad.job.document import Report
    from mracad.job.judge import Judged
    from mracad.job.output import Made
    from mracad.job.produce import Production
    from mracad.model.facts import Validity
    from mracad.seam.natural import Treatment
    from mracad.spec.recipe import Step


def plain(value: Any) -> Any:
    """Dataclasses and structs as JSON-ready values; face and edge indices count from 1 as on the command line."""
    return msgspec.to_builtins(value)


def outcome(value: FaceOutcome) -> dict[str, Any]:
    """The outcome of one face; lengths in millimetres."""
    return {**plain(value), "face": value.face + 1}


def treatment(value: Treatment) -> dict[str, Any]:
    """How an edge was treated; the edge and its faces by number."""
    faces, reason = [i + 1 for i in value.faces], "" if value.reason is None else str(value.reason)
    return {**plain(value), "edge": value.edge + 1, "faces": faces, "reason": reason}


def seam(value: SeamMeasure) -> dict[str, Any]:
    """One seam; its faces by number."""
    return {
        **plain(value),
        "edge": value.edge + 1,
        "faces": [i + 1 for i in value.faces],
        "smooth": value.smooth,
    }


def steps(name: str, each: Sequence[Step], done: Production, *, single: bool) -> dict[str, Any]:
    """The full report of the steps of a recipe, or of a single edit."""
    pairs = list(zip(each, done.results, strict=False))
    parts = [{**result(found), "options": structs.asdict(step.options)} for step, found in pairs]
    if single:
        return parts[0]
    named = [{"step": step.id, "use": step.use, **part} for (step, _), part in zip(pairs, parts, strict=True)]
    return {"file": name, "steps": named}


def result(value: Report | Judged) -> dict[str, Any]:
    """The full report of a step."""
    from mracad.job.document import Report

    return report(value) if isinstance(value, Report) else verdict(value.verdict, value.failed)


def report(value: Report) -> dict[str, Any]:
    """The full report of an edit."""
    from mracad.inspect.seams import key, summary

    smooth = value.smooth_seams()
    after = {key(m): m for m in value.after}
    return {
        "file": value.model.name,
        "diagonal": value.model.diagonal,
        "counts": dict(Counter(o.status for o in value.edit.outcomes)),
        "faces": [outcome(o) for o in value.edit.outcomes],
        "edges": [treatment(e) for e in value.edit.edges],
        "copies": [{**plain(c), "faces": [i + 1 for i in c.faces]} for c in value.edit.copies],
        "scale": value.edit.scale,
        "control_points": dict(zip(("before", "after"), value.control_points, strict=True)),
        "notes": notes(value),
        "deviation": [{**plain(d), "face": d.face + 1} for d in value.deviations],
        "seams": {
            "before": plain(summary(value.before, smooth)),
            "after": plain(summary(value.after, smooth)),
            "each": [
                {
                    **seam(m),
                    "after": {k: v for k, v in seam(after[key(m)]).items() if k not in ("edge", "faces", "sewn")},
                }
                for m in value.before
            ],
        },
        "valid": {"before": validity(value.valid_before), "after": validity(value.valid_after)},
    }


def written(made: Sequence[Made]) -> dict[str, Any]:
    """The outputs that were written."""
    each = {one.target.name: one for one in made}
    return {
        "written": list(each),
        "lost": {name: [asdict(lost) for lost in one.written.lost] for name, one in each.items()},
        "cut": {
            name: [{"face": cut.face + 1, "parts": cut.parts} for cut in one.written.cut] for name, one in each.items()
        },
        "scalars": {name: [asdict(legend) for legend in one.written.legends] for name, one in each.items()},
        "read_back": {name: read_back(one.read_back) for name, one in each.items()},
    }


def read_back(value: ReadBack | None) -> dict[str, Any] | None:
    """The verdict on an output as read back; None where it was not read back."""
    if value is None:
        return None
    return {**plain(value), "faults": _faults(value.faults), "forgiven": _faults(value.forgiven)}


def _faults(faults: Sequence[Fault]) -> list[dict[str, Any]]:
    return [{**plain(fault), "faces": [face + 1 for face in fault.faces]} for fault in faults]


def validity(value: Validity) -> dict[str, Any]:
    """The kernel's verdict."""
    return dict(plain(value))


def verdict(found: Verdict, failed: Sequence[Layer]) -> dict[str, Any]:
    """A verdict as JSON-ready values; faces and edges count from 1, numbers that are not finite are null."""
    return {
        "file": found.subject,
        "passed": not failed,
        "valid": found.valid,
        "failed": [layer.name for layer in failed],
        "layers": [
            {
                "name": layer.name,
                "status": layer.status,
                "text": layer.text,
                "findings": [_finding(finding) for finding in layer.findings],
                "notes": [_finding(note) for note in layer.notes],
                "figures": _shown(msgspec.to_builtins(dict(layer.figures))),
            }
            for layer in found.layers
        ],
    }


def _finding(finding: Finding) -> dict[str, Any]:
    return {
        "text": of_finding(finding),
        "rule": finding.rule,
        "faces": [face + 1 for face in finding.faces],
        "edge": None if finding.edge is None else finding.edge + 1,
        "where": None if finding.where is None else list(finding.where),
        "figures": {name: _counted(name, value) for name, value in finding.figures.items()},
    }


def _counted(name: str, value: Figure) -> Figure:
    """A figure of a finding; faces count from 1."""
    return value + 1 if name in ("face", "was_face") and isinstance(value, int) else value


def _shown(value: Any) -> Any:
    """Figures with faces and edges numbered as on the command line."""
    if isinstance(value, dict):
        seam = isinstance(value.get("faces"), list | tuple)
        counted = {"ref", "new"} if "there" in value else {"edge", "faces"} if seam else set()
        return {key: _numbered(item) if key in counted else _shown(item) for key, item in value.items()}
    return [_shown(item) for item in value] if isinstance(value, list) else value


def _numbered(index: int | Sequence[int]) -> int | list[int]:
    return index + 1 if isinstance(index, int) else [i + 1 for i in index]
