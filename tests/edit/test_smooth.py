"""Smoothing on kernel-free models: covariance, what must not move, bounds, levels, what is said of each face."""

import dataclasses

import msgspec
import numpy as np
import pytest

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.edit.fair import Filter
from mracad.edit.result import Reason
from mracad.edit.smooth import smooth
from mracad.edit.whole import edited
from mracad.errors import UsageError
from mracad.occ.view import view
from mracad.spec.select import Scope
from mracad.spec.steps import Smooth
from tests.edit.models import rotation, sheet
from tests.occ import shapes

SPANS = (16, 12)


def rough(seed=0, degree=3, spans=SPANS, noise=0.05, weights=False):
    """A sheet with uneven knots, about one millimetre apart; its rims are clean."""
    rng = np.random.default_rng(seed)
    u, v = (KnotVector.clamped(np.r_[0, np.cumsum(rng.uniform(0.5, 1.5, n))], degree) for n in spans)
    x, y = np.meshgrid(u.greville(), v.greville(), indexing="ij")
    poles = np.stack([x, y, 2 * np.sin(x / 9) * np.cos(y / 7)], axis=-1)
    poles[degree:-degree, degree:-degree] += noise * rng.standard_normal((*np.array(x.shape) - 2 * degree, 3))
    return Net(u, v, poles, rng.uniform(0.7, 1.4, x.shape) if weights else None)


def moved(net, matrix=None, shift=0.0, factor=1.0):
    matrix = np.eye(3) if matrix is None else matrix
    return Net(net.u, net.v, factor * net.poles @ matrix.T + shift, net.weights)


def smoothed(net, **options):
    model = sheet(net)
    edit = smooth(model, Smooth(**options))
    return edit.displacement.applied(model).surfaces[0].net, edit.outcomes[0]


def grid(net, count=80):
    return np.asarray(net.grid(*(np.linspace(*knots.domain, count) for knots in (net.u, net.v))))


def motion(net, result):
    """How far each point of a grid moved, mm."""
    return np.linalg.norm(grid(result) - grid(net), axis=-1)


@pytest.mark.parametrize(("degree", "weights"), [(2, False), (3, True), (5, True), (8, False)])
def test_translation_rotation_and_scaling_commute(degree, weights):
    net = rough(degree=degree, weights=weights, spans=(12, 9))
    plain, outcome = smoothed(net, scale="4mm")
    assert outcome.status == "edited" and outcome.moved > 5e-4
    size = np.ptp(net.poles)
    shift = np.array([1e3, -400.0, 250.0])
    assert np.abs(smoothed(moved(net, shift=shift), scale="4mm")[0].poles - plain.poles - shift).max() < 1e-9 * size
    turn = rotation([1, 2, -0.5], 0.7)
    assert np.abs(smoothed(moved(net, turn), scale="4mm")[0].poles - plain.poles @ turn.T).max() < 1e-9 * size
    large = smoothed(moved(net, factor=25.4), scale=f"{4 * 25.4}mm")[0].poles
    assert np.abs(large / 25.4 - plain.poles).max() < 1e-9 * size


@pytest.mark.parametrize("keep", ["as-is", "g1", "g2"])
def test_free_edges_keep_their_points_by_the_bit(keep):
    net = rough()
    result, outcome = smoothed(net, scale="4mm", keep=keep, refine="never")
    assert outcome.status == "edited"
    border = np.ones(net.poles.shape[:2], bool)
    border[1:-1, 1:-1] = False
    border[np.ix_([1, -2], [1, -2])] = True
    assert np.array_equal(result.poles[border], net.poles[border])
    assert (result.poles[~border] != net.poles[~border]).mean() > 0.99


def test_amount_scales_the_edit_and_zero_is_the_identity():
    net = rough()
    full, whole = smoothed(net, scale="4mm")
    half, outcome = smoothed(net, scale="4mm", amount=0.5)
    assert np.abs(half.poles - (net.over(full.u, full.v).poles + full.poles) / 2).max() < 1e-12
    assert outcome.amount == whole.amount / 2 and outcome.moved == pytest.approx(whole.moved / 2)
    model = sheet(net)
    none = smooth(model, Smooth(scale="4mm", amount=0.0))
    assert not none.displacement.offsets
    assert (none.outcomes[0].status, none.outcomes[0].reason) == ("unchanged", Reason.AMOUNT)


def test_a_bound_on_the_deviation_holds_and_changes_no_status():
    net = rough(noise=0.1)
    free, _ = smoothed(net, scale="4mm")
    normals = np.stack([net.normals(uv) for uv in _rows(net)], axis=0)
    far = np.abs(((grid(free) - grid(net)) * normals).sum(axis=-1))
    bound = 0.4 * far.max()
    result, outcome = smoothed(net, scale="4mm", max_deviation=f"{bound}mm")
    limited = np.abs(((grid(result) - grid(net)) * normals).sum(axis=-1))
    assert outcome.status == "edited" and 0.5 * bound < limited.max() <= bound * (1 + 1e-6)
    loose, _ = smoothed(net, scale="4mm", max_deviation="50mm")
    assert np.array_equal(loose.poles, free.poles)


def _rows(net, count=80):
    us, vs = (np.linspace(*knots.domain, count) for knots in (net.u, net.v))
    return [np.stack([np.full(count, u), vs], axis=1) for u in us]


def test_levels_take_off_more_the_higher_they_are():
    net = rough(noise=0.1, spans=(32, 24))
    found = [smoothed(net, level=level)[1] for level in (0.5, 1.0, 1.5)]
    assert {each.status for each in found} == {"edited"}
    assert found[0].detail < found[1].detail < found[2].detail
    assert found[0].roughness[1].bending > found[1].roughness[1].bending > found[2].roughness[1].bending


def test_what_is_fair_at_a_scale_stays_and_says_so():
    for net, scale in ((rough(), "0.1mm"), (flat(), "4mm")):
        model = sheet(net)
        edit = smooth(model, Smooth(scale=scale))
        assert (edit.outcomes[0].status, edit.outcomes[0].reason) == ("unchanged", Reason.FAIR)
        assert not edit.displacement.offsets


@pytest.mark.parametrize(("share", "status"), [(0.4, "unchanged"), (1.25, "edited")])
def test_ripples_below_a_millionth_of_the_scale_stay(share, status):
    """Alternating control points make a ripple of a third of their displacement along either direction."""
    net = uniform(ripple=9 * share * 4e-6)
    _, outcome = smoothed(net, scale="4mm", free_edges="smooth", corners="move")
    assert outcome.status == status and outcome.detail > 4e-6
    assert outcome.reason == (Reason.FAIR if status == "unchanged" else None)


def uniform(ripple):
    """A plane of even spans of a millimetre with a ripple across both."""
    u, v = (KnotVector.clamped(np.arange(n + 1.0), 3) for n in SPANS)
    x, y = np.meshgrid(u.greville(), v.greville(), indexing="ij")
    sign = (-1.0) ** np.add.outer(np.arange(u.count), np.arange(v.count))
    sign[[0, 1, -2, -1]] = sign[:, [0, 1, -2, -1]] = 0.0
    return Net(u, v, np.stack([x, y, ripple * sign], axis=-1))


class Nothing(Filter):
    """A filter that has no way but to stay put."""

    def ways(self, problem, target, width):
        return [[0.0 * target]]


def test_a_face_that_nothing_admissible_makes_fairer_says_that_its_edges_hold_it():
    """Nothing but staying put is left of what is wanted, and the judge took nothing off it."""
    edit = edited(sheet(rough(noise=0.1)), Smooth(scale="4mm"), Nothing(4.0), None, None)
    assert (edit.outcomes[0].status, edit.outcomes[0].reason) == ("left", Reason.RIM)
    assert edit.outcomes[0].words == "cannot get fairer with its edges held" and not edit.displacement.offsets


def test_a_face_whose_seams_take_all_its_control_points_says_so_or_gets_some():
    """The middle one of three strips under one zigzag keeps the curvature at both: two times three rows of six."""
    model = view(shapes.document(shapes.zigzag_strips(6, 6, 6)))
    options = Smooth(scale="8mm", refine="never", faces=("#2",))
    outcome = smooth(model, options).outcomes[1]
    assert (outcome.status, outcome.reason, outcome.free) == ("left", Reason.NO_FREE, 0)
    assert smooth(model, msgspec.structs.replace(options, keep="g1")).outcomes[1].status == "edited"
    outcome = smooth(model, msgspec.structs.replace(options, refine="auto")).outcomes[1]
    assert outcome.status == "edited" and 0 < outcome.inserted < 12


def test_points_that_bring_next_to_nothing_nearer_are_not_added():
    """Spans beside the rims are wider than a quarter of the scale, but the sheet gets as fair with them."""
    net = rough()
    assert max(np.diff(knots.breaks)[[0, -1]].max() for knots in (net.u, net.v)) > 1.0
    (plain, _), (result, outcome) = (smoothed(net, scale="4mm", refine=refine) for refine in ("never", "auto"))
    assert outcome.status == "edited" and outcome.inserted == 0
    assert np.array_equal(result.poles, plain.poles)


def flat():
    net = rough(noise=0.0)
    return Net(net.u, net.v, np.concatenate([net.poles[..., :2], 0 * net.poles[..., :1]], axis=-1))


def test_points_are_not_added_where_a_face_does_as_well_without_them():
    """A ruled strip with a wave between straight edges: its rows move once its degree is raised."""
    u = KnotVector.clamped(np.arange(33.0), 3)
    x = u.greville()
    rows = [np.stack([x, 2 * i + 0 * x, 0.05 * np.sin(2 * np.pi * x / 3)], axis=-1) for i in (0, 1)]
    strip = Net(u, KnotVector.clamped([0, 2], 1), np.stack(rows, axis=1))
    for refine in ("never", "auto"):
        result, outcome = smoothed(strip, scale="8mm", refine=refine)
        assert outcome.status == "edited" and outcome.detail > 0.01
        assert outcome.inserted == 0
        assert motion(strip, result)[:, [0, -1]].max() < 1e-12 < motion(strip, result).max()


def test_a_crease_line_stays_and_a_smooth_line_of_full_multiplicity_goes():
    breaks, mults = np.arange(31.0), np.ones(31, int)
    mults[[0, 15, -1]] = 4, 3, 4
    u = KnotVector.from_multiplicities(breaks, mults, 3)
    v = KnotVector.clamped(np.arange(21.0), 3)
    rng = np.random.default_rng(0)
    for slope, creases in ((1.0, 1), (0.0, 0)):
        x, y = np.meshgrid(u.greville(), v.greville(), indexing="ij")
        noise = 0.02 * rng.standard_normal(x.shape)
        noise[14:21] = 0.0
        net = Net(u, v, np.stack([x, y, slope * np.abs(x - 15) + noise], axis=-1))
        result, outcome = smoothed(net, scale="5mm")
        assert outcome.creases == creases and outcome.status == "edited"
        line = np.stack([np.full(20, 15.0), np.linspace(5, 15, 20)], axis=1)
        turn = np.einsum("ij,ij->i", result.normals(line, ("left", "right")), result.normals(line))
        assert np.degrees(np.arccos(np.clip(turn, -1, 1))).max() == pytest.approx(90.0 * slope, abs=1.5)


def test_held_and_unselected_faces_stay():
    model = sheet(rough())
    for scope, status, reason in (
        (Scope(frozenset({0}), held=frozenset({0})), "held", Reason.HELD),
        (Scope(frozenset()), "unselected", Reason.UNSELECTED),
    ):
        edit = smooth(model, Smooth(scale="4mm"), scope=scope)
        assert (edit.outcomes[0].status, edit.outcomes[0].reason) == (status, reason)
        assert not edit.displacement.offsets


def test_faces_that_are_not_nurbs_are_named():
    model = sheet(rough())
    plane = dataclasses.replace(model.faces[0], index=1, kind="plane", surface=None, trims=())
    edit = smooth(dataclasses.replace(model, faces=(*model.faces, plane)), Smooth(scale="4mm"))
    assert [o.status for o in edit.outcomes] == ["edited", "analytic"]
    assert edit.outcomes[1].words == "not a NURBS face: plane"


@pytest.mark.parametrize("scale", ["0", "-3mm", "nan", "inf", "5 parsecs", "", "mm", "1e400mm"])
def test_a_scale_that_is_no_length_is_refused(scale):
    with pytest.raises(UsageError, match="scale"):
        smooth(sheet(rough()), Smooth(scale=scale))


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"scale": "5", "level": 1.0},
        {"level": 0.0},
        {"level": float("nan")},
        {"scale": "5", "amount": 1.5},
        {"scale": "5", "amount": float("nan")},
    ],
)
def test_contradictory_options_are_refused(options):
    with pytest.raises(UsageError):
        Smooth(**options)
