import pickle

import numpy as np
import pytest
from scipy.interpolate import BSpline, NdBSpline, make_interp_spline

from mracad.bspline.surface import pairs
from mracad.errors import UsageError
from mracad.wavelet import wavedec, waverec
from tests.bspline.spaces import random_knots
from tests.bspline.test_surface import circle, sphere


def bspline(degree, shape=(), axis=0, kind="clamped"):
    kv = random_knots(degree, kind, 12, degree, most=2)
    rng = np.random.default_rng(degree)
    c = np.moveaxis(rng.standard_normal((kv.count, *shape)), 0, axis)
    return BSpline(kv.knots, c, kv.degree, axis=axis), np.linspace(*kv.domain, 60)


@pytest.mark.parametrize("degree", [1, 2, 3, 5, 9])
@pytest.mark.parametrize(("shape", "axis"), [((), 0), ((3,), 0), ((2, 3), 1)])
@pytest.mark.parametrize("kind", ["clamped", "unclamped"])
def test_curves_of_scipy_come_back(degree, shape, axis, kind):
    spline, x = bspline(degree, shape, axis, kind)
    pyramid = wavedec(spline)
    again = waverec(pyramid)
    assert (again.axis, again.k, again.extrapolate) == (spline.axis, spline.k, spline.extrapolate)
    np.testing.assert_array_equal(again.t, spline.t)
    np.testing.assert_allclose(again(x), spline(x), atol=1e-12)
    for level in (1, 2):
        coarse = waverec(pyramid.coarser(level))
        assert len(coarse.t) < len(spline.t)
        np.testing.assert_allclose(coarse(x), waverec(pyramid, level)(x), atol=1e-11)


def test_coarse_curves_are_least_squares_approximations():
    """That is what scipy's own quadrature says: the error is orthogonal to every coarse function."""
    spline, _ = bspline(3)
    coarse = waverec(wavedec(spline).coarser(2))
    x, w = np.polynomial.legendre.leggauss(4)
    breaks = np.unique(spline.t)
    half = np.diff(breaks)[:, None] / 2
    at = (breaks[:-1, None] + half * (1 + x)).ravel()
    error = (half * w).ravel() * (spline(at) - coarse(at))
    moments = BSpline.design_matrix(at, coarse.t, 3).T @ error
    np.testing.assert_allclose(moments, 0, atol=1e-13)


def test_closed_curves_of_scipy_stay_closed():
    turn = np.linspace(0, 2 * np.pi, 33)
    spline = make_interp_spline(turn, np.c_[np.cos(turn), np.sin(turn)], bc_type="periodic")
    pyramid = wavedec(spline)
    low, high = np.array([-1e-9, 1e-9])
    np.testing.assert_allclose(waverec(pyramid)(turn), spline(turn), atol=1e-13)
    for level in (1.0, 1.5, 3.0):
        coarse = waverec(pyramid, level)
        np.testing.assert_allclose(coarse(2 * np.pi + low, 1), coarse(high, 1), atol=1e-7)
    assert waverec(pyramid.coarser(1)).extrapolate == "periodic"


def test_a_spline_that_is_only_evaluated_periodically_need_not_close():
    knots = np.array([0, 0, 0, 1, 2, 4, 4, 4.0])
    spline = BSpline(knots, [0.0, 1, 2, 3, 5], 2, extrapolate="periodic")
    again = waverec(wavedec(spline))
    np.testing.assert_allclose(again.c, spline.c, atol=1e-14)
    turn = np.arange(-2.0, 7.0)  # its knots repeat, its control points do not
    open_ended = BSpline(turn, np.arange(6.0), 2, extrapolate="periodic")
    np.testing.assert_allclose(waverec(wavedec(open_ended)).c, open_ended.c, atol=1e-14)


@pytest.mark.parametrize("shape", [(), (3,), (2, 2)])
def test_surfaces_of_scipy_come_back(shape):
    u, v = random_knots(3, "clamped", 9, 1), random_knots(2, "unclamped", 6, 2)
    c = np.random.default_rng(0).standard_normal((u.count, v.count, *shape))
    spline = NdBSpline((u.knots, v.knots), c, (3, 2))
    at = pairs(np.linspace(*u.domain, 20), np.linspace(*v.domain, 20))
    pyramid = wavedec(spline)
    np.testing.assert_allclose(waverec(pyramid)(at), spline(at), atol=1e-12)
    np.testing.assert_allclose(waverec(pyramid.coarser(1))(at), waverec(pyramid, 1)(at), atol=1e-12)
    line = NdBSpline((u.knots,), c[:, 0], (3,))
    np.testing.assert_allclose(waverec(wavedec(line)).c, line.c, atol=1e-13)


def test_rational_curves_and_surfaces_keep_their_weights():
    for spline in (circle(), sphere()):
        pyramid = wavedec(spline)
        again = waverec(pyramid)
        assert type(again) is type(spline)
        np.testing.assert_allclose(again.poles, spline.poles, atol=1e-14)
        np.testing.assert_array_equal(again.weights, spline.weights)
        assert pyramid.levels
        with pytest.raises(UsageError, match="weights on its finest knots"):
            pyramid.coarser(1)


def test_pyramids_can_be_stored():
    spline, _ = bspline(3, (2,))
    np.testing.assert_allclose(waverec(pickle.loads(pickle.dumps(wavedec(spline)))).c, spline.c, atol=1e-13)


def test_what_is_no_spline_is_refused():
    cube = [0.0, 0, 1, 1]
    for wrong, words in (
        (np.zeros(5), "ndarray is no spline"),
        (BSpline(np.arange(5.0), np.arange(4.0), 0), "degree 0"),
        (BSpline(np.arange(8.0), np.arange(4) * 1j, 3), "complex"),
        (BSpline(np.arange(8.0), np.ones((4, 0)), 3), "no values"),
        (NdBSpline((cube,) * 3, np.zeros((2, 2, 2)), 1), "3 variables"),
    ):
        with pytest.raises(UsageError, match=words):
            wavedec(wrong)
