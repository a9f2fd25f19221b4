"""The amount of a displacement that is allowed: found in few measurements."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from mracad.edit.tolerances import Tolerances
from mracad.edit.watch import MEASURED, amounts
from mracad.inspect.places import Placed
from mracad.inspect.roughness import Change, Growth, Roughness, between

STEPS = 32
BEFORE = Roughness(10.0, 4.0, 2.0, 1.0, 0.5)


def placed(figures):
    ends = np.array([1.0]), np.arange(1.0, 1.0 + figures.shape[1])
    still = np.zeros((4, *figures.shape))
    return Placed(np.stack([figures, -figures, *still, figures, figures]), still[0] + 1.0, ends)


def change(amount, most):
    """Bending and the figures of two places grow like a parabola until they exceed what is allowed at ``most``."""
    figures = np.array([[amount * (amount - most), -amount]])
    after = replace(BEFORE, bending=4.0 + figures[0, 0], variation=2.0 - amount)
    return Change(BEFORE, after, Roughness(), motion=amount, deviation=amount / 2, placed=placed(figures))


@dataclass
class Parabolas:
    """Displacements of surfaces of which each has one face, measured in closed form."""

    most: list
    asked: list = field(default_factory=list)

    @property
    def still(self):
        return [{7: Change(BEFORE, BEFORE, Roughness())} for _ in self.most]

    @property
    def watch(self):
        return self

    def changes(self, amounts):
        self.asked += list(amounts.items())
        return {i: {7: change(amount, self.most[i])} for i, amount in amounts.items()}

    def measured(self, i):
        return sorted({at for j, at in self.asked if j == i})

    def about(self, i, amount):
        seen = {0.0, *(at for j, at in self.asked if j == i)}
        return {7: between({at: change(at, self.most[i]) for at in seen}, amount)}


def test_parabolas_are_met():
    known = {at: change(at, 0.6) for at in (0.0, 0.25, 1.0)}
    found, expected = between(known, 0.4), change(0.4, 0.6)
    assert found.after.bending == pytest.approx(expected.after.bending)
    assert found.deviation == pytest.approx(0.2) and found.before is BEFORE
    np.testing.assert_allclose(found.placed.spread, expected.placed.spread)
    np.testing.assert_allclose(found.placed.rise, expected.placed.rise)
    assert found.placed.area is not None and found.placed.ends is known[0.25].placed.ends


@pytest.mark.parametrize("most", [0.03, 0.1, 0.24, 0.26, 0.6, 0.99, 1.5])
def test_the_largest_allowed_step_is_found_in_few_measurements(most):
    tried = Parabolas([most, 2.0])
    (found, whole), (after, _), (why, _) = amounts(tried, np.zeros(2), np.ones(2), Tolerances(growth=Growth()), STEPS)
    assert whole == 1.0
    assert found == pytest.approx(min(np.floor(most * STEPS) / STEPS, 1.0))
    assert bool(why) == (found < 1.0) and after[7].after.bending <= 4.0
    assert len([i for i, _ in tried.asked if i == 0]) <= MEASURED


def test_floors_and_ceilings_hold():
    tried = Parabolas([0.6, 0.6, 0.2, 0.6])
    found, *_ = amounts(
        tried, np.array([0.5, 0.7, 0.0, 2.0]), np.array([1.0, 1.0, 0.1, 1.0]), Tolerances(growth=Growth()), STEPS
    )
    assert found == pytest.approx([np.floor(0.6 * STEPS) / STEPS, 0.0, 0.1, 0.0])
    assert all(i != 3 for i, _ in tried.asked)


def test_deviations_are_bounded():
    tried = Parabolas([2.0])
    (found,), *_ = amounts(tried, np.zeros(1), np.ones(1), Tolerances(growth=Growth(), deviation=0.3), STEPS)
    assert found == pytest.approx(np.floor(0.6 * STEPS) / STEPS)


def test_what_was_measured_before_counts():
    tried = Parabolas([0.6])
    tried.asked = [(0, 0.59), (0, 0.61), (0, 0.9)]
    (found,), *_ = amounts(tried, np.zeros(1), np.ones(1), Tolerances(growth=Growth()), STEPS)
    assert found == 19 / STEPS and not {0.25, 1.0} & set(tried.measured(0))
