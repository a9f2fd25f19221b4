"""One answer to what may be worse: what rims are aimed at is what the verdict on the document allows."""

import math
from dataclasses import replace

import numpy as np
import pytest

from mracad.edit.fair import Filter
from mracad.edit.pose import Scene
from mracad.edit.result import Edit, FaceOutcome
from mracad.edit.target import sheets
from mracad.edit.tolerances import MORE, Tolerances, tolerances
from mracad.edit.torn import gaps, torn
from mracad.inspect.seams import seams
from mracad.model.displacement import Displacement
from mracad.occ.view import view
from mracad.seam.interface import joints, rims
from mracad.seam.natural import Treatment
from mracad.seam.wishes import Wishes
from mracad.spec.steps import Repeat, Smooth
from tests.edit import halves

EDGE = 5e-5


@pytest.fixture(scope="module")
def model():
    """Two halves that meet along a trim curve, of edges with a tolerance of their own."""
    found = view(halves.document(*halves.quiet(0.05, (10, 14))))
    return replace(found, edges=tuple(replace(edge, tolerance=EDGE) for edge in found.edges))


def aimed(model, movable, allowed):
    """By how much the rim along the seam of the halves may grow, for each surface that may move."""
    wish = Filter(40.0)
    scene = Scene(model, sheets(model, movable, wish), joints(model, movable, Wishes("as-is")), allowed)
    alone = scene.joints.among({0})
    sheet = scene.sheets[0]
    _, contacts = rims(model, sheet.net, sheet.all_faces, movable, alone)
    return [scene.allowed(each, alone, 40.0) for each in contacts if len(model.edges[each.edge].sides) == 2]


def test_edges_may_gape_as_far_as_they_are_made():
    edge = type("Edge", (), {"tolerance": EDGE})()
    allowed = Tolerances(gap=1e-4, least=1e-5)
    assert allowed.wider(edge, 0.0) == EDGE
    assert allowed.wider(edge, 2e-5) == pytest.approx(3e-5)
    assert allowed.wider(edge, 1.0) == MORE  # it gapes as far as it may
    edge.tolerance = 1.0
    assert allowed.wider(edge, 0.0) == 1e-4  # --gap-tolerance is the upper bound
    assert Tolerances(gap=1e-6).wider(edge, 0.0) == 1e-6
    edge.tolerance = 1e-7
    assert allowed.wider(edge, 0.0) == 1e-5


def test_options_say_what_an_edit_may_be_worse_in(model):
    options = Smooth(scale="5mm", gap_tolerance="1%", max_deviation="2mm")
    found = tolerances(model, options)
    assert found.gap == pytest.approx(model.diagonal / 100) and found.deviation == 2.0
    assert tolerances(model, Repeat(feature="near:0,0,0,radius:1", at=("near:1,1,1",))) == Tolerances()


def test_two_faces_that_move_by_themselves_share_what_their_edge_may_gape(model):
    allowed = Tolerances(gap=1e-4)
    (one,), (both,) = aimed(model, {0}, allowed), aimed(model, {0, 1}, allowed)
    gap = next(measure.gap for measure in seams(model))
    assert one == pytest.approx((EDGE - gap, allowed.angle, allowed.bend / 40.0), rel=1e-2)
    assert both == pytest.approx([x / 2 for x in one])


def shifted(model, offset):
    """A model whose left half is moved along z, which opens its seam by that; and the seams before and after."""
    net = model.surfaces[0].net
    moved = replace(model.surfaces[0], net=replace(net, poles=np.add(net.poles, [0.0, 0.0, offset])))
    return seams(model), seams(replace(model, surfaces=(moved, *model.surfaces[1:])))


@pytest.mark.parametrize(
    ("how", "keep", "most"), [("frozen", "as-is", EDGE), ("to tolerance", "as-is", 1e-4), ("mended", "as-is", np.inf)]
)
def test_the_verdict_allows_what_rims_are_aimed_at(model, how, keep, most):
    for offset in (0.9 * EDGE, 0.9e-4, 1.5e-4, 1.0):
        before, after = shifted(model, offset)
        edge = before[0].edge
        edit = Edit(Displacement({}), (), edges=(Treatment(edge, before[0].faces, how),))
        found = torn(model, before, after, edit, Tolerances(gap=1e-4), keep)
        grown = after[0].gap - before[0].gap
        wider = most - before[0].gap if how == "frozen" else most
        assert found == (set(before[0].faces) if grown > wider else set())
        edited = replace(edit, outcomes=(FaceOutcome(0, "edited"),))
        widest = {(0, 1): pytest.approx(before[0].gap + wider)} if how != "mended" else {}
        assert gaps(model, before, edited, Tolerances(gap=1e-4)) == widest and not gaps(
            model, before, edit, Tolerances()
        )


def test_a_smooth_seam_may_not_turn_further(model):
    before = [replace(seams(model)[0], angle=0.5)]
    assert before[0].smooth
    edit = Edit(Displacement({}), ())
    for angle, keep, bent in ((0.009, "as-is", False), (0.011, "as-is", True), (0.011, "g0", False)):
        after = [replace(before[0], angle=before[0].angle + angle)]
        assert bool(torn(model, before, after, edit, Tolerances(), keep)) == bent
    assert math.degrees(Tolerances().angle) == pytest.approx(0.01)
