"""Viewing and editing in place: what is seen is what the kernel holds, what moves is what was asked."""

from itertools import pairwise

import numpy as np
import pytest
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_Copy,
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakeWire,
)
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeBox,
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakePrism,
    BRepPrimAPI_MakeRevol,
    BRepPrimAPI_MakeSphere,
    BRepPrimAPI_MakeTorus,
)
from OCP.Geom import Geom_BezierCurve, Geom_OffsetSurface, Geom_RectangularTrimmedSurface
from OCP.gp import gp_Ax1, gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
from OCP.TColgp import TColgp_Array1OfPnt
from OCP.TopLoc import TopLoc_Location

from mracad.errors import MracadError, UsageError
from mracad.model.displacement import Displacement, Offset
from mracad.occ.apply import apply
from mracad.occ.check import check
from mracad.occ.geometry import basis, set_poles
from mracad.occ.step import read_step, write_step
from mracad.occ.view import view
from tests.occ import shapes


def placed(angle, *shift):
    turn, move = gp_Trsf(), gp_Trsf()
    turn.SetRotation(gp_Ax1(gp_Pnt(1, 2, 3), gp_Dir(1, 1, 0)), angle)
    move.SetTranslation(gp_Vec(*shift))
    return TopLoc_Location(move * turn)


def kernel_poles(document, face):
    """The poles as the kernel gives them one by one, in memory units."""
    surface = basis(BRep_Tool.Surface_s(document.faces[face], TopLoc_Location()))
    table = [[surface.Pole(i, j) for j in range(1, surface.NbVPoles() + 1)] for i in range(1, surface.NbUPoles() + 1)]
    return np.array([[(p.X(), p.Y(), p.Z()) for p in row] for row in table])


def gaps(model):
    """Largest distance of the sides from their edges, mm."""
    worst = 0.0
    for edge in (edge for edge in model.edges if not edge.degenerate):
        for side in edge.sides:
            face = model.faces[side.face]
            points = side.points
            if points is None:
                points = model.surfaces[face.surface].net.evaluate(side.uv) @ face.frame[:3, :3].T + face.frame[:3, 3]
            worst = max(worst, np.linalg.norm(points - edge.points, axis=1).max())
    return worst


def bump(net, rows=slice(3, -3)):
    poles = np.zeros(net.poles.shape)
    poles[rows, rows] = [0.1, 0.2, 0.3]
    return Offset(poles)


def profile():
    """A closed planar profile with one curved side."""
    points = TColgp_Array1OfPnt(1, 5)
    for i, height in enumerate((0, 4, -2, 5, 1), 1):
        points.SetValue(i, gp_Pnt(4.0 * i, height, 0))
    curve = Geom_BezierCurve(points)
    corners = [gp_Pnt(20, 1, 0), gp_Pnt(20, -9, 0), gp_Pnt(4, -9, 0), gp_Pnt(4, 0, 0)]
    wire = BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(curve).Edge())
    for start, end in pairwise(corners):
        wire.Add(BRepBuilderAPI_MakeEdge(start, end).Edge())
    return BRepBuilderAPI_MakeFace(wire.Wire()).Face()


def solids():
    bar = BRepPrimAPI_MakeCylinder(5, 20).Shape()
    hole = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(-10, 0, 10), gp_Dir(1, 0, 0)), 2, 20).Shape()
    drilled = BRepAlgoAPI_Cut(bar, hole).Shape()
    return {
        "cylinder": bar,
        "drilled": drilled,
        "placed": drilled.Moved(placed(0.7, 3, 4, 5)),
        "apex": BRepPrimAPI_MakeCone(5, 0, 10).Shape(),
        "sphere": BRepPrimAPI_MakeSphere(7).Shape(),
        "torus": BRepPrimAPI_MakeTorus(10, 3).Shape(),
        "box": BRepPrimAPI_MakeBox(1, 2, 3).Shape(),
        "extrusion": BRepPrimAPI_MakePrism(profile(), gp_Vec(0, 0, 9)).Shape(),
        "revolution": BRepPrimAPI_MakeRevol(profile(), gp_Ax1(gp_Pnt(0, -20, 0), gp_Dir(1, 0, 0)), 2.0).Shape(),
        "turned": BRepPrimAPI_MakeRevol(profile(), gp_Ax1(gp_Pnt(0, -20, 0), gp_Dir(1, 0, 0))).Shape(),
    }


SOLIDS = solids()


def solid(name):
    """One of them, afresh: edits change shapes in place."""
    return BRepBuilderAPI_Copy(SOLIDS[name]).Shape()


@pytest.mark.parametrize("rational", [False, True])
def test_nets_are_the_kernels_own(rational):
    weights = 1 + np.random.default_rng(2).random((9, 7)) if rational else None
    document = shapes.document(shapes.face_on(shapes.bspline(shapes.wavy_poles(9, 7), weights=weights)))
    model = view(document)
    net = model.surfaces[0].net
    assert np.array_equal(net.poles, kernel_poles(document, 0))
    assert net.u.degree == 3 and net.u.domain == (0.0, 1.0)
    assert (net.weights is None) != rational
    if rational:
        assert np.array_equal(net.weights, weights)
    assert [len(edge.sides) for edge in model.edges] == [1] * 4 and all(edge.free for edge in model.edges)
    assert gaps(model) < 1e-12


def test_trimmed_and_bezier_surfaces_are_nurbs_too():
    surface = shapes.bspline(shapes.wavy_poles(9, 7))
    trimmed = shapes.face_on(Geom_RectangularTrimmedSurface(surface, 0.1, 0.6, 0.2, 0.9))
    model = view(shapes.document(trimmed, shapes.face_on(shapes.bezier(shapes.wavy_poles(5, 4)))))
    assert [face.kind for face in model.faces] == ["bspline", "bezier"]
    assert model.surfaces[0].net.poles.shape == (9, 7, 3)
    ends = np.concatenate([trim.curve.poles for trim in model.faces[0].trims])
    assert ends.min(axis=0) == pytest.approx([0.1, 0.2]) and ends.max(axis=0) == pytest.approx([0.6, 0.9])
    assert model.surfaces[1].net.u.degree == 4
    assert gaps(model) < 1e-12


def test_faces_on_one_handle_share_a_surface():
    surface = shapes.bspline(shapes.wavy_poles(9, 7))
    halves = shapes.face_on(surface, 0.0, 0.5, 0.0, 1.0), shapes.face_on(surface, 0.5, 1.0, 0.0, 1.0)
    other = shapes.face_on(shapes.bspline(shapes.wavy_poles(9, 7, seed=5)))
    model = view(shapes.document(shapes.compound(*halves, other)))
    assert [face.surface for face in model.faces] == [0, 0, 1]
    assert model.surfaces[0].faces == (0, 1)


@pytest.mark.parametrize("name", SOLIDS)
def test_every_side_lies_on_its_edge_and_normals_point_out(name):
    model = view(shapes.document(solid(name)))
    assert gaps(model) < 1e-6
    assert not any(edge.free for edge in model.edges)
    middle = np.mean([face.box for face in model.faces], axis=(0, 1))
    if name in ("cylinder", "apex", "sphere", "box"):
        for side in (side for edge in model.edges if not edge.degenerate for side in edge.sides):
            assert (np.einsum("ij,ij->i", side.normals, side.points - middle) > -1e-9).all()


def test_closing_and_degenerate_edges_are_flagged():
    model = view(shapes.document(solid("apex")))
    assert sum(edge.closing for edge in model.edges) == 1
    assert sum(edge.degenerate for edge in model.edges) == 1
    degenerate = next(edge for edge in model.edges if edge.degenerate)
    assert degenerate.points.shape == (0, 3) and not degenerate.free


def test_only_asked_poles_move_and_the_rest_keep_every_bit(tmp_path):
    surface = shapes.bspline(shapes.wavy_poles(12, 11))
    document = read_step(shapes.save(shapes.face_on(surface), tmp_path / "in.step", "INCH"))
    model = view(document)
    before = kernel_poles(document, 0)
    offset = bump(model.surfaces[0].net)
    apply(document, model, Displacement({0: offset}))
    after = kernel_poles(document, 0)
    moved = offset.poles.any(axis=2)
    assert np.array_equal(after[~moved], before[~moved])
    assert (after - before)[moved] == pytest.approx(offset.poles[moved])
    seen = model.surfaces[0].net.poles + offset.poles
    assert view(document).surfaces[0].net.poles == pytest.approx(seen, abs=1e-12)
    assert check(document).valid


def test_inserted_knots_are_exact_and_poles_line_up(tmp_path):
    weights = 1 + np.random.default_rng(2).random((9, 7))
    document = shapes.document(shapes.face_on(shapes.bspline(shapes.wavy_poles(9, 7), weights=weights)))
    model = view(document)
    u, v = np.array([0.05, 0.05, 1 / 6]), np.array([0.3])
    fine = model.surfaces[0].net.refined(u, v)
    offset = Offset(np.zeros(fine.poles.shape), u, v)
    apply(document, model, Displacement({0: offset}))
    net = view(document).surfaces[0].net
    assert net.u == fine.u and net.v == fine.v
    assert net.poles == pytest.approx(fine.poles, abs=1e-13) and net.weights == pytest.approx(fine.weights, abs=1e-13)


@pytest.mark.parametrize("name", ["cylinder", "sphere", "torus"])
def test_knots_go_into_periodic_surfaces(name):
    document = shapes.document(solid(name))
    model = view(document, convert=[0])
    net = model.surfaces[0].net
    assert net.u.periodic
    u, v = np.array([1.0, 1.0]), np.array([sum(net.v.domain) / 2 + 0.1])
    fine = net.refined(u, v)
    apply(document, model, Displacement({0: Offset(np.zeros(fine.poles.shape), u, v)}))
    assert view(document).surfaces[0].net.poles == pytest.approx(fine.poles, abs=1e-12)
    assert check(document).valid


def test_a_bezier_face_moves_with_and_without_knots():
    for knots in (np.empty(0), np.array([0.5])):
        document = shapes.document(shapes.face_on(shapes.bezier(shapes.wavy_poles(8, 8))))
        model = view(document)
        fine = model.surfaces[0].net.refined(knots, knots)
        offset = Offset(bump(fine).poles, knots, knots)
        apply(document, model, Displacement({0: offset}))
        again = view(document)
        assert again.surfaces[0].origin == ("bspline" if knots.size else "bezier")
        assert again.surfaces[0].net.poles == pytest.approx(fine.poles + offset.poles, abs=1e-12)
        assert check(document).valid and gaps(again) < 1e-9


def test_wrong_offsets_are_refused():
    document = shapes.document(shapes.face_on(shapes.bspline(shapes.wavy_poles(9, 7))))
    with pytest.raises(MracadError, match="shape"):
        apply(document, view(document), Displacement({0: Offset(np.zeros((3, 3, 3)))}))
    with pytest.raises(UsageError, match="no face #9"):
        view(document, convert=[8])


def test_instances_share_one_edit(tmp_path):
    face = shapes.face_on(shapes.bspline(shapes.wavy_poles(9, 9)))
    made = shapes.assembly(shapes.compound(face), placed(0, 0, 0, 0), placed(0.5, 30, 0, 0), placed(1, 60, 0, 9))
    write_step(made, tmp_path / "in.step")
    document = read_step(tmp_path / "in.step")
    model = view(document)
    assert len(model.faces) == 1 and model.faces[0].instances == 3
    assert model.diagonal > 60
    apply(document, model, Displacement({0: bump(model.surfaces[0].net)}))
    write_step(document, tmp_path / "out.step")
    again = view(read_step(tmp_path / "out.step"))
    assert again.faces[0].instances == 3
    assert np.array_equal(again.surfaces[0].net.poles, view(document).surfaces[0].net.poles)


def test_a_placed_body_inside_a_part_moves_in_its_own_frame():
    face = shapes.face_on(shapes.bspline(shapes.wavy_poles(9, 9)))
    place = placed(0.8, 7, 8, 9)
    document = shapes.document(shapes.compound(face, face.Moved(place)))
    model = view(document)
    assert [f.surface for f in model.faces] == [0, 0]
    assert not np.allclose(model.faces[1].frame, np.eye(4)) and gaps(model) < 1e-12
    offset = Offset(np.full(model.surfaces[0].net.poles.shape, 0.25))
    apply(document, model, Displacement({0: offset}))
    again = view(document)
    assert gaps(again) < 1e-7 and again.surfaces[0].net.poles == pytest.approx(model.surfaces[0].net.poles + 0.25)
    assert check(document).valid


@pytest.mark.parametrize("name", SOLIDS)
def test_converted_faces_stay_valid_and_closed(name, tmp_path):
    document = read_step(shapes.save(solid(name), tmp_path / "in.step"))
    before = check(document, distances=True)
    model = view(document, convert=range(len(document.faces)))
    assert gaps(model) < 1e-6
    assert len(model.surfaces) == len(model.faces) and "bspline" not in {s.origin for s in model.surfaces}
    still = {s.index: Offset(np.zeros(s.net.poles.shape)) for s in model.surfaces}
    apply(document, model, Displacement(still))
    write_step(document, tmp_path / "out.step")
    for after in (check(document, distances=True), check(read_step(tmp_path / "out.step"), distances=True)):
        assert after.valid and after.free_edges == before.free_edges == 0
        assert after.edge_tolerance <= before.edge_tolerance + 1e-6
        assert after.curve_distance <= before.curve_distance + 1e-6
    assert {face.kind for face in view(document).faces} == {"bspline"}


def test_only_selected_faces_are_converted():
    document = shapes.document(solid("drilled"))
    kinds = [face.kind for face in view(document).faces]
    chosen = kinds.index("cylinder")
    model = view(document, convert=[chosen])
    assert [face.index for face in model.faces if face.surface is not None] == [chosen]
    assert [face.kind for face in view(document).faces] == kinds
    apply(document, model, Displacement({0: Offset(np.zeros(model.surfaces[0].net.poles.shape))}))
    assert [face.kind for face in view(document).faces].count("bspline") == 1
    assert check(document).valid


def test_an_offset_surface_converts():
    base = shapes.bspline(shapes.wavy_poles(9, 9))
    document = shapes.document(shapes.face_on(Geom_OffsetSurface(base, 0.2)))
    assert view(document).faces[0].kind == "offset"
    model = view(document, convert=[0])
    assert model.surfaces[0].origin == "offset" and gaps(model) < 1e-3


@pytest.mark.parametrize("name", ["drilled", "apex", "sphere", "torus", "revolution", "placed"])
def test_edges_follow_faces_that_move_together(name):
    document = shapes.document(solid(name))
    model = view(document, convert=range(len(document.faces)))
    shift = np.full(3, 0.5)
    offsets = {}
    for surface in model.surfaces:
        in_own_frame = shift @ model.faces[surface.faces[0]].frame[:3, :3]
        offsets[surface.index] = Offset(np.broadcast_to(in_own_frame, surface.net.poles.shape))
    apply(document, model, Displacement(offsets))
    after = check(document, distances=True)
    assert after.valid and after.free_edges == 0
    assert after.edge_tolerance < 1e-6 and after.vertex_tolerance < 1e-6 and after.curve_distance < 1e-6
    again = view(document)
    assert gaps(again) < 1e-6
    for old, new in zip(model.edges, again.edges, strict=True):
        assert new.points == pytest.approx(old.points + (not old.degenerate) * shift, abs=1e-6)


def test_edges_that_stay_are_as_loose_as_the_kernel_finds_them():
    """Their curves lie as far off as their tolerance says; the face moves by less than what edges follow for."""
    off, by = 1e-5, 9e-10
    document = shapes.document(shapes.face_on(shapes.bspline(shapes.wavy_poles(9, 9))))
    lifted = np.add(view(document).surfaces[0].net.poles, [0.0, 0.0, off])
    set_poles(basis(BRep_Tool.Surface_s(document.faces[0], TopLoc_Location())), lifted)
    for edge in document.edges:
        BRep_Builder().UpdateEdge(edge, off + by / 10)
    assert check(document).valid
    model = view(document)
    curves = [BRep_Tool.Curve_s(edge, 0.0, 0.0) for edge in document.edges]
    apply(document, model, Displacement({0: Offset(np.full((9, 9, 3), [0.0, 0.0, by]))}))
    assert [BRep_Tool.Curve_s(edge, 0.0, 0.0) for edge in document.edges] == curves
    verdict = check(document)
    assert verdict.valid and off < verdict.edge_tolerance < off + 2 * by


def test_a_crack_is_found():
    document = shapes.document(shapes.sewn(*(
        shapes.face_on(shapes.bspline(shapes.wavy_poles(9, 9)), *bounds) for bounds in ((0, 0.5, 0, 1), (0.5, 1, 0, 1))
    )))  # fmt: skip
    assert check(document).valid
    model = view(document)
    poles = np.zeros(model.surfaces[0].net.poles.shape)
    poles[...] = [0, 0, 0.5]
    apply(document, model, Displacement({0: Offset(poles)}))
    verdict = check(document, faces=[0], distances=True)
    assert verdict.edge_tolerance > 0.1 or not verdict.valid


def test_check_names_what_fails():
    document = shapes.document(shapes.sewn(solid("box")), shapes.face_on(shapes.bspline(shapes.wavy_poles(9, 9))))
    good = check(document)
    assert (good.valid, good.solids + good.shells, good.faces, good.free_edges) == (True, good.solids + 1, 7, 4)
    model = view(document)
    poles = np.zeros(model.surfaces[0].net.poles.shape)
    poles[4, 4] = 1.0
    surface = basis(BRep_Tool.Surface_s(document.faces[6], TopLoc_Location()))
    surface.SetPole(1, 1, gp_Pnt(5, 5, 5))
    bad = check(document)
    assert not bad.valid
    assert {failure.face for failure in bad.failures} == {6}
    assert any(failure.kind in ("edge", "vertex") and failure.status.startswith("Invalid") for failure in bad.failures)
    assert check(document, faces=range(6)).valid
    assert not check(document, faces=[6]).valid
