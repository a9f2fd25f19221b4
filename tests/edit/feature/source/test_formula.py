"""Formulas: closed forms, and texts that are none."""

import re

import numpy as np
import pytest

from mracad.edit.feature.source import made
from mracad.errors import UsageError
from mracad.spec.sources import source


def build(formula, radius="10mm", taper=None):
    text = f"formula:{formula},radius:{radius}"
    return made(source(text, "feature"), text, taper)


@pytest.mark.parametrize(
    ("formula", "function"),
    [
        ("'0.3*cos(2*pi*x/5)*cos(2*pi*y/7)'", lambda x, y: 0.3 * np.cos(2 * np.pi * x / 5) * np.cos(2 * np.pi * y / 7)),
        ("-exp(-hypot(x-1, y)**2/8)/2", lambda x, y: -np.exp(-((x - 1) ** 2 + y**2) / 8) / 2),
        ("0.2+0.05*(x%100)*0+1e-3*max(min(x,50),-50)", lambda x, y: 0.2 + 1e-3 * x),
    ],
)
def test_a_formula_is_what_it_says_within_its_radius(formula, function):
    feature = build(formula)
    xy = np.random.default_rng(0).uniform(-7, 7, (500, 2))
    assert np.abs(feature.lookup(xy)[:, 2] - function(*xy.T)).max() < 2e-3
    beyond = feature.lookup(13.0 * np.stack([np.cos(xy[:, 0]), np.sin(xy[:, 0])], axis=1))
    assert np.abs(beyond[:, 2]).max() < 1e-3 and np.abs(beyond[:, 3]).max() < 1e-2


def test_a_taper_begins_at_the_radius():
    ring = 13.0 * np.array([[1.0, 0.0], [0.0, 1.0]])
    assert np.abs(build("0.5+0*x", taper=6.0).lookup(ring)[:, 2] - 0.25).max() < 2e-3
    assert build("0.5+0*x").lookup(ring)[:, 2] == pytest.approx([0, 0], abs=2e-3)


def test_a_formula_reaches_no_farther_than_its_taper():
    for feature, end in ((build("0.3*cos(2*pi*x/5)"), 12.5), (build("0.5+0*x", taper=6.0), 16.0)):
        assert feature.radius == feature.reach == pytest.approx(end)
    sharp = build("0.3*sign(x)")  # rounding carries heights beyond the window
    assert sharp.radius == pytest.approx(12.5) and sharp.radius < sharp.reach < 12.5 + 4.5 * sharp.spacing


def test_the_place_without_a_height_has_none_by_its_digits():
    for formula, function in (
        ("sqrt(25-x**2-y**2)", lambda x, y: 25 - x**2 - y**2),
        ("log(50-hypot(x,y)**2)", lambda x, y: 50 - np.hypot(x, y) ** 2),
    ):
        with pytest.raises(UsageError, match=r"up to 12\.5 mm .* or a smaller radius") as error:
            build(formula)
        x, y = re.search(r"x = (\S+), y = (\S+) mm", error.value.message).groups()
        assert function(float(x), float(y)) < 0
    with pytest.raises(UsageError) as error:
        build("1/x")
    assert "smaller radius" not in str(error.value)


@pytest.mark.parametrize(
    ("formula", "said"),
    [
        ("0.3*z", "character 5: z is not known"),
        ("x.__class__", "character 1"),
        ("__import__('os').system('true')", "is not known"),
        ("[x for x in y]", "character 1"),
        ("sin(x", "not a formula"),
        ("sin(x,y)", "character 1: sin takes 1 argument"),
        ("1+x^2", "character 1: powers are written with **, not ^"),
        ("2*foo(x)", "character 3: foo(x) is not known"),
        ("x if y else 1", "is not known"),
        ("'a'", "is not known"),
        ("9**9**9**9*x", "no height"),
        ("1/x", "no height"),
        ("log(x)", "no height at x = 0"),
        ("(" * 400 + "x" + ")" * 400, "formula"),
        ("x+" * 600 + "x", "longer"),
        ("", "not a formula"),
    ],
)
def test_other_texts_are_refused_with_the_place(formula, said):
    with pytest.raises(UsageError) as error:
        build(formula)
    assert said in str(error.value) and "\n" not in str(error.value)
