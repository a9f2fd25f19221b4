"""What a check found: what fails, and the facts behind it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Verdict:
    """The outcome of a check.

    Attributes
    ----------
    failures : sequence of str
        What does not hold, one line each; empty when the check is passed.
    facts : object
        What was measured, as the check has it.
    """

    failures: Sequence[str]
    facts: Any

    @property
    def passed(self) -> bool:
        return not self.failures
