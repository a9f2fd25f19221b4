"""Congruent surfaces, whose parameters may run otherwise, get the same result without a search."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from mracad import processes
from mracad.bspline.knots import KnotVector
from mracad.bspline.surface import Net
from mracad.edit import alone, target
from mracad.edit.fair import Filter, faired
from mracad.edit.target import sheets
from mracad.edit.tolerances import Tolerances
from mracad.model.brep import Model, Trim
from mracad.seam.metric import smoothed
from mracad.seam.wishes import Wishes
from tests.edit.models import noisy, rotation, segment, sheet

TURN = rotation((1, 2, 3), 0.7) @ np.diag([1.0, 1.0, -1.0])


@pytest.fixture(scope="module")
def net():
    return noisy()


def moved(values, swapped, flipped):
    values = values.swapaxes(0, 1) if swapped else values
    return values[:: -1 if flipped[0] else 1, :: -1 if flipped[1] else 1]


def alike(net, swapped, flipped):
    """A congruent surface over knots of another length."""
    axes = (net.v, net.u) if swapped else (net.u, net.v)
    knots = [
        KnotVector(7.0 + 0.3 * (k.knots[::-1] * -1 if f else k.knots), 3) for k, f in zip(axes, flipped, strict=True)
    ]
    return Net(*knots, moved(net.poles, swapped, flipped) @ TURN + (40.0, -5.0, 3.0))


def together(*nets):
    """A model of several sheets."""
    surfaces, faces, edges = [], [], []
    for net in nets:
        one, first = sheet(net), len(edges)
        trims = tuple(Trim(trim.edge + first, trim.curve) for trim in one.faces[0].trims)
        sides = [
            replace(edge, index=edge.index + first, sides=(replace(edge.sides[0], face=len(faces)),))
            for edge in one.edges
        ]
        surfaces.append(replace(one.surfaces[0], index=len(faces), faces=(len(faces),)))
        faces.append(replace(one.faces[0], index=len(faces), surface=len(faces), trims=trims))
        edges += sides
    return Model("sheets", tuple(surfaces), tuple(faces), tuple(edges), 20.0)


@pytest.fixture
def searches(monkeypatch):
    """The surfaces for which results are searched."""
    found, search = [], alone._searched

    def searched(scene, wish, i):
        found.append(i)
        return search(scene, wish, i)

    monkeypatch.setattr(alone, "_searched", searched)
    return found


def fair(model):
    return faired(model, {0, 1}, Filter(5.0), Wishes(), Tolerances()).moved


@pytest.mark.parametrize(("swapped", "flipped"), list(product((False, True), product((False, True), repeat=2))))
def test_congruent_surfaces_get_the_same_result(net, searches, swapped, flipped):
    found = fair(together(net, alike(net, swapped, flipped)))
    assert searches == [0] and found[0].amount == found[1].amount > 0
    expected = moved(found[0].offset, swapped, flipped) @ TURN
    assert np.abs(found[1].offset - expected).max() < 1e-12
    for old, new in zip(found[0].changes.values(), found[1].changes.values(), strict=True):
        assert new.after.bending == pytest.approx(old.after.bending, rel=1e-9)


@pytest.mark.parametrize(("swapped", "flipped"), list(product((False, True), product((False, True), repeat=2))))
def test_congruent_surfaces_are_prepared_once(net, swapped, flipped, monkeypatch):
    other, done = alike(net, swapped, flipped), []
    (apart,) = sheets(sheet(other), {0}, Filter(5.0, limited=True)).values()
    monkeypatch.setattr(target, "smoothed", lambda *given: done.append(0) or smoothed(*given))
    found = sheets(together(net, other), {0, 1}, Filter(5.0, limited=True))[1]
    assert done == [0] and found.detail == pytest.approx(apart.detail, rel=1e-9)
    for name in ("metric", "trend", "base"):
        assert np.abs(getattr(found, name).poles - getattr(apart, name).poles).max() < 1e-9
    for name in ("mass", "bending", "creases"):
        form, own = (getattr(each.form, name).toarray() for each in (found, apart))
        assert np.abs(form - own).max() <= 1e-9 * np.abs(own).max()


def test_what_hardly_differs_is_prepared_for_itself(net):
    other = alike(net, False, (False, False))
    other.poles[5, 5, 2] += 1e-5
    found = sheets(together(net, other), {0, 1}, Filter(5.0))
    assert found[0].form is not found[1].form and found[0].detail != found[1].detail


def test_what_differs_a_little_is_not_congruent(net, searches):
    other = alike(net, False, (False, False))
    other.poles[5, 5, 2] += 1e-3
    fair(together(net, other))
    assert searches == [0, 1]


def test_what_is_trimmed_otherwise_is_not_congruent(net, searches):
    model = together(net, alike(net, False, (True, False)))
    face = model.faces[1]
    curve = face.trims[1].curve
    cut = segment(*(curve.poles - (0.3 * model.surfaces[1].net.u.period, 0.0)))
    trims = (face.trims[0], Trim(face.trims[1].edge, cut), *face.trims[2:])
    fair(replace(model, faces=(model.faces[0], replace(face, trims=trims))))
    assert searches == [0, 1]


def test_a_wish_that_depends_on_the_place_asks_for_each(net, searches):
    faired(together(net, alike(net, False, (False, False))), {0, 1}, Placed(5.0), Wishes(), Tolerances())
    assert searches == [0, 1]


class Placed(Filter):
    alike = False


@pytest.mark.parametrize("workers", ["2", "1"])
def test_other_processes_find_the_same(net, monkeypatch, workers):
    model = together(net, net.with_poles(1.2 * net.poles), net)
    one = faired(model, {0, 1, 2}, Filter(5.0), Wishes(), Tolerances())
    monkeypatch.setattr(processes, "PATIENCE", -1.0)
    monkeypatch.setattr(processes, "_can_fork", lambda: True)
    monkeypatch.setenv("MRACAD_WORKERS", workers)
    started, start = [], processes.Ahead._start
    monkeypatch.setattr(processes.Ahead, "_start", lambda self, count: started.append(count) or start(self, count))
    many = faired(model, {0, 1, 2}, Filter(5.0), Wishes(), Tolerances())
    assert started == [2] * (workers == "2")
    for i, found in one.moved.items():
        assert found.amount and many.moved[i].offset.tobytes() == found.offset.tobytes()
        assert many.moved[i].sheet.index == i and many.moved[i].limits == found.limits
        assert [each.after for each in many.moved[i].changes.values()] == [
            each.after for each in found.changes.values()
        ]
