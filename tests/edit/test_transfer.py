"""Transfers of detail: closed forms of adding, replacing and blending; several faces, files, what is refused."""

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.edit.compose import compose
from mracad.edit.details import Details
from mracad.edit.level import level
from mracad.edit.mra import save
from mracad.edit.result import Reason
from mracad.edit.transfer import transfer
from mracad.edit.whole import _left
from mracad.errors import Code, EditError, FileError, UsageError
from mracad.inspect.deviation import deviations
from mracad.inspect.roughness import Rougher, Worse
from mracad.inspect.seams import seams
from mracad.model.brep import Face, Model
from mracad.occ.view import view
from mracad.spec.steps import Compose, Level, Transfer
from mracad.wavelet.project import at_scale
from tests.edit import panels
from tests.edit.models import sheet

OPEN = {"free_edges": "smooth", "corners": "move"}
"""Nothing is held on a sheet."""


def textured(seed, cuts=(6.0, 12.0), size=40.0):
    """A plane of 1 mm spans, and the detail of each band on it: noise less its projections, along z."""
    k = KnotVector.clamped(np.linspace(0.0, size, int(size) + 1), 3)
    x, y = np.meshgrid(k.greville(), k.greville(), indexing="ij")
    flat = Net(k, k, np.stack([x, y, 0 * x], axis=-1))
    noise = 1e-4 * np.random.default_rng(seed).standard_normal(x.shape)
    levels = [noise, *(at_scale(flat.with_poles(flat.poles + _up(noise)), cut).poles[..., 2] for cut in cuts)]
    return flat, [_up(fine - coarse) for fine, coarse in pairwise(levels)]


def _up(z):
    return np.stack([0 * z, 0 * z, z], axis=-1)


def done(target, source, **options):
    """A sheet with the detail of another."""
    source = sheet(source) if isinstance(source, Net) else source
    if "map" not in options:
        options = {"from_": "#1", "to": "#1", **options}
    edit = transfer(sheet(target), Transfer(source="x.step", **options), source)
    found = edit.displacement.applied(sheet(target)).surfaces[0].net
    return found.poles if (found.u, found.v) == (target.u, target.v) else found


def bands(factors, parts):
    return sum(factor * part for factor, part in zip(factors, parts, strict=True))


@pytest.mark.parametrize(
    ("options", "own", "other"),
    [
        ({"band": ":12mm"}, (1, 1), (1, 1)),
        ({"band": ":6mm"}, (1, 1), (1, 0)),
        ({"band": ":12mm", "mode": "replace"}, (0, 0), (1, 1)),
        ({"band": "6mm:12mm", "mode": "replace", "height": -2.0}, (1, 0), (0, -2)),
        ({"band": ":12mm", "blend": ("0.3",)}, (0.7, 0.7), (0.3, 0.3)),
        ({"band": ":12mm", "blend": ("0",)}, (1, 1), (0, 0)),
        ({"band": ":12mm", "blend": ("1",)}, (0, 0), (1, 1)),
        ({"blend": ("6mm:12mm=0.25", ":6mm=1")}, (0, 0.75), (1, 0.25)),
        ({"band": ":12mm", "mode": "replace", "amount": 0.4}, (0.6, 0.6), (0.4, 0.4)),
        ({"map": ("place",), "band": ":12mm", "blend": ("0.3",)}, (0.7, 0.7), (0.3, 0.3)),
    ],
)
def test_shares_of_detail_on_a_plane(options, own, other):
    (flat, mine), (_, others) = textured(0), textured(1)
    target, source = (flat.with_poles(flat.poles + sum(parts)) for parts in (mine, others))
    found = done(target, source, **options, **OPEN)
    wanted = flat.poles + bands(own, mine) + bands(other, others)
    assert np.abs(found - wanted).max() <= 1e-3 * np.abs(sum(others)).max()


@pytest.mark.parametrize("mode", [{"mode": "replace"}, {"blend": ("0.4",)}])
@pytest.mark.parametrize("where", [{"from_": "#1", "to": "#1"}, {"map": ("place",)}])
def test_the_detail_of_a_model_replaced_by_its_own_is_the_model(mode, where):
    net = panels.whole(12, 0.05, patches=(1, 1))[1]
    options = Transfer(source="x.step", band=":30mm", **where, **mode)
    edit = transfer(sheet(net), options, sheet(net))
    assert not edit.displacement.offsets


def test_points_on_long_spans_are_found():
    """On a disc whose first span is long, all ends of spans nearest to points in it are the pole."""
    u = KnotVector.clamped(np.linspace(0.0, 1.0, 25), 3)
    v = KnotVector.clamped(np.r_[0.0, 20.0 + 0.5 * np.arange(100.0)], 3)
    angle, radius = np.meshgrid(1.9 * np.pi * u.greville(), v.greville(), indexing="ij")
    height = 0.05 * np.random.default_rng(0).standard_normal(angle.shape) * (radius > 1.0)
    net = Net(u, v, np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=-1))
    options = Transfer(source="x.step", map=("place",), band=":8mm", mode="replace")
    edit = transfer(sheet(net), options, sheet(net))
    assert not edit.displacement.offsets


@pytest.fixture(scope="module")
def two():
    """A clean and a noisy panel of two patches, as nets and as models."""
    clean, noisy = panels.whole(10, 0.05, patches=(2, 1))
    models = [view(panels.document(panels.cut(net, (2, 1)))) for net in (clean, noisy)]
    return clean, noisy, *models


def heights(model, before):
    """How far the middles of the faces moved along z, and the same of the seam."""
    us = np.linspace(0.3, 0.7, 20)
    for one, two in zip(model.surfaces, before.surfaces, strict=True):
        at = [k.domain[0] + us * k.period for k in (one.net.u, one.net.v)]
        yield one.net.grid(*at)[..., 2] - two.net.grid(*at)[..., 2]


def smooth(model):
    """Largest gap (mm) and angle (degrees) along the seam."""
    (seam,) = [each for each in seams(model) if len(set(each.faces)) == 2]
    return seam.gap, np.degrees(seam.angle)


def test_several_faces_and_the_seam_between_them(two):
    """Noise goes from one panel to another; the seam stays smooth, and moves."""
    _, _, target, source = two
    options = Transfer(source="x.step", map=("#1=#1,#2=#2",), band=":40mm")
    found = transfer(target, options, source).displacement.applied(target)
    bare = [at_scale(each.net, 40.0) for each in source.surfaces]
    for moved, one, coarse in zip(heights(found, target), source.surfaces, bare, strict=True):
        at = [k.domain[0] + np.linspace(0.3, 0.7, 20) * k.period for k in (one.net.u, one.net.v)]
        wanted = one.net.grid(*at)[..., 2] - coarse.grid(*at)[..., 2]
        assert np.abs(wanted).max() > 0.03
        assert np.abs(moved - wanted).max() <= 0.02 * np.abs(wanted).max()
    gap, angle = smooth(found)
    assert gap <= 1e-9 and angle <= 1e-5
    along = [
        each.net.grid(each.net.u.domain[i - 1 :][:1], np.linspace(20, 80, 30)) for i, each in enumerate(found.surfaces)
    ]
    flat = target.surfaces[0].net.grid(target.surfaces[0].net.u.domain[1:], np.linspace(20, 80, 30))
    assert np.abs(along[0] - flat).max() > 0.02
    options = Transfer(source="x.step", map=("#1=#1,#2=#2",), band=":40mm", edges="frozen")
    held = transfer(target, options, source).displacement.applied(target)
    same = held.surfaces[0].net.grid(held.surfaces[0].net.u.domain[1:], np.linspace(20, 80, 30))
    assert np.abs(same - flat).max() <= 1e-12


def test_other_faces_can_give_and_take(two):
    """Both faces take the detail of one; a face that is not named stays."""
    _, _, target, source = two
    options = Transfer(source="x.step", map=("#1=#1", "#1=#2"), band=":40mm")
    found = transfer(target, options, source).displacement.applied(target)
    one, other = heights(found, target)
    assert np.corrcoef(one.ravel(), other.ravel())[0, 1] > 0.8  # as long from the corner, but not quite in the middle
    assert smooth(found)[0] <= 1e-9 and smooth(found)[1] <= 1e-5
    edit = transfer(target, Transfer(source="x.step", from_="#1", to="#2", band=":40mm"), source)
    assert [each.status for each in edit.outcomes] == ["unchanged", "edited"]
    assert edit.outcomes[0].words == "no details for it"


def test_by_place_the_parameters_of_the_source_do_not_count(two):
    """The same source with u and v swapped, and so with its normals along S_v × S_u."""
    _, noisy, target, _ = two
    one, other = (
        view(panels.document({key: panels.turned(patch, how) for key, patch in panels.cut(noisy, (2, 1)).items()}))
        for how in ("", "x")
    )
    options = Transfer(source="x.step", map=("place",), band=":40mm")
    plain, turned = (transfer(target, options, each).displacement.applied(target) for each in (one, other))
    assert max(np.abs(each).max() for each in heights(plain, target)) > 0.03
    for a, b in zip(heights(plain, target), heights(turned, target), strict=True):
        assert np.abs(a - b).max() <= 1e-6
    lifted = (
        replace(each, net=each.net.with_poles(each.net.poles + np.array([0.0, 0.0, 900.0]))) for each in one.surfaces
    )
    away = replace(one.with_surfaces(tuple(lifted)), name="away")
    with pytest.raises(EditError, match="no face of away with detail in the band is over one of"):
        transfer(target, options, away)


def test_details_of_a_file(tmp_path):
    """All of them put back by a map of faces are the model; a band of them is that of the model."""
    net = panels.whole(16, 0.05, patches=(1, 1))[1]
    model, file = sheet(net), tmp_path / "a.mra"
    edit = level(model, Level(scale="25mm"))
    file.write_bytes(save(Details.of(model, edit.displacement, "")))
    coarse = edit.displacement.applied(model)
    back = transfer(coarse, Transfer(source=str(file), from_="#1", to="#1", **OPEN)).displacement.applied(coarse)
    composed = compose(coarse, Compose(details=str(file))).displacement.applied(coarse)
    places = np.linspace(*net.u.domain, 50)
    for found in (back, composed):
        assert np.abs(found.surfaces[0].net.grid(places, places) - net.grid(places, places)).max() <= 1e-9
    options = {"from_": "#1", "to": "#1", "band": ":15mm"}
    one = transfer(coarse, Transfer(source=str(file), **options))
    two = transfer(coarse, Transfer(source="x.step", **options), model)
    same = (each.displacement.applied(coarse).surfaces[0].net.grid(places, places) for each in (one, two))
    assert np.abs(np.subtract(*same)).max() <= 1e-9
    half = transfer(coarse, Transfer(source=str(file), from_="#1", to="#1", amount=0.5, **OPEN))
    half = half.displacement.applied(coarse).surfaces[0].net.grid(places, places)
    both = [each.surfaces[0].net.grid(places, places) for each in (coarse, back)]
    assert np.abs(half - sum(both) / 2).max() <= 1e-9
    with pytest.raises(UsageError, match="from: '#2': the model has faces #1 to #1"):
        transfer(coarse, Transfer(source=str(file), from_="#2", to="#1"))


def test_what_holds_faces_holds_them_here(two):
    _, _, target, source = two
    words = {"source": "x.step", "map": ("#1=#1,#2=#2",), "band": ":40mm"}
    free = transfer(target, Transfer(**words), source).displacement.applied(target)
    bound = transfer(target, Transfer(**words, max_deviation="0.02mm"), source).displacement
    far = [max(np.abs(each).max() for each in heights(found, target)) for found in (free, bound.applied(target))]
    assert far[0] > 0.05 and 0.01 < far[1] < 0.022
    assert max(each.normal for each in deviations(target, bound)) <= 0.02
    held = transfer(target, Transfer(**words, hold=("near:50,50,0,radius:30",)), source).displacement.applied(target)
    before, after = (np.asarray(each.surfaces[0].net.evaluate([[50.0, 50.0]])) for each in (target, held))
    assert np.abs(before - after).max() <= 1e-12
    with pytest.raises(EditError, match=r"#1 is not among the faces to edit") as caught:
        transfer(target, Transfer(**words, hold=("#1",)), source)
    assert caught.value.code == Code.CANNOT_EDIT


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"band": ":9mm"}, "map: either it or from and to are needed"),
        ({"band": ":9mm", "from_": "#1"}, "from and to belong together"),
        ({"band": ":9mm", "from_": "#1", "to": "#1", "map": ("#1=#1",)}, "either it or from and to"),
        ({"band": ":9mm", "map": ("",)}, "is not a list of pairs of faces"),
        ({"band": ":9mm", "map": ("#1=#2,#3",)}, "is not a list of pairs of faces"),
        ({"band": ":9mm", "map": ("place", "#1=#2")}, "place names no faces"),
        ({"band": ":9mm", "map": ("place",), "rotate": 30.0}, "rotate: detail that goes to the nearest place"),
        ({"map": ("#1=#2",)}, "band: the detail of a face cannot be told without one"),
        ({"map": ("#1=#2",), "blend": ("0.3",)}, "band: the detail of a face cannot be told without one"),
        ({"map": ("#1=#2",), "blend": ("0.3", ":9mm=1")}, "several shares need a band each"),
        ({"map": ("#1=#2",), "blend": (":9mm=1",), "band": ":9mm"}, "bands of its own exclude --band"),
        ({"map": ("#1=#2",), "blend": (":9mm=1", "5mm:12mm=1")}, "one begins at 5mm, before another ends"),
        ({"map": ("#1=#2",), "blend": (":9mm=1.2",)}, "'?1.2'? is not a share between 0 and 1"),
        ({"map": ("#1=#2",), "blend": ("nan",), "band": ":9mm"}, "'?nan'? is not a share"),
        ({"map": ("#1=#2",), "blend": ("0.5",), "band": ":9mm", "mode": "replace"}, "blend and mode cannot"),
        ({"map": ("#1=#2",), "band": ":9mm", "clip": True}, "clip: it is for a feature"),
        ({"from_": "near:1,1,1,radius:2", "to": "1,2,3", "amount": 0.5}, "amount: it is for the detail of faces"),
    ],
)
def test_options_that_do_not_go_together(options, said):
    with pytest.raises(UsageError, match=said):
        Transfer(source="x.step", **options)


@pytest.mark.parametrize(
    ("options", "error", "said"),
    [
        ({"map": ("#9=#1",)}, UsageError, "'#9': the model has faces #1 to #3"),
        ({"map": ("#1=#7",)}, UsageError, "'#7': the model has faces #1 to #3"),
        ({"map": ("lid=#1",)}, UsageError, "no faces are named 'lid'"),
        ({"map": ("#1=#1,#2=#1",)}, UsageError, "#1 gets the detail of two faces"),
        ({"map": ("#3=#1",)}, EditError, "#3 .plane. is not a NURBS face"),
        ({"map": ("#1=#3",)}, EditError, "#3 .plane. is not a NURBS face"),
        ({"map": ("#1=#1",), "size": 1e-9, "band": ":40mm"}, EditError, "closer than"),
        ({"map": ("#1=#1",), "band": ":0.001mm"}, EditError, "#1 has no detail in the band"),
    ],
)
def test_faces_that_cannot_give_or_take(two, options, error, said):
    _, _, target, _ = two
    flat = Face(2, "plane", None, (), False, np.eye(4), np.zeros((2, 3)))
    model = Model("x.step", target.surfaces, (*target.faces, flat), target.edges, target.diagonal)
    with pytest.raises(error, match=said):
        transfer(model, Transfer(source="x.step", **{"band": ":9mm", **options}), model)


def test_files_that_hold_no_details(two, tmp_path):
    _, _, target, _ = two
    (tmp_path / "bad.mra").write_bytes(b"PK")
    for name in ("bad.mra", "none.mra"):
        with pytest.raises(FileError, match=name):
            transfer(target, Transfer(source=str(tmp_path / name), map=("#1=#1",)))


@pytest.mark.parametrize(
    ("fairs", "limits", "reason"),
    [
        (False, (), "STUCK"),
        (False, (Worse(Rougher.FOLD, 0.0, 170.0),), "FOLDED"),
        (False, (Worse(Rougher.VARIATION, 0.1, 0.2),), "ROUGHER"),
        (True, (), "RIM"),
    ],
)
def test_why_a_face_stays_depends_on_what_is_asked(fairs, limits, reason):
    """An edit that need not make faces fairer does not say that one cannot get fairer."""
    moved = SimpleNamespace(rough=True, wanted=1.0, free=3, limits=limits)
    options = Transfer(source="x.step", map=("place",), band=":9mm")
    assert _left(moved, options, fairs)[:2] == ("left", Reason[reason])
