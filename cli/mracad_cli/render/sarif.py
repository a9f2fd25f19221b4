"""Verdicts as SARIF."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any
from urllib.parse import quote

import mracad
from mracad.inspect.verdict import Finding, Layer, Verdict
from mracad.job.words import placed


def verdict(found: Verdict, failed: Sequence[Layer], command: str) -> dict[str, Any]:
    """One result per finding: an error if its layer fails the command, else a note."""
    results = [
        result
        for layer in found.layers
        for level, evidence in (("error" if layer in failed else "note", layer.findings), ("note", layer.notes))
        for result in (_result(found.subject, layer, finding, level) for finding in evidence)
    ]
    results += [_result(found.subject, layer, None, "error") for layer in failed if not layer.findings]
    rules = sorted({str(result["ruleId"]) for result in results})
    driver = {"name": f"mracad {command}", "version": mracad.__version__, "rules": [{"id": rule} for rule in rules]}
    return {
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
        "version": "2.1.0",
        "runs": [{"tool": {"driver": driver}, "results": results}],
    }


def _result(subject: str, layer: Layer, finding: Finding | None, level: str) -> dict[str, Any]:
    """The result for a finding, or for a layer that fails without one."""
    faces = finding.faces if finding else ()
    places = [{"name": f"#{face + 1}", "kind": "face"} for face in faces]
    if finding and finding.edge is not None:
        places.append({"name": f"edge#{finding.edge + 1}", "kind": "edge"})
    return {
        "ruleId": f"{layer.name}/{finding.rule if finding else layer.status}",
        "level": level,
        "message": {"text": placed(finding) if finding else layer.text},
        "locations": [
            {"physicalLocation": {"artifactLocation": {"uri": quote(subject)}}, "logicalLocations": places},
        ],
    }
