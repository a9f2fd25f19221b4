"""Free edges: they stay, or move with their faces, but for the corners."""

import numpy as np
import pytest
from msgspec import structs

from mracad.edit.denoise import denoise
from mracad.edit.smooth import smooth
from mracad.errors import UsageError
from mracad.inspect.seams import seams
from mracad.occ.view import view
from mracad.spec.steps.smooth import Denoise, Smooth
from tests.edit import panels
from tests.edit.models import sheet

NOISE, BAND = 0.3, 8.0


@pytest.fixture(scope="module")
def noisy():
    return panels.whole(24, NOISE)[1]


def errors(net):
    """Root mean square of the error of a panel within a band along its edges, and inside."""
    us, vs = (np.linspace(*knots.domain, 301) for knots in (net.u, net.v))
    points = net.grid(us, vs)
    off = points[..., 2] - panels.truth(points[..., 0], points[..., 1])
    beside = [np.minimum(x - x[0], x[-1] - x) < BAND for x in (us, vs)]
    rim = beside[0][:, None] | beside[1]
    return [float(np.sqrt((off[where] ** 2).mean())) for where in (rim, ~rim)]


@pytest.mark.parametrize(("edit", "options", "most"), [(smooth, Smooth(scale="25mm"), 1.2), (denoise, Denoise(), 1.4)])
def test_a_rim_that_moves_gets_as_fair_as_the_inside(noisy, edit, options, most):
    """Estimates know less about a rim than about the inside; but noise of the corners, which stay, is not spread."""
    model = sheet(noisy)
    held, free = (
        edit(model, structs.replace(options, free_edges=way)).displacement.applied(model).surfaces[0].net
        for way in ("hold", "smooth")
    )
    (rim, inside), (before, _) = errors(free), errors(held)
    print(f"rim {rim:.4f}, inside {inside:.4f}; rim of held edges {before:.4f}")
    assert rim <= most * inside and rim < before
    for i in (0, -1):
        assert np.array_equal(held.poles[i], noisy.poles[i]) and np.array_equal(held.poles[:, i], noisy.poles[:, i])
        for j in (0, -1):
            assert np.array_equal(free.poles[i, j], noisy.poles[i, j])


def test_corners_may_move_along(noisy):
    model = sheet(noisy)
    nets = {
        way: smooth(model, Smooth(scale="25mm", free_edges="smooth", corners=way)).displacement.applied(model)
        for way in ("hold", "move")
    }
    held, free = (errors(nets[way].surfaces[0].net)[0] for way in ("hold", "move"))
    off = {way: np.abs(_corners(nets[way].surfaces[0].net) - _corners(noisy)).min() for way in nets}
    print(f"rim {held:.4f} with its corners held, {free:.4f} without")
    assert off["hold"] == 0 < off["move"] and free < held
    with pytest.raises(UsageError, match="corners: they cannot move while free edges stay"):
        Smooth(scale="25mm", corners="move")


def _corners(net):
    return net.poles[np.ix_([0, -1], [0, -1])]


def test_seams_end_on_the_rim_where_it_went(noisy):
    model = view(panels.document(panels.cut(noisy, (2, 3))))
    edit = smooth(model, Smooth(scale="25mm", free_edges="smooth"))
    after = edit.displacement.applied(model)
    assert all(treatment.how == "coupled" for treatment in edit.edges)
    found = seams(after)
    assert len(found) == 7 and max(each.gap for each in found) < 1e-9 and max(each.angle for each in found) < 1e-5


def test_free_edges_that_are_held_stay(noisy):
    model = sheet(noisy)
    held = smooth(model, Smooth(scale="25mm", free_edges="smooth", hold=("edge#1",)))
    moved = [np.abs(held.displacement.offsets[0].poles[side]).max() for side in ((slice(None), 0), (slice(None), -1))]
    assert moved[0] == 0 < moved[1]
    frozen = smooth(model, Smooth(scale="25mm", free_edges="smooth", edges="frozen"))
    assert not frozen.displacement.offsets[0].poles[:, [0, -1]].any()
