"""Surfaces of higher degree: the same in memory and in the file, and what moves is what was asked."""

import numpy as np
import pytest

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.edit.result import Edit
from mracad.errors import UsageError
from mracad.job.document import Report
from mracad.model.displacement import Displacement, Offset
from mracad.occ.apply import apply, restore
from mracad.occ.check import check
from mracad.occ.geometry import nets, spline
from mracad.occ.step import read_step, write_step
from mracad.occ.view import view
from tests.bspline.spaces import random_knots
from tests.occ import shapes
from tests.occ.test_edit import gaps, placed, solid

SIZE = 20.0


def sheet(u, v, weights=None):
    """A wavy sheet, closed round the z axis where ``u`` is periodic."""
    x, y = np.meshgrid(np.linspace(0, 1, u.count, endpoint=not u.periodic), np.linspace(0, 1, v.count), indexing="ij")
    flat = np.stack([SIZE * x, SIZE * y, np.sin(9 * x) * np.cos(5 * y)], axis=-1)
    radius, turn = 0.4 * SIZE + flat[..., 2], 2 * np.pi * x
    ring = np.stack([radius * np.cos(turn), radius * np.sin(turn), SIZE * y], axis=-1)
    return Net(u, v, ring if u.periodic else flat, weights)


def even(spans, degree):
    return KnotVector.clamped(np.linspace(0, 1, spans + 1), degree)


def periodic(mults, degree):
    return KnotVector.from_multiplicities(np.arange(len(mults) + 1.0), [*mults, mults[0]], degree, periodic=True)


UNCLAMPED = KnotVector(np.arange(12.0), 3)
ROUND = np.tile(1 + 0.3 * np.cos(np.arange(10.0))[:, None], 4)
SHEETS = {
    "ruled": sheet(even(6, 3), even(1, 1)),
    "creased": sheet(even(7, 1), even(4, 2)),
    "rational": sheet(even(8, 2), even(2, 2), ROUND),
    "periodic": sheet(periodic([1] * 7, 2), even(3, 2)),
    "periodic uneven": sheet(periodic([1, 2, 1, 2, 1, 2, 1], 2), even(3, 2), ROUND[:, :1] * np.ones((10, 5))),
    "unclamped": sheet(UNCLAMPED, even(3, 2)),
}
SOLIDS = ["cylinder", "apex", "sphere", "torus", "drilled", "placed"]


def beds(name):
    """A document with the surface under one face, two faces, one of them twice; or a solid."""
    if name in SOLIDS:
        return shapes.document(solid(name))
    surface = spline(SHEETS[name])
    low, high = SHEETS[name].v.domain
    u = SHEETS[name].u.domain
    lower, upper = (shapes.face_on(surface, *u, *ends) for ends in ((low, high / 2), (high / 2, high)))
    whole = shapes.compound(lower, upper, lower.Moved(placed(0.8, 7, 8, 90)))
    return shapes.document(whole)


def raised(model, degrees=(4, 5), size=0.0):
    """A displacement of all surfaces over higher degrees and one knot more each way, nothing moving at the ends."""
    offsets = {}
    for surface in model.surfaces:
        knots = [np.array([kv.breaks[:2] @ [0.4, 0.6]]) for kv in (surface.net.u, surface.net.v)]
        still = Offset(np.zeros(0), *knots, degrees)
        poles = np.zeros(still.over(surface.net).poles.shape)
        poles[3:-3, 2:-2, 2] = size
        offsets[surface.index] = Offset(poles, *knots, degrees)
    return Displacement(offsets)


def seen(document, name):
    return view(document, convert=range(len(document.faces)) if name in SOLIDS else ())


def placed_points(model, face):
    """Points of the surface of a face on a grid, in the part's frame."""
    net, frame = model.surfaces[face.surface].net, face.frame
    return net.grid(*(np.linspace(*kv.domain, 41) for kv in (net.u, net.v))) @ frame[:3, :3].T + frame[:3, 3]


def assert_same_shape(before, after):
    """Same points at the same parameters, and edges that lie on them."""
    for old, new in zip(before.faces, after.faces, strict=True):
        if old.surface is not None:
            off = placed_points(after, new) - placed_points(before, old)
            assert np.abs(off).max() <= 1e-12 * before.diagonal
    assert sorted(len(e.sides) for e in before.edges) == sorted(len(e.sides) for e in after.edges)
    assert gaps(after) <= gaps(before) + 1e-9
    assert max(e.tolerance for e in after.edges) <= max(e.tolerance for e in before.edges) + 1e-9


@pytest.mark.parametrize("rational", [False, True])
def test_control_points_are_those_of_the_kernel(rational):
    for seed in range(12):
        u, v = random_knots(1 + seed % 4, "clamped", 5, seed), random_knots(1 + seed % 3, "clamped", 3, seed + 1)
        rng = np.random.default_rng(seed)
        weights = rng.uniform(0.5, 2, (u.count, v.count)) if rational else None
        net = Net(u, v, rng.uniform(-SIZE, SIZE, (u.count, v.count, 3)), weights)
        surface = spline(net)
        surface.IncreaseDegree(u.degree + 2, v.degree + 1)
        (kernel,) = nets([surface])
        fine = net.over(u.elevated(u.degree + 2), v.elevated(v.degree + 1))
        assert (kernel.u, kernel.v) == (fine.u, fine.v)
        np.testing.assert_allclose(fine.poles, kernel.poles, rtol=0, atol=1e-12 * SIZE)
        if rational:
            np.testing.assert_allclose(fine.weights, kernel.weights, rtol=1e-12)


@pytest.mark.parametrize("name", [*SHEETS, *SOLIDS])
def test_an_elevated_surface_is_the_same_in_memory_and_in_the_file(name, tmp_path):
    document = beds(name)
    if name in SOLIDS:
        model = seen(document, name)
        apply(document, model, Displacement({s.index: Offset(np.zeros(s.net.poles.shape)) for s in model.surfaces}))
    model = view(document)
    change = raised(model)
    apply(document, model, change)
    after = view(document)
    for old, new in zip(model.surfaces, after.surfaces, strict=True):
        fine = change.offsets[old.index].over(old.net)
        assert (new.net.u, new.net.v) == (fine.u, fine.v) and (fine.u.degree, fine.v.degree) == (4, 5)
        assert np.array_equal(new.net.poles, fine.poles) and old.faces == new.faces
        assert fine.weights is None or np.array_equal(new.net.weights, fine.weights)
    for old, new in zip(model.edges, after.edges, strict=True):
        assert old.tolerance == new.tolerance and np.array_equal(old.points, new.points)
        for a, b in zip(old.sides, new.sides, strict=True):
            assert a.face == b.face and (a.uv is None or np.array_equal(a.uv, b.uv))
    assert_same_shape(model, after)
    assert check(document).valid
    write_step(document, tmp_path / "out.step")
    again = read_step(tmp_path / "out.step")
    assert_same_shape(after, view(again))
    assert check(again).valid


@pytest.mark.parametrize("name", [*SHEETS, "cylinder"])
def test_an_elevated_surface_moves_and_is_restored(name, tmp_path):
    document = beds(name)
    model = seen(document, name)
    change = raised(model, size=0.01)
    apply(document, model, change)
    wanted = change.applied(model)
    after = view(document)
    for old, new in zip(wanted.surfaces, after.surfaces, strict=True):
        assert np.array_equal(new.net.poles, old.net.poles)
    assert check(document).valid
    write_step(document, tmp_path / "out.step")
    again = read_step(tmp_path / "out.step")
    assert_same_shape(after, view(again))
    assert check(again).valid
    restore(document, model, change)
    for old, new in zip(model.surfaces, view(document).surfaces, strict=True):
        assert (new.net.u, new.net.v) == (old.net.u, old.net.v)
        assert np.array_equal(new.net.poles, old.net.poles)
        assert old.net.weights is None or np.array_equal(new.net.weights, old.net.weights)
    assert check(document).valid


def test_instances_share_a_higher_degree(tmp_path):
    made = shapes.assembly(
        shapes.compound(shapes.face_on(spline(SHEETS["ruled"]))), placed(0, 0, 0, 0), placed(0.5, 60, 0, 0)
    )
    write_step(made, tmp_path / "in.step")
    document = read_step(tmp_path / "in.step")
    model = view(document)
    change = raised(model, size=0.01)
    apply(document, model, change)
    write_step(document, tmp_path / "out.step")
    again = view(read_step(tmp_path / "out.step"))
    assert [face.instances for face in again.faces] == [2]
    np.testing.assert_allclose(
        again.surfaces[0].net.poles, change.applied(model).surfaces[0].net.poles, rtol=0, atol=1e-12 * SIZE
    )


def test_an_edge_without_a_curve_in_space_keeps_its_range(tmp_path):
    tip = sheet(even(5, 2), even(4, 2))
    tip.poles[0] = [-3, 9, 0]
    document = read_step(shapes.save(shapes.face_on(spline(tip)), tmp_path / "in.step"))
    model = view(document)
    assert any(edge.degenerate for edge in model.edges)
    change = raised(model)
    for step in (apply, restore):
        step(document, model, change)
        for old, new in zip(model.edges, view(document).edges, strict=True):
            assert all(np.array_equal(a.uv, b.uv) for a, b in zip(old.sides, new.sides, strict=True))
        assert check(document).valid


def test_a_bezier_face_is_elevated_too():
    document = shapes.document(shapes.face_on(shapes.bezier(shapes.wavy_poles(3, 2))))
    model = view(document)
    change = raised(model, size=0.1)
    apply(document, model, change)
    (surface,) = view(document).surfaces
    assert np.array_equal(surface.net.poles, change.applied(model).surfaces[0].net.poles)
    assert surface.origin == "bspline" and check(document).valid


def test_offsets_keep_their_degrees_and_are_counted():
    model = view(beds("ruled"))
    change = raised(model, size=0.5)
    assert change.scaled(0.5).offsets[0].degrees == (4, 5)
    net = model.surfaces[0].net
    assert Offset(np.zeros(net.poles.shape), degrees=(2, 1)).over(net) is net
    report = Report(model, Edit(change, ()), [], [], [], *[None] * 3, (), 0.0)
    # six spans of degree 3 and one of 1 become degrees 4 and 5 with a knot more each way
    assert report.control_points == (9 * 2, (5 + 5 * 2 + 1) * (6 + 1))


def test_a_degree_beyond_the_kernel_is_refused_before_anything_moves():
    document = beds("ruled")
    model = view(document)
    with pytest.raises(UsageError, match="degree 26"):
        apply(document, model, raised(model, (26, 3)))
    assert np.array_equal(view(document).surfaces[0].net.poles, model.surfaces[0].net.poles)
