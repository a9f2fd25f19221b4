"""However badly faces come out, edits are done again a bounded number of times; counted, not timed."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from mracad.edit import driver
from mracad.edit.result import Edit, FaceOutcome
from mracad.edit.smooth import smooth
from mracad.errors import Code, EditError
from mracad.inspect.faults import Fault, FaultKind, ReadBack
from mracad.job import document as job
from mracad.job import produce
from mracad.model.displacement import Displacement
from mracad.occ.view import view
from mracad.spec.recipe import Step
from mracad.spec.steps import Smooth
from tests.edit import panels
from tests.occ import shapes


def panel(side, spans=6):
    _, noisy = panels.whole(spans, 0.1, patches=(side, side))
    return view(panels.document(panels.cut(noisy, (side, side))))


@pytest.mark.parametrize("side", [2, 4])
def test_groups_are_solved_a_bounded_number_of_times(side, monkeypatch):
    """The judge takes everything from one surface more in every round, as if there were no end of them."""
    tried, refused = [], set()
    attempt = driver._attempt

    def refusing(scene, wish, members, joined, *rest):
        found = attempt(scene, wish, members, joined, *rest)
        if len(members) > 1:
            tried.append(len(members))
            refused.add(min(members))
        return {
            i: replace(moved, amount=0.0) if i in refused and len(members) > 1 else moved for i, moved in found.items()
        }

    monkeypatch.setattr(driver, "_attempt", refusing)
    model = panel(side)
    edit = smooth(model, Smooth(scale="60mm"))
    assert 0 < sum(tried) <= (1 + driver.ROUNDS) * side * side  # all at once, and then the rounds
    assert len(edit.faces("edited")) > side * side / 2 and all(edge.how == "frozen" for edge in edit.edges)


@pytest.mark.parametrize(("spans", "scale", "solved"), [(10, "30mm", [1, 1, 9]), (6, "60mm", [1, 1, 9, *[1] * 7])])
def test_surfaces_that_go_through_together_are_not_all_tried_alone(spans, scale, solved, monkeypatch):
    """What comes of them is what would have come of them; at 60 mm two of them do not, and are left out then."""
    model, options, tried = panel(3, spans), Smooth(scale=scale, refine="never"), []
    attempt = driver._attempt

    def counted(scene, wish, members, joined, finer=()):
        tried.append(len(members))
        return attempt(scene, wish, members, joined, finer)

    monkeypatch.setattr(driver, "_attempt", counted)
    some = smooth(model, options)
    assert tried == solved
    monkeypatch.setattr(driver, "FIRST", 9)
    every = smooth(model, options)
    assert tried[len(solved) :] == [1] * 9 + [9]
    assert some.displacement.offsets.keys() == every.displacement.offsets.keys()
    assert some.faces("edited") == every.faces("edited")
    for index, offset in some.displacement.offsets.items():
        assert np.array_equal(offset.poles, every.displacement.offsets[index].poles)


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

    def found(model, before, after, edit, allowed, keep):
        return set(sorted({outcome.face for outcome in edit.faces("edited")} & set(faces))[:1])

    return found


def test_an_edit_is_done_again_a_bounded_number_of_times(monkeypatch):
    """Then all that seams join to what came out worse is left, and the rest is edited."""
    stub, document = Stub(), chains(job.ROUNDS + 6, 3)
    row = range(job.ROUNDS + 6)
    monkeypatch.setattr(job, "torn", first_edited(row))
    report = job.run(document, stub, Smooth(level=1))
    assert stub.rounds == job.ROUNDS + 2
    left = report.edit.faces("left")
    assert [outcome.face for outcome in left] == list(row)
    assert {outcome.said for outcome in left} == {"its seams would not hold"}
    assert [outcome.face for outcome in report.edit.faces("edited")] == [row.stop, row.stop + 1, row.stop + 2]


def test_an_edit_that_never_comes_out_is_refused_after_these_rounds(monkeypatch):
    stub, document = Stub(), chains(*[1] * (job.ROUNDS + 4))
    monkeypatch.setattr(job, "torn", first_edited(range(job.ROUNDS + 4)))
    with pytest.raises(EditError, match=f"#{job.ROUNDS + 2} would come out worse") as caught:
        job.run(document, stub, Smooth(level=1))
    assert caught.value.code == Code.CANNOT_EDIT and stub.rounds == job.ROUNDS + 2


def test_an_edit_that_fails_for_a_face_that_had_to_stay_says_so(monkeypatch):
    """The edit itself only sees that it may not touch the face."""

    def edit(model, options, *, scope, progress):
        if 1 not in scope.chosen:
            raise EditError("the place is off the faces to edit", "give a point on one of them")
        return Stub()(model, options, scope=scope, progress=progress)

    monkeypatch.setattr(job, "torn", first_edited([1]))
    with pytest.raises(EditError, match="#2 cannot be edited: its seams would not hold; choose other faces"):
        job.run(chains(3), edit, Smooth(level=1))
    with pytest.raises(EditError, match="off the faces to edit"):
        job.run(chains(3), edit, Smooth(level=1, faces=("#1",)))


def test_files_are_made_again_a_bounded_number_of_times(monkeypatch):
    """Every file is worse at one more face; the last is named."""
    stub, document = Stub(), chains(*[1] * (produce.ROUNDS + 4))

    def judged(made, memory, copies):
        assert memory.edited == set(range(stub.rounds - 1, produce.ROUNDS + 4))
        return replace(made, read_back=ReadBack(False, (Fault(FaultKind.AREA, (min(memory.edited),), 2.0, 1.0),)))

    monkeypatch.setattr("mracad.job.produce._judged", judged)
    monkeypatch.setattr(sys.modules["mracad.edit.smooth"], "smooth", stub)
    step = Step("smooth", "smooth", Smooth(level=1))
    with pytest.raises(EditError, match=f"the area of #{produce.ROUNDS} changes") as caught:
        produce.produce(
            document, lambda: chains(*[1] * (produce.ROUNDS + 4)), [step], [produce.Target("out.brep", "brep")]
        )
    assert caught.value.code == Code.CANNOT_EDIT and stub.rounds == produce.ROUNDS
