"""Details and composing: the input comes back; details turn with a surface; files that anybody can read."""

import json
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import BSpline

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net, pairs
from mracad.edit.compose import compose
from mracad.edit.details import Details
from mracad.edit.level import level
from mracad.edit.mra import load, save
from mracad.errors import EditError, UsageError
from mracad.inspect.seams import seams
from mracad.job.document import run
from mracad.model.brep import Model
from mracad.occ.geometry import spline
from mracad.occ.view import view
from mracad.spec.steps import Compose, Level
from tests.edit import panels
from tests.edit.models import sheet
from tests.edit.test_fair import rough
from tests.edit.test_level import nets
from tests.occ import shapes


def points(net, count=40):
    return net.grid(*(np.linspace(*k.domain, count) for k in (net.u, net.v)))


def apart(model, edit):
    """The coarse model, and the file of its details."""
    return edit.displacement.applied(model), save(Details.of(model, edit.displacement, "level 2"))


def coarse(model, path, **options):
    """A model at a level, whose details are saved."""
    edit = level(model, Level(**options or {"level": 2.0}))
    assert edit.faces("edited")
    found, data = apart(model, edit)
    path.write_bytes(data)
    return found


def put(model, path, **options):
    """A model with details put on it."""
    return compose(model, Compose(details=str(path), **options)).displacement.applied(model)


def off(one, two):
    """The largest distance of the surfaces of models, as a share of the size of each."""
    both = zip(one.surfaces, two.surfaces, strict=True)
    return max(np.abs(points(a.net) - points(b.net)).max() / np.ptp(a.net.poles, axis=(0, 1)).max() for a, b in both)


@pytest.mark.parametrize("name", nets())
@pytest.mark.parametrize("options", [{"level": 1.5}, {"scale": "25mm"}, {"level": 2.0, "amount": 0.4}])
def test_the_input_comes_back(name, options, tmp_path):
    model, path = sheet(nets()[name]), tmp_path / "a.mra"
    found = coarse(model, path, **options)
    assert off(model, found) > 1e-5
    back = put(found, path)
    assert off(model, back) <= 1e-14
    for one, two in zip(model.surfaces, back.surfaces, strict=True):
        assert one.net.over(two.net.u, two.net.v).poles.shape == two.net.poles.shape


def test_patches_come_back_with_their_seams(tmp_path):
    _, noisy = panels.whole(8, 0.2)
    model, path = view(panels.document(panels.cut(noisy, (2, 3)))), tmp_path / "a.mra"
    found = coarse(model, path)
    assert off(model, put(found, path)) <= 1e-14
    measured = seams(found)
    assert max(each.gap for each in measured) <= 1e-9 and max(each.angle for each in measured) <= 1e-5


def test_a_part_of_the_details_is_a_level_between(tmp_path):
    """Half of them is half-way, and none of them is the coarse model."""
    model, path = sheet(rough(spans=(24, 18))[1]), tmp_path / "a.mra"
    found = coarse(model, path)
    half = put(found, path, amount=0.5)
    middle = (points(model.surfaces[0].net) + points(found.surfaces[0].net)) / 2
    np.testing.assert_allclose(points(half.surfaces[0].net), middle, atol=1e-12)
    assert off(found, put(found, path, amount=0.0)) == 0.0


def spun(axis, angle):
    """A rotation about an axis."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


@pytest.mark.parametrize("name", ["cubic", "rational"])
def test_a_rigid_motion_carries_details_exactly(name, tmp_path):
    net, path = nets()[name], tmp_path / "a.mra"
    found, turn, shift = coarse(sheet(net), path), spun((1, 2, 3), 0.9), np.array([30.0, -5.0, 8.0])
    own = found.surfaces[0].net
    edit = compose(there := sheet(own.with_poles(own.poles @ turn.T + shift)), Compose(details=str(path)))
    back = edit.displacement.applied(there).surfaces[0].net
    np.testing.assert_allclose(points(back), points(net) @ turn.T + shift, atol=1e-10)
    assert edit.notes == ("details of 1 surface: 1 carried by a surface that has changed",)


def flat(spans=40, size=100.0):
    knots = KnotVector.clamped(np.linspace(0.0, size, spans + 1), 3)
    x, y = np.meshgrid(knots.greville(), knots.greville(), indexing="ij")
    return Net(knots, knots, np.stack([x, y, 0.0 * x], axis=-1))


def ripple(net, height=0.2):
    x, y = net.poles[..., 0], net.poles[..., 1]
    wave = height * np.sin(2 * np.pi * x / 8) * np.sin(np.pi * x / 100) ** 4 * np.sin(np.pi * y / 100) ** 4
    return net.with_poles(net.poles + wave[..., None] * np.array([0.0, 0.0, 1.0]))


def rolled(net, radius):
    """A plane rolled up about a cylinder, within the space of its splines."""
    from mracad.bspline.fit import through

    plane = net.grid(net.u.greville(), net.v.greville())
    angle = plane[..., 0] / radius
    bent = np.stack([(radius) * np.sin(angle), plane[..., 1], radius * (1 - np.cos(angle))], axis=-1)
    return net.with_poles(through(net, bent))


def test_details_turn_with_a_surface_that_is_bent(tmp_path):
    """A ripple on a plane stands along the normals of the cylinder into which the plane is rolled, as high as it was;
    added without turning, it would lean by up to the angle of the roll."""
    path, radius = tmp_path / "a.mra", 60.0
    found = coarse(sheet(ripple(flat())), path, scale="16mm")
    own = found.surfaces[0].net
    assert np.abs(own.poles[..., 2]).max() < 0.01
    bent = rolled(own, radius)
    back = put(sheet(bent), path).surfaces[0].net
    uv = pairs(*[np.linspace(5.0, 95.0, 60)] * 2)
    moved, normal = back.evaluate(uv) - bent.evaluate(uv), bent.normals(uv)
    height = (moved * normal).sum(axis=1)
    wanted = (load(path).surfaces[0].motion.evaluate(uv))[:, 2]
    assert np.abs(height - wanted).max() <= 0.01 * np.abs(wanted).max()
    assert np.linalg.norm(moved - height[:, None] * normal, axis=1).max() <= 0.01 * np.abs(wanted).max()


def test_seams_of_a_bent_model_stay_closed_under_their_details(tmp_path):
    _, noisy = panels.whole(8, 0.2)
    patches = panels.cut(noisy, (2, 2))
    model, path = view(panels.document(patches)), tmp_path / "a.mra"
    found = coarse(model, path)

    def sheared(net):
        x, y, z = np.moveaxis(net.poles, -1, 0)
        return net.with_poles(np.stack([x + 0.2 * y, y - 0.3 * z, z + 0.4 * x], axis=-1))

    nets = [surface.net for surface in found.surfaces]
    moved = {k: replace(patch, net=sheared(net)) for (k, patch), net in zip(sorted(patches.items()), nets, strict=True)}
    there = view(panels.document(moved))
    back = put(there, path)
    assert off(there, back) > 1e-4
    measured = seams(back)
    assert max(each.gap for each in measured) <= 1e-9 and max(each.angle for each in measured) <= 1e-5


def test_details_come_over_other_knots(tmp_path):
    """Knots that the coarse surface lacks are inserted; with --refine never they are projected, and it is said so."""
    net, path = rough(spans=(24, 18))[1], tmp_path / "a.mra"
    found = coarse(sheet(net), path)
    lean = Net(*(KnotVector.clamped(k.breaks[::3], 3) for k in (net.u, net.v)), np.zeros((11, 9, 3)))
    x, y = np.meshgrid(lean.u.greville(), lean.v.greville(), indexing="ij")
    lean = sheet(lean.with_poles(np.stack([100 * x, 100 * y, 0 * x], axis=-1)))
    edits = [compose(lean, Compose(details=str(path), refine=refine)) for refine in ("auto", "never")]
    assert [each.notes[0].partition(": 1 ")[2] for each in edits] == [
        "carried by a surface that has changed",
        "projected on other knots",
    ]
    wanted = load(path).surfaces[0].motion
    full, own = (each.displacement.applied(lean).surfaces[0].net for each in edits)
    assert (own.u.count, own.v.count) == (11, 9) and full.u.spans == 24
    turned = np.abs(points(full) - points(lean.surfaces[0].net) - points(wanted)).max()
    assert turned < 0.5 * np.abs(points(wanted)).max() and found is not None


def test_a_domain_that_was_scaled_is_the_same(tmp_path):
    net, path = rough(spans=(24, 18))[1], tmp_path / "a.mra"
    own = coarse(sheet(net), path).surfaces[0].net
    u, v = (KnotVector(3.0 * k.knots + 7.0, 3) for k in (own.u, own.v))
    back = put(sheet(Net(u, v, own.poles)), path).surfaces[0].net
    np.testing.assert_allclose(points(back), points(net), atol=1e-11)


def test_faces_that_were_numbered_anew_are_found(tmp_path):
    """By where they are; though the whole has moved a little, too."""
    _, noisy = panels.whole(8, 0.2)
    model, path = view(panels.document(panels.cut(noisy, (2, 2)))), tmp_path / "a.mra"
    found, details = coarse(model, path), load(path)
    numbers = [each.faces for each in details.surfaces]
    renamed = [replace(each, faces=faces) for each, faces in zip(details.surfaces, reversed(numbers), strict=True)]
    path.write_bytes(save(replace(details, surfaces=tuple(renamed))))
    shift = np.array([0.5, 0.25, 1.0])
    there = found.with_surfaces([replace(s, net=s.net.with_poles(s.net.poles + shift)) for s in found.surfaces])
    back = put(there, path)
    for one, two in zip(model.surfaces, back.surfaces, strict=True):
        np.testing.assert_allclose(points(two.net), points(one.net) + shift, atol=1e-9)


def test_copies_of_a_part_in_one_place_get_the_details_once_each_and_others_none(tmp_path):
    plain = flat()
    nets = ripple(plain), ripple(plain), plain.with_poles(plain.poles + np.array([0.0, 200.0, 0.0]))
    model = view(shapes.document(*(shapes.face_on(spline(net)) for net in nets)))
    found = coarse(model, tmp_path / "a.mra").surfaces
    shape = model.with_surfaces([replace(s, net=s.net.with_poles(np.round(s.net.poles, 13))) for s in found])
    edit = compose(shape, Compose(details=str(tmp_path / "a.mra")))
    assert off(model, edit.displacement.applied(shape)) < 1e-12
    assert edit.notes == ("details of 2 surfaces: 2 added as they were",)


def test_what_is_held_gets_no_details(tmp_path):
    model, path = sheet(rough(spans=(24, 18))[1]), tmp_path / "a.mra"
    found = coarse(model, path)
    edit = compose(found, Compose(details=str(path), hold=("edge#1",)))
    back = edit.displacement.applied(found).surfaces[0].net
    own = found.surfaces[0].net
    assert np.array_equal(back.poles[:, 0], own.over(back.u, back.v).poles[:, 0])
    assert np.abs(back.poles[:, -1] - own.over(back.u, back.v).poles[:, -1]).max() > 0.01


def test_a_model_that_the_details_are_not_of_is_refused(tmp_path):
    path = tmp_path / "a.mra"
    coarse(sheet(rough(spans=(24, 18))[1]), path)
    empty = Model("empty.step", (), (), (), 100.0)
    with pytest.raises(EditError, match=r"empty\.step: no face fits the details"):
        compose(empty, Compose(details=str(path)))


@pytest.mark.parametrize("options", [{}, {"level": 2.0, "scale": "5mm"}, {"level": 0.0}])
def test_a_level_needs_one_place(options):
    with pytest.raises((UsageError, ValueError)):
        Level(**options)


def test_anybody_can_read_the_file(tmp_path):
    """As docs/mra.md says, with numpy and scipy alone: the sum of all levels on the coarse surface is the input."""
    net, path = rough(spans=(24, 18))[1], tmp_path / "a.mra"
    coarse(sheet(net), path)
    file = np.load(path)
    header = json.loads(file["header.json"])
    told = header["surfaces"][0]
    at = np.linspace(0.0, 1.0, 30)[1:-1]

    def on(number, points):
        first = BSpline(file[f"0/u{number}"], points, told["degrees"][0])(at)
        return BSpline(file[f"0/v{number}"], first.swapaxes(0, 1), told["degrees"][1])(at).swapaxes(0, 1)

    bands = [on(number, file[f"0/d{number}"]) for number in range(told["levels"])]
    np.testing.assert_allclose(on(0, file["0/points"]) + sum(bands), net.grid(at, at), atol=1e-11)
    assert header["format"] == "mracad details 1" and header["unit"] == "mm" and told["faces"] == [1]
    assert told["levels"] >= 4 and np.abs(bands[0]).max() > 0.01


def test_levels_of_details_are_orthogonal(tmp_path):
    """Over the parameters: their energies add up to that of the whole."""
    net = rough(spans=(24, 18))[1]
    from mracad.bspline.gram import gram
    from mracad.edit.details import Detail

    random = np.random.default_rng(4).standard_normal(net.poles.shape)
    detail = Detail.of(net, random)
    both = [gram(k).tocsr().toarray() for k in (net.u, net.v)]
    every = [each.over(net.u, net.v).poles for each in detail.levels]
    table = np.array([[np.einsum("ia,jb,ijk,abk->", *both, p, q) for p in every] for q in every])
    np.testing.assert_allclose(table, np.diag(np.diag(table)), atol=1e-12 * table.max())
    whole = np.einsum("ia,jb,ijk,abk->", *both, random, random)
    assert np.trace(table) == pytest.approx(whole, rel=1e-12)


def test_the_same_details_give_the_same_bytes(tmp_path):
    model = sheet(rough(spans=(24, 18))[1])
    assert coarse(model, tmp_path / "a.mra") and coarse(model, tmp_path / "b.mra")
    assert (tmp_path / "a.mra").read_bytes() == (tmp_path / "b.mra").read_bytes()
    assert zipfile.ZipFile(tmp_path / "a.mra").testzip() is None


def test_documents_take_it_in_place(tmp_path):
    """Edges and vertices follow; the input comes back as a document, too."""
    _, noisy = panels.whole(8, 0.2)
    document, path = panels.document(panels.cut(noisy, (2, 2))), tmp_path / "a.mra"
    before = view(document)
    report = run(document, level, Level(level=1.0))
    path.write_bytes(save(Details.of(report.model, report.edit.displacement)))
    report = run(document, compose, Compose(details=str(path)))
    assert report.valid_after.valid and report.valid_after.edge_tolerance <= 1.001e-7
    assert off(before, view(document)) <= 1e-14
