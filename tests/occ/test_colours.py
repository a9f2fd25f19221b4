"""Colours and transparency of single instances, in STEP and in every mesh format that has colours."""

import io
import json
import re
import zipfile
from collections import Counter

import numpy as np
import pytest
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from OCP.gp import gp_Trsf, gp_Vec
from OCP.Quantity import Quantity_Color, Quantity_ColorRGBA, Quantity_TOC_sRGB
from OCP.TDF import TDF_LabelSequence
from OCP.TopAbs import TopAbs_FACE
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.XCAFDoc import XCAFDoc_ColorType, XCAFDoc_DocumentTool, XCAFDoc_GraphNode

from mracad.occ.contents import contents
from mracad.occ.document import Document, empty
from mracad.occ.files import read, write
from mracad.occ.labels import components, labels, name_label
from mracad.occ.load import Text
from tests.occ import shapes

RED, GLASS, GREEN, BLUE = "#ff0000", "#ffff0080", "#00ff00", "#0000ff40"
FACES = 6


def at(x):
    move = gp_Trsf()
    move.SetTranslation(gp_Vec(x, 0, 0))
    return TopLoc_Location(move)


def colour(document, label, text):
    red, green, blue, alpha = (int((text + "ff")[i : i + 2], 16) / 255 for i in (1, 3, 5, 7))
    tool = XCAFDoc_DocumentTool.ColorTool_s(document.xcaf.Main())
    value = Quantity_ColorRGBA(Quantity_Color(red, green, blue, Quantity_TOC_sRGB), alpha)
    tool.SetColor(label, value, XCAFDoc_ColorType.XCAFDoc_ColorSurf)


@pytest.fixture(scope="module")
def document():
    """Two subassemblies of two red boxes with one green face; one box is glass in both, one blue in the first."""
    xcaf = empty()
    tool = XCAFDoc_DocumentTool.ShapeTool_s(xcaf.Main())
    made = Document(xcaf, "made.step")
    shape = BRepPrimAPI_MakeBox(1, 2, 3).Shape()
    box = tool.AddShape(shape, False)
    colour(made, box, RED)
    colour(made, tool.AddSubShape(box, TopExp_Explorer(shape, TopAbs_FACE).Current()), GREEN)
    sub, top = tool.NewShape(), tool.NewShape()
    plain, glass = (tool.AddComponent(sub, box, at(x)) for x in (0, 5))
    colour(made, glass, GLASS)
    first, second = (tool.AddComponent(top, sub, at(x)) for x in (0, 20))
    tool.UpdateAssemblies()
    path = TDF_LabelSequence()
    path.Append(first)
    path.Append(plain)
    assert tool.SetSHUO(path, XCAFDoc_GraphNode())
    (found,) = shuo(first)
    colour(made, found, BLUE)
    for label, name in ((box, "box"), (sub, "sub"), (top, "top"), (plain, "plain"), (glass, "glass")):
        name_label(label, name)
    for label, name in ((first, "first"), (second, "second")):
        name_label(label, name)
    return made


def shuo(label):
    from OCP.TDF import TDF_AttributeSequence
    from OCP.XCAFDoc import XCAFDoc_ShapeTool

    found = TDF_AttributeSequence()
    XCAFDoc_ShapeTool.GetAllComponentSHUO_s(label, found)
    return [found.Value(i).Label() for i in range(1, found.Length() + 1)]


#: of the faces of all four boxes
EXPECTED = Counter({GREEN: 4, GLASS: 2 * (FACES - 1), BLUE: FACES - 1, RED: FACES - 1})


def test_every_instance_has_its_colour(document):
    from mracad.occ.scene import scene

    for each, blue in ((document, BLUE), (again(document), BLUE[:7])):
        bodies = list(scene(each)[0].placed())
        found = Counter(text for body in bodies for text in body.colours)
        assert found == Counter({blue if text == BLUE else text: count for text, count in EXPECTED.items()})
        where = {body.colours[-1]: round(float(body.points[:, 0].min())) for body in bodies}
        assert where[blue] == 0 and where[RED] == 20
        assert len(scene(each)[0].bodies) == 3


def again(document):
    return read(Text(written(document, "step"), "again.step"))


def written(document, format):
    stream = io.BytesIO()
    write(document, stream, format)
    return stream.getvalue()


def test_transparency_survives_step(document):
    (lost,) = write(document, io.BytesIO(), "step").lost  # but for the one that the kernel writes without
    assert (lost.what, lost.stated) == ("transparencies", 1)
    once = again(document)
    assert write(once, io.BytesIO(), "step").lost == ()
    twice = again(once)
    assert {text for _, _, text in contents(once).colours} >= {RED, GLASS, GREEN}
    assert contents(twice).colours == contents(once).colours
    assert written(once, "step").count(b"SURFACE_STYLE_TRANSPARENT(") == written(twice, "step").count(
        b"SURFACE_STYLE_TRANSPARENT("
    )


def test_colours_reach_every_format_that_has_them(document):
    counts = Counter()
    content = json.loads(written(document, "gltf"))
    uses = Counter(node["mesh"] for node in content["nodes"] if "mesh" in node)
    for mesh, count in uses.items():
        for primitive in content["meshes"][mesh]["primitives"]:
            counts[content["materials"][primitive["material"]]["name"]] += count
    assert counts == EXPECTED
    model = zipfile.ZipFile(io.BytesIO(written(document, "3mf"))).read("3D/3dmodel.model").decode()
    shades = re.findall('displaycolor="(#[0-9A-F]{8})"', model)
    assert {shade.lower().removesuffix("ff") for shade in shades} >= {RED, GREEN}
    assert {GLASS, BLUE} <= {shade.lower() for shade in shades}
    used = Counter(shades[int(place)].lower() for place in re.findall(' p1="([0-9]+)"', model))
    assert used[GLASS] == used[BLUE] == 2 * (FACES - 1)  # triangles; a body that stands twice is there once
    head, body = written(document, "ply").split(b"end_header\n")
    points = int(re.search(rb"element vertex (\d+)", head)[1])
    layout = np.dtype([("count", "u1"), ("corners", "<i4", 3), ("face", "<i4"), ("colour", "u1", 4)])
    table = np.frombuffer(body[24 * points :], layout)
    seen = Counter("#" + bytes(row.tolist()).hex().removesuffix("ff") for row in table["colour"])
    assert seen == Counter({text: 2 * count for text, count in EXPECTED.items()})
    lines = [line.split()[1:] for line in written(document, "obj").decode().splitlines() if line.startswith("v ")]
    assert len(lines) == 4 * 8 and {len(line) for line in lines} == {7}
    corners = Counter(tuple(round(float(x) * 255) for x in line[3:]) for line in lines)
    assert corners[0, 0, 255, 0x40] >= 4 and corners[255, 255, 0, 0x80] >= 8 and corners[255, 0, 0, 255] >= 4


def test_an_uncoloured_model_has_plain_points():
    made = shapes.document(BRepPrimAPI_MakeBox(1, 2, 3).Shape(), names={0: "box"})
    lines = [line for line in written(made, "obj").decode().splitlines() if line.startswith("v ")]
    assert {len(line.split()) for line in lines} == {4}
    opaque = shapes.document(BRepPrimAPI_MakeBox(1, 2, 3).Shape(), colours={0: RED})
    lines = [line for line in written(opaque, "obj").decode().splitlines() if line.startswith("v ")]
    assert {tuple(line.split()[4:]) for line in lines} == {("1", "0", "0")}
    assert not list(components(next(labels(made.shape_tool.GetShapes))))
