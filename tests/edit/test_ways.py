"""How many ways to a target are tried, and with how many control points."""

import pytest

from mracad.edit import alone
from mracad.edit.fair import Filter, faired
from mracad.edit.smooth import smooth
from mracad.edit.tolerances import Tolerances
from mracad.edit.trial import Trial
from mracad.occ.view import view
from mracad.seam.wishes import Wishes
from mracad.spec.steps import Smooth
from tests.edit import panels
from tests.edit.models import noisy, sheet
from tests.edit.test_fair import fillet


@pytest.fixture(scope="module")
def net():
    return noisy()


@pytest.fixture
def trials(monkeypatch):
    """The displacements that are judged, by attempt."""
    found = []
    begin, judge = Trial.__init__, Trial.judged

    def begun(self, *given, **more):
        found.append([])
        begin(self, *given, **more)

    def judged(self, *given, **more):
        found[-1].append(given[0])
        return judge(self, *given, **more)

    monkeypatch.setattr(Trial, "__init__", begun)
    monkeypatch.setattr(Trial, "judged", judged)
    return found


def test_no_other_way_is_tried_after_one_that_is_allowed_whole_and_as_near_as_any(net, trials):
    found = faired(sheet(net), {0}, Filter(1.0), Wishes(), Tolerances(), refine=False).moved[0]
    assert found.amount == 1.0
    assert [len(each) for each in trials] == [1]


def test_control_points_are_multiplied_only_so_far(net, trials, monkeypatch):
    faired(sheet(net), {0}, Filter(2.0), Wishes(), Tolerances())
    assert len(trials) == 2
    trials.clear()
    monkeypatch.setattr(alone, "MOST", (1.0, 0))
    faired(sheet(net), {0}, Filter(2.0), Wishes(), Tolerances())
    assert len(trials) == 1


@pytest.mark.parametrize(("spans", "tried"), [(8, 1), (3, 2)], ids=["circular", "wavy"])
def test_control_points_are_added_only_where_a_surface_would_get_fairer_if_nothing_were_held(spans, tried, trials):
    moved = faired(sheet(fillet(spans=spans)), {0}, Filter(4.0), Wishes(), Tolerances()).moved[0]
    assert len(trials) == tried and moved.gaining == (tried == 2)


def test_amounts_of_joined_surfaces_are_only_found_where_no_way_is_allowed_whole(monkeypatch):
    model = view(panels.document(panels.cut(panels.whole(12, 0.2, patches=(2, 2))[1], (2, 2))))
    looked, shared, judge, share = [], [], Trial.judged, Trial.shared
    monkeypatch.setattr(Trial, "shared", lambda *given: shared.append(given) or share(*given))
    monkeypatch.setattr(
        Trial, "judged", lambda *given, **more: looked.append(more.get("wholly")) or judge(*given, **more)
    )
    moved = smooth(model, Smooth(scale="58.3mm"))
    assert [each.amount for each in moved.outcomes] == [1.0] * 4
    assert looked.count(True) == 2 and not shared
