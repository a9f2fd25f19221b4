"""Gains by band: the transfer function, ripples on five parameterisations and across seams, what is refused."""

import json

import numpy as np
import pytest
from mracad_cli.__main__ import main

from mracad.bspline.fit import interpolated
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.edit.equalize import equalize
from mracad.errors import UsageError
from mracad.inspect.seams import seams
from mracad.occ.files import write
from mracad.occ.step import read_step
from mracad.occ.view import view
from mracad.spec.steps.shape import Equalize
from tests.edit import panels
from tests.edit.models import fitted, sheet

RIPPLES = {6.0: (0.05, 0.4), 30.0: (0.3, 1.0)}
"""Wavelengths (mm), with amplitudes (mm) and directions (radians)."""


def phase(wavelength, x, y):
    direction = RIPPLES[wavelength][1]
    return 2 * np.pi * (x * np.cos(direction) + y * np.sin(direction)) / wavelength


def truth(x, y):
    return 6 * np.sin(2 * np.pi * x / 300) + 4 * np.cos(2 * np.pi * (0.3 * x + y) / 200)


def rippled(x, y):
    return truth(x, y) + sum(size * np.sin(phase(w, x, y)) for w, (size, _) in RIPPLES.items())


def left(points):
    """How much is left of each ripple on the panel, by wavelength."""
    x, y, z = points.T
    waves = [f(phase(w, x, y)) for w in RIPPLES for f in (np.sin, np.cos)]
    s, t = (2 * (each - each.mean()) / np.ptp(each) for each in (x, y))
    shape = [s**i * t**j for i in range(9) for j in range(7) if i + j < 9]
    found = np.linalg.lstsq(np.array([*waves, *shape]).T, z - truth(x, y), rcond=None)[0]
    return {w: np.hypot(*found[2 * i : 2 * i + 2]) / size for i, (w, (size, _)) in enumerate(RIPPLES.items())}


def middle(net, count=100):
    us, vs = (k.domain[0] + np.linspace(0.15, 0.85, count) * k.period for k in (net.u, net.v))
    return np.asarray(net.grid(us, vs)).reshape(-1, 3)


def even(spans, degree=3):
    return KnotVector.clamped(np.linspace(0, 1, spans + 1), degree)


def uneven(spans, seed):
    steps = np.random.default_rng(seed).uniform(0.6, 1.4, spans)
    return KnotVector.clamped(np.concatenate([[0], np.cumsum(steps) / steps.sum()]), 3)


def swapped(net):
    return Net(net.v, net.u, net.poles.swapaxes(0, 1))


def rational(net):
    """The same waves under weights that vary slowly."""
    x, y = np.meshgrid(net.u.greville(), net.v.greville(), indexing="ij")
    weights = 1.0 + 0.2 * x * (1.0 - y)
    over = np.asarray(Net(net.u, net.v, weights[..., None]).grid(net.u.greville(), net.v.greville()))
    values = np.asarray(net.grid(net.u.greville(), net.v.greville()))
    return Net(net.u, net.v, interpolated(net.u, net.v, values * over) / weights[..., None], weights)


def graded(u):
    return 100 * u + 6 * np.sin(2 * np.pi * u)


NETS = {
    "uniform": lambda: fitted(even(70), even(70), rippled),
    "uneven": lambda: fitted(uneven(70, 0), uneven(70, 2), rippled),
    "graded": lambda: fitted(even(80), even(70), rippled, u_of=graded),
    "swapped": lambda: swapped(fitted(even(70), uneven(70, 0), rippled)),
    "degree 5": lambda: fitted(even(50, 5), even(50, 5), rippled),
    "rational": lambda: rational(fitted(even(70), even(70), rippled)),
}


@pytest.mark.parametrize("name", NETS)
@pytest.mark.parametrize(("band", "gone", "other"), [("2mm:10mm=0", 6.0, 30.0), ("15mm:50mm=0", 30.0, 6.0)])
def test_one_ripple_goes_and_the_other_stays(name, band, gone, other):
    net = NETS[name]()
    before = left(middle(net))
    model = sheet(net)
    after = left(middle(equalize(model, Equalize(band=(band,))).displacement.applied(model).surfaces[0].net))
    assert after[gone] / before[gone] <= 0.03
    assert 0.97 <= after[other] / before[other] <= 1.03


@pytest.mark.parametrize("times", [0.7, 0.75, 1.0, 4 / 3, 1.5])
def test_the_gain_is_as_it_is_written_down(times):
    """G = 1 + (g − 1) (1 − H), H = 1 / (1 + (c/Λ)¹⁶)."""
    cut, length = 12.0, 12.0 * times
    net = fitted(even(60), even(8), lambda x, y: 0.02 * np.sin(2 * np.pi * x / length))
    model = sheet(net)
    after = equalize(model, Equalize(band=(":12mm=3",), free_edges="smooth", corners="move")).displacement
    x, _, z = middle(after.applied(model).surfaces[0].net).T
    wave = [np.sin(2 * np.pi * x / length), np.cos(2 * np.pi * x / length), np.ones_like(x)]
    found = np.linalg.lstsq(np.array(wave).T, z / 0.02, rcond=None)[0]
    low = 1 / (1 + (cut / length) ** 16)
    assert np.hypot(*found[:2]) == pytest.approx(1 + 2 * (1 - low), rel=0.02)


def test_amounts_go_beyond_one():
    """A gain of 2 thrice over is one of 4; and half of a gain of 0 one of a half."""
    model = sheet(fitted(even(40), even(40), lambda x, y: 0.05 * np.sin(phase(6.0, x, y)), size=60.0))

    def points(**options):
        return middle(equalize(model, Equalize(**options)).displacement.applied(model).surfaces[0].net)

    assert np.allclose(points(band=(":10mm=2",), amount=3), points(band=(":10mm=4",)), atol=1e-12)
    assert np.allclose(points(band=("1mm:10mm=0",), amount=0.5), points(band=("1mm:10mm=0.5",)), atol=1e-9)


def test_shape_stays_as_it_is():
    """A cylinder has no waves of 60 mm, however near its rims."""
    angles, along = even(30), even(30)
    turn, y = np.meshgrid(np.pi * angles.greville(), along.greville(), indexing="ij")
    values = np.stack([100 * np.cos(turn), 150 * y, 100 * np.sin(turn)], axis=-1)
    model = sheet(Net(angles, along, interpolated(angles, along, values)))
    edit = equalize(model, Equalize(band=("10mm:60mm=2",), free_edges="smooth", corners="move"))
    assert max(outcome.moved for outcome in edit.outcomes) < 0.02


def test_seams_hold_in_the_file(tmp_path):
    """Two patches of unlike orientation; the ripple across them goes as on one, and the other stays."""
    clean, _ = panels.whole(60, 0.0, patches=(2, 1))
    x, y = np.meshgrid(clean.u.greville(), clean.v.greville(), indexing="ij")
    whole = Net(clean.u, clean.v, interpolated(clean.u, clean.v, np.stack([x, y, rippled(x, y)], axis=-1)))
    patches = panels.cut(whole, (2, 1))
    patches[1, 0] = panels.turned(patches[1, 0], "ux")
    source, target, report = (tmp_path / name for name in ("in.step", "out.step", "r.json"))
    write(panels.document(patches), source)
    words = ["--band", "2mm:10mm=0", "--band", "15mm:50mm=2"]
    assert main(["equalize", str(source), "-o", str(target), *words, "--report", str(report)]) == 0
    model = view(read_step(target))
    (seam,) = seams(model)
    assert seam.gap <= 1e-9 and seam.angle <= 1e-5
    assert json.loads(report.read_text())["valid"]["after"]["valid"]
    u, v = (grid.ravel() for grid in np.meshgrid(np.linspace(20, 180, 150), np.linspace(20, 80, 90), indexing="ij"))
    points, before = np.zeros((len(u), 3)), np.zeros((len(u), 3))
    for (key, patch), surface in zip(sorted(patches.items()), model.surfaces, strict=True):
        own = (u < 100) == (key == (0, 0))
        uv = np.stack(patch.place((u[own], v[own])), axis=1)
        before[own], points[own] = patch.net.evaluate(uv), surface.net.evaluate(uv)
    shares = [left(points)[w] / left(before)[w] for w in RIPPLES]
    assert shares[0] <= 0.03 and shares[1] == pytest.approx(2.0, abs=0.03)


def test_what_weakens_short_waves_makes_nothing_rougher():
    """As smoothing does; other gains do as they say."""
    noisy = sheet(fitted(even(40), even(40), lambda x, y: 0.2 * np.sin(phase(6.0, x, y)) + (x > 50) * 3.0))
    judged, plain = (equalize(noisy, Equalize(band=bands)) for bands in ((":30mm=0",), ("1mm:30mm=0",)))
    before, after = judged.outcomes[0].roughness
    assert judged.outcomes[0].amount < 1.0 or after.curvature <= before.curvature
    assert after.bending <= before.bending and plain.outcomes[0].amount == 1.0


@pytest.mark.parametrize(
    ("options", "what"),
    [
        ({}, "no band"),
        ({"band": ("10mm=0",)}, "not a band"),
        ({"band": ("2mm:10mm",)}, "not a band"),
        ({"band": ("10mm:=2",)}, "no end"),
        ({"band": ("10mm:2mm=2",)}, "empty"),
        ({"band": ("2mm:10mm=-1",)}, "between 0"),
        ({"band": ("2mm:10mm=nan",)}, "not a band"),
        ({"band": ("2mm:10mm=0", "8mm:20mm=1")}, "before another ends"),
        ({"band": ("2mm:10mm=0.5",), "amount": 2.5}, "allows up to 2"),
        ({"band": ("2mm:10mm=2",), "amount": -1.0}, "amount"),
    ],
)
def test_bad_bands_are_refused(options, what):
    with pytest.raises(UsageError, match=what):
        Equalize(**options)


def test_bands_in_shares_of_the_model_may_overlap_on_it():
    flat = sheet(fitted(even(10), even(10), lambda x, y: 0.0 * x))
    with pytest.raises(UsageError, match="before another ends"):
        equalize(flat, Equalize(band=("1mm:10%=0", "12mm:20mm=2")))
