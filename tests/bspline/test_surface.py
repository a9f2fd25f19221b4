import numpy as np
import pytest

from mracad import memo
from mracad.bspline.curve import Curve
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.compiled import Compiled
from mracad.errors import UsageError
from tests.bspline.spaces import KINDS, random_knots

HALF = np.sqrt(0.5)


def circle():
    """The unit circle: periodic, rational, degree 2."""
    poles = np.array([[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1]], dtype=float)
    knots = KnotVector.from_multiplicities(np.arange(5.0), [2] * 5, 2, periodic=True)
    return Curve(knots, poles, np.array([1, HALF] * 4))


def sphere():
    """The unit sphere: periodic in u, poles at the ends of v."""
    arc = KnotVector.from_multiplicities([0, 1, 2], [3, 2, 3], 2)
    profile = np.array([[0, -1], [1, -1], [1, 0], [1, 1], [0, 1]], dtype=float)
    ring = circle()
    poles = np.empty((8, 5, 3))
    poles[..., :2] = ring.poles[:, None] * profile[None, :, :1]
    poles[..., 2] = profile[:, 1]
    return Net(ring.knots, arc, poles, np.outer(ring.weights, [1, HALF, 1, HALF, 1]))


def random_net(kind_u, kind_v, rational, seed=0, degrees=(3, 2)):
    rng = np.random.default_rng(seed)
    u, v = random_knots(degrees[0], kind_u, 5, seed), random_knots(degrees[1], kind_v, 4, seed + 1)
    poles = rng.standard_normal((u.count, v.count, 3))
    return Net(u, v, poles, rng.uniform(0.5, 2, poles.shape[:2]) if rational else None)


def places(net, count=25, seed=0):
    rng = np.random.default_rng(seed)
    return np.stack([rng.uniform(*net.u.domain, count), rng.uniform(*net.v.domain, count)], axis=1)


def test_a_circle_is_round():
    t = np.linspace(-3, 9, 101)
    points, first, second = circle().evaluate(t, 2)
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 1, atol=1e-14)
    np.testing.assert_allclose((points * first).sum(axis=1), 0, atol=1e-14)
    cross = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    np.testing.assert_allclose(cross / np.linalg.norm(first, axis=1) ** 3, 1, atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("rational", [False, True])
def test_curve_derivatives_against_differences(kind, rational):
    rng = np.random.default_rng(1)
    kv = random_knots(4, kind, 5, 1)
    curve = Curve(kv, rng.standard_normal((kv.count, 3)), rng.uniform(0.5, 2, kv.count) if rational else None)
    t, h = 0.5 * (kv.breaks[1:] + kv.breaks[:-1]), 1e-5
    exact = curve.evaluate(t, 3)
    for k in (1, 2, 3):
        slope = (curve.evaluate(t + h, k - 1)[-1] - curve.evaluate(t - h, k - 1)[-1]) / (2 * h)
        np.testing.assert_allclose(exact[k], slope, rtol=1e-4, atol=1e-5 * np.abs(exact[k]).max())


@pytest.mark.parametrize("kind_u", KINDS)
@pytest.mark.parametrize("rational", [False, True])
def test_surface_derivatives_against_differences(kind_u, rational):
    net = random_net(kind_u, "clamped", rational)
    mids = [0.5 * (kv.breaks[1:] + kv.breaks[:-1]) for kv in (net.u, net.v)]
    uv = np.stack(np.meshgrid(*mids), axis=-1).reshape(-1, 2)
    h = 1e-5
    exact = net.evaluate(uv, 2)
    for axis, (low, targets) in enumerate((((0, 1, 2), (1, 3, 4)), ((0, 1, 2), (2, 4, 5)))):
        step = np.eye(2)[axis] * h
        after, before = net.evaluate(uv + step, 1), net.evaluate(uv - step, 1)
        for a, b in zip(low, targets, strict=True):
            slope = (after[a] - before[a]) / (2 * h)
            np.testing.assert_allclose(exact[b], slope, rtol=1e-4, atol=1e-6 * np.abs(exact[b]).max())


@pytest.mark.parametrize("kind_u", KINDS)
@pytest.mark.parametrize("rational", [False, True])
def test_grid_is_evaluate_on_a_tensor_product(kind_u, rational):
    net = random_net(kind_u, "periodic", rational)
    us, vs = np.linspace(*net.u.domain, 7), np.linspace(*net.v.domain, 5)
    uv = np.stack(np.meshgrid(us, vs, indexing="ij"), axis=-1).reshape(-1, 2)
    for a, b in zip(net.grid(us, vs, 1), net.evaluate(uv, 1), strict=True):
        np.testing.assert_allclose(a.reshape(-1, 3), b, atol=1e-12 * np.abs(b).max())
    np.testing.assert_allclose(net.grid(us, vs).reshape(-1, 3), net.evaluate(uv), atol=1e-12)
    for axis in (0, 1):
        np.testing.assert_array_equal(net.tangents(us, vs, axis), net.grid(us, vs, 1)[1 + axis])


def test_many_points_are_what_few_at_a_time_are():
    """More than go through at once."""
    net = random_net("clamped", "clamped", True)
    uv = places(net, 50_000)
    few = [net.evaluate(part, 2) for part in np.array_split(uv, 50)]
    for whole, *parts in zip(net.evaluate(uv, 2), *few, strict=True):
        np.testing.assert_array_equal(whole, np.concatenate(parts))


@pytest.mark.parametrize("kind_u", KINDS)
@pytest.mark.parametrize("rational", [False, True])
def test_knot_insertion_changes_nothing(kind_u, rational):
    net = random_net(kind_u, "clamped", rational)
    rng = np.random.default_rng(3)
    fine = net.refined(rng.uniform(*net.u.domain, 4), rng.uniform(*net.v.domain, 2))
    uv = places(net)
    np.testing.assert_allclose(fine.evaluate(uv), net.evaluate(uv), atol=1e-13 * 10)
    assert fine.poles.shape == (net.poles.shape[0] + 4, net.poles.shape[1] + 2, 3)
    assert net.refined([], []) is net


@pytest.mark.parametrize("kind_u", KINDS)
@pytest.mark.parametrize("kind_v", KINDS)
@pytest.mark.parametrize("rational", [False, True])
def test_degree_elevation_changes_nothing(kind_u, kind_v, rational):
    net = random_net(kind_u, kind_v, rational)
    uv = places(net)
    for degrees in ((5, 2), (3, 4), (4, 6)):
        fine = net.over(net.u.elevated(degrees[0]), net.v.elevated(degrees[1]))
        assert (fine.u.degree, fine.v.degree) == degrees
        for a, b in zip(net.evaluate(uv, 1), fine.evaluate(uv, 1), strict=True):
            np.testing.assert_allclose(b, a, rtol=0, atol=1e-12 * np.abs(a).max())
        assert rational == (fine.weights is not None)
    assert net.over(net.u.elevated(2), net.v.elevated(2)) is net


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("rational", [False, True])
def test_bezier_pieces(kind, rational):
    from math import comb

    rng = np.random.default_rng(2)
    kv = random_knots(3, kind, 5, 8)
    curve = Curve(kv, rng.standard_normal((kv.count, 2)), rng.uniform(0.5, 2, kv.count) if rational else None)
    breaks, pieces = kv.breaks, curve.bezier()
    assert pieces.shape == (5, 4, 3)
    x = np.linspace(0, 1, 9)[1:-1]
    bernstein = np.array([comb(3, i) * x**i * (1 - x) ** (3 - i) for i in range(4)]).T
    for k in range(5):
        points = bernstein @ pieces[k]
        piece = points[:, :2] / points[:, 2:]
        np.testing.assert_allclose(piece, curve.evaluate(breaks[k] + x * (breaks[k + 1] - breaks[k]))[0], atol=1e-12)


def test_sphere_normals_also_at_the_poles():
    ball = sphere()
    uv = np.stack(np.meshgrid(np.linspace(0, 4, 9), np.linspace(0, 2, 9)), axis=-1).reshape(-1, 2)
    points, normals = ball.evaluate(uv), ball.normals(uv)
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 1, atol=1e-14)
    np.testing.assert_allclose(normals, points, atol=1e-7)


def test_normals_scale_and_turn_with_the_model():
    from scipy.spatial.transform import Rotation

    ball, turn = sphere(), Rotation.from_rotvec([0.3, -1, 0.5]).as_matrix()
    moved = Net(ball.u, ball.v, 1e-3 * ball.poles @ turn.T + 5, ball.weights)
    uv = np.array([[0.3, 0.0], [1.2, 2.0], [2.0, 1.1]])
    np.testing.assert_allclose(moved.normals(uv), ball.normals(uv) @ turn.T, atol=1e-7)


def test_a_point_has_no_normal():
    flat = KnotVector.clamped([0, 1], 2)
    assert np.isnan(Net(flat, flat, np.ones((3, 3, 3))).normals([[0.5, 0.5]])).all()
    line = np.zeros((3, 3, 3))
    line[..., 0] = np.arange(3)[:, None]
    assert np.isnan(Net(flat, flat, line).normals([[0.5, 0.5]])).all()


def test_sides_at_a_crease():
    u, v = KnotVector.from_multiplicities([0, 1, 2], [2, 1, 2], 1), KnotVector.clamped([0, 1], 1)
    poles = np.zeros((3, 2, 3))
    poles[..., 0], poles[..., 1] = np.arange(3)[:, None], np.arange(2)
    poles[2, :, 2] = 1
    roof = Net(u, v, poles)
    flat, steep = roof.normals([[1, 0.5]], ("left", "right")), roof.normals([[1, 0.5]], ("right", "right"))
    np.testing.assert_allclose(flat, [[0, 0, 1]], atol=1e-15)
    np.testing.assert_allclose(steep, [[-HALF, 0, HALF]], atol=1e-15)


def test_shapes_are_checked():
    kv = KnotVector.clamped([0, 1], 2)
    with pytest.raises(UsageError):
        Curve(kv, np.zeros((2, 3)))
    with pytest.raises(UsageError):
        Net(kv, kv, np.zeros((3, 2, 3)))
    with pytest.raises(UsageError):
        Net(kv, kv, np.zeros((3, 3, 3)), np.zeros((3, 3)))
    with pytest.raises(UsageError):
        Curve(kv, np.zeros((3, 3)), np.ones(2))


@pytest.mark.parametrize("rational", [False, True])
def test_compiled_code_and_arrays_give_the_same_bits(rational, monkeypatch):
    net, found = random_net("periodic", "clamped", rational), []
    for used in (True, False):
        monkeypatch.setattr(Compiled, "pays", lambda self, work, used=used: used)
        memo.clear()
        found.append([*net.evaluate(places(net), 2), *net.grid(*places(net, 6).T, 1)])
    for compiled, arrays in zip(*found, strict=True):
        np.testing.assert_array_equal(compiled, arrays)


def test_whole_numbers_are_control_points_as_others_are():
    knots, rng = random_knots(3, "clamped", 6, 1), np.random.default_rng(2)
    poles = rng.integers(-9, 9, (knots.count, knots.count, 3))
    whole, real = (
        Net(knots, knots, each, np.ones(poles.shape[:2], each.dtype)) for each in (poles, poles.astype(float))
    )
    uv = rng.uniform(*knots.domain, (30_000, 2))
    assert whole.evaluate(uv).tobytes() == real.evaluate(uv).tobytes()
