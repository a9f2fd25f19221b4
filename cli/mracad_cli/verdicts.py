"""Verdicts as text, JSON, JUnit and SARIF."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any
from xml.etree import ElementTree as Xml

import msgspec

import mracad
from mracad.inspect.verdict import Figure, Finding, Layer, Verdict
from mracad.inspect.words import words
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
                "notes": [_finding(note) for note in layer.notes],
                "figures": _shown(msgspec.to_builtins(dict(layer.figures))),
            }
            for layer in verdict.layers
        ],
    }


def _finding(finding: Finding) -> dict[str, Any]:
    return {
        "text": words(finding),
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
    """Figures in which faces and edges have numbers as on the command line."""
    if isinstance(value, dict):
        seam = isinstance(value.get("faces"), list | tuple)
        counted = {"ref", "new"} if "there" in value else {"edge", "faces"} if seam else set()
        return {key: _numbered(item) if key in counted else _shown(item) for key, item in value.items()}
    return [_shown(item) for item in value] if isinstance(value, list) else value


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
        lines += [f"  note: {_placed(note)}" for note in layer.notes[:SHOWN]]
        if len(layer.notes) > SHOWN:
            lines.append(f"  and {len(layer.notes) - SHOWN} more notes")
    lines.append("failed: " + ", ".join(layer.name for layer in failed) if failed else "passed")
    return lines


def _placed(finding: Finding) -> str:
    at = "" if finding.where is None else " at " + " ".join(f"{x:.6g}" for x in finding.where)
    return words(finding) + at


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
        result
        for layer in verdict.layers
        for level, evidence in (("error" if layer in failed else "note", layer.findings), ("note", layer.notes))
        for result in (_result(verdict.subject, layer, finding, level) for finding in evidence)
    ]
    results += [_result(verdict.subject, layer, None, "error") for layer in failed if not layer.findings]
    rules = sorted({str(result["ruleId"]) for result in results})
    driver = {"name": f"mracad {command}", "version": mracad.__version__, "rules": [{"id": rule} for rule in rules]}
    return {
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
        "version": "2.1.0",
        "runs": [{"tool": {"driver": driver}, "results": results}],
    }


def _result(subject: str, layer: Layer, finding: Finding | None, level: str) -> dict[str, Any]:
    """A finding, or what a layer says that fails without one."""
    faces = finding.faces if finding else ()
    places = [{"name": f"#{face + 1}", "kind": "face"} for face in faces]
    if finding and finding.edge is not None:
        places.append({"name": f"edge#{finding.edge + 1}", "kind": "edge"})
    return {
        "ruleId": f"{layer.name}/{finding.rule if finding else layer.status}",
        "level": level,
        "message": {"text": _placed(finding) if finding else layer.text},
        "locations": [
            {"physicalLocation": {"artifactLocation": {"uri": _uri(subject)}}, "logicalLocations": places},
        ],
    }


def _uri(name: str) -> str:
    from urllib.parse import quote

    return quote(name)
