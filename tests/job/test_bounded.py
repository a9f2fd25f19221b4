"""However badly faces come out, edits are done again a bounded number of times; counted, not timed."""

from dataclasses import dataclass, field
from importlib import import_module

import numpy as np
import pytest

from mracad.edit import driver
from mracad.edit.fair import Filter
from mracad.edit.result import Edit, FaceOutcome
from mracad.edit.whole import edited
from mracad.errors import Code, EditError
from mracad.inspect import accept
from mracad.inspect.faults import Fault, FaultKind, ReadBack
from mracad.job import document as job
from mracad.job import produce
from mracad.job.left import ROUNDS
from mracad.model.displacement import Displacement
from mracad.occ.view import view
from mracad.spec.recipe import Step
from mracad.spec.steps import Smooth
from tests.edit import panels
from tests.occ import shapes


def panel(side, spans=6):
    _, noisy = panels.whole(spans, 0.1, patches=(side, side))
    return view(panels.document(panels.cut(noisy, (side, side))))


@dataclass(frozen=True)
class Counted(Filter):
    """Smoothing that writes down of how many surfaces it is asked at a time."""

    tried: list[int] = field(default_factory=list)

    def ways(self, problem, target, width):
        self.tried.append(len(problem.spaces))
        return super().ways(problem, target, width)


@dataclass(frozen=True)
class Refused(Counted):
    """That smoothing, but of joined surfaces one more is made rougher each time, as if there were no end of them."""

    refused: set[int] = field(default_factory=set)

    def ways(self, problem, target, width):
        every = super().ways(problem, target, width)
        if len(problem.spaces) == 1:
            return every
        self.refused.add(min(problem.spaces))
        parts = [-part if i in self.refused else part for i, part in problem.split(target).items()]
        return [[problem.nearest(np.concatenate([part.reshape(-1, 3) for part in parts]))]]


def test_groups_are_solved_a_bounded_number_of_times():
    """The judge takes everything from one surface more in every round."""
    wish = Refused(60.0)
    edit = edited(panel(3), Smooth(scale="60mm"), wish, None, None)
    assert [count for count in wish.tried if count > 1] == [9 - i for i in range(driver.ROUNDS)]
    assert len(edit.faces("edited")) == 9 and all(edge.how == "frozen" for edge in edit.edges)


@pytest.mark.parametrize(("spans", "scale", "solved"), [(10, 30.0, [1, 1, 9]), (6, 60.0, [1, 1, 9, *[1] * 7])])
def test_surfaces_that_go_through_together_are_not_all_tried_alone(spans, scale, solved):
    """At 60 mm not all that is wanted may be done to all of them together, so that the others are, too."""
    wish = Counted(scale)
    edit = edited(panel(3, spans), Smooth(scale=f"{scale}mm", refine="never"), wish, None, None)
    assert wish.tried == solved
    assert len({outcome.amount for outcome in edit.faces("edited")}) == 1 and len(edit.faces("edited")) == 9
    assert all((edge.how == "coupled") == (len(edge.faces) == 2) for edge in edit.edges)


class Stub:
    """An edit that says of every face that it may move that it did; the rounds are counted."""

    def __init__(self):
        self.chosen = []

    @property
    def rounds(self):
        return len(self.chosen)

    def __call__(self, model, options, *, scope, progress):
        self.chosen.append(scope.chosen)
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

    def found(model, before, after, edit, allowed, keep):
        return set(sorted({outcome.face for outcome in edit.faces("edited")} & set(faces))[:1])

    return found


def test_an_edit_is_done_again_a_bounded_number_of_times(monkeypatch):
    """Then all that seams join to what came out worse is left, and the rest is edited."""
    stub, document = Stub(), chains(ROUNDS + 6, 3)
    row = range(ROUNDS + 6)
    monkeypatch.setattr(job, "torn", first_edited(row))
    report = job.run(document, stub, Smooth(level=1))
    assert stub.rounds == ROUNDS + 2
    left = report.edit.faces("left")
    assert [outcome.face for outcome in left] == list(row)
    assert {outcome.said for outcome in left} == {"its seams would not hold"}
    assert [outcome.face for outcome in report.edit.faces("edited")] == [row.stop, row.stop + 1, row.stop + 2]


def test_an_edit_that_never_comes_out_is_refused_after_these_rounds(monkeypatch):
    stub, document = Stub(), chains(*[1] * (ROUNDS + 4))
    monkeypatch.setattr(job, "torn", first_edited(range(ROUNDS + 4)))
    with pytest.raises(EditError, match=f"#{ROUNDS + 2} would come out worse") as caught:
        job.run(document, stub, Smooth(level=1))
    assert caught.value.code == Code.CANNOT_EDIT and stub.rounds == ROUNDS + 2


def test_an_edit_that_fails_for_a_face_that_had_to_stay_says_so(monkeypatch):
    """The edit itself only sees that it may not touch the face."""

    def edit(model, options, *, scope, progress):
        if 1 not in scope.chosen:
            raise EditError("the place is not on the faces to edit", "give a point on one of them")
        return Stub()(model, options, scope=scope, progress=progress)

    monkeypatch.setattr(job, "torn", first_edited([1]))
    with pytest.raises(EditError, match="#2 cannot be edited: its seams would not hold; choose other faces"):
        job.run(chains(3), edit, Smooth(level=1))
    with pytest.raises(EditError, match="not on the faces to edit"):
        job.run(chains(3), edit, Smooth(level=1, faces=("#1",)))


def test_files_are_made_again_a_bounded_number_of_times(monkeypatch):
    """Every file is worse at one more face; the last is named."""
    stub, faces = Stub(), produce.ROUNDS + 4

    def worse(*_):
        return ReadBack(False, (Fault(FaultKind.AREA, (stub.rounds - 1,), 2.0, 1.0),))

    monkeypatch.setattr(accept, "read_back", worse)
    monkeypatch.setattr(import_module("mracad.edit.smooth"), "smooth", stub)
    step, target = Step("smooth", "smooth", Smooth(level=1)), produce.Target("out.brep", "brep")
    with pytest.raises(EditError, match=f"the area of #{produce.ROUNDS} changes") as caught:
        produce.produce(chains(*[1] * faces), lambda: chains(*[1] * faces), [step], [target])
    assert caught.value.code == Code.CANNOT_EDIT and stub.rounds == produce.ROUNDS
    assert stub.chosen == [set(range(i, faces)) for i in range(produce.ROUNDS)]
