"""A bound of the deviation instead of a scale: the largest scale that stays within it."""

import cadquery
import numpy as np
import pytest

from mracad.bspline.knots import KnotVector
from mracad.edit import bound as bound_module
from mracad.edit.smooth import smooth
from mracad.errors import UsageError
from mracad.occ.view import view
from mracad.spec.steps import Smooth
from tests.edit import panels
from tests.edit.models import fitted, sheet
from tests.occ import shapes


def deviation(model, edit):
    """The largest along the normals, over all surfaces."""
    most = 0.0
    after = edit.displacement.applied(model)
    for old, new in zip(model.surfaces, after.surfaces, strict=True):
        us, vs = (np.linspace(*knots.domain, 241) for knots in (old.net.u, old.net.v))
        normals = old.net.normals(np.stack(np.meshgrid(us, vs, indexing="ij"), axis=-1).reshape(-1, 2))
        off = (new.net.grid(us, vs) - old.net.grid(us, vs)).reshape(-1, 3)
        most = max(most, float(np.abs((off * normals).sum(axis=1)).max()))
    return most


@pytest.fixture(scope="module")
def patches():
    return view(panels.document(panels.cut(panels.whole(16, 0.05)[1], (1, 2))))


@pytest.mark.parametrize("most", [0.03, 0.06, 0.2])
@pytest.mark.parametrize("way", [{}, {"free_edges": "smooth"}])
def test_the_largest_scale_reaches_the_bound(patches, most, way, monkeypatch):
    solved = []
    monkeypatch.setattr(bound_module, "sheets", _counted(bound_module.sheets, solved))
    edit = smooth(patches, Smooth(max_deviation=f"{most}mm", **way))
    reached = deviation(patches, edit)
    print(f"{most} mm: {edit.scale:.3g} mm, {reached / most:.3f} of the bound, {len(solved)} problems solved unjudged")
    assert 0.95 * most <= reached <= 1.001 * most  # of what is judged, measured between the points of the judge, too
    assert 1 <= len(solved) <= bound_module.LOOKS
    assert {outcome.status for outcome in edit.outcomes} == {"edited"}


def _counted(function, calls):
    def counted(*arguments):
        calls.append(arguments)
        return function(*arguments)

    return counted


def test_it_is_the_smoothing_at_that_scale(patches):
    found = smooth(patches, Smooth(max_deviation="0.06mm"))
    same = smooth(patches, Smooth(scale=f"{found.scale!r}mm", max_deviation="0.06mm"))
    assert all(
        np.array_equal(offset.poles, same.displacement.offsets[i].poles)
        for i, offset in found.displacement.offsets.items()
    )
    assert same.scale is None


def test_a_bound_that_no_scale_reaches_takes_the_largest():
    knots = KnotVector.clamped(np.linspace(0, 1, 21), 3)
    model = sheet(fitted(knots, knots, lambda x, y: 0.05 * np.sin(x) + 0 * y))
    edit = smooth(model, Smooth(max_deviation="50mm", free_edges="smooth", corners="move"))
    assert edit.scale == model.diagonal and 0 < deviation(model, edit) < 1


def test_models_with_nothing_to_smooth_come_out_as_they_are():
    knots = KnotVector.clamped(np.linspace(0, 1, 21), 3)
    flat = sheet(fitted(knots, knots, lambda x, y: 0.3 * x + 0 * y))
    for model in (flat, view(shapes.document(cadquery.Solid.makeBox(3, 2, 1).wrapped))):
        edit = smooth(model, Smooth(max_deviation="0.1mm"))
        assert edit.scale == model.diagonal and not edit.displacement.offsets


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({}, "smooth needs a scale, a level or a limit of the deviation"),
        ({"max_deviation": "0.1mm", "amount": 0.5}, "amount: it needs a scale or a level"),
        ({"max_deviation": "0.1mm", "across": "5mm"}, "across: it needs a scale"),
        ({"max_deviation": "0mm"}, "max-deviation: '0mm' is not greater than zero"),
    ],
)
def test_what_leaves_no_scale_to_find_is_refused(options, said):
    with pytest.raises(UsageError, match=said):
        Smooth(**options)
