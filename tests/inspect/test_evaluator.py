"""The tests' own evaluator: closed forms, and what the product sees of the same faces."""

import numpy as np
import pytest
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

from mracad.bspline.surface import Net
from mracad.inspect.survey import surveys
from mracad.occ.geometry import spline
from mracad.occ.settings import quiet
from mracad.occ.step import read_step
from mracad.occ.view import view
from tests.model.shapes import cylinder, graph, sphere
from tests.roughness import compared, removed


def written(path, *nets):
    """A STEP file of bare faces."""
    with quiet():
        writer = STEPControl_Writer()
        for net in nets:
            writer.Transfer(BRepBuilderAPI_MakeFace(spline(net), 1e-7).Face(), STEPControl_AsIs)
        writer.Write(str(path))
    return path


def moved(net, poles):
    return Net(net.u, net.v, poles, net.weights)


def wave(amplitude, length=0.5, spans=20):
    return graph(lambda x, y: amplitude * np.sin(2 * np.pi * x / length) + 0 * y, spans, degree=4)


@pytest.mark.parametrize(
    ("net", "bending", "variation", "largest"),
    [
        (sphere(2.0), 8 * np.pi, 0, 0.5),
        (cylinder(2.0, 3.0), 3 * np.pi, 0, 0.5),
        (wave(1e-4), 1e-8 * (4 * np.pi) ** 4 / 2, 1e-8 * (4 * np.pi) ** 6 / 8, 1e-4 * (4 * np.pi) ** 2),
    ],
    ids=["sphere", "cylinder", "wave"],
)
def test_closed_forms(tmp_path, net, bending, variation, largest):
    path = written(tmp_path / "a.step", net)
    (found,) = compared(path, path)
    assert found.before == found.after and found.grew == () and not found.moved
    assert found.before.bending == pytest.approx(bending, rel=5e-3)
    assert found.before.variation == pytest.approx(variation, rel=2e-2, abs=1e-9)
    assert found.before.largest == pytest.approx(largest, rel=5e-3)


@pytest.mark.parametrize("name", ["trimmed", "bottle"])
def test_the_product_sees_the_same(samples, name):
    document = read_step(samples / f"{name}.step")
    model = view(document)
    own = {
        survey.faces[0].index: survey.roughness
        for surface in model.surfaces
        for survey in surveys([(surface.net, [model.faces[i]]) for i in surface.faces])
    }
    found = compared(samples / f"{name}.step", samples / f"{name}.step")
    assert {each.index for each in found} == set(own)
    for each in found:
        assert each.before.bending == pytest.approx(own[each.index].bending, rel=0.04)
        assert each.before.variation == pytest.approx(own[each.index].variation, rel=0.1)
        assert each.before.largest == pytest.approx(own[each.index].curvature, rel=0.1)


def test_what_grew_and_what_folded(tmp_path):
    clean, rippled = wave(1e-2), wave(1.02e-2)
    folded = clean.poles.copy()
    folded[10, 10, 0] -= 0.3
    before = written(tmp_path / "before.step", *(moved(clean, clean.poles + 3 * k) for k in range(3)))
    after = written(
        tmp_path / "after.step", *(moved(clean, p + 3 * k) for k, p in enumerate([clean.poles, rippled.poles, folded]))
    )
    same, grown, turned = compared(before, after)
    assert same.grew == () and not same.moved
    assert grown.grew == ("bending", "variation") and grown.moved
    assert "fold" in turned.grew and turned.turn > 90


def test_faces_are_told_by_where_they_lie(tmp_path):
    nets = [moved(wave(1e-2), wave(1e-2).poles + 3 * k) for k in range(3)]
    before, after = written(tmp_path / "a.step", *nets), written(tmp_path / "b.step", *nets[::-1])
    assert not any(each.moved for each in compared(before, after))


@pytest.mark.parametrize("left", [0.0, 0.5, 1.0])
def test_the_share_of_detail_that_is_gone(tmp_path, left):
    """A ripple a quarter of the scale on a long wave: what is left is its amplitude squared; the wave is no detail."""

    def face(amplitude):
        return graph(lambda x, y: 0.05 * np.sin(2 * x) + amplitude * np.sin(16 * np.pi * x), 32)

    before, after = written(tmp_path / "a.step", face(1e-3)), written(tmp_path / "b.step", face(left * 1e-3))
    assert removed(compared(before, after, 0.5)) == pytest.approx(1 - left**2, abs=5e-3)
    assert removed(compared(before, after, 0.02)) == 0
