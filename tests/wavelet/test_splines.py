"""Pyramids of curves and surfaces: where details are, and what is left without some of them."""

import numpy as np
import pytest

from mracad.bspline.curve import Curve
from mracad.bspline.gram import gram
from mracad.bspline.knots import KnotVector
from mracad.bspline.refine import refinement
from mracad.bspline.surface import Net
from mracad.errors import UsageError
from mracad.wavelet import decompose, wavedec, wavedec_patches, waverec
from mracad.wavelet.transform import reconstruct
from tests.bspline.spaces import KINDS, random_knots


def inner(one, two):
    """∫ one · two over the support of their functions, which is the domain if that is clamped."""
    whole, ends = one.knots.closed()
    a, b = (np.pad(each.poles, (ends, (0, 0))) for each in (one, two))
    return float((a * gram(whole).apply(b)).sum())


def energy(curve):
    return inner(curve, curve)


def curve_over(kind="clamped", degree=3, spans=24):
    kv = random_knots(degree, kind, spans, 3, most=1)
    return Curve(kv, np.random.default_rng(1).standard_normal((kv.count, 2)))


def on_level(pyramid, level):
    """The same pyramid with the details of one level alone."""
    alone = pyramid.scaled([float(i == level) for i in range(len(pyramid.levels))])
    zero = decompose(np.zeros_like(waverec(pyramid).poles), *pyramid.ladders)
    return Curve(
        alone.form.knots[0], reconstruct(type(pyramid)(zero.coarse, alone.levels, zero.centroid, alone.ladders))
    )


@pytest.mark.parametrize("kind", KINDS)
def test_levels_are_orthogonal_and_share_the_energy(kind):
    curve = curve_over(kind)
    curve = Curve(curve.knots, curve.poles - curve.poles.mean(axis=0))
    pyramid = wavedec(curve)
    parts = [on_level(pyramid, j) for j in range(len(pyramid.levels))]
    parts.append(waverec(pyramid, len(pyramid.levels)))
    table = np.array([[inner(a, b) for b in parts] for a in parts])
    np.testing.assert_allclose(table - np.diag(np.diag(table)), 0, atol=1e-11 * np.trace(table))
    assert np.trace(table) == pytest.approx(energy(curve), rel=1e-11)


@pytest.mark.parametrize("kind", KINDS)
def test_one_detail_is_one_wavelet_at_its_place(kind):
    pyramid = wavedec(curve_over(kind))
    kv = pyramid.ladders[0][0]
    (places,) = pyramid.places(0)["HL"]
    assert len(places) == len(pyramid.levels[0].bands["HL"])
    if kind != "unclamped":
        assert ((places >= kv.domain[0]) & (places <= kv.domain[1])).all()
    for i in range(0, len(places), 5):
        detail = np.zeros((len(places), 1))
        detail[i] = 3.0
        wave = pyramid.levels[0].u.synthesise(np.zeros((pyramid.ladders[0][1].count, 1)), detail)
        assert energy(Curve(kv, wave)) == pytest.approx(9.0)  # ∫ψ² = 1
        assert pyramid.levels[0].u.heights[i] == pytest.approx(np.abs(wave).max() / 3)
        x = np.linspace(*kv.domain, 400)
        size = np.abs(Curve(kv, wave).evaluate(x)[0, :, 0])
        away = np.abs(x[np.argmax(size)] - places[i])
        if kind == "periodic":
            away = min(away, kv.period - away)
        assert away <= 2 * np.diff(kv.breaks).max()


def test_places_on_even_knots_are_the_middles_of_supports():
    kv = KnotVector.clamped(np.arange(33.0), 3)
    (places,) = wavedec(Curve(kv, np.zeros((kv.count, 1)))).places(0)["HL"]
    np.testing.assert_allclose(places, 32 - places[::-1], atol=1e-9)
    np.testing.assert_allclose(places[4:-4], np.arange(9.0, 24.0, 2.0), atol=1e-9)


def test_places_and_heights_of_surfaces_fit_their_bands():
    u, v = random_knots(3, "clamped", 16, 1, most=2), random_knots(2, "periodic", 9, 2, most=1)
    pyramid = wavedec(Net(u, v, np.random.default_rng(0).standard_normal((u.count, v.count, 3))))
    assert f"{u.count} × {v.count}" in repr(pyramid)
    for j, level in enumerate(pyramid.levels):
        for name, band in level.bands.items():
            assert tuple(len(each) for each in pyramid.places(j)[name]) == band.shape[:2] == level.heights[name].shape
    ends = pyramid.places(0)["LH"][0]
    np.testing.assert_array_equal(ends, pyramid.ladders[0][1].greville())


def test_a_height_is_how_far_a_wavelet_moves_control_points():
    net = Net(*[random_knots(3, "clamped", 8, seed, most=1) for seed in (1, 2)], np.zeros((11, 11, 3)))
    pyramid = wavedec(net)
    for name, band in pyramid.levels[0].bands.items():
        band[1, 2] = [0.0, 3.0, 4.0]
        moved = np.linalg.norm(waverec(pyramid).poles, axis=2).max()
        height = pyramid.levels[0].heights[name][1, 2]
        assert height == pytest.approx(moved) if name == "HH" else moved <= height < 3 * moved
        band[1, 2] = 0.0


@pytest.mark.parametrize("soft", [False, True])
def test_thresholds_take_low_details_alone(soft):
    curve = curve_over()
    pyramid = wavedec(curve)
    limit = float(np.median(pyramid.levels[0].heights["HL"]))
    lean = pyramid.thresholded(limit, soft)
    lost = 0.0
    for level, before in zip(lean.levels, pyramid.levels, strict=True):
        old, new = before.heights["HL"], level.heights["HL"]
        np.testing.assert_allclose(
            new, np.maximum(old - limit, 0) if soft else np.where(old > limit, old, 0), atol=1e-12
        )
        gone = before.u.synthesise(np.zeros((before.u.coarse.count, 2)), before.bands["HL"] - level.bands["HL"])
        lost += energy(Curve(before.u.fine, gone))
    off = Curve(curve.knots, waverec(lean).poles - curve.poles)
    assert 0 < lost == pytest.approx(energy(off), rel=1e-10)
    np.testing.assert_allclose(waverec(pyramid.thresholded(0.0, soft)).poles, curve.poles, atol=1e-13)
    plain = waverec(pyramid, len(pyramid.levels)).poles
    np.testing.assert_allclose(waverec(pyramid.thresholded(1e9, soft)).poles, plain, atol=1e-13)
    with pytest.raises(UsageError, match="negative"):
        pyramid.thresholded(-1.0)


def test_a_threshold_takes_rounding_losses_that_are_low():
    spans = 10 ** np.random.default_rng(0).uniform(-4, 0.3, 60)
    kv = KnotVector.clamped(np.concatenate([[0], np.cumsum(spans)]), 15)
    pyramid = wavedec(Curve(kv, np.random.default_rng(0).standard_normal((kv.count, 2))))
    assert any(level.residual is not None for level in pyramid.levels)
    least = pyramid.thresholded(1e300)
    assert not any(level.residual.any() for level in least.levels if level.residual is not None)


def test_the_number_of_levels():
    curve = curve_over()
    every = wavedec(curve)
    assert len(wavedec(curve, levels=2).levels) == 2 < len(every.levels)
    few, many = waverec(wavedec(curve, levels=2), 2), waverec(every, 2)
    np.testing.assert_allclose(few.poles, many.poles, atol=1e-12)
    assert waverec(every.coarser(1).coarser(1)).knots == every.knots(2)[0]
    for wrong in (lambda: wavedec(curve, levels=-1), lambda: every.coarser(99), lambda: every.coarser(-1)):
        with pytest.raises(UsageError):
            wrong()
    bare = decompose(curve.poles, every.ladders[0])
    with pytest.raises(UsageError, match="not made from a spline"):
        waverec(bare)
    fine = refinement(every.ladders[0][1], curve.knots).apply(np.eye(every.ladders[0][1].count, 2))
    assert max(wavedec(Curve(curve.knots, fine)).levels[0].heights["HL"]) < 1e-13


def test_plots_have_a_panel_for_each_level():
    u, v = random_knots(3, "clamped", 8, 1, most=1), random_knots(2, "clamped", 5, 2, most=1)
    for spline, bars in ((curve_over(), 0), (Net(u, v, np.random.default_rng(0).random((11, 7, 3))), 1)):
        pyramid = wavedec(spline)
        found = pyramid.plot()
        assert len(found.axes) == (1 + bars) * len(pyramid.levels)
        assert found.axes[0].get_xlim() == pyramid.ladders[0][0].domain
        shown = found.axes[0].collections[0]
        drawn = shown.get_offsets() if bars else shown.get_segments()
        assert len(drawn) == sum(each.size for each in pyramid.levels[0].heights.values())


def test_details_on_another_coarse_shape():
    u, v = random_knots(3, "clamped", 20, 1, most=2), random_knots(2, "periodic", 7, 2, most=1)
    poles = np.random.default_rng(0).standard_normal((u.count, v.count, 3))
    by = np.arange(3.0)
    for pyramid in (wavedec(Net(u, v, poles)), *wavedec_patches([Net(v, u, poles.swapaxes(0, 1)[:, ::-1])])):
        for level in (0, 1, len(pyramid.levels)):
            coarse = waverec(pyramid.coarser(level))
            moved = waverec(pyramid, coarse=coarse.with_poles(coarse.poles + by)).poles - by
            np.testing.assert_allclose(moved, waverec(pyramid).poles, atol=1e-12)
        with pytest.raises(UsageError, match="not over the knots"):
            waverec(pyramid, coarse=curve_over(spans=23))
