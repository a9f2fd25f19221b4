"""What checks and comparisons have in common."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mracad.brief import named_line
from mracad.inspect.verdict import Layer, Verdict
from mracad.job.words import of_finding

if TYPE_CHECKING:
    from mracad.occ.document import Document

Original = Callable[[], "Document"]
"""Reads a document again as it was before any step."""


@dataclass(frozen=True)
class Judged:
    """What a check or comparison found, and the layers for which it fails."""

    verdict: Verdict
    failed: tuple[Layer, ...]

    def __repr__(self) -> str:
        return named_line("Judged", self.verdict.subject, self.told)

    @property
    def told(self) -> str:
        """What came out, in a few words."""
        return "passed" if self.passed else f"failed ({', '.join(layer.name for layer in self.failed)})"

    def _repr_html_(self) -> str:
        from mracad.report.notebook import cell

        heads, facts = ("What", "Status", "Found"), [("Model", self.verdict.subject), ("Result", self.told)]
        return cell(facts, heads, [(layer.name, layer.status, layer.text) for layer in self.verdict.layers])

    @property
    def passed(self) -> bool:
        return not self.failed

    @property
    def failures(self) -> list[str]:
        """What failed, one line each; empty when everything passed."""
        return [text for layer in self.failed for text in ([of_finding(f) for f in layer.findings] or [layer.text])]
