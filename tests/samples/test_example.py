"""The example of make example: what each step does to the shell, on files as read back."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pytest

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.inspect.seams import seams
from mracad.job.document import play
from mracad.job.look import snapshot
from mracad.occ.files import read, write
from mracad.spec import recipe
from samples.example import make
from samples.models import documents, panel, shell

FOLDER = Path(make.__file__).parent
STEPS = "shell", "smooth", "sweep", "move", "repeat", "transfer", "equalize"
HEIGHT = 1.5
"""Of the emboss, mm."""
TOP, FIRST = np.array([shell.EMBOSS]), np.array([[32.0, 35.0]])
"""Where the emboss is, and where it is moved to, in u and v of the whole shell."""


def patches(model, uv):
    """Points and normals at parameters ``(n, 2)`` of the whole shell."""
    counts = np.array(shell.PATCHES)
    cells = np.minimum((uv / shell.SIZE * counts).astype(int), counts - 1)
    points, normals = np.empty((len(uv), 3)), np.empty((len(uv), 3))
    for i, surface in enumerate(model.surfaces):
        on = cells @ [counts[1], 1] == i
        if on.any():
            points[on], normals[on] = surface.net.evaluate(uv[on]), surface.net.normals(uv[on])
    return points, normals


def grid(u, v, count=(120, 60)):
    places = np.meshgrid(*(np.linspace(*ends, n) for ends, n in zip((u, v), count, strict=True)))
    return np.stack(places, axis=-1).reshape(-1, 2)


@dataclass
class Story:
    """The model after each step, what each step said, and the shell without its emboss, swept."""

    models: dict
    said: dict
    bare: object

    def heights(self, name, uv, over=None):
        """Heights of the model after a step above another, by default the bare swept one."""
        points, normals = patches(self.bare if over is None else self.models[over], uv)
        return ((patches(self.models[name], uv)[0] - points) * normals).sum(axis=1)

    @cached_property
    def truth(self):
        u, v, poles = shell.shell_net()
        return Net(KnotVector(u, 3), KnotVector(v, 3), poles)

    def off(self, name, uv):
        """Heights of the model after a step above the shell without marks and noise."""
        return ((patches(self.models[name], uv)[0] - self.truth.evaluate(uv)) * self.truth.normals(uv)).sum(axis=1)


@pytest.fixture(scope="module")
def story(tmp_path_factory):
    path = tmp_path_factory.mktemp("example") / "out.step"
    steps = recipe.load(str(FOLDER / "recipe.toml")).steps(str(FOLDER.parent / "shell.step"))
    document = read(FOLDER.parent / "shell.step")
    models, said = {"shell": snapshot(document)}, {}
    for step in steps[:-1]:
        (said[step.use],) = play(document, [step])
        write(document, path)
        models[step.use] = snapshot(read(path))
    play(document, steps[-1:])
    assert tuple(models) == STEPS and steps[-1].use == "check"
    bare = documents.single(panel.sewn(panel.cut(*shell.shell_net(0.0), shell.PATCHES)), "bare")
    play(bare, [steps[1]])
    return Story(models, said, snapshot(bare))


@pytest.mark.parametrize("name", STEPS)
def test_every_seam_stays_smooth(story, name):
    measures = seams(story.models[name])
    gap, angle = max(m.gap for m in measures), max(m.angle for m in measures)
    print(f"{name}: {len(measures)} seams, gap {gap:.1e} mm, angle {angle:.1e}°")
    assert len(measures) == 17 and gap <= 1e-9 and angle <= 1e-5


def test_smoothing_takes_the_marks_and_most_of_the_noise_and_keeps_the_emboss(story):
    uv = grid((5, 235), (5, 115), (461, 45))
    before, after = (story.off(name, uv) for name in ("shell", "smooth"))
    wave = np.exp(2j * np.pi * uv[:, 0] / shell.STEP)
    marks = abs((after * wave).mean()) / abs((before * wave).mean())
    print(f"marks {marks:.2%}, rms {before.std() * 1e3:.1f} → {after.std() * 1e3:.1f} µm")
    assert marks <= 2 / (1 + (9 / 5) ** 8)
    assert after.std() <= 0.3 * before.std()
    assert np.abs(story.off("smooth", grid((70, 110), (45, 75)))).max() <= 0.025 * HEIGHT


def test_the_sweep_meets_its_point_and_the_emboss_rides(story):
    at = np.array([[150.0, 40.0]])
    way = patches(story.models["sweep"], at)[0] - patches(story.models["smooth"], at)[0]
    print(f"point off by {np.abs(way - [0, -2, 6]).max():.1e} mm")
    assert np.abs(way - [0, -2, 6]).max() <= 1e-6
    assert story.heights("sweep", TOP) == pytest.approx(HEIGHT, rel=0.025)


def test_the_old_place_is_clean_and_the_emboss_is_whole_at_the_new_one(story):
    left = np.abs(story.heights("move", grid((68, 112), (42, 78)))).max()
    before, there = (story.heights(name, place)[0] for name, place in (("sweep", TOP), ("move", FIRST)))
    print(f"left {left * 1e3:.0f} µm, height {before:.3f} → {there:.3f} mm")
    assert left <= 0.012 * HEIGHT and there == pytest.approx(before, rel=0.02)
    (copy,) = story.said["move"].edit.copies
    assert copy.deviation <= 3e-3 * HEIGHT and copy.lost <= 3e-3 * HEIGHT


def test_copies_over_seams_are_near_their_ideal(story):
    copies = story.said["repeat"].edit.copies
    worst = max(copy.deviation for copy in copies)
    print(f"{len(copies)} copies, off by {worst * 1e3:.1f} µm; over {max(len(c.faces) for c in copies)} faces")
    assert len(copies) == 5 and worst <= 4e-3 * HEIGHT
    assert sum(len(copy.faces) > 1 for copy in copies) >= 3 and max(len(copy.faces) for copy in copies) == 4


def test_the_knurl_has_its_height_and_then_twice_that(story):
    inside = grid((194, 226), (52, 68))
    one, two = (story.heights(name, inside, "repeat") for name in ("transfer", "equalize"))
    twice = one @ two / (one @ one)
    print(f"knurl: {np.abs(one).max():.3f} mm high, {twice:.3f} times that")
    assert np.abs(one).max() == pytest.approx(make.HEIGHT, rel=0.03)
    octaves = np.array([5.0, 10.0]) / (make.PERIOD / 2**0.5)  # ends of the band over the wavelength
    low, high = 1 / (1 + octaves**16)
    assert twice == pytest.approx(1 + low - high, rel=0.02)


def test_the_knurled_plate_is_what_makes_it(tmp_path):
    make.main(tmp_path)
    assert (tmp_path / "knurl.step").read_bytes() == (FOLDER / "knurl.step").read_bytes()
