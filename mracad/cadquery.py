"""Edits as methods of ``cadquery.Workplane``, and as free functions of shapes; importing this module adds them.

>>> import cadquery as cq
>>> import mracad.cadquery
>>> pad = cq.importers.importStep("assembly.step")
>>> fair = pad.faces("%BSPLINE").smooth(scale=5).faces("<Z").workplane()

A method edits the shapes on the stack, or the faces on it and returns their solid, as ``fillet`` does with edges; its
options are those of the edit (``help(mracad.smooth)``).  ``mracad.cadquery.smooth(shape, scale=5)`` does the same for a
``Shape`` or an ``Assembly``.  Names that CadQuery has for other things are longer: ``repeatFeature``, ``moveFeature``,
``transferDetail``, ``offsetFaces``, ``sweepPoints``, ``coarsen`` (level) and ``restoreDetails`` (compose).
"""

from __future__ import annotations

from typing import Any

import cadquery

from mracad.api.edits import edit
from mracad.api.verbs import verbs

for _use, _name in verbs(camel=True).items():
    globals()[_name] = edit(_use)
    setattr(cadquery.Workplane, _name, globals()[_name])


def __getattr__(name: str) -> Any:  # so that type checkers know of the names above
    raise AttributeError(f"module 'mracad.cadquery' has no attribute {name!r}")
