"""What holds surfaces, and where they get more control points."""

from dataclasses import replace

import numpy as np
import pytest
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.gp import gp_Dir, gp_Pln, gp_Pnt

from mracad.bspline.fit import interpolated
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.model.brep import Edge, Face, Model, Side, Surface, Trim
from mracad.model.cells import quadrature
from mracad.occ.view import view
from mracad.seam.interface import Joints, away, contact, end, joints, rims, twists
from mracad.seam.metric import planar, smoothed
from mracad.seam.natural import Meeting
from mracad.seam.space import MOST_POINTS, refined
from mracad.seam.wishes import Wishes
from mracad.wavelet.ladder import arc_lengths
from tests.edit import panels
from tests.edit.models import free_edge, sheet
from tests.model.shapes import circle, cylinder, face, graph, plane, rectangle, segment
from tests.occ import shapes


def trimmed(net, curves):
    """A model of one face of ``net`` within curves, all of them free edges."""
    own = face(curves)
    edges = tuple(free_edge(i, net, curve) for i, curve in enumerate(curves))
    return Model("face", (Surface(0, net, (0,)),), (own,), edges, 1.0)


def held_by(model, net, moving=(), orders=(), movable=(0,)):
    meetings = {edge: Meeting(order, 0.0, 0.0, ()) for edge, order in dict(orders).items()}
    joined = Joints(closing=dict.fromkeys(moving), meetings=meetings)
    return rims(model, net, model.faces, set(movable), joined)


def test_a_natural_rim_holds_its_row():
    net = plane(6)
    held, contacts = held_by(sheet(net), net)
    border = np.ones(held.shape, bool)
    border[1:-1, 1:-1] = False
    assert not contacts and np.array_equal(held, border)
    held, _ = held_by(sheet(net), net, moving={0})
    assert not held[1:-1, 0].any() and held[[0, -1]].all() and held[:, -1].all()


def test_twists_are_kept_where_two_held_sides_meet():
    net = plane(6)
    for moving, corners in ((), 4), ({0}, 2), ({0, 1}, 1), ({0, 2}, 0):
        held, _ = held_by(sheet(net), net, moving)
        found = twists(held)
        assert found.sum() == corners and not (found & held).any()
        assert not found.any() or found[np.ix_([1, -2], [1, -2])].sum() == corners


def beside(angle, curvature=0.0):
    """A sheet whose first edge, y = 0, is shared with a face at an angle that no edit moves."""
    net = plane(6)
    model = sheet(net)
    edge = model.edges[0]
    normals = np.tile([0.0, -np.sin(angle), np.cos(angle)], (len(edge.points), 1))
    other = Side(1, points=edge.points, normals=normals, curvatures=np.full(len(normals), curvature))
    flat = Face(1, "plane", None, (), False, np.eye(4), model.faces[0].box)
    edges = (replace(edge, sides=(edge.sides[0], other)), *model.edges[1:])
    return replace(model, faces=(*model.faces, flat), edges=edges), net


@pytest.mark.parametrize(("keep", "bent"), [("g0", 0), ("g1", 1), ("g2", 2), ("as-is", 2)])
def test_smooth_rims_hold_as_many_rows_as_they_keep_derivatives(keep, bent):
    for angle, rows in ((0.0, bent + 1), (0.5, 1)):
        model, net = beside(angle)
        joined = joints(model, {0}, Wishes(keep))
        held, _ = rims(model, net, model.faces[:1], {0}, joined)
        assert held[:, :rows].all() and not held[1:-1, rows:-1].any()


def test_rims_keep_what_they_have():
    for curvature, allowed, order in ((0.0, 0.0, 2), (1e-3, 1e-4, 1), (1e-3, 2e-3, 2), (np.nan, 1.0, 1)):
        model, _ = beside(0.0, curvature)
        assert joints(model, {0}, Wishes("as-is", bend=allowed)).orders == {0: order}
    model, _ = beside(0.5)
    assert joints(model, {0}, Wishes("as-is")).orders == {0: 0}


@pytest.mark.parametrize("bend", [1.0, -1.0])
def test_curvatures_may_differ_by_a_hundredth(bend):
    wishes, straight = Wishes("as-is"), np.zeros(5)
    one = bend * np.linspace(0.5, 2.0, 5)
    assert wishes.order(straight, one, 0.995 * one) == 2 and wishes.order(straight, one, 0.98 * one) == 1
    assert wishes.order(straight, one, -one) == 1
    assert wishes.order(straight + 0.1, one, one) == 0


def test_rims_of_faces_that_were_never_sewn_keep_what_they_have():
    clean, _ = panels.whole(6, 0.0, patches=(1, 2))
    model = view(panels.document(panels.cut(clean, (1, 2)), sewn=False))
    both = joints(model, {0, 1}, Wishes("g1"))
    assert len(both.exact) == 1
    twins = {both.exact[0].edge, both.exact[0].twin}
    for movable in ({0}, {1}):
        joined = joints(model, movable, Wishes("g1"))
        assert not joined.exact and {edge for edge, order in joined.orders.items() if order} == twins
        net = model.surfaces[next(iter(movable))].net
        held, _ = rims(model, net, [model.faces[next(iter(movable))]], movable, joined)
        assert held[3].sum() == 3  # two rows at the neighbour, one at the free edge


def test_part_of_a_side_holds_what_reaches_it():
    net = plane(8)
    model = trimmed(net, rectangle(0.0, 0.0, 1.0, 0.5))
    held, contacts = held_by(model, net)
    assert len(contacts) == 1 and contacts[0].order == 0 and contacts[0].b is None  # y = 0.5 is no end
    reaching = net.v.knots[: net.v.count] < 0.5
    assert np.array_equal(held[0], reaching) and np.array_equal(held[-1], reaching)
    assert held[:, 0].all() and not held[1:-1, 1:].any()


def test_a_trim_curve_is_held_by_contact():
    net = plane(8)
    curves = [*rectangle(0.0, 0.0, 1.0, 1.0), circle((0.5, 0.5), 0.2)]
    held, contacts = held_by(trimmed(net, curves), net)
    assert [contact.a.curve for contact in contacts] == [curves[-1]]
    assert not held[1:-1, 1:-1].any()


def test_a_degenerate_edge_holds_no_more_than_its_point():
    net = plane(4)
    model = trimmed(net, rectangle(0.1, 0.1, 0.9, 0.9))
    point = Edge(0, np.empty((0, 3)), np.empty((0, 3)), model.edges[0].sides, 1e-7, degenerate=True)
    _, contacts = held_by(replace(model, edges=(point, *model.edges[1:])), net)
    assert len(contacts) == 3


def test_a_face_that_stays_holds_all_that_it_shows():
    net = plane(10)
    halves = rectangle(0.0, 0.0, 0.3, 1.0), rectangle(0.3, 0.0, 1.0, 1.0)
    faces = tuple(
        replace(face(curves), index=i, trims=tuple(Trim(4 * i + k, curve) for k, curve in enumerate(curves)))
        for i, curves in enumerate(halves)
    )
    edges = tuple(free_edge(4 * i + k, net, curve) for i, curves in enumerate(halves) for k, curve in enumerate(curves))
    model = Model("two", (Surface(0, net, (0, 1)),), faces, edges, 1.0)
    held, _ = held_by(model, net, movable={1})
    assert held[net.u.knots[: net.u.count] < 0.3 - 1e-9].all() and not held[7:-1, 1:-1].any()


def tube():
    """A model of a tube, closed along u = 0 and u = 1."""
    net = cylinder().refined(np.arange(16) / 16 + 0.03, [])
    low, high = net.v.domain
    sides = ((0.0, low), (1.0, low)), ((1.0, low), (1.0, high)), ((1.0, high), (0.0, high)), ((0.0, low), (0.0, high))
    trims = tuple(Trim(edge, segment(*ends)) for edge, ends in zip((0, 1, 2, 1), sides, strict=True))
    low_rim, closing, high_rim = (free_edge(trim.edge, net, trim.curve) for trim in trims[:3])
    right = closing.sides[0].uv
    closing = replace(closing, sides=(Side(0, uv=right), Side(0, uv=right - [1.0, 0.0])))
    own = replace(face(), trims=trims)
    return Model("tube", (Surface(0, net, (0,)),), (own,), (low_rim, closing, high_rim), 5.0)


def test_closing_edges_of_periodic_surfaces_move():
    model = tube()
    joined = joints(model, {0}, Wishes())
    assert set(joined.closing) == {1} and joined.moving == {1} and not joined.exact
    held, contacts = rims(model, model.surfaces[0].net, model.faces, {0}, joined)
    assert not contacts and held[:, [0, -1]].all() and not held[:, 1:-1].any()


def test_distances_from_what_holds():
    net = plane(9)
    model = sheet(net)
    far = away(net, model.faces, ())
    x, y = net.poles[..., 0], net.poles[..., 1]
    assert np.abs(far - np.minimum(np.minimum(x, y), np.minimum(1 - x, 1 - y))).max() < 1 / 128  # 65 points a side
    far = away(net, model.faces, {0, 1, 2})
    assert np.abs(far - x).max() < 1 / 128
    assert np.isinf(away(net, model.faces, {0, 1, 2, 3})).all()


def test_ends_are_told_from_lines_inside():
    net = plane(4)
    for curve, place in (
        (segment((0, 0), (0, 1)), (0, 0)),
        (segment((1, 1), (1, 0)), (0, -1)),
        (segment((0.2, 1), (0.7, 1)), (1, -1)),
        (segment((0.5, 0), (0.5, 1)), None),
        (segment((0, 0), (1, 1)), None),
    ):
        assert end(net, Trim(0, curve)) == place
    tube = cylinder()
    assert end(tube, Trim(0, segment((0, 0), (0, 3)))) is None
    assert end(tube, Trim(0, segment((0, 3), (1, 3)))) == (1, -1)


def test_refinement_goes_across_rims_only():
    net = graph(lambda x, y: 0.2 * np.sin(4 * x) * y, 4, 3)
    model = sheet(net)
    own = model.faces[0]
    fine = refined(net, (own.trims[3].curve,), (0.05, 0.05))  # x = 0
    assert fine.v == net.v and fine.u.count > net.u.count
    assert arc_lengths(fine, 0)[0] <= 0.05 * (1 + 1e-9)
    assert set(net.u.breaks[1:]) <= set(fine.u.breaks) and (fine.u.breaks[1:-1] < 0.25 + 1e-9).sum() > 3
    assert np.array_equal(fine.u.breaks[fine.u.breaks >= 0.25], net.u.breaks[1:])
    uv = np.random.default_rng(0).uniform(0, 1, (200, 2))
    assert np.abs(fine.evaluate(uv) - net.evaluate(uv)).max() < 1e-13
    assert refined(net, (), (0.05, 0.05)) is net and refined(net, (own.trims[3].curve,), (1.0, 1.0)) is net


def test_refinement_meets_slanted_rims_in_both_directions_and_is_bounded():
    net = plane(4)
    curves = [segment((0.1, 0.1), (0.9, 0.2)), segment((0.9, 0.2), (0.5, 0.9)), segment((0.5, 0.9), (0.1, 0.1))]
    model = trimmed(net, curves)
    own = model.faces[0]
    fine = refined(net, (own.trims[0].curve,), (0.1, 0.1))
    assert fine.u.count > net.u.count and fine.v.count > net.v.count
    most = refined(net, tuple(trim.curve for trim in own.trims), (1e-4, 1e-4))
    assert most.u.count * most.v.count <= MOST_POINTS


def test_joints_of_a_panel():
    clean, _ = panels.whole(4, 0.0)
    model = view(panels.document(panels.cut(clean, (2, 3))))
    found = joints(model, {0, 1, 2, 3, 4, 5}, Wishes("g1"))
    assert len(found.exact) == 7 and not found.loose and not found.closing
    assert {seam.joint.order for seam in found.exact} == {1}
    part = found.among({0, 1})
    assert set(part.pairs()) <= {(0, 1), (1, 0)} and len(part.exact) == 1 and len(part.moving) == 1
    lone = joints(model, {0}, Wishes("g1"))
    assert not lone.exact and not lone.moving


@pytest.mark.parametrize(("raised", "exact"), [([(0, 1)], 4), ([(0, 1), (1, 0)], 2)])
def test_seams_that_would_take_too_much_memory_are_kept_to_a_tolerance(raised, exact):
    patches = panels.cut(panels.whole(6, 0.0)[0], (2, 2))
    for place in raised:  # high degrees in both directions meet in the first patch
        net = patches[place].net
        knots = [k.elevated(14) if k is (net.u, net.v)[place[0]] else k for k in (net.u, net.v)]
        patches[place] = replace(patches[place], net=net.over(*knots))
    found = joints(view(panels.document(patches)), {0, 1, 2, 3}, Wishes("g1"))
    assert (len(found.exact), len(found.loose), len(found.moving)) == (exact, 4 - exact, 4)
    assert {seam.order for seam in found.loose} <= {1} and {seam.joint.order for seam in found.exact} <= {1}


def test_the_first_metric_is_a_plane_of_mean_chords():
    net = graph(lambda x, y: 0.3 * np.sin(5 * x), 8, 3)
    flat = planar(net)
    steps = np.linalg.norm(np.diff(net.poles, axis=0), axis=2).mean(axis=1)
    assert np.abs(np.diff(flat.poles[:, 0, 0]) - steps).max() < 1e-14
    assert not np.ptp(flat.poles[..., 2]) and not np.ptp(flat.poles[..., 0], axis=1).any()


@pytest.mark.parametrize("most", [1, 3])
def test_the_first_metric_of_a_tube_is_rolled_up(most):
    """Unrolled, its end would lead back to its start: lengths would be wrong there, and smoothing open the tube."""
    u = KnotVector.from_multiplicities(np.arange(25.0), [most, *[1] * 23, most], 3, periodic=True)
    v = KnotVector.clamped(np.linspace(0.0, 60.0, 7), 3)
    turn = 2 * np.pi * np.arange(u.count)[:, None] / u.count
    ring = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=-1) * [9.0, 9.0, 0.0]
    net = Net(u, v, ring + v.greville()[None, :, None] * [0.0, 0.0, 1.0])
    us, vs = np.linspace(0.0, 24.0, 200), np.linspace(0.0, 60.0, 7)
    for axis in (0, 1):
        own, flat = (np.linalg.norm(each.tangents(us, vs, axis), axis=-1) for each in (net, planar(net)))
        np.testing.assert_allclose(flat, own, rtol=0.02)


def test_a_smoothed_metric_loses_noise_and_keeps_its_plane():
    rule = quadrature(plane(10), [face()])
    net = plane(10)
    rough = Net(net.u, net.v, net.poles + 0.01 * np.random.default_rng(0).standard_normal(net.poles.shape))
    assert np.abs(smoothed(net, rule, 1e-3).poles - net.poles).max() < 1e-9
    left = smoothed(rough, rule, 0.1**4).poles - net.poles
    assert left.std() < 0.4 * 0.01


def met(steeper, bent):
    """What joins two sheets of the height x² / 2 that meet in x = 0, of which one has another speed or bend."""
    flat, (u, v) = plane(8, 6), (np.moveaxis(plane(8, 6).poles[..., :2], -1, 0))
    left = graph(lambda x, y: x**2 / 2, 8, 6)
    x = u * (1 + steeper * v)
    right = interpolated(flat.u, flat.v, np.stack([x, v, (1 + bent) * x**2 / 2], axis=-1))
    model = view(panels.pair(Net(left.u, left.v, left.poles * [-1.0, 1.0, 1.0]), Net(flat.u, flat.v, right)))
    return joints(model, {0, 1}, Wishes("as-is"))


def test_seams_keep_what_they_have_exactly_where_it_has_a_law():
    for bent, order in ((0.0, 2), (0.005, 2), (0.5, 1)):
        joined = met(0.0, bent)
        assert [seam.joint.order for seam in joined.exact] == [order] and not joined.loose
    joined = met(0.5, 0.0)
    (exact,), (loose,) = joined.exact, joined.loose
    assert (exact.joint.order, loose.order, loose.since) == (1, 2, 2)
    assert contact(loose).since == 2 and joined.moving == {exact.edge}


def test_a_patch_of_few_rows_keeps_tangents():
    for spans, order in ((3, 1), (4, 2)):
        clean, _ = panels.whole(spans, 0.0, patches=(1, 2))
        model = view(panels.document(panels.cut(clean, (1, 2))))
        assert [seam.joint.order for seam in joints(model, {0, 1}, Wishes("as-is")).exact] == [order]


@pytest.mark.parametrize(("longer", "why"), [(0.0, "plane neighbour"), (5.0, "coincides with part of another edge")])
def test_an_edge_beside_an_unsewn_face_that_stays_is_not_free(longer, why):
    """A patch beside a plane that was never sewn to it, whose edge may be longer; free edges move."""
    x, y = np.meshgrid(np.linspace(0, 10, 8), np.linspace(0, 10, 8), indexing="ij")
    patch = shapes.face_on(shapes.bspline(np.stack([x, y, 0.02 * x * (10 - x)], axis=-1)))
    plane = BRepBuilderAPI_MakeFace(gp_Pln(gp_Pnt(10, 0, 0), gp_Dir(0, 0, 1)), 0.0, 10.0, -longer, 10.0).Face()
    model = view(shapes.document(shapes.compound(patch, plane)))
    joined = joints(model, {0}, Wishes(free=True))
    assert len(joined.open) == 3
    (cause,) = (joined.frozen[edge.index] for edge in model.edges if edge.index in joined.frozen)
    assert str(cause) == why
