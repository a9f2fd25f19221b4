"""Regions that --hold protects: nothing moves there, edits fade towards them within a wavelength."""

import numpy as np
import pytest
from msgspec import structs

from mracad.edit.denoise import denoise
from mracad.edit.feature.edits import move, repeat
from mracad.edit.offset import offset
from mracad.edit.smooth import smooth
from mracad.edit.transfer import transfer
from mracad.errors import EditError, UsageError
from mracad.spec.steps import Move, Repeat, Smooth, Transfer
from mracad.spec.steps.smooth import Denoise, OffsetFaces
from tests.edit import panels
from tests.edit.feature import grounds
from tests.edit.models import sheet

SCALE = 25.0
MIDDLE, RADIUS = np.array([45.0, 55.0, panels.truth(45.0, 55.0)]), 12.0
BALL = f"near:45,55,{float(MIDDLE[2])!r},radius:{RADIUS}"


@pytest.fixture(scope="module")
def noisy():
    return panels.whole(24, 0.3, patches=(1, 1))[1]


def change(model, edit, options, net=0):
    """Points of a surface before, all over it, and how far each moved."""
    before = model.surfaces[net].net
    after = edit(model, options).displacement.applied(model).surfaces[net].net
    us, vs = (np.linspace(*knots.domain, 301) for knots in (before.u, before.v))
    points = before.grid(us, vs)
    return points, np.linalg.norm(after.grid(us, vs) - points, axis=-1)


@pytest.mark.parametrize(
    ("edit", "options"),
    [
        (smooth, Smooth(scale="25mm", free_edges="smooth")),
        (smooth, Smooth(scale="25mm", across="20mm", along="x")),
        (smooth, Smooth(level=2.0)),
        (denoise, Denoise(noise="0.03mm")),
        (offset, OffsetFaces(distance="1mm")),
    ],
)
def test_nothing_moves_in_a_ball(noisy, edit, options):
    model = sheet(panels.whole(24, 0.0, patches=(1, 1))[0] if edit is offset else noisy)
    points, held = change(model, edit, structs.replace(options, hold=(BALL,)))
    _, free = change(model, edit, options)
    apart = np.linalg.norm(points - MIDDLE, axis=-1) - RADIUS
    assert held[apart <= 0].max() <= 1e-12  # of rounding, where knots were inserted
    assert np.abs(held - free)[apart > 40].max() < 0.2 * free.max()
    assert held[(apart > 15) & (apart < 25)].max() > 0


def test_an_edit_fades_within_a_wavelength(noisy):
    model = sheet(noisy)
    options = Smooth(scale="25mm", free_edges="smooth")
    points, held = change(model, smooth, structs.replace(options, hold=(BALL,)))
    _, free = change(model, smooth, options)
    apart = np.linalg.norm(points - MIDDLE, axis=-1) - RADIUS
    share = [
        np.sqrt((held[ring] ** 2).mean() / (free[ring] ** 2).mean())
        for low in (0.0, 0.2, 0.4, 0.6, 0.8, 1.2)
        for ring in [(apart > low * SCALE) & (apart <= (low + 0.2) * SCALE)]
    ]
    print("share of the change, by distance from the region:", np.round(share, 3))
    assert (np.diff(share[:-1]) > 0).all() and share[0] < 0.05 and share[-1] > 0.95


def test_nothing_moves_in_a_box(noisy):
    model = sheet(noisy)
    points, held = change(model, smooth, Smooth(scale="25mm", hold=("box:75,40,-100,30,20,100",)))
    inside = ((points[..., :2] >= [30, 20]) & (points[..., :2] <= [75, 40])).all(axis=-1)
    assert inside.any() and not held[inside].any() and held.any()


def rounded(radius=6.0, noise=0.02):
    """Two planes with a round between them, and noise."""
    from mracad.bspline.fit import interpolated
    from mracad.bspline.knots import KnotVector
    from mracad.bspline.surface import Net

    u, v = KnotVector.clamped(np.linspace(-60, 60, 121), 3), KnotVector.clamped(np.linspace(0, 80, 41), 3)
    us, vs = np.meshgrid(u.greville(), v.greville(), indexing="ij")
    half = radius * np.pi / 4
    turn = np.clip(us, -half, half) / radius
    away = us - np.clip(us, -half, half)
    x = radius * np.sin(turn) + away * np.cos(turn)
    z = radius * (np.cos(turn) - 1) - away * np.sin(turn)
    net = Net(u, v, interpolated(u, v, np.stack([x, vs, z], axis=-1)))
    return net.with_poles(net.poles + noise * np.random.default_rng(1).standard_normal(net.poles.shape))


def test_what_bends_more_tightly_than_a_radius_stays():
    """Noise bends as tightly, and goes."""
    model = sheet(rounded())
    points, held = change(model, smooth, Smooth(scale="20mm", hold=("radius<15mm",)))
    tight = np.abs(points[..., 0]) < 3.5
    assert not held[tight].any() and held[np.abs(points[..., 0]) > 30].max() > 0.02
    _, other = change(model, smooth, Smooth(scale="20mm", hold=("radius<3mm",)))
    assert other[tight].any()


def test_features_leave_regions_alone():
    model = sheet(grounds.plane(150.0))
    near = {"feature": "near:50,50,0,radius:20"}
    points, moved = change(model, repeat, Repeat(**near, at=("120,50,0",), hold=("near:120,80,0,radius:15",)))
    assert moved.max() > 0.5 and not moved[np.linalg.norm(points - [120, 80, 0], axis=-1) <= 15].any()
    with pytest.raises(EditError, match="cut off"):
        repeat(model, Repeat(**near, at=("120,50,0",), hold=("near:120,55,0,radius:10",)))
    points, moved = change(
        model, repeat, Repeat(**near, at=("120,50,0",), hold=("near:120,55,0,radius:10",), clip=True)
    )
    assert moved.any() and not moved[np.linalg.norm(points - [120, 55, 0], axis=-1) <= 10].any()
    with pytest.raises(EditError, match="feature: a region of --hold keeps part of it"):
        move(model, Move(**near, to="120,50,0", hold=("near:50,50,0,radius:5",)))
    options = Transfer(
        from_="#1", to="#1", band="0mm:30mm", blend=("0.5",), source="a.step", hold=("near:50,50,0,radius:5",)
    )
    before = model.surfaces[0].net
    after = transfer(model, options, model).displacement.applied(model).surfaces[0].net
    middle = np.array([[50.0, 50.0]])
    assert np.abs(before.evaluate(middle) - after.evaluate(middle)).max() <= 1e-12


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("box:1,2,3", "hold: 'box:1,2,3' is not a box"),
        ("near:1,2,3,radius:0", "hold: radius 0 is not greater than zero"),
        ("near:#1@0,0,radius:5", "is not a region"),
        ("near:1,2,radius:5", "hold: '1,2' is not a place"),
        ("radius<0", "hold: '0' is not greater than zero"),
        ("radius>5mm", "hold: 'radius>5mm' is not a region"),
    ],
)
def test_what_is_no_region_is_refused(noisy, word, said):
    with pytest.raises(UsageError, match=said):
        smooth(sheet(noisy), Smooth(scale="25mm", hold=(word,)))
