"""The sample models are what samples/README.md says, and what samples/make.py writes."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Tool
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.Geom import Geom_BSplineSurface, Geom_CylindricalSurface, Geom_Plane
from OCP.gp import gp_Pnt, gp_Vec
from OCP.IFSelect import IFSelect_RetDone
from OCP.Quantity import Quantity_Color
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.STEPControl import STEPControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label, TDF_LabelSequence
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_ShapeEnum, TopAbs_SHELL, TopAbs_SOLID, TopAbs_WIRE
from OCP.TopExp import TopExp
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Face, TopoDS_Shape
from OCP.TopTools import TopTools_IndexedMapOfShape
from OCP.XCAFDoc import (
    XCAFDoc_ColorSurf,
    XCAFDoc_ColorTool,
    XCAFDoc_DocumentTool,
    XCAFDoc_LayerTool,
    XCAFDoc_ShapeTool,
)

from mracad.occ.settings import quiet
from mracad.occ.step import read_step
from mracad.occ.view import view
from samples.models import shell
from samples.models.documents import single
from samples.models.panel import cut, sewn

SAMPLES = Path(__file__).resolve().parents[2] / "samples"
NAMES = ("assembly", "blade", "bottle", "panel", "panel_clean", "panel_inside", "shell", "trimmed")


@cache
def read(name: str) -> TopoDS_Shape:
    """A sample as the kernel alone reads it."""
    reader = STEPControl_Reader()
    with quiet():
        assert reader.ReadFile(str(SAMPLES / f"{name}.step")) == IFSelect_RetDone
        reader.TransferRoots()
    assert reader.NbShapes() == 1
    return reader.OneShape()


def parts(shape: TopoDS_Shape, kind: TopAbs_ShapeEnum) -> list[TopoDS_Shape]:
    """The different sub-shapes of one kind, in order."""
    found = TopTools_IndexedMapOfShape()
    TopExp.MapShapes_s(shape, kind, found)
    return [found.FindKey(i) for i in range(1, found.Extent() + 1)]


def faces(name: str, kind: type = Geom_BSplineSurface) -> list[TopoDS_Face]:
    """The faces of a sample on one kind of surface."""
    every = [TopoDS.Face_s(face) for face in parts(read(name), TopAbs_FACE)]
    return [face for face in every if isinstance(surface(face), kind)]


def surface(face: TopoDS_Face):
    """The surface under a face."""
    return BRep_Tool.Surface_s(face, TopLoc_Location())


def poles(on: Geom_BSplineSurface) -> np.ndarray:
    """The control net."""
    net = [on.Pole(i, j) for i in range(1, on.NbUPoles() + 1) for j in range(1, on.NbVPoles() + 1)]
    return np.array([(p.X(), p.Y(), p.Z()) for p in net]).reshape(on.NbUPoles(), on.NbVPoles(), 3)


def knots(on: Geom_BSplineSurface) -> tuple[list[float], list[float]]:
    """The different knots in u and v."""
    return [on.UKnot(i) for i in range(1, on.NbUKnots() + 1)], [on.VKnot(i) for i in range(1, on.NbVKnots() + 1)]


def multiplicities(on: Geom_BSplineSurface) -> tuple[list[int], list[int]]:
    """How often each knot counts in u and v."""
    return (
        [on.UMultiplicity(i) for i in range(1, on.NbUKnots() + 1)],
        [on.VMultiplicity(i) for i in range(1, on.NbVKnots() + 1)],
    )


def jet(on: Geom_BSplineSurface, u: float, v: float) -> np.ndarray:
    """Place, first and second derivatives."""
    place, first, second = gp_Pnt(), (gp_Vec(), gp_Vec()), (gp_Vec(), gp_Vec(), gp_Vec())
    on.D2(u, v, place, *first, *second)
    return np.array([(item.X(), item.Y(), item.Z()) for item in (place, *first, *second)])


def bending(on: Geom_BSplineSurface) -> float:
    """Root mean square of the second derivatives along both directions over a grid."""
    (u, v), shares = knots(on), np.linspace(0.0, 1.0, 60)
    second = [jet(on, u[0] + s * (u[-1] - u[0]), v[0] + t * (v[-1] - v[0]))[3:5] for s in shares for t in shares]
    return float(np.sqrt(np.mean(np.square(second))))


@pytest.fixture(scope="module")
def fresh(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of newly made samples, in another order, at another date."""
    folder = tmp_path_factory.mktemp("samples")
    environment = {**os.environ, "SOURCE_DATE_EPOCH": "86400", "PYTHONHASHSEED": "7"}
    command = [sys.executable, str(SAMPLES / "make.py"), str(folder), *NAMES]
    subprocess.run(command, check=True, capture_output=True, env=environment, timeout=60)
    return folder


@pytest.mark.parametrize("name", NAMES)
def test_committed_file_is_what_the_script_writes(fresh: Path, name: str):
    same = (fresh / f"{name}.step").read_bytes() == (SAMPLES / f"{name}.step").read_bytes()
    assert same, "run: python samples/make.py"


def test_every_sample_is_known_and_small():
    files = sorted(SAMPLES.glob("*.step"))
    assert [file.stem for file in files] == sorted(NAMES)
    assert max(file.stat().st_size for file in files) < 1e6
    assert sum(file.stat().st_size for file in files) < 4e6


def test_unknown_name_beside_a_folder_is_an_error(tmp_path: Path):
    done = subprocess.run(
        [sys.executable, str(SAMPLES / "make.py"), str(tmp_path), "panle"], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 2
    assert "panle" in done.stderr


@pytest.mark.parametrize("name", NAMES)
def test_valid_on_reading_back(name: str):
    shape = read(name)
    assert BRepCheck_Analyzer(shape).IsValid()
    tolerances = [BRep_Tool.Tolerance_s(TopoDS.Edge_s(edge)) for edge in parts(shape, TopAbs_EDGE)]
    assert max(tolerances) <= (1e-4 if name == "trimmed" else 1e-7)


@pytest.mark.parametrize("name", ["trimmed", "bottle", "blade"])
def test_closed_solid(name: str):
    (solid,) = parts(read(name), TopAbs_SOLID)
    (shell,) = parts(solid, TopAbs_SHELL)
    assert BRep_Tool.IsClosed_s(shell)


class TestPanel:
    def test_one_shell_of_six_bicubic_patches_on_uneven_knots(self):
        for name in ("panel", "panel_clean", "panel_inside"):
            assert len(parts(read(name), TopAbs_SHELL)) == 1
            assert len(parts(read(name), TopAbs_EDGE)) == 17
            patches = [surface(face) for face in faces(name)]
            assert len(patches) == 6
            for patch in patches:
                assert (patch.UDegree(), patch.VDegree()) == (3, 3)
                assert (patch.NbUPoles(), patch.NbVPoles()) == (35, 35)
                assert not patch.IsURational()
                assert not patch.IsVRational()
                steps = np.diff(knots(patch)[0])
                assert steps.max() / steps.min() > 2.0

    @pytest.mark.parametrize("name", ["panel", "panel_inside"])
    def test_knots_and_order_are_those_of_the_truth(self, name: str):
        for rough, clean in zip(faces(name), faces("panel_clean"), strict=True):
            assert knots(surface(rough)) == knots(surface(clean))
            assert np.abs(poles(surface(rough)) - poles(surface(clean))).max() < 0.25

    def test_noise_everywhere_is_0_05_mm(self):
        noise = [
            poles(surface(a)) - poles(surface(b)) for a, b in zip(faces("panel"), faces("panel_clean"), strict=True)
        ]
        rms = np.sqrt(np.mean([np.sum(part**2, axis=-1) for part in noise]))
        assert rms == pytest.approx(0.05, rel=0.05)
        assert all(np.abs(part[0]).max() > 0.02 for part in noise)

    def test_noise_inside_leaves_two_rows_untouched(self):
        for rough, clean in zip(faces("panel_inside"), faces("panel_clean"), strict=True):
            noise = poles(surface(rough)) - poles(surface(clean))
            inside = noise[2:-2, 2:-2].copy()
            assert np.sqrt(np.mean(np.sum(inside**2, axis=-1))) == pytest.approx(0.05, rel=0.05)
            noise[2:-2, 2:-2] = 0.0
            assert not noise.any()

    @pytest.mark.parametrize(("name", "order"), [("panel", 2), ("panel_clean", 2), ("panel_inside", 1)])
    def test_smooth_across_seams(self, name: str, order: int):
        grid = np.array(faces(name), dtype=object).reshape(3, 2)
        kept = slice(0, 6 if order == 2 else 3)
        for j in range(2):
            for left, right in pairwise(surface(face) for face in grid[:, j]):
                seam, (low, high) = knots(right)[0][0], (knots(right)[1][0], knots(right)[1][-1])
                for v in np.linspace(low, high, 41):
                    assert np.abs(jet(left, seam, v) - jet(right, seam, v))[kept].max() < 1e-10
        for lower, upper in (map(surface, row) for row in grid):
            seam, (low, high) = knots(upper)[1][0], (knots(upper)[0][0], knots(upper)[0][-1])
            for u in np.linspace(low, high, 41):
                assert np.abs(jet(lower, u, seam) - jet(upper, u, seam))[kept].max() < 1e-10

    def test_noise_bends_the_surface_more_than_the_truth_does(self):
        for name in ("panel", "panel_inside"):
            for rough, clean in zip(faces(name), faces("panel_clean"), strict=True):
                assert bending(surface(rough)) > 1.4 * bending(surface(clean))


class TestShell:
    def test_a_dozen_patches_smooth_across_seams(self):
        grid = np.array(faces("shell"), dtype=object).reshape(4, 3)
        for axis, lines in ((0, grid.T), (1, grid)):
            for one, other in (pair for line in lines for pair in pairwise(map(surface, line))):
                seam, (low, high) = knots(other)[axis][0], np.array(knots(other)[1 - axis])[[0, -1]]
                for along in np.linspace(low, high, 21):
                    at = (seam, along) if axis == 0 else (along, seam)
                    assert np.abs(jet(one, *at) - jet(other, *at)).max() < 1e-9

    def test_marks_and_an_emboss(self):
        u, v, poles = shell.shell_net()
        bare, truth = (single(sewn(cut(u, v, net, shell.PATCHES)), "truth") for net in (shell.shell_net(0.0)[2], poles))
        rough, plain, clean = (view(each).surfaces[4].net for each in (read_step(SAMPLES / "shell.step"), bare, truth))
        top = [shell.EMBOSS]
        assert np.linalg.norm(clean.evaluate(top) - plain.evaluate(top)) == pytest.approx(1.5, rel=0.02)
        assert np.std(rough.poles - clean.poles, axis=(0, 1))[:2] == pytest.approx(shell.NOISE, rel=0.1)
        assert np.std(rough.poles - clean.poles, axis=(0, 1))[2] == pytest.approx(shell.CHATTER / 2**0.5, rel=0.1)


class TestTrimmed:
    def test_freeform_top_with_a_hole(self):
        (top,) = faces("trimmed")
        assert len(parts(top, TopAbs_WIRE)) == 2
        assert len(faces("trimmed", Geom_CylindricalSurface)) == 2
        assert len(faces("trimmed", Geom_Plane)) == 4

    def test_one_side_runs_across_the_net(self):
        (top,) = faces("trimmed")
        u, v = knots(surface(top))
        across = []
        for edge in parts(top, TopAbs_EDGE):
            first, last = BRep_Tool.Range_s(TopoDS.Edge_s(edge))
            path = BRep_Tool.CurveOnSurface_s(TopoDS.Edge_s(edge), top, 0.0, 0.0)
            places = [path.Value(time) for time in np.linspace(first, last, 33)]
            gaps = [min(p.X() - u[0], u[-1] - p.X(), p.Y() - v[0], v[-1] - p.Y()) for p in places]
            across.append(max(gaps) > 1.0)
        assert sorted(across) == [False, False, False, True, True, True]

    def test_rough_at_one_percent_of_the_diagonal(self):
        (top,) = faces("trimmed")
        u, v = knots(surface(top))
        assert max(np.median(np.diff(u)), np.median(np.diff(v))) < 0.0135 * np.hypot(107.0, 52.0)
        assert np.std(np.diff(poles(surface(top))[..., 2], 2, axis=0)) > 0.05


class TestBottle:
    def test_truly_periodic(self):
        (wall,) = faces("bottle")
        on = surface(wall)
        assert on.IsUPeriodic()
        assert on.IsUClosed()
        assert not on.IsVPeriodic()
        assert set(multiplicities(on)[0]) == {1}

    def test_first_row_is_one_point_on_a_degenerate_edge(self):
        (wall,) = faces("bottle")
        net = poles(surface(wall))
        assert not np.ptp(net[:, 0], axis=0).any()
        assert not np.ptp(net[:, 1, 2])
        edges = [TopoDS.Edge_s(edge) for edge in parts(wall, TopAbs_EDGE)]
        assert sum(BRep_Tool.Degenerated_s(edge) for edge in edges) == 1
        assert sum(BRep_Tool.IsClosed_s(edge, wall) for edge in edges) == 1

    def test_ripples_on_the_side_only(self):
        (wall,) = faces("bottle")
        radius = np.hypot(*np.moveaxis(poles(surface(wall))[..., :2], -1, 0))
        spread = np.std(radius, axis=0)
        assert spread.max() > 0.04
        assert max(*spread[:6], *spread[-6:]) < 0.01


class TestBlade:
    def test_rational_degree_five_double_knots(self):
        skin = max((surface(face) for face in faces("blade")), key=lambda on: on.NbUPoles())
        assert (skin.UDegree(), skin.VDegree()) == (3, 5)
        assert skin.IsURational()
        assert skin.IsVRational()
        u, v = multiplicities(skin)
        assert u[1:-1].count(2) == 3
        assert v[1:-1].count(2) == 4
        assert set(u[1:-1]) | set(v[1:-1]) == {1, 2}

    def test_blunt_edge_and_flat_ends(self):
        assert len(faces("blade")) == 2
        assert len(faces("blade", Geom_Plane)) == 2


@dataclass
class Contents:
    """What an XCAF document says: where each part stands (mm), colours and layers by name."""

    names: set[str]
    places: dict[str, list[tuple[float, float, float]]]
    colours: dict[str, str]
    layers: dict[str, list[str]]


def labels(fill: Callable[[TDF_LabelSequence], object]) -> list[TDF_Label]:
    """The labels that a kernel function puts in a sequence."""
    sequence = TDF_LabelSequence()
    fill(sequence)
    return [sequence.Value(i) for i in range(1, sequence.Length() + 1)]


def called(label: TDF_Label) -> str:
    """The name of a label."""
    attribute = TDataStd_Name()
    assert label.IsAttribute(TDataStd_Name.GetID_s())
    label.FindAttribute(TDataStd_Name.GetID_s(), attribute)
    return attribute.Get().ToExtString()


def colour(label: TDF_Label) -> str:
    """The surface colour of a label."""
    found = Quantity_Color()
    assert XCAFDoc_ColorTool.GetColor_s(label, XCAFDoc_ColorSurf, found)
    return Quantity_Color.ColorToHex_s(found).ToCString()


@pytest.fixture(scope="module")
def assembly() -> Contents:
    """The assembly as the kernel alone reads it."""
    reader = STEPCAFControl_Reader()
    reader.SetNameMode(True)
    reader.SetColorMode(True)
    reader.SetLayerMode(True)
    document = TDocStd_Document(TCollection_ExtendedString("BinXCAF"))
    with quiet():
        assert reader.ReadFile(str(SAMPLES / "assembly.step")) == IFSelect_RetDone
        assert reader.Transfer(document)
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    made = Contents(set(), {}, {}, {})

    def walk(label: TDF_Label, place: TopLoc_Location) -> None:
        made.names.add(called(label))
        place = place.Multiplied(XCAFDoc_ShapeTool.GetLocation_s(label))
        if XCAFDoc_ShapeTool.IsReference_s(label):
            referred = TDF_Label()
            XCAFDoc_ShapeTool.GetReferredShape_s(label, referred)
            walk(referred, place)
        elif XCAFDoc_ShapeTool.IsAssembly_s(label):
            for component in labels(lambda found: XCAFDoc_ShapeTool.GetComponents_s(label, found, False)):
                walk(component, place)
        else:
            shift = place.Transformation().TranslationPart()
            made.places.setdefault(called(label), []).append((shift.X(), shift.Y(), shift.Z()))

    for label in labels(shapes.GetFreeShapes):
        walk(label, TopLoc_Location())
    for label in labels(shapes.GetShapes):
        if XCAFDoc_ShapeTool.IsSimpleShape_s(label):
            made.colours[called(label)] = colour(label)
            for part in labels(lambda found, label=label: XCAFDoc_ShapeTool.GetSubShapes_s(label, found)):
                on = BRep_Tool.Surface_s(TopoDS.Face_s(XCAFDoc_ShapeTool.GetShape_s(part)))
                made.colours[f"{called(label)}: {type(on).__name__}"] = colour(part)
    layers = XCAFDoc_DocumentTool.LayerTool_s(document.Main())
    for layer in labels(layers.GetLayerLabels):
        held = labels(lambda found, layer=layer: XCAFDoc_LayerTool.GetShapesOfLayer_s(layer, found))
        made.layers[called(layer)] = [called(label) for label in held]
    return made


class TestAssembly:
    def test_in_inches(self):
        text = (SAMPLES / "assembly.step").read_text()
        assert "CONVERSION_BASED_UNIT('INCH'" in text
        box = Bnd_Box()
        BRepBndLib.AddOptimal_s(read("assembly"), box, False, False)
        assert np.ptp(np.reshape(box.Get(), (2, 3)), axis=0)[:2] == pytest.approx([177.8, 101.6])

    def test_names_and_instances(self, assembly: Contents):
        assert assembly.names == {
            *("fixture", "base", "base plate", "locating pin", "pin"),
            *("pad pair", "front pair", "back pair", "pad left", "pad right", "pad"),
        }
        inches = {part: np.round(np.divide(places, 25.4), 9).tolist() for part, places in assembly.places.items()}
        assert inches == {
            "base plate": [[0.0, 0.0, 0.0]],
            "pad": [[1.0, 0.5, 0.5], [4.0, 0.5, 0.5], [1.0, 2.5, 0.5], [4.0, 2.5, 0.5]],
            "pin": [[3.5, 2.0, 0.5]],
        }

    def test_colours_of_parts_and_of_one_face(self, assembly: Contents):
        assert assembly.colours == {
            "base plate": "#00FF00",
            "pad": "#0000FF",
            "pad: Geom_BSplineSurface": "#FF0000",
            "pin": "#FFFF00",
        }

    def test_layer(self, assembly: Contents):
        assert assembly.layers == {"tooling": ["base plate"]}
