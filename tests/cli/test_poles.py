"""Copies of features and poles: places there are named, and fills keep clear of them."""

import json

import numpy as np

FORMULA = "formula:0.3*exp(-(x**2+y**2)/2),radius:4mm"


def test_places_at_a_pole_are_named(mracad, samples, tmp_path):
    words = ("repeat", samples / "bottle.step", "--feature", FORMULA, "-o", tmp_path / "a.step")
    result = mracad(*words, "--at", "0,0,0", "--at", "11.3,0,60")
    assert result.code == 4 and "place 1 (0,0,0) is at a pole" in result.err and not list(tmp_path.iterdir())
    assert mracad(*words, "--at", "0,0,0", "--at", "11.3,0,60", "--skip-off").code == 0


def test_fills_keep_clear_of_poles(mracad, samples):
    words = ("repeat", samples / "bottle.step", "--feature", FORMULA, "--fill", "hexagons,spacing:14mm")
    body = json.loads(mracad(*words, "--dry-run", "--json").out)
    far = np.linalg.norm([copy["at"] for copy in body["copies"]], axis=1)
    assert len(far) > 20 and far.min() > 4.0
