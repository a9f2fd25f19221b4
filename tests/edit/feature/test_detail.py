"""Features and their files."""

import json

import numpy as np
import pytest

from mracad.edit.feature.detail import load, save, taper
from mracad.errors import FileError
from tests.edit.feature.test_ideal import bump, feature


def test_a_taper_has_two_vanishing_derivatives_at_its_ends():
    assert taper(np.array([-1.0, 0.0, 0.5, 1.0, 2.0])).tolist() == [1.0, 1.0, 0.5, 0.0, 0.0]
    h = 1e-3
    assert abs(1 - taper(np.array(h))) < 20 * h**3 and taper(np.array(1 - h)) < 20 * h**3


def test_a_table_is_looked_up_between_its_cells_and_zero_beyond():
    one = feature()
    xy = np.random.default_rng(0).uniform(-9, 9, (500, 2))
    assert np.abs(one.lookup(xy)[:, 2] - bump(np.hypot(*xy.T))).max() < 1e-5
    assert np.abs(one.lookup(np.array([[30.0, 0.0]]))).max() == 0


def test_files_give_back_what_was_saved(tmp_path):
    path = tmp_path / "a.feature"
    path.write_bytes(save(one := feature(cells=20)))
    two = load(path)
    assert np.abs(one.table - two.table).max() <= 1e-9 and (two.radius, two.reach) == (one.radius, one.reach)
    body = json.loads(path.read_text())
    for change in ({"format": "x"}, {"size": 3}, {"window": []}, {"radius": 0}, {"radius": 99.0}, {"spacing": -1.0}):
        path.write_text(json.dumps({**body, **change}))
        with pytest.raises(FileError):
            load(path)
