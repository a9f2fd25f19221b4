"""Seams of whole solids that move: a rounded box, a bottle, a blade, a panel with a hole."""

import cadquery
import numpy as np
import pytest
from OCP.BRep import BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_NurbsConvert
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS

from mracad.edit.equalize import equalize
from mracad.edit.result import Reason
from mracad.edit.smooth import smooth
from mracad.edit.tolerances import MORE, Tolerances
from mracad.job.document import run
from mracad.model.displacement import Displacement, Offset
from mracad.occ.apply import apply
from mracad.occ.check import check
from mracad.occ.files import write
from mracad.occ.step import read_step
from mracad.occ.view import view
from mracad.spec.steps import Smooth
from mracad.spec.steps.shape import Equalize
from samples.models import documents
from tests.occ.test_mesh import corners, is_watertight

NOISE, SPANS = 0.05, 6


def rounded_box():
    """A cube with rounded edges as 26 bicubic or biquintic NURBS faces, noise inside each of them."""
    solid = cadquery.Workplane().box(60, 60, 60).edges().fillet(15).val().wrapped
    solid = BRepBuilderAPI_NurbsConvert(solid, True).Shape()
    for face in cadquery.Shape.cast(solid).Faces():
        BRep_Tool.Surface_s(TopoDS.Face_s(face.wrapped), TopLoc_Location()).IncreaseDegree(3, 3)
    document = documents.single(solid, "box")
    model = view(document)
    rng, offsets = np.random.default_rng(3), {}
    for surface in model.surfaces:
        knots = [
            np.setdiff1d(np.linspace(*k.domain, SPANS + 1).round(9), k.breaks.round(9))
            for k in (surface.net.u, surface.net.v)
        ]
        delta = np.zeros(surface.net.refined(*knots).poles.shape)
        delta[3:-3, 3:-3] = NOISE * rng.standard_normal(delta[3:-3, 3:-3].shape)
        offsets[surface.index] = Offset(delta, *knots)
    apply(document, model, Displacement(offsets))
    return document


def sample(name):
    return lambda folder: read_step(folder / f"{name}.step")


@pytest.mark.parametrize(
    ("source", "scale"),
    [(lambda _: rounded_box(), "12mm"), (sample("bottle"), "3%"), (sample("blade"), "6%"), (sample("trimmed"), "5%")],
    ids=["rounded box", "bottle", "blade", "panel with a hole"],
)
def test_solids_stay_solid_and_smooth(samples, tmp_path, source, scale):
    """Seams stay shut; those that are smooth stay so, edges keep their place."""
    document = source(samples)
    report = run(document, smooth, Smooth(scale=scale))
    assert report.edit.faces("edited")
    assert report.valid_before.valid and report.valid_after.valid and check(document).solids == 1
    widest = max(measure.gap for measure in report.before)
    allowed = max((1 + MORE) * widest, Tolerances().least)  # edges that follow one face get the whole gap to the other
    assert report.valid_after.edge_tolerance <= max(report.valid_before.edge_tolerance, allowed)
    for before, after in zip(report.before, report.after, strict=True):
        assert after.gap <= max(before.gap, 1e-4)
        if before.smooth:
            assert after.angle <= before.angle + 0.01
    write(document, tmp_path / "out.stl")
    assert is_watertight(corners(tmp_path / "out.stl"))


def pipe():
    path = cadquery.Workplane("XY").spline([(0, 0), (20, 5), (40, 30), (60, 20)])
    solid = cadquery.Workplane("YZ").circle(4).sweep(path).val().wrapped
    return documents.single(BRepBuilderAPI_NurbsConvert(solid, True).Shape(), "pipe")


def test_a_clean_pipe_is_left_as_it_is():
    document = pipe()
    edit = run(document, smooth, Smooth(scale="8%")).edit
    assert [(o.status, o.reason) for o in edit.outcomes] == [("unchanged", Reason.FAIR)] * 3
    assert {t.how for t in edit.edges} == {"frozen"} and not edit.displacement.offsets


def noisy_pipe(noise=0.1):
    """A pipe without noise on the three rows about its closing line, where it would make a kink."""
    document = pipe()
    model = view(document)
    net = model.surfaces[0].net
    knots = np.linspace(*net.u.domain, 13)[1:-1], np.linspace(*net.v.domain, 25)[1:-1]
    fine = net.refined(*knots)
    offsets = np.zeros(fine.poles.shape)
    offsets[:, 12:-12] = noise * np.random.default_rng(0).standard_normal(offsets[:, 12:-12].shape)
    first = int(np.abs(fine.u.greville() - fine.u.domain[0]).argmin())
    offsets[(first + np.arange(-1, 2)) % len(offsets)] = 0.0
    apply(document, model, Displacement({0: Offset(offsets, *knots)}))
    return document


def test_an_edit_that_would_make_a_kink_on_a_closing_line_is_scaled_back():
    """What the judge allows on knot lines must be allowed along edges, or the face would stay as it is."""
    report = run(noisy_pipe(0.002), equalize, Equalize(band=(":5%=0.2",)))
    assert {each.status for each in report.edit.outcomes if each.face == 0} == {"edited"}


def test_a_face_that_closes_on_itself_gets_no_kink_there():
    report = run(noisy_pipe(), smooth, Smooth(scale="12%"))
    closing = [(a, b) for a, b in zip(report.before, report.after, strict=True) if a.faces[0] == a.faces[1]]
    assert [t.how for t in report.edit.edges if t.faces[0] == t.faces[1]] == ["coupled"]
    (outcome,) = (each for each in report.edit.outcomes if each.status == "edited")
    assert outcome.roughness[1].variation < 0.1 * outcome.roughness[0].variation
    assert closing and report.valid_after.valid
    assert all(after.angle <= before.angle + 0.01 for before, after in closing)
