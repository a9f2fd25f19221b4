"""Free edges that coincide: at every size, across the roots and products of a file, and not across instances."""

import io
from dataclasses import replace

import numpy as np
import pytest
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.gp import gp_Trsf, gp_Vec
from OCP.TopLoc import TopLoc_Location

from mracad.bspline.surface import Net
from mracad.edit.smooth import smooth
from mracad.inspect.seams import seams
from mracad.job.document import run
from mracad.model.adjacency import TORN, coinciding, touching
from mracad.occ.document import Document, empty
from mracad.occ.files import read, write
from mracad.occ.load import Text
from mracad.occ.view import view
from mracad.seam.cause import Cause, Still
from mracad.spec.steps import Smooth
from tests.edit import panels
from tests.occ import shapes

SIZES = (1e-3, 0.2, 1.0, 40.0, 1e3)
LIFTS = {(0, 1): 4e-3, (1, 0): 0.08, (1, 1): 1.5}  # mm, on a panel of 200 mm: the seam holds, is torn, is none


def faces(lifts=(), size=1.0, spans=6):
    """Four patches of a noisy panel with edges of their own, some lifted."""
    _, noisy = panels.whole(spans, 0.05, patches=(2, 2))
    lifted = {}
    for place, patch in panels.cut(noisy, (2, 2)).items():
        net, up = patch.net, np.array([0, 0, dict(lifts).get(place, 0.0)])
        lifted[place] = replace(patch, net=Net(net.u, net.v, size * (net.poles + up)))
    return panels.document(lifted, sewn=False).faces


def pairs(model, gap=1.0):
    return {(edge.index, one.face, two.face) for edge, _, (one, two) in coinciding(model, gap)}


def at(x=0.0):
    move = gp_Trsf()
    move.SetTranslation(gp_Vec(x, 0, 0))
    return TopLoc_Location(move)


def test_a_model_has_the_same_seams_at_every_size():
    found = [view(shapes.document(shapes.compound(*faces(LIFTS, size)))) for size in SIZES]
    assert {len(pairs(model)) for model in found} == {1} and {len(pairs(model, TORN)) for model in found} == {2}
    assert all(pairs(model) == pairs(found[0]) for model in found)
    assert all(pairs(model, TORN) == pairs(found[0], TORN) for model in found)


def test_edges_coincide_within_the_tolerances_that_they_have():
    model = view(shapes.document(shapes.compound(*faces(LIFTS))))
    loose = replace(model, edges=tuple(replace(edge, tolerance=0.05) for edge in model.edges))
    assert pairs(model) < pairs(loose)


def exchanged(document, format):
    stream = io.BytesIO()
    write(document, stream, format)
    return read(Text(stream.getvalue(), "again"))


@pytest.mark.parametrize("format", ["", "iges", "step"])
def test_products_that_touch_are_as_one_part(format):
    def one():
        return shapes.document(shapes.compound(*faces()))

    def many():
        made = shapes.document(*faces(), names={k: f"patch {k}" for k in range(4)})
        return exchanged(made, format) if format else made

    assert len(many().parts) == 4
    single, several = (run(document, smooth, Smooth(level=1)) for document in (one(), many()))
    assert len(single.before) == 4
    for a, b in zip(single.before, several.before, strict=True):
        assert (a.edge, a.faces) == (b.edge, b.faces)
        assert b.gap == pytest.approx(a.gap, abs=1e-6) and b.angle == pytest.approx(a.angle, abs=1e-4)
    assert [(t.edge, t.how) for t in single.edit.edges] == [(t.edge, t.how) for t in several.edit.edges]
    assert sum(t.how == "coupled" for t in several.edit.edges) == 8
    offsets = several.edit.displacement.offsets
    for surface, offset in single.edit.displacement.offsets.items():
        assert offsets[surface].poles == pytest.approx(offset.poles, abs=1e-6)


def test_instances_that_touch_are_said_to_be_separate():
    """A flat face, but for noise inside, and another of it beside it."""
    _, clean = panels.whole(16, 0.0, patches=(1, 1))
    poles = clean.poles * [1, 1, 0]
    poles[3:-3, 3:-3, 2] = np.random.default_rng(1).normal(0, 0.1, (poles.shape[0] - 6, poles.shape[1] - 6))
    rough = Net(clean.u, clean.v, poles)
    (face,) = panels.document({(0, 0): panels.Patch(rough, "", ((0, panels.SIZE), (0, panels.SIZE)))}, sewn=False).faces
    for places, count in (((at(), at(100.0)), 2), ((at(), at(100.5)), 0)):
        document = shapes.assembly(face, *places)
        model = view(document)
        assert len(touching(model)) == count and not seams(model)
        edit = smooth(model, Smooth(level=1))
        assert edit.faces("edited")
        assert sum(t.reason == Cause(Still.ELSEWHERE) for t in edit.edges) == count


def test_products_placed_apart_are_said_to_be_separate():
    one, other = faces()[0], BRepBuilderAPI_Transform(faces()[2], at(-5.0).Transformation(), True).Shape()
    made = Document(empty(), "assembly.step")
    whole = made.shape_tool.NewShape()
    for shape, place in ((one, at()), (other, at(5.0))):
        made.shape_tool.AddComponent(whole, made.shape_tool.AddShape(shape, False), place)
    made.shape_tool.UpdateAssemblies()
    model = view(made)
    assert len(set(model.spaces)) == 2 and not seams(model)
    treatments = smooth(model, Smooth(level=1)).edges
    assert sorted(t.faces[0] for t in treatments if t.reason == Cause(Still.ELSEWHERE)) == [0, 1]
