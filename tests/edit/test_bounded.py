"""However badly seams hold, the work of a group stays in proportion to it; counted, not timed."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from mracad import guard, job, produce
from mracad.audit.faults import Fault, ReadBack, Reason
from mracad.edit import group as module
from mracad.edit.group import Group
from mracad.edit.result import Edit, FaceOutcome
from mracad.edit.smooth import smooth
from mracad.errors import Code, EditError
from mracad.model import Displacement
from mracad.occ.view import view
from mracad.options import Smooth
from mracad.recipe import Step
from tests.edit import halves, panels
from tests.occ import shapes


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
    assert {edge.reason for edge in given_up} <= {
        "given up after 1 round",
        *(f"given up after {n} rounds" for n in range(2, 12)),
    }
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


class Stub:
    """An edit that says of every face that it may move that it did; the rounds are counted."""

    def __init__(self):
        self.rounds = 0

    def __call__(self, model, options, *, scope, progress):
        self.rounds += 1
        faces = range(len(model.faces))
        return Edit(
            Displacement({}),
            tuple(FaceOutcome(i, "edited") if i in scope.chosen else FaceOutcome(i, "held") for i in faces),
        )


def chains(*lengths):
    """Rows of flat faces that seams join, each row apart from the others."""
    grid = np.stack(np.meshgrid(np.arange(4.0), np.arange(4.0), [0.0], indexing="ij"), axis=-1)[:, :, 0]
    rows = [
        [shapes.face_on(shapes.bspline(grid + np.array([3.0 * i, 10.0 * row, 0.0]))) for i in range(length)]
        for row, length in enumerate(lengths)
    ]
    return shapes.document(shapes.compound(*(shapes.sewn(*faces) for faces in rows)))


def first_edited(faces):
    """A finding of the first of some faces that is edited, each time, as if there were no end of them."""

    def found(before, after, edit, keep):
        return set(sorted({outcome.face for outcome in edit.faces("edited")} & set(faces))[:1])

    return found


def test_an_edit_is_done_again_a_bounded_number_of_times(monkeypatch):
    """Then all that seams join to what came out worse is left, and the rest is edited."""
    stub, document = Stub(), chains(job.ROUNDS + 6, 3)
    row = range(job.ROUNDS + 6)
    monkeypatch.setattr(job, "_torn", first_edited(row))
    report = job.run(document, stub, Smooth(level=1))
    assert stub.rounds == job.ROUNDS + 2
    stuck = report.edit.faces("stuck")
    assert [outcome.face for outcome in stuck] == list(row)
    assert {outcome.reason for outcome in stuck} == {"its seams would not hold"}
    assert [outcome.face for outcome in report.edit.faces("edited")] == [row.stop, row.stop + 1, row.stop + 2]


def test_an_edit_that_never_comes_out_is_refused_after_these_rounds(monkeypatch):
    stub, document = Stub(), chains(*[1] * (job.ROUNDS + 4))
    monkeypatch.setattr(job, "_torn", first_edited(range(job.ROUNDS + 4)))
    with pytest.raises(EditError, match=f"#{job.ROUNDS + 2} would come out worse") as caught:
        job.run(document, stub, Smooth(level=1))
    assert caught.value.code == Code.CANNOT_EDIT and stub.rounds == job.ROUNDS + 2


def test_files_are_made_again_a_bounded_number_of_times(monkeypatch):
    """Every file is worse at one more face; the last is named."""
    stub, document = Stub(), chains(*[1] * (produce.ROUNDS + 4))

    def judged(made, memory, copies):
        assert memory.edited == set(range(stub.rounds - 1, produce.ROUNDS + 4))
        return replace(made, read_back=ReadBack(False, (Fault(Reason.AREA, (min(memory.edited),), 2.0, 1.0),)))

    monkeypatch.setattr("mracad.produce._judged", judged)
    monkeypatch.setattr(sys.modules["mracad.edit.smooth"], "smooth", stub)
    step = Step("smooth", "smooth", Smooth(level=1))
    with pytest.raises(EditError, match=f"the area of #{produce.ROUNDS} changes") as caught:
        produce.produce(
            document, lambda: chains(*[1] * (produce.ROUNDS + 4)), [step], [produce.Target("out.brep", "brep")]
        )
    assert caught.value.code == Code.CANNOT_EDIT and stub.rounds == produce.ROUNDS


def test_trimmed_seams_join_no_more_surfaces_than_can_be_solved_at_once(monkeypatch):
    left, right = halves.surfaces(0.2, (30, 60))[1:]
    model = view(halves.document(left, right))
    for most, how in ((own_points(model), "to tolerance"), (own_points(model) - 1, "frozen")):
        monkeypatch.setattr("mracad.edit.together.MOST_TOGETHER", most)
        edit = smooth(model, Smooth(scale="30mm"))
        (seam,) = (edge for edge in edit.edges if len(edge.faces) == 2)
        assert seam.how == how and (how != "frozen" or seam.reason == "too many faces there to move together")
        assert len(edit.faces("edited")) == 2
