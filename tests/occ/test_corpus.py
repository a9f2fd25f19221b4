"""Real files, when ``MRACAD_CORPUS`` names a folder of them: nothing is lost that the kernel itself would keep."""

import os
from pathlib import Path

import numpy as np
import pytest
from OCP.BRep import BRep_Tool
from OCP.STEPCAFControl import STEPCAFControl_Reader, STEPCAFControl_Writer
from OCP.STEPControl import STEPControl_AsIs
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_FORWARD
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS
from OCP.XCAFDoc import XCAFDoc_ShapeTool

from mracad.occ.check import check
from mracad.occ.geometry import basis
from mracad.occ.settings import quiet
from mracad.occ.step import read_step, write_step
from mracad.occ.topology import edge_uses
from mracad.occ.view import view

FOLDER = os.environ.get("MRACAD_CORPUS", "")
FILES = sorted(Path(FOLDER).glob("*.st*p")) if FOLDER else []
pytestmark = pytest.mark.skipif(not FILES, reason="MRACAD_CORPUS names no folder with STEP files")


@pytest.fixture(scope="module", params=FILES or [None], ids=lambda path: path.stem if path else "none")
def source(request):
    return request.param


@pytest.fixture(scope="module")
def document(source):
    XCAFDoc_ShapeTool.SetAutoNaming_s(False)  # as CadQuery leaves it: names of products must not depend on it
    try:
        return read_step(source)
    finally:
        XCAFDoc_ShapeTool.SetAutoNaming_s(True)


@pytest.fixture(scope="module")
def model(document):
    return view(document)


def plainly(source, target):
    """What the kernel itself makes of a file: read, written, read back."""
    with quiet():
        reader, writer = STEPCAFControl_Reader(), STEPCAFControl_Writer()
        xcaf = TDocStd_Document(TCollection_ExtendedString("BinXCAF"))
        reader.ReadFile(str(source))
        reader.Transfer(xcaf)
        writer.Transfer(xcaf, STEPControl_AsIs)
        writer.Write(str(target))
    return read_step(target)


def test_round_trip_is_as_good_as_the_kernels_own(source, document, model, tmp_path):
    write_step(document, tmp_path / "out.step")
    again, other = read_step(tmp_path / "out.step"), plainly(source, tmp_path / "plain.step")
    first, ours, plain = (check(d, distances=True) for d in (document, again, other))
    for count in ("solids", "shells", "faces", "open_shells", "free_edges"):
        assert getattr(ours, count) == getattr(first, count) == getattr(plain, count), count
    assert ours.valid == plain.valid
    for size in ("edge_tolerance", "vertex_tolerance", "curve_distance"):
        assert getattr(ours, size) <= 1.25 * getattr(plain, size) + 1e-6, size
    assert again.unit == document.unit
    seen, expected = view(again), view(other)
    assert seen.products == model.products
    for old, new, same in zip(model.faces, seen.faces, expected.faces, strict=True):
        assert new.kind == same.kind
        assert (old.name, old.product, old.colour, old.instances) == (new.name, new.product, new.colour, new.instances)
    for old, new in zip(model.surfaces, seen.surfaces, strict=True):
        # the kernel unrolls a periodic surface for the file, and rolls it up again
        slack = 1e-12 * model.diagonal if old.net.u.periodic or old.net.v.periodic else 0.0
        assert np.abs(old.net.poles - new.net.poles).max() <= slack


def test_poles_are_the_kernels_own(document, model):
    for surface in model.surfaces:
        handle = basis(BRep_Tool.Surface_s(document.faces[surface.faces[0]], TopLoc_Location()))
        rows, columns = range(1, handle.NbUPoles() + 1), range(1, handle.NbVPoles() + 1)
        poles = [[handle.Pole(i, j).Coord() for j in columns] for i in rows]
        assert np.array_equal(surface.net.poles, np.array(poles))
        if surface.net.weights is not None:
            assert np.array_equal(surface.net.weights, [[handle.Weight(i, j) for j in columns] for i in rows])
        for u, v in np.random.default_rng(0).random((3, 2)):
            u, v = (low + x * (high - low) for x, (low, high) in ((u, surface.net.u.domain), (v, surface.net.v.domain)))
            point = np.array(handle.Value(u, v).Coord())
            assert surface.net.evaluate([[u, v]])[0] == pytest.approx(point, abs=1e-9 * model.diagonal)


def test_curves_in_the_parameter_plane_are_the_kernels_own(document, model):
    conics = ("Geom2d_Circle", "Geom2d_Ellipse")
    for face in (face for face in model.faces if face.surface is not None):
        forward = TopoDS.Face_s(document.faces[face.index].Oriented(TopAbs_FORWARD))
        for trim, edge in zip(face.trims, edge_uses(forward), strict=True):
            curve = BRep_Tool.CurveOnSurface_s(edge, forward, 0.0, 0.0)
            first, last = BRep_Tool.Range_s(edge, forward)
            assert trim.curve.knots.domain == pytest.approx((first, last))
            inside = [first, last] if type(curve).__name__ in conics else np.linspace(first, last, 7).tolist()
            points = [curve.Value(t).Coord() for t in inside]
            size = max(1.0, np.abs(points).max())
            ours = trim.curve.evaluate(np.array(inside), side="left")[0]
            assert ours == pytest.approx(np.array(points), abs=1e-9 * size)
            assert document.edges[trim.edge].IsSame(edge)


def test_every_face_of_the_boundary_is_bounded(model):
    for edge in model.edges:
        assert edge.sides
        lengths = np.linalg.norm(edge.tangents, axis=1)
        assert lengths == pytest.approx(np.ones(len(lengths)))
        for side in edge.sides:
            assert (side.uv is None) == (model.faces[side.face].surface is None)
            if side.normals is not None:
                assert np.linalg.norm(side.points - edge.points, axis=1).max(initial=0) < 0.1
