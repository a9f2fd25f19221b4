"""What rims take of copies, as shares of their volume: closed forms of a Gaussian bump."""

from statistics import NormalDist

import numpy as np
import pytest

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.edit.feature.edits import repeat
from mracad.edit.feature.score import Copy, share
from mracad.spec.steps import Repeat
from tests.edit.feature.grounds import HEIGHT, SIGMA
from tests.edit.models import sheet

VOLUME = 2 * np.pi * HEIGHT * SIGMA**2


def taken(feature, *places, **options):
    """Copies on a square of 100 mm with spans of 0.5 mm."""
    k = KnotVector.clamped(np.linspace(0.0, 100.0, 201), 3)
    x, y = np.meshgrid(k.greville(), k.greville(), indexing="ij")
    flat = sheet(Net(k, k, np.stack([x, y, 0 * x], axis=-1)))
    return repeat(flat, Repeat(feature=feature, at=tuple(places), clip=True, **options)).copies


@pytest.mark.parametrize(("place", "beyond"), [("0,50,0", 0.5), ("100,0,0", 0.75), ("6,50,0", None)])
def test_a_rim_takes_what_lies_beyond_it_and_the_strip_that_it_holds(feature, place, beyond):
    (copy,) = taken(feature, place)
    assert abs(copy.volume / VOLUME - 1) < 1e-3
    if beyond is None:
        # between what lies beyond the rim, and beyond four spans inside it
        low, high = (NormalDist().cdf(x / SIGMA) for x in (-6.0, -4.0))
        assert low < copy.taken < high
    else:
        assert beyond - 1e-3 <= copy.taken < beyond + 0.03


def test_nothing_is_taken_of_a_copy_away_from_rims_and_volumes_go_with_sizes(feature):
    one, two = taken(feature, "30,30,0", "50,50,0", height=-0.5, size=0.5)
    assert one.taken == two.taken == 0.0
    assert abs(one.volume / (VOLUME / 8) - 1) < 1e-3


def test_the_share_of_several_copies_is_that_of_their_volumes():
    made = [Copy("", (0, 0, 0), (0,), 0, 0, 0, 0, False, volume=v, taken=t) for v, t in ((1.0, 0.5), (3.0, 0.1))]
    assert abs(share(made) - 0.2) < 1e-12 and share([]) == 0.0
