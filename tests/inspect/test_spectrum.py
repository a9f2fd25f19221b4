"""Spectra: amplitudes and bands of waves that are known, whatever the parameters; sums; invariance."""

from dataclasses import replace

import numpy as np
import pytest

from mracad.bspline.fit import through
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.inspect.spectrum import spectra, spectrum, together
from mracad.model.brep import Trim
from tests.edit.models import segment, sheet

SIZE = 300.0, 200.0
SHORT, LONG = (6.0, 0.1), (30.0, 0.3)
"""Wavelength and amplitude of the ripples, mm: both along x."""


def crown(x, y):
    """The panel of the samples, with its bulge and soft character line."""
    p, q = x / 150 - 1, y / 100 - 1
    line = (y - 118 - 14 * p) / 32
    return 42 - 26 * p**2 - 15 * q**2 + 4 * p * q**2 + 8 * line / np.sqrt(1 + line**2)


def slopes(x, y):
    step = 1e-4
    return (crown(x + step, y) - crown(x - step, y)) / 2 / step, (crown(x, y + step) - crown(x, y - step)) / 2 / step


def rippled(x, y):
    """The panel with both ripples along its normals, their lengths counted along it from x = 0."""
    fine = np.linspace(0.0, SIZE[0], 3001)[:, None]
    steps = np.hypot(1.0, slopes((fine[1:] + fine[:-1]) / 2, y[:1])[0]) * (fine[1] - fine[0])
    lengths = np.concatenate([np.zeros((1, y.shape[1])), np.cumsum(steps, axis=0)])
    s = np.stack([np.interp(x[:, 0], fine[:, 0], column) for column in lengths.T], axis=1)
    down, aside = slopes(x, y)
    normal = np.stack([-down, -aside, np.ones_like(x)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    wave = sum(a * np.sin(2 * np.pi * s / length + 1.0) for length, a in (SHORT, LONG))
    return np.stack([x, y, crown(x, y)], axis=-1) + wave[..., None] * normal


def surface(u, v, x_of=lambda u: u, height=None, weights=None):
    """The rippled panel, or a height field, through its Greville points."""
    net = Net(u, v, np.zeros((u.count, v.count, 3)), weights)
    x, y = np.meshgrid(x_of(u.greville()), v.greville(), indexing="ij")
    points = rippled(x, y) if height is None else np.stack([x, y, height(x, y)], axis=-1)
    return net.with_poles(through(net, points))


def breaks(size, step, uneven=0.0, seed=0):
    share = np.arange(round(size / step) + 1) / round(size / step)
    share[1:-1] += uneven * np.random.default_rng(seed).uniform(-0.5, 0.5, len(share) - 2) / round(size / step)
    return size * share


def even(step=0.75, degree=3):
    return KnotVector.clamped(breaks(SIZE[0], step), degree), KnotVector.clamped(breaks(SIZE[1], 8.0), degree)


def swapped(net):
    return Net(net.v, net.u, net.poles.swapaxes(0, 1))


def ways():
    """The same panel in five parameterizations, and which direction runs along x."""
    u, v = even()
    uneven = KnotVector.clamped(breaks(SIZE[0], 0.75, 0.8), 3)
    graded = KnotVector.clamped(np.linspace(0.0, 1.0, 501), 3)
    weights = 1.0 + 0.3 * np.random.default_rng(5).random((u.count, 1)) * np.ones((1, v.count))
    weights = np.sort(weights, axis=0)
    return {
        "uniform": (surface(u, v), "u"),
        "uneven knots": (surface(uneven, v), "u"),
        "graded": (surface(graded, v, lambda t: SIZE[0] * (0.6 * t + 0.4 * t**2)), "u"),
        "swapped": (swapped(surface(u, v)), "v"),
        "degree 5": (surface(*even(1.0, 5)), "u"),
        "rational": (surface(u, v, weights=weights), "u"),
    }


def amplitudes(direction):
    """Of the waves in the octaves about both ripples, by √2 rms."""
    by = {band.low: np.sqrt(2) * band.rms for band in direction.bands}
    return np.array([by[5.0], by[20.0]])


def found(net):
    return spectra(sheet(net), [0])[0]


@pytest.fixture(scope="module")
def panel():
    return {name: (found(net), way) for name, (net, way) in ways().items()}


WANTED = np.array([SHORT[1], LONG[1]])


def test_both_ripples_have_their_amplitudes_in_their_bands(panel):
    for name, (found, way) in panel.items():
        got = amplitudes(getattr(found, way))
        print(name, got / WANTED)
        np.testing.assert_allclose(got, WANTED, rtol=0.05, err_msg=name)


def test_parameterizations_agree(panel):
    every = np.array([amplitudes(getattr(spectrum, way)) for spectrum, way in panel.values()])
    assert (np.ptp(every, axis=0) <= 0.03 * every.mean(axis=0)).all()


def test_no_other_band_has_them(panel):
    """Between the ripples and beside them, and across them."""
    spectrum, _ = panel["uniform"]
    along, across = ({band.low: band.rms for band in way.bands} for way in (spectrum.u, spectrum.v))
    assert along[10.0] < 0.03 * LONG[1] and along[2.5] < 0.03 * SHORT[1]
    assert max(across[low] for low in (5.0, 10.0)) < 0.03 * SHORT[1]


def test_patches_of_the_panel_tell_the_same(panel):
    """Three by two, each with a spectrum of its own; and the whole."""
    pieces = []
    for low in (0.0, 100.0, 200.0):
        for bottom in (0.0, 100.0):
            u, v = (KnotVector.clamped(b, 3) for b in (low + breaks(100.0, 0.75), bottom + breaks(100.0, 8.0)))
            pieces.append(found(surface(u, v)))
    whole = together(pieces)
    got = amplitudes(whole.u)
    print("patches", got / WANTED)
    np.testing.assert_allclose(got, WANTED, rtol=0.05)
    np.testing.assert_allclose(got, amplitudes(panel["uniform"][0].u), rtol=0.03)
    assert 40.0 <= whole.u.shape <= 80.0
    assert whole.area == pytest.approx(sum(each.area for each in pieces)) and whole.faces == (0,) * 6


def test_the_shape_begins_beyond_the_ripples(panel):
    spectrum, _ = panel["uniform"]
    assert 40.0 <= spectrum.u.shape <= 80.0 and spectrum.v.shape == 0.0
    assert spectrum.scale == spectrum.u.shape / 2
    assert spectrum.u.detail == pytest.approx(np.sqrt((WANTED**2 / 2).sum()), rel=0.05)


def test_energies_add_up_to_the_mean_square():
    """Of waves of many lengths on a plane: shares to one, energies to height² times area, in both directions."""
    rng = np.random.default_rng(2)
    waves = [(length, rng.uniform(0, 6), rng.uniform(-0.05, 0.05)) for length in 2.0 ** np.arange(2, 6, 0.25)]

    def height(x, y):
        return sum(a * np.sin(2 * np.pi * x / length + phase) for length, phase, a in waves) + 0 * y

    spectrum = found(surface(*even(), height=height))
    x = np.linspace(0, SIZE[0], 20001)
    mean = np.mean(height(x, 0 * x) ** 2)
    assert sum(band.share for band in spectrum.u.bands) == pytest.approx(1.0)
    total = sum(band.energy for band in spectrum.u.bands)
    assert total == pytest.approx(mean * SIZE[0] * SIZE[1], rel=0.02)
    assert sum(band.rms**2 for band in spectrum.u.bands) == pytest.approx(total / spectrum.area, rel=1e-9)
    assert spectrum.area == pytest.approx(SIZE[0] * SIZE[1], rel=0.01)


def test_motion_turns_nothing_and_size_scales():
    net = ways()["uniform"][0]
    angle = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    own, moved = found(net), found(net.with_poles(net.poles @ angle.T + [10.0, -20.0, 5.0]))
    for one, two in zip((*own.u.bands, *own.v.bands), (*moved.u.bands, *moved.v.bands), strict=True):
        assert two.rms == pytest.approx(one.rms, rel=1e-5, abs=1e-9)
    twice = found(net.with_poles(2.0 * net.poles))
    for one, two in zip(own.u.bands, twice.u.bands, strict=True):
        assert two.low == 2 * one.low and two.rms == pytest.approx(2 * one.rms, rel=1e-5)


def test_only_what_lies_inside_the_trims_counts():
    """A face on the half of a plane that has no waves has none."""
    u, v = even()
    net = surface(u, v, height=lambda x, y: 0.3 * np.sin(2 * np.pi * x / 30) * (x < 150) + 0 * y)
    model, box = sheet(net), [(160.0, 10.0), (290.0, 10.0), (290.0, 190.0), (160.0, 190.0)]
    trims = tuple(Trim(i, segment(box[i], box[(i + 1) % 4])) for i in range(4))
    face = replace(model.faces[0], trims=trims)
    trimmed = spectra(replace(model, faces=(face,)), [0])[0]
    assert trimmed.area == pytest.approx(130 * 180, rel=0.03)
    assert amplitudes(found(net).u)[1] == pytest.approx(0.3 / np.sqrt(2), rel=0.05)
    assert max(band.rms for band in trimmed.u.bands) < 1e-3


def test_a_ring_has_the_waves_around_it():
    """Twelve waves around a tube of radius 50."""
    turn = KnotVector.from_multiplicities(np.linspace(0, 2 * np.pi, 97), np.ones(97, int), 3, True)
    along = KnotVector.clamped(np.linspace(0, 80, 21), 3)
    net = Net(turn, along, np.zeros((turn.count, along.count, 3)))
    a, z = np.meshgrid(turn.greville(), along.greville(), indexing="ij")
    r = 50 + 0.2 * np.sin(12 * a)
    net = net.with_poles(through(net, np.stack([r * np.cos(a), r * np.sin(a), z], axis=-1)))
    model = sheet(net)
    spectrum = spectra(model, [0])[0]
    by = {band.low: np.sqrt(2) * band.rms for band in spectrum.u.bands}
    assert by[20.0] == pytest.approx(0.2, rel=0.03) and by[10.0] < 0.004 and by.get(40.0, 0.0) < 0.004


def test_noise_is_found_and_a_scale_that_takes_it():
    u, v = even(3.0)
    v = KnotVector.clamped(breaks(SIZE[1], 3.0), 3)
    net = surface(u, v, height=crown)
    noisy = net.with_poles(net.poles + 0.03 * np.random.default_rng(1).standard_normal(net.poles.shape))
    clean, rough = found(net), found(noisy)
    assert clean.noise == 0.0 and clean.scale is None
    assert rough.noise == pytest.approx(0.03, rel=0.1) and 6.0 <= rough.scale <= 30.0


@pytest.mark.parametrize("degrees", [(3, 3), (2, 5)])
def test_noise_reaches_the_floor(degrees):
    """On uneven spans: in every octave from twice the spans, within the scatter of the noise."""
    u, v = (KnotVector.clamped(breaks(200.0, 2.0, 0.3), d) for d in degrees)
    net = Net(u, v, np.zeros((u.count, v.count, 3)))
    x, y = np.meshgrid(u.greville(), v.greville(), indexing="ij")
    flat = np.stack([x, y, 0.05 * np.random.default_rng(3).standard_normal(x.shape)], axis=-1)
    model = sheet(net.with_poles(flat))
    found = spectrum(model.surfaces[0].net, model.faces[0], 0.05)
    for way in (found.u, found.v):
        seen = [band for band in way.bands if 4.0 < band.low < 25.0]
        assert len(seen) == 3
        assert [band.floor for band in seen] == pytest.approx([band.rms for band in seen], rel=0.1)
