"""The fairing solve against its dense normal equations, its limit the mask, and its gain on a wave."""

import numpy as np
import pytest

from mracad.bspline.gram import gram
from mracad.bspline.knots import KnotVector
from mracad.bspline.net import Net
from mracad.constraint.fairing import REACH, Fairing, border_noise
from tests.constraint.test_frozen import along
from tests.constraint.test_region import circle


def spaces(seed=0, periodic=False):
    rng = np.random.default_rng(seed)
    v = KnotVector.clamped(np.r_[0, np.cumsum(rng.uniform(0.5, 1.5, 14))], 3)
    if periodic:
        return KnotVector.from_multiplicities(np.arange(17.0), [1] * 17, 3, periodic=True), v
    return KnotVector.clamped(np.r_[0, np.cumsum(rng.uniform(0.5, 1.5, 16))], 3), v


def masks(u, v):
    frame = np.zeros((u.count, v.count), bool)
    frame[2:-2, 2:-2] = True
    unit = KnotVector.clamped(np.linspace(0, 1, u.spans + 1), 3), KnotVector.clamped(np.linspace(0, 1, v.spans + 1), 3)
    if not u.periodic:
        hole = along(Net(*unit, np.zeros((u.count, v.count, 3))), circle([0.5, 0.5], 0.2))
        return {"frame": frame, "hole": frame & ~hole}
    return {"frame": frame}


@pytest.mark.parametrize("periodic", [False, True])
def test_it_solves_its_normal_equations(periodic):
    u, v = spaces(periodic=periodic)
    rng = np.random.default_rng(1)
    shape = (u.count, v.count, 3)
    for free in masks(u, v).values():
        target, given = rng.standard_normal(shape), rng.standard_normal(shape)
        spans = np.diff(u.breaks), np.diff(v.breaks)
        x = Fairing(u, v, spans, 1.3 * REACH, 0.0).solve(target, given, free)
        g = [gram(k).toarray() for k in (u, v)]
        a = [m + 1.3**4 * gram(k, 2).toarray() for m, k in zip(g, (u, v), strict=True)]
        stiff, mass, inside = np.kron(*a), np.kron(*g), np.flatnonzero(free)
        residual = stiff @ x.reshape(-1, 3) - mass @ target.reshape(-1, 3)
        assert np.abs(residual[inside]).max() < 1e-8 * np.abs(stiff @ given.reshape(-1, 3)).max()
        assert np.array_equal(x[~free], given[~free])


def test_its_limit_is_the_mask():
    u, v = spaces()
    rng = np.random.default_rng(2)
    shape = (u.count, v.count, 3)
    target, given = rng.standard_normal(shape), rng.standard_normal(shape)
    free = masks(u, v)["hole"]
    x = Fairing(u, v, (np.diff(u.breaks), np.diff(v.breaks)), 5.0, border=1.0).solve(target, given, free)
    assert np.abs(x - np.where(free[..., None], target, given)).max() < 1e-10


def test_translation_and_scaling_commute():
    u, v = spaces()
    rng = np.random.default_rng(3)
    shape, free = (u.count, v.count, 3), masks(u, v)["hole"]
    target, given = rng.standard_normal(shape), rng.standard_normal(shape)
    spans = np.diff(u.breaks), np.diff(v.breaks)
    x = Fairing(u, v, spans, 4.0, 0.2).solve(target, given, free)
    shift = np.array([1e3, -2e3, 5e2])
    moved = Fairing(u, v, spans, 4.0, 0.2).solve(target + shift, given + shift, free)
    assert np.abs(moved - shift - x).max() < 1e-9
    scaled = Fairing(u, v, (7 * spans[0], 7 * spans[1]), 28.0, 0.2).solve(7 * target, 7 * given, free)
    assert np.abs(scaled / 7 - x).max() < 1e-9


def test_a_wave_is_multiplied_by_the_stated_gain():
    n = 64
    u = KnotVector.from_multiplicities(np.arange(n + 1.0), [1] * (n + 1), 3, periodic=True)
    v = KnotVector.clamped(np.linspace(0, 4, 5), 3)
    wave = np.cos(2 * np.pi * np.arange(n) / 16)
    target = np.repeat(wave[:, None], v.count, axis=1)[..., None] * np.ones(3)
    x = Fairing(u, v, (np.ones(n), np.ones(4)), 16 / 3, 0.0).solve(target, target, np.ones((n, v.count), bool))
    gain = 1 / (1 + (2 * np.pi / 15) ** 4)
    assert np.abs(x - gain * (target - target.mean(axis=(0, 1))) - target.mean(axis=(0, 1))).max() < 2e-3
    assert gain > 0.96


def test_knots_too_uneven_to_solve_on_are_refused():
    u = KnotVector.clamped(np.r_[0, 1, 2 + 1e-5 * np.arange(8), 3, 4], 3)
    with pytest.raises(ValueError, match="uneven"):
        Fairing(u, u, (np.diff(u.breaks), np.diff(u.breaks)), 1.0, 0.0)


def test_border_noise_tells_a_clean_border_from_a_noisy_one():
    rng = np.random.default_rng(4)
    free = np.zeros((30, 30), bool)
    free[2:-2, 2:-2] = True
    detail = rng.standard_normal((30, 30, 3))
    assert border_noise(detail, detail, ~free, free) == pytest.approx(1.0, abs=0.15)
    clean = np.where(free[..., None], detail, 0.0)
    assert border_noise(clean, clean, ~free, free) == 0.0
    leak = np.zeros((30, 30, 3))
    leak[[0, 1, -2, -1]] = 1.0  # across the border, from the smoothing of the inside
    assert border_noise(clean + leak, clean, ~free, free) < 0.3
