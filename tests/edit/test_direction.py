"""Scales by direction: waves along a blade go and its profile stays; which parameter leads."""

import numpy as np
import pytest

from mracad.bspline.knots import KnotVector
from mracad.edit.heading import lead
from mracad.edit.smooth import smooth
from mracad.errors import UsageError
from mracad.spec.steps import Smooth
from tests.edit import blades
from tests.edit.models import fitted, rotation, sheet

RIMS = {"free_edges": "smooth", "corners": "move"}


def after(net, **options):
    model = sheet(net)
    return smooth(model, Smooth(**options)).displacement.applied(model).surfaces[0].net


def ripple(wave, count=101):
    """A square of 400 mm with a ripple of 0.1 mm of some wavevector (1/mm)."""
    knots = KnotVector.clamped(np.linspace(0, 1, count - 2), 3)
    return fitted(knots, knots, lambda x, y: 0.1 * np.cos(wave[0] * x + wave[1] * y), size=400.0)


def height(net, wave):
    """That of a ripple in the middle of the square."""
    points = net.grid(np.linspace(0.3, 0.7, 101), np.linspace(0.3, 0.7, 101)).reshape(-1, 3)
    shape = np.exp(1j * (points[:, :2] @ wave))
    basis = np.stack([shape.real, shape.imag, np.ones(len(shape))], axis=1)
    return np.linalg.lstsq(basis, points[:, 2], rcond=None)[0][0]


@pytest.mark.parametrize("waves", [(52.0, np.inf), (70.0, np.inf), (np.inf, 18.0), (np.inf, 24.0), (90.0, 30.0)])
def test_a_ripple_keeps_the_gain_of_its_lengths_along_and_across(waves):
    scale, across = 60.0, 20.0
    k = 2 * np.pi / np.array(waves)
    before = ripple(k)
    kept = height(after(before, scale="60mm", across="20mm", along="X", **RIMS), k) / height(before, k)
    turn = ((scale / waves[0]) ** 2 + (across / waves[1]) ** 2) ** 2
    assert kept == pytest.approx(1 / (1 + turn**2), abs=0.02)


@pytest.mark.parametrize("way", [{}, {"along": "Z"}])
def test_waves_along_a_blade_go_and_its_profile_stays(way):
    clean, wavy = blades.blade()
    wave, shape = blades.left(clean, after(wavy, scale="200mm", across="20mm", **way, **RIMS))
    print(f"{way or 'by default'}: {wave / blades.HEIGHT:.4f} of the waves left, profile changed by {shape:.4f} mm")
    assert wave <= 0.05 * blades.HEIGHT and shape <= 0.02


def test_a_turned_blade_with_its_parameters_swapped_is_the_same():
    _, wavy = blades.blade((31, 61))
    turn = rotation([1, 2, 3], 1.0)
    one = after(wavy, scale="200mm", across="20mm", **RIMS)
    other = after(blades.swapped(wavy.with_poles(wavy.poles @ turn.T)), scale="200mm", across="20mm", **RIMS)
    assert np.abs(one.poles - blades.swapped(other).poles @ turn).max() < 1e-6


def test_one_scale_for_both_is_a_scale():
    _, wavy = blades.blade((31, 61))
    both, one = after(wavy, scale="50mm", across="50mm", **RIMS), after(wavy, scale="50mm", **RIMS)
    assert np.array_equal(both.poles, one.poles)


def test_the_parameter_that_leads():
    clean, _ = blades.blade((31, 41))
    model, other = sheet(clean), sheet(blades.swapped(clean))
    for along in (None, "z"):
        assert (lead(model, model.faces, along), lead(other, other.faces, along)) == (1, 0), along
    assert [lead(model, model.faces, f"edge#{i}") for i in (1, 2, 3, 4)] == [0, 1, 0, 1]
    assert lead(model, model.faces, "u") == 0
    assert lead(model, model.faces, "x") == 0
    turned = sheet(clean.with_poles(clean.poles @ rotation([0, 1, 0], np.radians(45)).T))
    assert lead(turned, turned.faces, "z") is None and lead(turned, turned.faces, None) == 1
    flat = sheet(ripple([0.1, 0.0], 21))
    assert lead(flat, flat.faces, "z") is None
    with pytest.raises(UsageError, match=r"along: 'edge#9': the model has edges #1 to #4"):
        lead(flat, flat.faces, "edge#9")


def test_a_face_whose_parameters_run_elsewhere_stays():
    model = sheet(ripple([0.1, 0.0], 21))
    edit = smooth(model, Smooth(scale="100mm", across="50mm", along="Z"))
    (outcome,) = edit.outcomes
    assert outcome.status == "left" and not edit.displacement.offsets
    assert outcome.words == "parameter lines do not follow the direction: none within 30° of Z"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"across": "2mm", "level": 2.0}, "across: it needs a scale"),
        ({"across": "2mm"}, "across: it needs a scale"),
        ({"scale": "5mm", "along": "X"}, "along: it needs a scale across it"),
        ({"scale": "5mm", "across": "2mm", "along": "W"}, "along: 'W' is not a direction"),
        ({"scale": "5mm", "across": "2mm", "along": "edge#0"}, "along: 'edge#0' is not a direction"),
        ({"scale": "5mm", "across": "-2mm"}, "across: '-2mm' is not greater than zero"),
        ({"level": 2.0, "limit_by_curvature": False}, "limit-by-curvature: levels are not limited by it"),
    ],
)
def test_what_contradicts_itself_is_refused(options, said):
    with pytest.raises(UsageError, match=said):
        Smooth(**options)
