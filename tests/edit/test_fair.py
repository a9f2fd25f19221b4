"""Fairing through the solver, the judge and the loop: what it removes, what it keeps, what it leaves alone."""

from types import SimpleNamespace

import numpy as np
import pytest

from mracad.bspline.fit import interpolated
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.edit.driver import groups
from mracad.edit.fair import Filter, faired
from mracad.edit.pose import Scene
from mracad.edit.target import sheets
from mracad.edit.tolerances import Tolerances
from mracad.edit.trial import Trial
from mracad.inspect.roughness import Growth, worse
from mracad.inspect.seams import seams
from mracad.inspect.survey import surveys
from mracad.occ.view import view
from mracad.seam.interface import joints
from mracad.seam.wishes import Wishes
from tests.edit import halves, panels
from tests.edit.models import fitted, rotation, sheet
from tests.inspect.ramps import changes
from tests.model.shapes import cylinder

ALLOWED = Growth(0.02, 0.02, 0.02, 0.1, 60.0)
"""What counts as rougher; normals of noise turn back by up to 45°."""


def smoothed(net, scale, **tolerances):
    """A sheet with its four edges held, faired; the result, and what became of its surface."""
    model = sheet(net)
    result = faired(model, {0}, Filter(scale), Wishes(), Tolerances(1e-3, **tolerances))
    after = result.displacement().applied(model).surfaces[0].net
    return result, after


def no_rougher(model, after):
    """Whether all surfaces are no rougher than they were, at nine points a span."""
    both = list(zip(model.surfaces, after.surfaces, strict=True))
    watched = surveys(
        [(old.net.over(new.net.u, new.net.v), [model.faces[i] for i in old.faces]) for old, new in both], points=9
    )
    return not any(worse(change, ALLOWED) for change in changes(watched, [new.net for _, new in both]))


@pytest.fixture(scope="module")
def noisy_panel():
    """Clean and noisy nets of the unsplit panel, its patches, their model, and the error of the unsplit one, faired."""
    clean, noisy = panels.whole(32, 0.3)
    patches = panels.cut(noisy, (2, 3))
    _, after = smoothed(noisy, 25.0)
    return clean, patches, view(panels.document(patches)), error(panels.cut(after, (2, 3)), patches, clean)


def error(found, patches, clean):
    return panels.rms({key: patch.net for key, patch in found.items()}, patches, clean)


@pytest.mark.parametrize(("keep", "most"), [("g1", 1.10), ("as-is", 1.05)])
def test_patches_come_close_to_the_unsplit_surface_and_stay_joined(noisy_panel, keep, most):
    clean, patches, model, unsplit = noisy_panel
    result = faired(model, set(range(6)), Filter(25.0), Wishes(keep), Tolerances(1e-3))
    after = result.displacement().applied(model)
    order = sorted(patches)
    rms = panels.rms({key: after.surfaces[i].net for i, key in enumerate(order)}, patches, clean)
    before = error(patches, patches, clean)
    print(f"{keep}: {before:.4f} before, {unsplit:.4f} unsplit, {rms / unsplit:.3f} of it in patches")
    assert len(result.joints.exact) == 7 and rms <= most * unsplit and rms < 0.6 * before
    measured = seams(after)
    assert len(measured) == 7
    assert max(seam.gap for seam in measured) <= 1e-9
    assert max(seam.angle for seam in measured) <= 1e-5
    if keep == "as-is":
        assert max(seam.bend for seam in measured) <= 1e-9
    assert no_rougher(model, after)


def mixed(noise=0.3):
    """A panel of patches that differ in degree, in knots and in sense."""
    clean, noisy = panels.whole(10, noise, patches=(2, 2))
    patches = panels.cut(noisy, (2, 2))
    patches[0, 1] = panels.turned(panels.refined(patches[0, 1], [13.0, 41.0], [111.0, 172.5]), "vx")
    quintic = panels.elevated(panels.elevated(patches[1, 0].net, 0, 2), 1, 2)
    patches[1, 0] = panels.replace(patches[1, 0], net=quintic)
    return clean, patches


def test_patches_of_other_degrees_knots_and_senses():
    clean, patches = mixed()
    model = view(panels.document(patches))
    result = faired(model, set(range(4)), Filter(35.0), Wishes("g1"), Tolerances(1e-3))
    after = result.displacement().applied(model)
    rms = panels.rms({key: after.surfaces[i].net for i, key in enumerate(sorted(patches))}, patches, clean)
    assert len(result.joints.exact) == 4 and rms < 0.9 * error(patches, patches, clean)
    measured = seams(after)
    assert max(seam.gap for seam in measured) <= 1e-9 and max(seam.angle for seam in measured) <= 1e-5
    assert no_rougher(model, after)


def rough(noise=0.1, spans=(44, 36), where=1.0, seed=0):
    """Clean and noisy nets of a sheet with uneven knots, about one millimetre apart."""
    rng = np.random.default_rng(seed)
    u, v = (KnotVector.clamped(np.r_[0, np.cumsum(rng.uniform(0.5, 1.5, n))], 3) for n in spans)
    x, y = np.meshgrid(u.greville(), v.greville(), indexing="ij")
    poles = np.stack([x, y, 2 * np.sin(x / 9) * np.cos(y / 7)], axis=-1)
    added = noise * rng.standard_normal(poles.shape) * np.asarray(where)[..., None]
    return Net(u, v, poles), Net(u, v, poles + added)


def distance(net, clean, count=100):
    """How far a net is off a clean one, mm, ``(count, count)``."""
    at = [np.linspace(*knots.domain, count) for knots in (clean.u, clean.v)]
    return np.linalg.norm(net.grid(*at) - clean.grid(*at), axis=-1)


def rms(values):
    return float(np.sqrt((values**2).mean()))


def test_noise_goes_and_the_rim_stays():
    clean, noisy = rough()
    result, after = smoothed(noisy, 6.0)
    assert result.moved[0].amount == 1.0 and rms(distance(after, clean)) <= 0.75 * rms(distance(noisy, clean))
    rim = np.ones(noisy.poles.shape[:2], bool)
    rim[1:-1, 1:-1] = False
    grid = [np.linspace(*knots.domain, 200) for knots in (noisy.u, noisy.v)]
    moved = np.linalg.norm(after.grid(*grid) - noisy.grid(*grid), axis=-1)
    assert max(moved[[0, -1]].max(), moved[:, [0, -1]].max()) < 1e-12
    assert no_rougher(sheet(noisy), sheet(after))


def test_a_bound_on_the_deviation_holds():
    _, noisy = rough(0.05)
    result, after = smoothed(noisy, 6.0, deviation=0.02)
    moved = result.moved[0]
    assert 0.01 < moved.deviation <= 0.02 * (1 + 1e-9) and moved.amount > 0.75
    free, _ = smoothed(noisy, 6.0)
    assert free.moved[0].deviation > 0.04
    assert no_rougher(sheet(noisy), sheet(after))


def test_a_clean_rim_beside_noise_does_not_ring():
    """Noise two wavelengths from the rim: beside the rim the surface stays where it is."""
    middle = np.zeros((43, 43))
    middle[12:-12, 12:-12] = 1.0
    clean, noisy = rough(spans=(40, 40), where=middle)
    _, after = smoothed(noisy, 5.0)
    before, left = distance(noisy, clean), distance(after, clean)
    assert rms(left) < 0.75 * rms(before)
    x = np.asarray(clean.grid(*(np.linspace(*knots.domain, 100) for knots in (clean.u, clean.v))))[..., :2]
    aside = (x - x[0, 0]).min(axis=-1) < 4.0
    print(f"beside the rim {left[aside].max():.2e} of {before.max():.2e} mm")
    assert left[aside].max() < 0.02 * before.max()


def quarter(radius=5.0, length=30.0):
    """A quarter of a cylinder, exactly, with eight spans each way."""
    u, v = KnotVector.clamped([0, 1], 2), KnotVector.clamped([0, 1], 1)
    poles = radius * np.array([[[1, 0, 0], [1, 0, 1]], [[1, 1, 0], [1, 1, 1]], [[0, 1, 0], [0, 1, 1]]], float)
    poles[..., 2] *= length / radius
    inner = np.arange(1, 8) / 8
    return Net(u, v, poles, np.array([1, np.sqrt(0.5), 1])[:, None] * np.ones(2)).refined(inner, inner)


def fillet(radius=5.0, length=30.0, spans=8):
    """A quarter of a cylinder as a polynomial surface."""
    u, v = KnotVector.clamped(np.linspace(0, 1, spans + 1), 3), KnotVector.clamped(np.linspace(0, 1, 5), 3)
    angle = np.pi / 2 * u.greville()
    around = panels.interpolated(u, u.greville(), radius * np.stack([np.cos(angle), np.sin(angle)], axis=1))
    poles = np.empty((u.count, v.count, 3))
    poles[..., :2], poles[..., 2] = around[:, None], length * v.greville()
    return Net(u, v, poles)


@pytest.mark.parametrize(
    "net", [cylinder(10.0, 40.0, spans=8), quarter(), fillet()], ids=["cylinder", "quarter", "fillet"]
)
@pytest.mark.parametrize("scale", [3.0, 12.0, 40.0])
def test_clean_faces_are_left_as_they_are(net, scale):
    result, _ = smoothed(net, scale)
    assert max((each.motion for each in result.moved.values()), default=0.0) < 5e-5 * scale


def test_rotation_translation_and_scaling_commute():
    _, net = rough(spans=(24, 18))
    _, plain = smoothed(net, 5.0)
    turn, shift = rotation([1, 2, -0.5], 0.7), np.array([1e3, -400.0, 250.0])
    _, turned = smoothed(Net(net.u, net.v, net.poles @ turn.T + shift), 5.0)
    size = np.ptp(net.poles)
    assert np.abs(plain.poles).max() > 1.0 and plain.poles.shape == turned.poles.shape
    assert np.abs(turned.poles - plain.poles @ turn.T - shift).max() < 1e-9 * size
    _, large = smoothed(Net(net.u, net.v, 25.4 * net.poles), 5.0 * 25.4)
    assert np.abs(large.poles / 25.4 - plain.poles).max() < 1e-8 * size


def test_flat_spans_are_raised_to_cubic_ones():
    _, noisy = rough(spans=(24, 18))
    net = Net(*(KnotVector.clamped(np.linspace(*k.domain, k.count - 1), 2) for k in (noisy.u, noisy.v)), noisy.poles)
    result, after = smoothed(net, 6.0)
    assert (after.u.degree, after.v.degree) == (3, 3) and result.moved[0].amount > 0
    assert no_rougher(sheet(net), sheet(after))


def test_points_are_added_only_where_that_is_allowed():
    u, v = KnotVector.clamped(np.linspace(0, 40, 7), 3), KnotVector.clamped(np.linspace(0, 30, 7), 3)
    x, y = np.meshgrid(u.greville(), v.greville(), indexing="ij")
    inner = np.pad(np.random.default_rng(0).standard_normal((5, 5)), 2)
    model = sheet(Net(u, v, np.stack([x, y, inner], axis=-1)))
    few, more = (
        faired(model, {0}, Filter(10.0), Wishes(), Tolerances(1e-3), refine=refine) for refine in (False, True)
    )
    assert few.moved[0].net.poles.shape[:2] == (9, 9)
    assert min(more.moved[0].net.poles.shape[:2]) > 9
    shares = [result.moved[0].gain / result.moved[0].wanted for result in (few, more)]
    assert shares[1] > shares[0]


@pytest.mark.parametrize(("scale", "keep"), [(30.0, "g1"), (45.0, "g2")])
def test_halves_that_meet_along_a_trim_curve_come_close_to_the_unsplit_surface(scale, keep):
    clean, left, right = halves.surfaces(0.2, (30, 60))
    model = view(halves.document(left, right))
    _, unsplit = smoothed(left, scale)
    result = faired(model, {0, 1}, Filter(scale), Wishes(keep), Tolerances(1e-3))
    after = result.displacement().applied(model)
    assert len(result.joints.loose) == 1
    (old,), (new,) = ([seam for seam in seams(each) if len(seam.faces) == 2] for each in (model, after))
    assert new.gap <= old.gap + 1e-3 and new.angle <= old.angle + 0.01
    if keep == "g2":
        assert new.bend <= old.bend + 1e-3 / scale
    assert no_rougher(model, after)
    whole = beside([unsplit] * 2, clean, (0.0, 0.0))
    rms = beside([surface.net for surface in after.surfaces], clean)
    print(f"{keep} at {scale}: {rms / whole:.3f} of the unsplit surface's error")
    assert rms <= 1.05 * whole


@pytest.mark.parametrize(("spans", "smooth"), [((15, 30), False), ((30, 60), True)])
def test_what_is_wanted_of_halves_knows_where_they_meet_smoothly(spans, smooth):
    """At a crease (the coarse half cannot follow the noise) each side is wanted as if it were alone."""
    _, left, right = halves.surfaces(0.2, spans)
    model = view(halves.document(left, right))
    wish = Filter(30.0)
    every, joined = sheets(model, {0, 1}, wish), joints(model, {0, 1}, Wishes())
    scene, found = Scene(model, every, joined, Tolerances(1e-3), refine=False), []
    for group in ({0, 1}, {0}, {1}):
        members = {i: every[i] for i in group}
        trial = Trial(scene, members, joined.among(group))
        found.append(wish.target(trial.problem, members, joined.among(group)))
    assert [seam.order > 0 for seam in joined.loose] == [smooth]
    off = np.abs(found[0] - np.concatenate(found[1:])).max()
    assert off > 0.01 if smooth else off < 1e-9


def test_what_suits_one_surface_and_another_is_put_together():
    """No way suits both halves: each by itself comes nearer to what is wanted than both do by any one."""
    _, left, right = halves.surfaces(0.2, (30, 60))
    model = view(halves.document(left, right))
    result = faired(model, {0, 1}, Filter(30.0), Wishes("g1"), Tolerances(1e-3))
    assert len(result.joints.loose) == 1 and all(moved.amount == 1.0 for moved in result.moved.values())
    assert no_rougher(model, result.displacement().applied(model))


def beside(nets, clean, shears=(0.0, halves.SHEAR)):
    """Root mean square of height over the truth within 25 mm of the seam of two halves."""
    found = []
    for net, shear, sign in zip(nets, shears, (-1, 1), strict=True):
        y, off = np.meshgrid(np.linspace(15, 185, 80), np.linspace(0.5, 25, 20))
        x = halves.waist(y) + sign * off
        points = net.evaluate(np.stack([(x - shear * y).ravel(), y.ravel()], axis=1))
        found.append(points[:, 2] - clean.evaluate(points[:, :2])[:, 2])
    return rms(np.concatenate(found))


def test_groups_are_what_seams_join():
    pairs = [(0, 4), (4, 2), (5, 6), (6, 9)]
    assert groups(range(8), SimpleNamespace(pairs=lambda: pairs)) == [[0, 2, 4], [1], [3], [5, 6], [7]]


SCALE, WAVE = 10.0, 0.05


def parameterisations(height):
    """One height field over 100 mm × 24 mm on five parameterisations; degrees, knots and speed differ."""
    rng = np.random.default_rng(5)
    uneven = np.r_[0, np.cumsum(rng.uniform(0.5, 1.5, 100))]
    uneven /= uneven[-1]
    dense = np.unique(np.r_[np.linspace(0, 0.5, 46), np.linspace(0.5, 1, 81)])
    even, few = KnotVector.clamped(np.linspace(0, 1, 101), 3), KnotVector.clamped(np.linspace(0, 1, 11), 3)
    narrow = {"v_of": lambda t: 24 * t}
    yield fitted(even, few, height, **narrow)
    yield fitted(KnotVector.clamped(uneven, 3), few, height, **narrow)
    yield fitted(KnotVector.clamped(np.linspace(0, 1, 81), 5), few, height, **narrow)
    yield fitted(KnotVector.clamped(dense, 3), KnotVector.clamped(np.linspace(0, 1, 13), 2), height, **narrow)
    speed = lambda t: 100 * (0.6 * t + 0.4 * t**2)  # noqa: E731
    yield fitted(KnotVector.clamped(np.linspace(0, 1, 131), 3), few, height, u_of=speed, **narrow)


def kept(net, wave):
    """Share of a ripple's amplitude left in the middle of the sheet, fitted to the ripple and its quadrature."""
    _, after = smoothed(net, SCALE)
    points = after.grid(np.linspace(0.25, 0.75, 160), np.linspace(0.45, 0.55, 5)).reshape(-1, 3)
    k = 2 * np.pi / wave
    waves = np.stack([np.sin(k * points[:, 0]), np.cos(k * points[:, 0]), np.ones(len(points))], axis=1)
    return float(np.hypot(*np.linalg.lstsq(waves, points[:, 2], rcond=None)[0][:2]) / WAVE)


@pytest.mark.parametrize(("wave", "low", "high"), [(5.0, 0.0, 0.1), (30.0, 0.95, 1.01)])
def test_scale_is_a_wavelength_on_every_parameterisation(wave, low, high):
    shares = [kept(net, wave) for net in parameterisations(lambda x, y: WAVE * np.sin(2 * np.pi * x / wave))]
    print(f"ripple of {wave} mm at scale {SCALE} mm: kept", np.round(shares, 4))
    assert low <= min(shares) and max(shares) <= high


def noisy_sheet(degree, spans, repeated, seed=1, noise=0.05):
    """Heights 8 sin(x / 30) cos(y / 25) over 120 mm × 80 mm, clean and with noise on the control points."""
    u, v = (
        KnotVector.from_multiplicities(
            np.linspace(0, 1, n + 1), np.array([degree + 1, *[repeated] * (n - 1), degree + 1]), degree
        )
        for n in spans
    )
    clean = fitted(
        u, v, lambda x, y: 8 * np.sin(x / 30) * np.cos(y / 25), u_of=lambda t: 120 * t, v_of=lambda t: 80 * t
    )
    poles = clean.poles.copy()
    poles[..., 2] += noise * np.random.default_rng(seed).standard_normal(poles.shape[:2])
    return clean, Net(u, v, poles)


@pytest.mark.parametrize(
    ("degree", "spans", "repeated"), [(3, (24, 16), 1), (5, (12, 8), 3), (8, (24, 16), 1)], ids=["3", "5, C2", "8"]
)
def test_noise_grows_neither_inside_nor_beside_the_rim_whatever_the_degree(degree, spans, repeated):
    clean, noisy = noisy_sheet(degree, spans, repeated)
    result, after = smoothed(noisy, 12.0)
    x, y = np.meshgrid(np.linspace(0, 120, 100), np.linspace(0, 80, 100), indexing="ij")
    band = np.minimum(np.minimum(x, 120 - x), np.minimum(y, 80 - y)) < 8
    figures = []
    for net in (noisy, after):
        off = distance(net, clean)
        figures.append([rms(off), off.max(), rms(off[band]), rms(off[~band])])
    print("rms, largest, beside the rim, inside:", *(np.round(each, 4) for each in figures))
    assert result.moved[0].amount > 0
    assert all(new <= old for old, new in zip(*figures, strict=True))
    assert no_rougher(sheet(noisy), sheet(after))


def rippled(degree, spans, repeated, seed=1, noise=0.05):
    """The same sheet, clean and with noise on the points that it goes through: its rims turn as sharply as the rest."""
    clean, _ = noisy_sheet(degree, spans, repeated)
    added = noise * np.random.default_rng(seed).standard_normal(clean.poles.shape[:2])
    poles = clean.poles.copy()
    poles[..., 2] += interpolated(clean.u, clean.v, added[..., None])[..., 0]
    return clean, Net(clean.u, clean.v, poles)


@pytest.mark.parametrize("degree", [3, 5, 7, 9])
def test_beside_noisy_rims_most_of_what_can_go_goes(degree):
    """Without rims, the filter leaves all that is longer than the scale."""
    clean, noisy = rippled(degree, (24, 16), 1)
    result, after = smoothed(noisy, 12.0)
    x, y = np.meshgrid(np.linspace(0, 120, 100), np.linspace(0, 80, 100), indexing="ij")
    band = np.minimum(np.minimum(x, 120 - x), np.minimum(y, 80 - y)) < 8
    old, new = (rms(distance(net, clean)[band]) for net in (noisy, after))
    print(f"beside the rim {old:.4f} -> {new:.4f} mm, amount {result.moved[0].amount}")
    assert new <= 0.75 * old
    corners = np.array([[u, v] for u in clean.u.domain for v in clean.v.domain])
    old, new = (np.stack(net.evaluate(corners, 2)) for net in (noisy, after))
    assert np.abs(new - old).max() < 1e-9 * np.abs(old).max()


def strut(noise, spans=(45, 40), length=4000.0, chord=400.0, thickness=80.0):
    """A straight strut: an elliptic nose, the sides drawn in towards the trailing edge."""
    u, v = (KnotVector.clamped(np.linspace(0, 1, n + 1), 3) for n in spans)
    side = 2 * u.greville() - 1
    nose, back = np.minimum(np.abs(side) / 0.4, 1) * np.pi / 2, np.maximum(np.abs(side) - 0.4, 0) / 0.6
    x = chord * (0.25 * (1 - np.cos(nose)) + 0.75 * back)
    y = np.sign(side) * thickness / 2 * (np.sin(nose) - 0.9 * back**2)
    poles = np.empty((u.count, v.count, 3))
    poles[..., :2] = panels.interpolated(u, u.greville(), np.stack([x, y], axis=1))[:, None]
    poles[..., 2] = length * v.greville()
    return Net(u, v, poles + noise * np.random.default_rng(0).standard_normal(poles.shape))


def turning(net):
    """Largest angle between normals 100 mm apart along a strut, degrees."""
    us, vs = np.linspace(0.01, 0.99, 197), np.linspace(0, 1, 401)
    normals = np.cross(net.tangents(us, vs, 0), net.tangents(us, vs, 1))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    chords = np.linalg.norm(normals[:, 10:] - normals[:, :-10], axis=-1)
    return float(np.degrees(2 * np.arcsin(chords.max() / 2)))


@pytest.mark.parametrize("noise", [0.0, 0.5])
def test_a_strut_between_held_ends_stays_straight(noise):
    """Its nose is finer than the scale: what is taken of it fades towards the ends."""
    net = strut(noise)
    result, after = smoothed(net, 300.0)
    before, now = turning(net), turning(after)
    print(f"{result.moved[0].amount:.2f} of it; turns by {now:.2f}° per 100 mm, before {before:.2f}°")
    assert now <= (1.01 * before if noise else 5.0)
    assert no_rougher(sheet(net), sheet(after))
