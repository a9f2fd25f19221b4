"""The options of every step, declared once: command line, recipes, schemas and documentation come from here.

There is one ``Struct`` per edit or check; it names its function and so becomes one of ``STEPS``.  The ``Meta`` of a
field holds its help.  This package imports no numerical library, so that the command line can show help quickly.
"""

from __future__ import annotations

from mracad.spec.steps import checks, features, levels, shape, smooth, transfer
from mracad.spec.steps.base import Options, Selection
from mracad.spec.steps.checks import Check, Compare
from mracad.spec.steps.features import Copied, Extract, Featured, Make, Move, Repeat, Single
from mracad.spec.steps.levels import Compose, Level, Shaped
from mracad.spec.steps.plugged import plugged
from mracad.spec.steps.smooth import Fairing, Fitting, Smooth
from mracad.spec.steps.transfer import Transfer

__all__ = [
    "OWN", "STEPS", "Check", "Compare", "Compose", "Copied", "Extract", "Fairing", "Featured", "Fitting", "Level",
    "Make", "Move", "Options", "Repeat", "Selection", "Shaped", "Single", "Smooth", "Transfer",
]  # fmt: skip

OWN: dict[str, type[Options]] = {
    struct.function.partition(":")[2]: struct
    for module in (smooth, shape, levels, features, transfer, checks)
    for struct in vars(module).values()
    if isinstance(struct, type) and issubclass(struct, Options) and "function" in vars(struct)
}
"""The steps of mracad itself."""

STEPS: dict[str, type[Options]] = {**plugged(), **OWN}
"""Every step by the name of its command: edits (subclasses of ``Selection``) and checks."""
