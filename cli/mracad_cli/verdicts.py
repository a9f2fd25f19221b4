"""Verdicts as text, JSON, JUnit and SARIF."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Any
from xml.etree import ElementTree as Xml

import msgspec

import mracad
from mracad.audit.verdict import Finding, Layer, Verdict
from mracad_cli.files import deliver
from mracad_cli.render import json_text

SHOWN = 8
"""Most findings of one layer in the text."""

_WORDS = {True: "yes", False: "no", None: "unknown"}
_CONTROL = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")  # what XML cannot hold


def emit(
    verdict: Verdict, failed: Sequence[Layer], *, command: str, as_json: bool, junit: str | None, sarif: str | None
) -> int:
    """Print a verdict, write its reports, and return the exit code.

    Parameters
    ----------
    verdict : Verdict
    failed : sequence of Layer
        The layers for which the command fails.
    command : str
        Which command it comes from.
    junit, sarif : str or None
        Files to write.
    """
    files = {junit: _junit(verdict, failed, command)} if junit else {}
    files |= {sarif: json_text(_sarif(verdict, failed, command), 1) + "\n"} if sarif else {}
    deliver(files, [json_text(as_data(verdict, failed))] if as_json else _lines(verdict, failed))
    return 1 if failed else 0


def as_data(verdict: Verdict, failed: Sequence[Layer]) -> dict[str, Any]:
    """A verdict as JSON-ready values; faces and edges count from 1, what is not finite is null."""
    return {
        "file": verdict.subject,
        "passed": not failed,
        "valid": verdict.valid,
        "failed": [layer.name for layer in failed],
        "layers": [
            {
                "name": layer.name,
                "status": layer.status,
                "text": layer.text,
                "findings": [_finding(finding) for finding in layer.findings],
                "figures": _finite(msgspec.to_builtins(dict(layer.figures))),
            }
            for layer in verdict.layers
        ],
    }


def _finding(finding: Finding) -> dict[str, Any]:
    return {
        "text": finding.text,
        "rule": finding.rule,
        "faces": [face + 1 for face in finding.faces],
        "edge": None if finding.edge is None else finding.edge + 1,
        "where": None if finding.where is None else list(finding.where),
    }


def _finite(value: Any) -> Any:
    """Values in which whatever is not finite is None, and faces and edges have numbers as on the command line."""
    if isinstance(value, dict):
        counted = (
            {"ref", "new"}
            if "there" in value
            else {"edge", "faces"}
            if isinstance(value.get("faces"), list | tuple)
            else set()
        )
        return {key: _numbered(item) if key in counted else _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _numbered(index: int | Sequence[int]) -> int | list[int]:
    return index + 1 if isinstance(index, int) else [i + 1 for i in index]


def _lines(verdict: Verdict, failed: Sequence[Layer]) -> list[str]:
    width = max(len(layer.name) for layer in verdict.layers)
    lines = [f"{verdict.subject}: valid: {_WORDS[verdict.valid]}"]
    for layer in verdict.layers:
        lines.append(f"{layer.name.ljust(width)}  {layer.status.ljust(7)}  {layer.text}".rstrip())
        lines += [f"  {_placed(finding)}" for finding in layer.findings[:SHOWN]]
        if len(layer.findings) > SHOWN:
            lines.append(f"  and {len(layer.findings) - SHOWN} more")
    lines.append("failed: " + ", ".join(layer.name for layer in failed) if failed else "passed")
    return lines


def _placed(finding: Finding) -> str:
    at = "" if finding.where is None else " at " + " ".join(f"{x:.6g}" for x in finding.where)
    return finding.text + at


def _junit(verdict: Verdict, failed: Sequence[Layer], command: str) -> str:
    """One test case a layer."""
    skipped = [layer for layer in verdict.layers if layer.status in ("skipped", "time limit")]
    suite = Xml.Element(
        "testsuite",
        name=clean(f"mracad {command} {verdict.subject}"),
        tests=str(len(verdict.layers)),
        failures=str(len(failed)),
        errors="0",
        skipped=str(sum(layer not in failed for layer in skipped)),
    )
    for layer in verdict.layers:
        case = Xml.SubElement(suite, "testcase", classname=clean(verdict.subject), name=layer.name)
        if layer in failed:
            failure = Xml.SubElement(case, "failure", message=clean(layer.text), type=layer.status)
            failure.text = clean("\n".join(_placed(finding) for finding in layer.findings))
        elif layer in skipped:
            Xml.SubElement(case, "skipped", message=clean(f"{layer.status}: {layer.text}"))
        elif layer.text:
            Xml.SubElement(case, "system-out").text = clean(layer.text)
    Xml.indent(suite)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + Xml.tostring(suite, encoding="unicode") + "\n"


def clean(text: str) -> str:
    """A text without the characters that XML cannot hold."""
    return _CONTROL.sub("\N{REPLACEMENT CHARACTER}", text)


def _sarif(verdict: Verdict, failed: Sequence[Layer], command: str) -> dict[str, Any]:
    """One result a finding; errors where the command fails for its layer, notes elsewhere."""
    results = [
        {
            "ruleId": f"{layer.name}/{finding.rule}",
            "level": "error" if layer in failed else "note",
            "message": {"text": _placed(finding)},
            "locations": [
                {
                    "physicalLocation": {"artifactLocation": {"uri": _uri(verdict.subject)}},
                    "logicalLocations": [{"name": f"#{face + 1}", "kind": "face"} for face in finding.faces]
                    + ([{"name": f"edge#{finding.edge + 1}", "kind": "edge"}] if finding.edge is not None else []),
                }
            ],
        }
        for layer in verdict.layers
        for finding in layer.findings or ((Finding(layer.text, layer.status),) if layer in failed else ())
    ]
    rules = sorted({str(result["ruleId"]) for result in results})
    driver = {"name": f"mracad {command}", "version": mracad.__version__, "rules": [{"id": rule} for rule in rules]}
    return {
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
        "version": "2.1.0",
        "runs": [{"tool": {"driver": driver}, "results": results}],
    }


def _uri(name: str) -> str:
    from urllib.parse import quote

    return quote(name)
