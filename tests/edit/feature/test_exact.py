"""Copies that are exact shifts of control points."""

import numpy as np

from mracad.edit.feature.exact import shifted
from mracad.edit.feature.extract import feature_of
from mracad.edit.feature.ground import Ground
from mracad.edit.feature.ideal import copies
from mracad.edit.feature.locate import Place
from mracad.spec.steps import Single
from tests.edit.feature import grounds
from tests.edit.models import sheet

WINDOW = "near:30,30,0,radius:18"


def shifts(*places, overlap="add", mirror=False):
    model = sheet(grounds.plane(110.0, (30.0, 30.0)))
    feature = feature_of(model, Single(feature=WINDOW), {0}, WINDOW)
    ground = Ground.of(model, {0}).without(feature.origin.offsets)
    feet = ground.feet(np.array([p.point for p in places]))
    return feature.origin.offsets[0], shifted(copies(ground, feature, places, feet, overlap, mirror))


def at(x, y, **changes):
    return Place(f"{x},{y}", np.array([x, y, 0.0]), **changes)


def test_whole_spans_away_the_offsets_are_moved():
    own, found = shifts(at(70.0, 45.0), at(35.0, 80.0, height=-2.0))
    assert found.matched.all()
    rows, columns = (slice(a.min(), a.max() + 1) for a in np.nonzero(own.any(axis=2)))
    wanted = np.zeros_like(own)
    for (i, j), height in (((40, 15), 1.0), ((5, 50), -2.0)):
        wanted[rows.start + i : rows.stop + i, columns.start + j : columns.stop + j] += height * own[rows, columns]
    assert np.abs(found.offsets[0] - wanted).max() < 1e-12


def test_what_is_turned_scaled_mirrored_or_between_the_knots_is_not():
    places = at(70.5, 45.0), at(70.0, 45.0, size=0.9), at(70.0, 45.0, rotate=0.1), at(70.0, 75.0)
    assert shifts(*places)[1].matched.tolist() == [False, False, False, True]
    assert not shifts(at(70.0, 45.0), mirror=True)[1].matched.any()
    assert not shifts(at(70.0, 45.0), overlap="max")[1].matched.any()
