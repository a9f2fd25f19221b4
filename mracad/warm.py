"""Compile everything ahead: ``python -m mracad.warm``, once after an installation.

That is the bytecode of all modules, without which each command takes a quarter of a second longer, and which Python
does not write by itself where ``PYTHONDONTWRITEBYTECODE`` is set; and the code for large models, which is kept beside
the package, or in the user's cache folder where that cannot be written, and which otherwise the first run compiles that
needs it.
"""

from __future__ import annotations

from compileall import compile_dir
from importlib.util import find_spec

import numpy as np

from mracad.bspline.band import BAND
from mracad.bspline.boor import EVALUATE
from mracad.bspline.gather import GATHER
from mracad.bspline.knots import KnotVector
from mracad.bspline.tensor import COMBINE
from mracad.inspect.spread import COMPARE
from mracad.inspect.sweep import SWEEP
from mracad.seam.points import CURVE, FRAME, LOOK, SQUARE
from mracad.seam.room import ROOM
from mracad.seam.stencil import MIRROR, PLACE
from mracad.wavelet.ladder import rungs_by_level
from mracad.wavelet.transform import decompose, reconstruct

COUNT = 515
"""Control points along a net whose transform is compiled, in levels above and below the limit."""

CODE = EVALUATE, BAND, GATHER, COMBINE, FRAME, CURVE, LOOK, SQUARE, PLACE, MIRROR, ROOM, COMPARE, SWEEP
"""All that is kept as machine code."""


def warm() -> None:
    """Compile everything that is not yet on disk."""
    for package in ("mracad", "mracad_cli"):
        found = find_spec(package)
        for folder in (found.submodule_search_locations or ()) if found else ():
            compile_dir(folder, quiet=2)
    for code in CODE:
        code.prepare()
    rungs = rungs_by_level(KnotVector.clamped(np.arange(COUNT - 2.0), 3))[:3]
    reconstruct(decompose(np.zeros((COUNT, COUNT, 3)), rungs, rungs))


if __name__ == "__main__":
    warm()
