"""Gaps and tilts that are pulled shut before anything else is done."""

from dataclasses import replace

import numpy as np
import pytest

from mracad.bspline.surface import Net
from mracad.edit.fair import Filter, faired
from mracad.edit.mend import mended
from mracad.edit.pose import Pose, Scene
from mracad.edit.target import sheets
from mracad.edit.tolerances import Tolerances
from mracad.inspect.seams import seams
from mracad.occ.view import view
from mracad.seam.interface import joints
from mracad.seam.wishes import Wishes
from tests.edit import halves, panels

GAP, TILT = 4e-3, 6e-3


def torn(noise):
    """A model of 2 × 2 patches of which one is a little too high and another tilted."""
    _, noisy = panels.whole(16, noise, patches=(2, 2))
    patches = panels.cut(noisy, (2, 2))
    for key, row, rise in (((0, 1), slice(None), GAP), ((1, 0), 1, TILT)):
        net = patches[key].net
        poles = net.poles.copy()
        poles[row, :, 2] += rise
        patches[key] = replace(patches[key], net=Net(net.u, net.v, poles))
    return view(panels.document(patches))


@pytest.mark.parametrize(("close", "fit"), [(True, 0.0), (False, 1.0), (True, 1.0)])
def test_what_is_torn_is_mended_to_the_ends_of_its_seams(close, fit):
    model = torn(0.05)
    wishes = Wishes("g1", np.radians(fit), close)
    result = faired(model, {0, 1, 2, 3}, Filter(15.0), wishes, Tolerances(1e-3))
    before, after = seams(model), seams(result.displacement().applied(model))
    assert len(result.joints.exact) == 4 and result.mended == {seam.edge for seam in before}
    assert max(seam.gap for seam in before) > 0.9 * GAP and max(seam.angle for seam in before) > 0.1
    if close:
        assert max(seam.gap for seam in after) <= 1e-9
        if fit:
            assert max(seam.angle for seam in after) <= 0.01
    else:  # where a gap stays, its slope does
        assert sorted(seam.mean_angle for seam in after)[:3] < [0.01] * 3
        assert all(abs(new.gap - old.gap) <= 1e-9 for old, new in zip(before, after, strict=True))


def test_mending_fades_within_the_wavelength_and_bends_no_more_than_it_must():
    model = torn(0.0)
    known = sheets(model, {0, 1, 2, 3}, Filter(30.0))
    joined = joints(model, {0, 1, 2, 3}, Wishes("g1", close_gaps=True))
    moved = mended(Scene(model, known, joined, Tolerances(1e-3))).moved[1]
    assert moved.motion < GAP and moved.changes[1].turn < 0.2
    at = np.linspace(0, 1, 60)
    grid = [low + at * (high - low) for low, high in (moved.net.u.domain, moved.net.v.domain)]
    off = np.linalg.norm(Net(moved.net.u, moved.net.v, moved.offset).grid(*grid), axis=-1)
    beside = off[-1].max()
    print(f"{beside:.2e} mm beside the gap, {off[:30, 30:].max():.2e} mm half a patch from both")
    assert beside > 0.3 * GAP and off[:30, 30:].max() < 0.02 * GAP


def test_what_is_done_after_mending_is_told_from_the_input():
    model = torn(0.05)
    result = faired(model, {0, 1, 2, 3}, Filter(15.0), Wishes("g1", close_gaps=True), Tolerances(1e-3))
    after = result.displacement().applied(model)
    for i, moved in result.moved.items():
        grid = [np.linspace(*knots.domain, 60) for knots in (moved.net.u, moved.net.v)]
        old, new = (np.asarray(each.surfaces[i].net.grid(*grid)) for each in (model, after))
        assert np.abs(moved.net.grid(*grid) - old).max() < 1e-9
        assert np.linalg.norm(new - old, axis=-1).max() <= 1.1 * moved.motion
        assert moved.changes[i].after.variation < moved.changes[i].before.variation


def test_seams_along_trim_curves_are_shut_to_the_tolerance_on_finer_spans():
    _, left, right = halves.surfaces(0.2, (15, 30))
    model = view(halves.document(left, right))
    found = {}
    for refine in (False, True):
        wishes = Wishes("g1", np.radians(2.0), True)
        result = faired(model, {0, 1}, Filter(45.0), wishes, Tolerances(1e-4), refine=refine)
        (old,), (new,) = (
            [seam for seam in seams(each) if len(seam.faces) == 2]
            for each in (model, result.displacement().applied(model))
        )
        found[refine] = new.gap
    assert old.gap > 1e-2 and found[True] <= 2e-4 and found[True] < found[False]


def half(opening):
    _, left, right = halves.surfaces(opening, (15, 30))
    model = view(halves.document(left, right))
    return Scene(
        model, sheets(model, {0, 1}, Filter(45.0)), joints(model, {0, 1}, Wishes("g1", 0.1, True)), Tolerances()
    )


def test_what_is_within_the_tolerances_is_no_defect():
    """Its seam moves no point, and gets no knots."""
    scene = half(0.2)
    assert mended(scene).moved
    assert not mended(replace(scene, tolerances=Tolerances(1.0, angle=0.1))).moved


def test_spans_are_halved_only_as_long_as_that_closes_seams(monkeypatch):
    scene, asked = half(0.2), []

    def stays(pose, delta):
        asked.append(sum(space.net.poles[..., 0].size for space in pose.problem.spaces.values()))
        return {0}, 0.5

    monkeypatch.setattr(Pose, "open", stays)
    found = mended(scene).moved
    assert len(asked) == 2 and asked[0] < asked[1]
    assert sum(each.net.poles[..., 0].size for each in found.values()) == asked[0]
