"""Derivatives as differences of control points: polynomials that they leave alone, and even knots."""

from itertools import combinations

import numpy as np
import pytest

from mracad.bspline.differences import differences, divided
from mracad.bspline.knots import KnotVector

UNEVEN = [0.0] * 6 + [0.2] * 3 + [0.5, 0.51, 0.9] + [1.0] * 6


def monomial(knots, power):
    """Control points of xᵖ: the elementary symmetric means of the knots of each function."""
    d = knots.degree
    return np.array([
        np.mean([np.prod(each) for each in combinations(knots.knots[i + 1 : i + 1 + d], power)])
        for i in range(knots.count)
    ])  # fmt: skip


def applied(weights, index, values):
    return (weights * values[index]).sum(axis=1)


@pytest.mark.parametrize("order", [2, 3, 4])
def test_polynomials_of_less_degree_vanish_on_any_knots(order):
    knots = KnotVector(UNEVEN, 5)
    weights, index = differences(knots, order)
    known = np.isfinite(weights).all(axis=1)
    for power in range(order):
        assert np.abs(applied(weights, index, monomial(knots, power))[known]).max() < 1e-12
    assert np.abs(applied(weights, index, monomial(knots, order))[known]).min() > 0


def test_differences_on_the_abscissae_of_the_spline_itself_take_parabolas_for_more():
    knots = KnotVector(UNEVEN, 5)
    assert np.abs(applied(*divided(knots, 3), monomial(knots, 2))).max() > 1e-3


@pytest.mark.parametrize("weighted", [differences, divided])
@pytest.mark.parametrize("order", [2, 3, 4])
def test_on_even_knots_they_are_plain_differences(weighted, order):
    knots = KnotVector(np.arange(20.0), 3)
    weights, index = weighted(knots, order)
    matrix = np.zeros((len(weights), knots.count))
    np.add.at(matrix, (np.arange(len(weights))[:, None], index), weights)
    assert np.allclose(matrix, np.diff(np.eye(knots.count), order, axis=0))


def test_no_weights_are_larger_and_there_are_none_across_full_multiplicity():
    knots = KnotVector([0.0] * 4 + [1.0, 1.0 + 1e-6, 2.0, 2.0, 2.0, 3.0] + [4.0] * 4, 3)
    weights, _ = differences(knots, 3)
    known = np.isfinite(weights).all(axis=1)
    assert not known.all() and np.linalg.norm(weights[known], axis=1).max() < np.sqrt(20) + 1e-9


@pytest.mark.parametrize("weighted", [differences, divided])
def test_a_periodic_direction_has_a_row_for_each_control_point(weighted):
    knots = KnotVector.from_multiplicities(np.arange(9.0), [2, 1, 1, 1, 1, 1, 1, 1, 2], 3, periodic=True)
    weights, index = weighted(knots, 3)
    assert len(weights) == knots.count and index.max() == knots.count - 1
    assert np.abs(weights[np.isfinite(weights).all(axis=1)].sum(axis=1)).max() < 1e-9


@pytest.mark.parametrize("weighted", [differences, divided])
def test_too_few_control_points_have_none(weighted):
    assert len(weighted(KnotVector.clamped([0.0, 1.0], 2), 3)[0]) == 0
