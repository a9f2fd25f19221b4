"""Compile the code for large models: ``python -m mracad.warm``, once after an installation.

Compiled code is kept beside the package, or in the user's cache folder where that cannot be written.  Without this, the
first run that needs it compiles it.
"""

from __future__ import annotations

import numpy as np

from mracad.bspline.knots import KnotVector
from mracad.inspect.sweep import SWEEP
from mracad.wavelet.ladder import rungs_by_level
from mracad.wavelet.transform import decompose, reconstruct

COUNT = 515
"""Control points along a net whose transform is compiled, in levels above and below the limit."""


def warm() -> None:
    """Compile everything that is not yet on disk."""
    SWEEP.prepare()
    rungs = rungs_by_level(KnotVector.clamped(np.arange(COUNT - 2.0), 3))[:3]
    reconstruct(decompose(np.zeros((COUNT, COUNT, 3)), rungs, rungs))


if __name__ == "__main__":
    warm()
