"""Traces: where they cross knot lines."""

import numpy as np
import pytest

from mracad.bspline.curve import Curve
from mracad.bspline.knots import KnotVector
from mracad.seam.trace import Trace, crossings


@pytest.mark.parametrize("ends", [((0.0, 0.3), (1.0, 0.3)), ((1.0, 0.3), (0.0, 0.3)), ((0.0, 0.2), (1.0, 0.9))])
@pytest.mark.parametrize("spans", [3, 16, 30, 1024])
def test_every_knot_line_is_crossed(ends, spans):
    """Also those through points at which the trace is sampled."""
    lines, none = (KnotVector.clamped(np.linspace(0.0, 1.0, n + 1), 3) for n in (spans, 1))
    trace = Trace(0, 0, Curve(KnotVector.clamped([0.0, 1.0], 1), np.array(ends)))
    wanted = np.linspace(0.0, 1.0, spans + 1)
    assert crossings(trace, (lines, none)) == pytest.approx(wanted)
    if spans == 30:
        assert crossings(trace.part(0.0, 16 / 30), (lines, none)) == pytest.approx(np.linspace(0.0, 1.0, 17))
