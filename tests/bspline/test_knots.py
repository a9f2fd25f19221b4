import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mracad.bspline.knots import KnotVector
from mracad.errors import UsageError
from tests.bspline.spaces import KINDS, knot_vectors, random_knots


@pytest.mark.parametrize(
    ("knots", "degree", "message"),
    [
        ([0, 0, np.nan, 1], 1, "finite"),
        ([0, 0, 2, 1, 3, 3], 1, "decrease"),
        ([0, 0, 1], 1, "at least 4"),
        ([0, 0, 0, 0], 1, "empty domain"),
        ([0, 0, 1, 1, 1, 2, 2], 1, "multiplicity 3"),
        ([0, 0, 1, 1], 0, "degree 0"),
        ([[0, 0], [1, 1]], 1, "at least 4"),
    ],
)
def test_bad_knots_are_refused(knots, degree, message):
    with pytest.raises(UsageError, match=message):
        KnotVector(knots, degree)


def test_periodic_knots_must_repeat():
    with pytest.raises(UsageError, match="do not repeat"):
        KnotVector([-1, 0, 1, 3, 4, 5.5], 1, periodic=True)
    with pytest.raises(UsageError, match="differ in multiplicity"):
        KnotVector.from_multiplicities([0, 1, 2], [1, 1, 2], 2, periodic=True)


def test_periodic_layout_is_the_kernels():
    # A full circle in OCCT: breaks 0, 1, 2, 3 of multiplicity 2, degree 2.
    circle = KnotVector.from_multiplicities([0, 1, 2, 3], [2, 2, 2, 2], 2, periodic=True)
    assert circle.count == 6
    assert circle.knots.tolist() == [-1, 0, 0, 1, 1, 2, 2, 3, 3, 4]
    cubic = KnotVector.from_multiplicities([0, 1, 3, 4], [1, 1, 1, 1], 3, periodic=True)
    assert cubic.knots.tolist() == [-4, -3, -1, 0, 1, 3, 4, 5, 7, 8]
    assert cubic.count == 3
    assert cubic.domain == (0, 4)


@given(knot_vectors())
@settings(deadline=None, max_examples=60)
def test_equal_by_content(kv):
    again = pickle.loads(pickle.dumps(kv))
    assert again == kv
    assert hash(again) == hash(kv)
    assert not again.knots.flags.writeable
    assert kv.count == (sum(kv.multiplicities[:-1]) if kv.periodic else len(kv.knots) - kv.degree - 1)
    assert kv != KnotVector(kv.knots + 1, kv.degree, kv.periodic)
    with pytest.raises(AttributeError):
        kv.degree = 4


@given(knot_vectors(), st.integers(0, 1000))
@settings(deadline=None, max_examples=60)
def test_refining_and_thinning_are_inverse(kv, seed):
    low, high = kv.domain
    extra = np.random.default_rng(seed).uniform(low, high, 3)
    fine = kv.refined(extra)
    assert fine.count == kv.count + 3
    assert fine.domain == kv.domain
    assert fine.without(extra) == kv
    assert kv.refined([]) is kv
    assert kv.with_multiplicities(kv.multiplicities) == kv


def test_knots_cannot_be_inserted_outside():
    kv = KnotVector.clamped([0, 1, 2], 2)
    for x in (0.0, 2.0, 3.0, np.nan):
        with pytest.raises(UsageError):
            kv.refined([x])
    with pytest.raises(UsageError):
        kv.refined([1.0] * 3)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("side", ["left", "right"])
def test_parameters_are_found_in_their_span(kind, side):
    kv = random_knots(3, kind, 6, 1)
    x = np.concatenate([kv.breaks, 0.5 * (kv.breaks[1:] + kv.breaks[:-1])])
    span, offset = kv.locate(x, side)
    assert (kv.knots[span] < kv.knots[span + 1]).all()
    begin, end = kv.knots[span], kv.knots[span + 1]
    at = begin + offset
    inside = (begin <= at) & (at < end) if side == "right" else (begin < at) & (at <= end)
    assert inside[(x > kv.breaks[0]) & (x < kv.breaks[-1])].all()
    if kv.periodic:
        turned, moved = kv.locate(x[1:-1] + 3 * kv.period, side)
        inner = ~np.isin(x[1:-1], kv.breaks)
        assert (turned == span[1:-1])[inner].all()
        np.testing.assert_allclose(moved[inner], offset[1:-1][inner], atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_greville_abscissae_reproduce_the_parameter(kind):
    from mracad.bspline.curve import Curve

    kv = random_knots(4, kind, 7, 2)
    if kind == "periodic":
        low, high = kv.domain
        assert ((kv.greville() >= low) & (kv.greville() <= high)).all()
    else:
        t = np.linspace(*kv.domain, 30)
        np.testing.assert_allclose(Curve(kv, kv.greville()[:, None]).evaluate(t)[0, :, 0], t, atol=1e-13)


def test_closing_an_unclamped_vector():
    kv = random_knots(3, "unclamped", 5, 3)
    closed, extra = kv.closed()
    assert extra == (3, 3)
    assert closed.count == kv.count + 6
    clamped = random_knots(3, "clamped", 5, 3)
    assert clamped.closed() == (clamped, (0, 0))
