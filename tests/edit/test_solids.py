"""Seams of whole solids that move: a rounded box, a bottle, a blade, a panel with a hole."""

import cadquery
import numpy as np
import pytest
from OCP.BRep import BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_NurbsConvert
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS

from mracad import job, occ
from mracad.edit.smooth import smooth
from mracad.model import Displacement, Offset
from mracad.occ.apply import apply
from mracad.occ.check import check
from mracad.occ.view import view
from mracad.options import Smooth
from samples import make
from tests.occ.test_mesh import corners, is_watertight

NOISE, SPANS = 0.05, 12


def rounded_box():
    """A cube with rounded edges as 26 bicubic or biquintic NURBS faces, noise inside each of them."""
    solid = cadquery.Workplane().box(60, 60, 60).edges().fillet(15).val().wrapped
    solid = BRepBuilderAPI_NurbsConvert(solid, True).Shape()
    for face in cadquery.Shape.cast(solid).Faces():
        BRep_Tool.Surface_s(TopoDS.Face_s(face.wrapped), TopLoc_Location()).IncreaseDegree(3, 3)
    document = make.single(solid, "box")
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
    return lambda folder: occ.read_step(folder / f"{name}.step")


@pytest.mark.parametrize(
    ("source", "scale", "moving"),
    [
        (lambda _: rounded_box(), "12mm", 48),
        (sample("bottle"), "3%", 1),
        (sample("blade"), "6%", 2),
        (sample("trimmed"), "5%", 0),
    ],
    ids=["rounded box", "bottle", "blade", "panel with a hole"],
)
def test_solids_stay_solid_and_smooth(samples, tmp_path, source, scale, moving):
    document = source(samples)
    report = job.run(document, smooth, Smooth(scale=scale))
    moved = {t.edge: t for t in report.edit.edges if t.how != "frozen"}
    assert len(moved) == moving and report.edit.faces("edited")
    assert report.valid_before.valid and report.valid_after.valid and check(document).solids == 1
    assert report.valid_after.edge_tolerance <= max(report.valid_before.edge_tolerance, 1e-5)
    for before, after in zip(report.before, report.after, strict=True):
        assert after.gap <= max(before.gap, 1e-4)
        if before.smooth or before.edge not in moved:
            assert after.angle <= before.angle + 0.01
    occ.write(document, tmp_path / "out.stl")
    assert is_watertight(corners(tmp_path / "out.stl"))


def pipe():
    path = cadquery.Workplane("XY").spline([(0, 0), (20, 5), (40, 30), (60, 20)])
    solid = cadquery.Workplane("YZ").circle(4).sweep(path).val().wrapped
    return make.single(BRepBuilderAPI_NurbsConvert(solid, True).Shape(), "pipe")


def test_a_face_that_only_follows_its_neighbour_counts_as_edited():
    report = job.run(pipe(), smooth, Smooth(scale="8%"))
    assert [t.how for t in report.edit.edges] == ["coupled", "to tolerance", "to tolerance"]
    assert [(o.status, o.moved > 0) for o in report.edit.outcomes] == [("edited", True)] * 3
    assert min(o.detail for o in report.edit.outcomes) < 1e-7


def test_a_face_that_closes_on_itself_gets_no_kink_there():
    document = pipe()
    report = job.run(document, smooth, Smooth(level=1))
    closing = [(a, b) for a, b in zip(report.before, report.after, strict=True) if a.faces[0] == a.faces[1]]
    assert closing and report.edit.faces("edited") and report.valid_after.valid
    assert all(after.angle <= before.angle + 0.01 for before, after in closing)
