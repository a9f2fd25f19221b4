"""However badly seams hold, the work of a group stays in proportion to it; counted, not timed."""

import numpy as np
import pytest

from mracad import guard
from mracad.edit import group as module
from mracad.edit.group import Group
from mracad.edit.smooth import smooth
from mracad.occ.view import view
from mracad.options import Smooth
from tests.edit import halves, panels


@pytest.fixture
def solved(monkeypatch):
    """Control points of every coupled projection and every shutting of trimmed seams, in order."""
    points = []
    project, shut = Group._moved, module.shut

    def projected(self, couplings, separations, bound):
        points.append(module.PROJECTION * module._points(p.net for p in couplings[0][1].patches.values()))
        return project(self, couplings, separations, bound)

    def shutting(sheets, *rest):
        points.append(module._points(sheet.net for sheet in sheets.values()))
        return shut(sheets, *rest)

    monkeypatch.setattr(Group, "_moved", projected)
    monkeypatch.setattr(module, "shut", shutting)
    monkeypatch.setattr(module, "LEAST_WORK", 0)
    return points


def panel(side, spans=6):
    _, noisy = panels.whole(spans, 0.1, patches=(side, side))
    return view(panels.document(panels.cut(noisy, (side, side))))


def own_points(model):
    return module._points(surface.net for surface in model.surfaces)


@pytest.mark.parametrize("side", [3, 5])
def test_rounds_do_not_grow_with_the_seams_of_a_group(side, solved, monkeypatch):
    """Every round finds one more seam that does not hold, as if there were no end of them."""
    monkeypatch.setattr(Group, "_broken", lambda self, moved: {self._every()[0].edge: "would gape"})
    model = panel(side)
    edit = smooth(model, Smooth(scale="60mm"))
    assert sum(solved) <= (module.WORK + module.LAST_WORK) * own_points(model)
    given_up = [edge for edge in edit.edges if edge.reason.startswith("given up after ")]
    assert len(given_up) > len(edit.edges) / 4 and all(edge.how == "frozen" for edge in given_up)
    assert {edge.reason for edge in given_up} <= {f"given up after {n} rounds" for n in range(1, 12)}
    assert all(edge.how == "frozen" for edge in edit.edges) and edit.faces("edited")


def test_seams_that_hold_are_not_given_up(solved):
    edit = smooth(panel(3), Smooth(scale="60mm"))
    assert not any(edge.reason.startswith("given up") for edge in edit.edges)
    assert sum(edge.how == "coupled" for edge in edit.edges) == 12 and len(solved) == 1


def test_spans_are_halved_only_up_to_a_bound_for_the_whole_group(solved, monkeypatch):
    """A trimmed seam that stays open whatever is done."""
    _, left, right = halves.surfaces(0.2, (12, 24))
    model = view(halves.document(left, right))
    monkeypatch.setattr(module, "MOST_POINTS", 2 * own_points(model))
    monkeypatch.setattr(Group, "_excess", lambda self, seam, after: (np.linspace(0, 1, 9), np.full(9, 2.0)))
    edit = smooth(model, Smooth(scale="30mm"))
    shutting = solved[1:]
    assert len(shutting) > 1 and max(shutting) <= module.MOST_GROWTH * own_points(model)
    assert sum(solved) <= (module.WORK + module.LAST_WORK) * own_points(model)
    assert all(edge.how == "frozen" for edge in edit.edges)


def test_what_a_group_is_at_is_noted(monkeypatch):
    """For the message of a time limit."""
    noted = []
    monkeypatch.setattr(guard, "doing", lambda stage="", subject="": noted.append(stage))
    smooth(panel(2), Smooth(scale="60mm"))
    assert "smoothing group 1 of 1, round 1" in noted
