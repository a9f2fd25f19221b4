"""Textures grown from the detail of a face: spectrum, no repeats, seams."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.edit.atlas import charts
from mracad.edit.character import Character
from mracad.edit.feature.patch import Patch
from mracad.edit.texture import _energies, grown
from mracad.edit.transfer import transfer
from mracad.errors import EditError, UsageError
from mracad.inspect.seams import seams
from mracad.inspect.spectrum import spectra
from mracad.occ.view import view
from mracad.spec.steps import Transfer
from mracad.wavelet.project import band
from tests.edit import panels
from tests.edit.models import sheet

SIZE, LARGE, LONGEST = 60.0, 165.0, 12.0
"""Sides of the source and of the target, and the longest waves of the texture, mm."""


def plane(size, spans, heights=None):
    k = KnotVector.clamped(np.linspace(0.0, size, spans + 1), 3)
    x, y = np.meshgrid(k.greville(), k.greville(), indexing="ij")
    return Net(k, k, np.stack([x, y, 0 * x if heights is None else heights(x.shape)], axis=-1))


def rough(shape):
    return 0.3 * gaussian_filter(np.random.default_rng(0).standard_normal(shape), (1.0, 1.4))


def options(**given):
    words = {"source": "x.step", "from_": "#1", "to": "#1", "band": f":{LONGEST}mm", "grow": True}
    return Transfer(**words | given)


@pytest.fixture(scope="module")
def source():
    return plane(SIZE, 30, rough)


@pytest.fixture(scope="module")
def large(source):
    """The texture on a plane that is more than twice as large."""
    return on_plane(source, free_edges="smooth", corners="move")


def on_plane(source, size=LARGE, **given):
    target = sheet(plane(size, 10))
    return transfer(target, options(**given), sheet(source)).displacement.applied(target).surfaces[0].net


def heights(net, size, step=0.5):
    at = np.arange(0.0, size, step)
    return np.asarray(net.grid(at, at))[..., 2]


def repeats(field, beyond):
    """The largest autocorrelation at shifts of more than ``beyond`` samples along u or v that leave a quarter of it."""
    shape = [2 * n for n in field.shape]
    ones, above = (np.abs(np.fft.rfft2(x, shape)) ** 2 for x in (np.ones(field.shape), field - field.mean()))
    pairs, found = (np.fft.irfft2(x, shape) for x in (ones, above))
    shift = [np.minimum(np.arange(n), n - np.arange(n)) for n in shape]
    far = ((shift[0][:, None] > beyond) | (shift[1] > beyond)) & (pairs > 0.25 * field.size)
    return float((found[far] / pairs[far]).max() / field.var())


def test_a_texture_has_the_spectrum_of_its_source(source, large):
    """In every octave with a tenth of the energy of which enough waves fit on the source."""
    detail = band(source, 0.0, LONGEST)[1]
    flat = source.with_poles(plane(SIZE, 30).poles + detail.poles)
    one, two = (spectra(sheet(net), [0])[0] for net in (flat, large))
    compared = 0
    for way in ("u", "v"):
        there = {each.low: each.rms for each in getattr(two, way).bands}
        for each in getattr(one, way).bands:
            if each.share > 0.1 and each.high <= SIZE / 3:
                print(f"{way} {each.low:g} to {each.high:g} mm: {there[each.low] / each.rms:.3f}")
                assert abs(there[each.low] / each.rms - 1) <= 0.1
                compared += 1
    assert compared >= 3
    assert heights(large, LARGE).std() == pytest.approx(heights(flat, SIZE).std(), rel=0.1)


def test_a_texture_does_not_repeat(source, large):
    found = repeats(heights(large, LARGE), SIZE / 0.5)
    mirrored = repeats(heights(on_plane(source, grow=False), LARGE), SIZE / 0.5)
    print(f"largest autocorrelation beyond the source: {found:.2f}, mirrored {mirrored:.2f}")
    assert found <= 0.3 < 0.8 < mirrored


def test_the_seed_tells_the_texture(source):
    own = Character.of(Patch.of(sheet(source), 0, {0}), [(0.0, LONGEST, 1.0)])
    one, again, other = (grown(own, LONGEST, np.zeros(2), np.full(2, LARGE), seed).heights for seed in (0, 0, 1))
    assert np.array_equal(one, again)
    assert abs(np.corrcoef(one.ravel(), other.ravel())[0, 1]) < 0.1


def test_a_texture_fades_out_at_rims_that_stay(source):
    """And half of it is half as high."""
    held, half, free = (
        heights(on_plane(source, 48.0, **given), 48.0)
        for given in ({}, {"amount": 0.5}, {"free_edges": "smooth", "corners": "move"})
    )
    assert max(np.abs(held[0]).max(), np.abs(held[:, 0]).max()) <= 1e-12
    assert np.abs(free[0]).max() > 0.02
    inner = slice(20, -20)
    assert np.abs(held[inner, inner] - free[inner, inner]).max() <= 0.05 * np.abs(free).max()
    assert np.abs(half - held / 2).max() <= 1e-9


def test_a_part_too_small_for_the_waves_is_not_amplified(source):
    own = Character.of(Patch.of(sheet(source), 0, {0}), [(0.0, LONGEST, 1.0)])
    found = grown(own, LONGEST, np.zeros(2), np.array([5.0, 3.0]), 0)
    assert found.heights.std() <= 2.1 * heights(own.detail, SIZE).std()


@pytest.mark.parametrize("wavelength", [3.7, 8.0])
def test_energies_of_a_wave_are_in_its_octave(wavelength):
    """With steps of 1, octaves are 2 to 4, 4 to 8 …; a wave along u is in the lowest along v."""
    x, _ = np.meshgrid(np.arange(120.0), np.arange(90.0), indexing="ij")
    found = _energies(np.sin(2 * np.pi * x / (0.9 * wavelength)))
    octave = int(np.log2(0.9 * wavelength))
    assert found.sum() == pytest.approx(0.5, rel=0.02)
    assert found[octave].sum() >= 0.95 * found.sum()
    assert found[octave, -1] >= 0.9 * found.sum()


TURNS = {(0, 0): "", (1, 0): "x", (0, 1): "uv", (1, 1): "vx"}


@pytest.fixture(scope="module")
def four():
    """Four patches around a corner, with their parameters in all directions."""
    clean, _ = panels.whole(6, 0.0, patches=(2, 2))
    cut = panels.cut(clean, (2, 2))
    return view(panels.document({key: panels.turned(patch, TURNS[key]) for key, patch in cut.items()}))


def test_faces_are_laid_beside_each_other(four):
    """In the plane of a texture, seams meet to a few per cent of their length, and faces do not lie over each other."""
    own = {i: Character.of(Patch.of(four, i, {i}), [(0.0, 30.0, 1.0)]) for i in range(4)}
    laid = charts(four, own)
    for edge in four.edges:
        if len(edge.sides) == 2:
            one, two = (laid[s.face](own[s.face].lengths(s.uv)) for s in edge.sides)
            assert np.linalg.norm(one - two, axis=1).max() <= 3.0
            assert np.ptp(one, axis=0).max() > 90.0
    middles = np.array([laid[i](np.array([own[i].sizes]) / 2)[0] for i in range(4)])
    apart = np.linalg.norm(middles[:, None] - middles, axis=-1)[np.triu_indices(4, 1)]
    assert np.sort(apart)[:4] == pytest.approx(100.0, rel=0.15) and (np.sort(apart)[4:] > 130.0).all()


def test_a_texture_goes_on_across_seams(four):
    net = plane(60.0, 12, lambda shape: 0.1 * np.random.default_rng(0).standard_normal(shape))
    pairs = "#1=#1,#1=#2,#1=#3,#1=#4"
    given = options(from_=None, to=None, map=(pairs,), band=":30mm", taper="10mm")
    found = transfer(four, given, sheet(net)).displacement.applied(four)
    assert max(each.gap for each in seams(found)) <= 1e-9
    assert max(np.degrees(each.angle) for each in seams(found) if len(set(each.faces)) == 2) <= 1e-5
    across = []
    for edge in found.edges:
        if len(edge.sides) == 2:
            surfaces = [(each.surfaces[s.face].net, s.uv) for each in (four, found) for s in edge.sides[:1]]
            before, after = (np.asarray(net.evaluate(uv))[:, 2] for net, uv in surfaces)
            across.append(after - before)
    both = zip(four.surfaces, found.surfaces, strict=True)
    inner = [(np.asarray(b.net.grid(*_grid(b.net))) - a.net.grid(*_grid(a.net)))[..., 2].ravel() for a, b in both]
    assert np.concatenate(across).std() > 0.6 * np.concatenate(inner).std() > 0.01


def _grid(net):
    return [each.domain[0] + np.linspace(0.2, 0.8, 40) * each.period for each in (net.u, net.v)]


def test_what_cannot_be_grown(source):
    with pytest.raises(UsageError, match="grow: it needs pairs of faces"):
        options(from_=None, to=None, map=("place",))
    with pytest.raises(UsageError, match="seed: it needs --grow"):
        options(grow=False, seed=3)
    own = Character.of(Patch.of(sheet(source), 0, {0}), [(0.0, LONGEST, 1.0)])
    with pytest.raises(EditError, match=r"grow: .* samples are too many"):
        grown(own, LONGEST, np.zeros(2), np.full(2, 1e5), 0)
