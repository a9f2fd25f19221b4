"""Built-in textures."""

import numpy as np
import pytest

from mracad.edit.feature.source import made
from mracad.errors import UsageError
from mracad.spec.sources import TEXTURES, source


def build(name, more="pitch:4mm", width=40, height=0.2):
    text = f"texture:{name},width:{width}mm,height:{height}mm,{more}"
    return made(source(text, "feature"), text)


def inner(feature, half=12.0, count=121):
    xy = np.stack(np.meshgrid(*2 * [np.linspace(-half, half, count)], indexing="ij"), axis=-1)
    return feature.lookup(xy.reshape(-1, 2))[:, 2].reshape(count, count)


@pytest.mark.parametrize("name", TEXTURES)
def test_a_texture_has_its_height_fades_out_and_is_the_same_again(name):
    one, two = build(name), build(name)
    assert np.array_equal(one.table, two.table)
    heights = inner(one)
    assert 0.6 * 0.2 < np.ptp(heights) < 1.02 * 0.2
    assert np.abs(heights).max() < 1.02 * 0.2 and (heights.max() < 1e-3) == (name == "dimples")
    rim = np.linspace(-21, 21, 200)
    for edge in (np.full(200, 20.5), np.full(200, -20.5)):
        assert np.abs(one.lookup(np.stack([edge, rim], axis=1))[:, 2:]).max() < 1e-3
    assert 4 / 40 < one.spacing < 4 / 4  # a pitch takes 4 to 40 spans


@pytest.mark.parametrize("name", ["leather", "hammered", "brushed"])
def test_seeds_give_others_of_the_same_kind(name):
    one, two = (inner(build(name, f"pitch:4mm,seed:{seed}")) for seed in (1, 2))
    assert abs(np.corrcoef(one.ravel(), two.ravel())[0, 1]) < 0.5
    assert np.std(one) == pytest.approx(np.std(two), rel=0.4)


@pytest.mark.parametrize(
    ("name", "period"),
    [("hexagons", (4.0, 0.0)), ("dimples", (2.0, 2 * np.sqrt(3))), ("knurl", (4 / np.cos(np.pi / 6), 0.0))],
)
def test_regular_ones_repeat_at_their_pitch(name, period):
    feature = build(name)
    xy = np.random.default_rng(0).uniform(-8, 8, (400, 2))
    assert np.abs(feature.lookup(xy)[:, 2] - feature.lookup(xy + period)[:, 2]).max() < 0.03 * 0.2


def test_a_pitch_must_fit_the_width():
    with pytest.raises(UsageError, match=r"pitch 0\.1 mm is not between"):
        build("knurl", "pitch:0.1mm")
