"""Names of edits as operations of other libraries, where short ones mean something else."""

from __future__ import annotations

import re

from mracad.api.edits import edits

_VERBS = {
    "offset": "offset_faces",
    "sweep": "sweep_points",
    "level": "coarsen",
    "compose": "restore_details",
    "move": "move_feature",
    "repeat": "repeat_feature",
    "transfer": "transfer_detail",
}


def verbs(*, camel: bool = False) -> dict[str, str]:
    """The name of each operation, by that of its edit; as ``repeatFeature`` with ``camel``."""
    found = {use: _VERBS.get(use, use) for use in edits()}
    if not camel:
        return found
    return {use: re.sub(r"_(.)", lambda match: match[1].upper(), verb) for use, verb in found.items()}
