"""A feature from a random place to another; ``make random`` tries 200."""

import pytest

from tests.edit.feature.random_places import placed


@pytest.mark.parametrize("number", [0, 5])
def test_a_copy_at_a_random_place_is_the_closed_form(number, tmp_path):
    what, code, off, rise = placed(number, 7, tmp_path)
    print(f"{what}: off by {off:.1e} of the height")
    assert code == 0 and off <= 3e-3 and abs(rise - 1) <= 5e-3
