"""A doctored file is told from a good one, whatever was done to it; what the kernel does as well is forgiven."""

from __future__ import annotations

import io
from collections.abc import Callable, Collection
from dataclasses import replace

import cadquery as cq
import numpy as np
import pytest
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_Copy, BRepBuilderAPI_NurbsConvert
from OCP.gp import gp_Pnt
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Shape

from mracad.inspect import accept, faults
from mracad.inspect.accept import Slack, judge
from mracad.inspect.faults import Fault, FaultKind
from mracad.inspect.seams import seams
from mracad.job.words import of_fault
from mracad.occ import brep
from mracad.occ.document import Document
from mracad.occ.facts import facts
from mracad.occ.load import Text
from mracad.occ.view import view

Doctor = Callable[[cq.Shape], TopoDS_Shape]


def body() -> cq.Shape:
    """A rounded block with a hole, all of NURBS."""
    solid = cq.Workplane().box(30, 20, 10).edges("|Z").fillet(4).faces(">Z").workplane().hole(5).val()
    return cq.Shape.cast(BRepBuilderAPI_NurbsConvert(solid.wrapped, True).Shape())


def document(shape: TopoDS_Shape) -> Document:
    stream = io.BytesIO()
    cq.Shape.cast(shape).exportBrep(stream)
    return brep.read_brep(Text(stream.getvalue(), "part.brep"))


def same(shape: cq.Shape) -> TopoDS_Shape:
    return shape.wrapped


def without_a_face(shape: cq.Shape) -> TopoDS_Shape:
    return cq.Shell.makeShell(shape.Faces()[:-1]).wrapped


def twice(shape: cq.Shape) -> TopoDS_Shape:
    return cq.Compound.makeCompound([shape, cq.Solid.makeBox(2, 2, 2, cq.Vector(-1, -1, 0))]).wrapped


def poles(move: Callable[[np.ndarray], np.ndarray]) -> Doctor:
    """Moves the control points of the largest face, and nothing else."""

    def doctor(shape: cq.Shape) -> TopoDS_Shape:
        copied = cq.Shape.cast(BRepBuilderAPI_Copy(shape.wrapped, True, False).Shape())
        face = max(copied.Faces(), key=lambda f: f.Area())
        surface = BRep_Tool.Surface_s(TopoDS.Face_s(face.wrapped), TopLoc_Location())
        for i in range(1, surface.NbUPoles() + 1):
            for j in range(1, surface.NbVPoles() + 1):
                surface.SetPole(i, j, gp_Pnt(*move(np.array(surface.Pole(i, j).Coord())).tolist()))
        return copied.wrapped

    return doctor


def loose(shape: cq.Shape) -> TopoDS_Shape:
    copied = BRepBuilderAPI_Copy(shape.wrapped, True, False).Shape()
    BRep_Builder().UpdateEdge(TopoDS.Edge_s(cq.Shape.cast(copied).Edges()[0].wrapped), 0.01)
    return copied


def smaller(shape: cq.Shape) -> TopoDS_Shape:
    return shape.scale(0.999).wrapped


def reasons(doctor: Doctor, **slack: object) -> set[FaultKind]:
    """What is found in a doctored body, with nothing to forgive it."""
    shape = body()
    memory, file = facts(document(shape.wrapped)), facts(document(doctor(shape)))
    left, forgiven = judge(memory, file, Slack(**slack), lambda: (memory, memory))  # type: ignore[arg-type]
    assert not forgiven
    return {fault.reason for fault in left}


def test_what_comes_back_as_it_was_has_no_faults() -> None:
    assert reasons(same) == set()


def test_a_face_that_is_missing_is_named() -> None:
    shape = body()
    memory, file = facts(document(shape.wrapped)), facts(document(without_a_face(shape)))
    left, _ = judge(memory, file, Slack(), lambda: (memory, memory))
    lost = [fault for fault in left if fault.reason is FaultKind.LOST]
    assert [fault.faces for fault in lost] == [(len(shape.Faces()) - 1,)]
    assert f"#{len(shape.Faces())} is lost" in of_fault(lost[0])
    assert {FaultKind.SOLIDS, FaultKind.FACES, FaultKind.FREE_EDGES} <= {fault.reason for fault in left}


@pytest.mark.parametrize(
    ("doctor", "expected"),
    [
        (twice, {FaultKind.SOLIDS, FaultKind.SHELLS, FaultKind.FACES, FaultKind.VOLUME}),
        (poles(lambda p: p + np.array([0, 0, 0.02])), {FaultKind.GAP}),
        (poles(lambda p: p + np.array([0, 0, 0.05 * p[0]])), {FaultKind.GAP}),
        (loose, {FaultKind.TOLERANCE}),
        (smaller, {FaultKind.AREA, FaultKind.BOX}),
    ],
    ids=["solid added", "seam opened", "face tilted", "tolerance grown", "smaller"],
)
def test_what_was_doctored_is_found(doctor: Doctor, expected: set[FaultKind]) -> None:
    assert expected <= reasons(doctor)


def panels(angle: float) -> TopoDS_Shape:
    """Two bilinear patches, joined along y, the second turned about the seam by an angle in degrees."""
    rise = np.tan(np.radians(angle))
    one = cq.Face.makeFromWires(cq.Wire.makePolygon([cq.Vector(*p) for p in _CORNERS], close=True))
    corners = [cq.Vector(x + 20, y, rise * x) for x, y, _ in _CORNERS]
    other = cq.Face.makeFromWires(cq.Wire.makePolygon(corners, close=True))
    sewn = cq.Shell.makeShell([one, other])
    return BRepBuilderAPI_NurbsConvert(sewn.wrapped, True).Shape()


_CORNERS = [(0, 0, 0), (20, 0, 0), (20, 30, 0), (0, 30, 0)]


@pytest.mark.parametrize(("angle", "found"), [(0.105, set()), (0.2, {FaultKind.ANGLE}), (5.0, {FaultKind.ANGLE})])
def test_a_smooth_seam_that_bends_is_found(angle: float, found: set[FaultKind]) -> None:
    """By more than a hundredth of a degree, and also where it is not smooth any more."""
    memory, file = facts(document(panels(0.1))), facts(document(panels(angle)))
    left, _ = judge(memory, file, Slack(), lambda: (memory, memory))
    assert {fault.reason for fault in left if fault.reason is FaultKind.ANGLE} == found
    assert all(fault.value == pytest.approx(angle, abs=1e-6) and fault.was == pytest.approx(0.1, abs=1e-6)
               for fault in left if fault.reason is FaultKind.ANGLE)  # fmt: skip


def test_the_slack_of_seams_that_moved_is_theirs_alone() -> None:
    """A gap of 2e-5 mm is a fault, but not where the seam may gape 1e-4 mm."""
    shift = poles(lambda p: p + np.array([0, 0, 2e-5]))
    assert FaultKind.GAP in reasons(shift)
    count = len(body().Faces())
    pairs = {(i, j) for i in range(count) for j in range(i, count)}
    assert FaultKind.GAP not in reasons(shift, gaps=dict.fromkeys(pairs, 1e-4))
    assert FaultKind.GAP in reasons(shift, moved=pairs)


def test_what_the_kernel_does_as_well_is_forgiven_but_no_loss() -> None:
    shape = body()
    memory, gap = facts(document(shape.wrapped)), facts(document(poles(lambda p: p + np.array([0, 0, 0.02]))(shape)))
    left, forgiven = judge(memory, gap, Slack(), lambda: (memory, gap))
    assert left == () and FaultKind.GAP in {fault.reason for fault in forgiven}
    lost = facts(document(without_a_face(shape)))
    left, _ = judge(memory, lost, Slack(), lambda: (memory, lost))
    assert {fault.reason for fault in left} >= {FaultKind.LOST}


def test_the_copy_is_read_unless_it_states_the_faces_in_the_same_way() -> None:
    memory, file = facts(document(panels(0.1))), facts(document(panels(0.2)))
    asked: list[object] = []

    def copy() -> tuple[accept.Facts, accept.Facts]:
        asked.append("copy")
        return memory, memory

    def alike(faces: Collection[int]) -> bool:
        asked.append(sorted(faces))
        return len(asked) == 1

    local = replace(file, spots=memory.spots)  # the box is not the subject
    assert judge(memory, local, Slack(), copy, alike)[0] == () and asked == [[0, 1]]
    left, _ = judge(memory, local, Slack(), copy, alike)
    assert [fault.reason for fault in left] == [FaultKind.ANGLE] and "copy" in asked


def test_faces_are_told_whatever_their_numbers() -> None:
    shape = body()
    memory = facts(document(shape.wrapped))
    back = facts(document(cq.Shell.makeShell(shape.Faces()[::-1]).wrapped))
    partners = accept.match(memory, back)
    assert sorted(partners.values()) == list(range(len(shape.Faces()))) and partners[0] != 0
    for face, twin in partners.items():
        assert back.spots[face] == pytest.approx(memory.spots[twin], abs=1e-6)


def test_faults_are_put_down_to_edited_faces() -> None:
    memory = facts(document(body().wrapped))
    fault = Fault(FaultKind.GAP, (0, 1))
    assert faults.blamed([fault], {1, 2}, memory) == {1}
    far = replace(fault, faces=(0,))
    near = faults.blamed([far], set(range(1, memory.count)), memory)
    assert near and near == {f for edge in memory.edges if 0 in edge.faces for f in edge.faces} - {0}
    assert faults.blamed([Fault(FaultKind.SOLIDS)], {3, 4}, memory) == {3, 4}


@pytest.mark.parametrize("height", [2e-3, 1.0])
def test_seams_that_were_never_sewn_are_judged_too(height: float) -> None:
    """A patch that lifts off its neighbour, so far that they do not look joined any more or not."""
    memory, file = (facts(document(apart(lift))) for lift in (0.0, height))
    for copy, expected in ((memory, {FaultKind.GAP, FaultKind.SEAM}), (file, set())):
        left, _ = judge(memory, file, Slack(), lambda copy=copy: (memory, copy))
        assert bool({fault.reason for fault in left} & {FaultKind.GAP, FaultKind.SEAM}) == bool(expected)


def apart(height: float) -> TopoDS_Shape:
    """Two patches side by side, each a shell of its own, the second lifted."""
    pieces = [cq.Wire.makePolygon([cq.Vector(x + dx, y, dz) for x, y, _ in _CORNERS], close=True)
              for dx, dz in ((0, 0), (20, height))]  # fmt: skip
    whole = cq.Compound.makeCompound([cq.Face.makeFromWires(wire) for wire in pieces])
    return BRepBuilderAPI_NurbsConvert(whole.wrapped, True).Shape()


def test_a_few_seams_measure_as_all_do() -> None:
    part = document(body().wrapped)
    every = seams(view(part))
    for number in (0, len(every) // 2):
        edge = every[number].edge
        (found,) = seams(facts(part).probe.along([edge]))
        assert found == every[number]


def test_a_few_edges_are_seen_without_the_true_box() -> None:
    """The box of a face needs all of its edges: of a few of them it came out without an end, and a sound file as
    damaged."""
    part = document(cq.Workplane().spline([(0, 0), (1, 1), (2, 0), (1, -1)]).close().extrude(3).val().wrapped)
    whole = view(part).diagonal
    assert whole <= view(part, edges=frozenset({0})).diagonal <= 1.1 * whole
