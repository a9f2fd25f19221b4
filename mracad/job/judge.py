"""What checks and comparisons have in common."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

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

    @property
    def passed(self) -> bool:
        return not self.failed

    @property
    def failures(self) -> list[str]:
        """What failed, one line each; empty when everything passed."""
        return [text for layer in self.failed for text in ([of_finding(f) for f in layer.findings] or [layer.text])]
