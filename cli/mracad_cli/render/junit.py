"""JUnit reports, all from one writer."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal
from xml.etree import ElementTree as Xml

from mracad.errors import Code

if TYPE_CHECKING:
    from mracad.inspect.verdict import Layer, Verdict
    from mracad.job.batch.run import Outcome

VERDICTS = Code.FAILED_CHECK, Code.CANNOT_EDIT
"""Exit codes that tell something about the model: failures, where all others are errors."""

_CONTROL = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")  # what XML cannot hold


@dataclass(frozen=True)
class Case:
    """A test case: its status, a line of text and the details.

    Attributes
    ----------
    kind : str
        The exit code or status of a failure or an error.
    seconds : float or None
    """

    group: str
    name: str
    became: Literal["passed", "failure", "error", "skipped"] = "passed"
    line: str = ""
    more: str = ""
    kind: str = ""
    seconds: float | None = None


def text(name: str, cases: Sequence[Case], seconds: float | None = None) -> str:
    """The XML of one test suite."""
    counts = Counter(case.became for case in cases)
    figures = {
        "tests": len(cases),
        "failures": counts["failure"],
        "errors": counts["error"],
        "skipped": counts["skipped"],
    }
    shared = {**{key: str(value) for key, value in figures.items()}, **_time(seconds)}
    suite = root = Xml.Element("testsuite", {"name": _clean(name), **shared})
    for case in cases:
        found = Xml.SubElement(
            suite, "testcase", {"classname": _clean(case.group), "name": _clean(case.name), **_time(case.seconds)}
        )
        if case.became in ("failure", "error"):
            said = Xml.SubElement(found, case.became, {"message": _clean(case.line), "type": case.kind})
            said.text = _clean(case.more)
        elif case.became == "skipped":
            Xml.SubElement(found, "skipped", {"message": _clean(case.line)})
        elif case.line:
            Xml.SubElement(found, "system-out").text = _clean(case.line)
    Xml.indent(root)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + Xml.tostring(root, encoding="unicode") + "\n"


def verdict(found: Verdict, failed: Sequence[Layer], command: str) -> str:
    """A verdict as a test suite with one case per layer."""
    return text(f"mracad {command} {found.subject}", [_layer(found.subject, x, x in failed) for x in found.layers])


def became(code: int) -> Literal["failure", "error"]:
    """What an exit code other than 0 is in JUnit."""
    return "failure" if code in VERDICTS else "error"


def _layer(subject: str, layer: Layer, failed: bool) -> Case:
    from mracad.job.words import placed

    if failed:
        return Case(
            subject, layer.name, "failure", layer.text, "\n".join(map(placed, layer.findings)), kind=layer.status
        )
    if layer.status in ("skipped", "time limit"):
        return Case(subject, layer.name, "skipped", f"{layer.status}: {layer.text}")
    return Case(subject, layer.name, line=layer.text)


def batch(name: str, outcomes: Sequence[Outcome], seconds: float) -> str:
    """A batch as a test suite; see :func:`became`."""
    return text(name, [_outcome(name, outcome) for outcome in outcomes], seconds)


def _outcome(name: str, outcome: Outcome) -> Case:
    if outcome.status == "failed":
        words = became(outcome.code or Code.INTERNAL), outcome.message, outcome.hint, str(outcome.code)
        return Case(name, outcome.file, *words, seconds=outcome.seconds)
    if outcome.status == "not tried":
        return Case(name, outcome.file, "skipped", "the batch stopped before", seconds=outcome.seconds)
    said = "unchanged" if outcome.status == "unchanged" else ""
    return Case(name, outcome.file, line=said, seconds=outcome.seconds)


def _time(seconds: float | None) -> dict[str, str]:
    return {} if seconds is None else {"time": f"{seconds:.3f}"}


def _clean(text: str) -> str:
    """A text with the characters that XML cannot hold replaced."""
    return _CONTROL.sub("\N{REPLACEMENT CHARACTER}", text)
