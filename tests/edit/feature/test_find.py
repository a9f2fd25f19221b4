"""Features that a model proposes."""

import numpy as np

from mracad.edit.feature.find import found
from tests.edit.feature import grounds
from tests.edit.feature.grounds import HEIGHT, SIGMA
from tests.edit.models import sheet


def test_a_bump_is_found_where_it_is_and_nothing_else():
    (one,) = found(sheet(grounds.plane(100.0, (40.0, 62.0))), {0})
    assert np.abs(np.array(one.place)[:2] - [40, 62]).max() < 1.0
    assert HEIGHT / 2 < one.height < 1.1 * HEIGHT and 2 * SIGMA < one.size < 8 * SIGMA
    assert one.text.startswith("near:40,62,")


def test_nothing_stands_out_of_a_bare_face():
    assert found(sheet(grounds.uneven()), {0}) == []
