"""Mesh formats, read back by trimesh and VTK: two pyramids of one part, one mirrored, under names that are hostile."""

import base64
import io
import json
import re
import zipfile
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from lxml import etree
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkDataArray

from mracad.mesh import Body, Node, Scene, write
from mracad.mesh.scene import Legend, Places
from tests.mesh import readers

POINTS = np.array([[0, 0, 0], [3, 0, 0], [3, 3, 0], [0, 3, 0], [1.5, 1.5, 2]])
CORNERS = np.array([[0, 2, 1], [0, 3, 2], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
FACES = np.array([0, 0, 1, 2, 3, 4])
NAME = 'a<b>"&\n\x01#../é'
VOLUME = 6.0  # of one


def scene(closed=True):
    keep = slice(None) if closed else slice(2, None)
    labels = tuple(f"#{i + 5} {NAME}" for i in range(5))
    colours = ("#ff0000", "", "", "#00ff0080", "")
    body = Body(NAME, POINTS, CORNERS[keep], FACES[keep], labels, colours)
    mirrored = np.diag([-1.0, 1, 1, 1])
    mirrored[:3, 3] = 10, 20, 30
    group = Node(NAME, mirrored, None, (Node("", np.eye(4), 0),))
    return Scene("pyramids.step", (body,), (Node("one", np.eye(4), 0), group))


@pytest.mark.parametrize(
    ("format", "unit"),
    [("stl", 1.0), ("3mf", 1.0), ("obj", 1.0), ("ply", 1.0), ("gltf", 1e-3), ("glb", 1e-3), ("vtp", 1.0), ("vtu", 1.0)],
)
@pytest.mark.parametrize("made", [scene, lambda: painted()], ids=["plain", "with numbers"])
def test_closed_bodies_stay_closed_where_they_stand(format, unit, made):
    mesh = readers.scene(write(made(), format), format).to_mesh()
    mesh.merge_vertices()
    assert len(mesh.faces) == 12 and mesh.is_watertight and mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(2 * VOLUME * unit**3, rel=1e-6)
    low, high = np.array([[0, 0, 0], [10, 23, 32]]) * unit
    if unit != 1.0:  # Y up
        low, high = np.array([0, 0, -23]) * unit, np.array([10, 32, 0]) * unit
    assert mesh.bounds == pytest.approx(np.array([low, high]), abs=1e-6 * unit)


def painted():
    """The scene with the face's number as the number of its points, its colours shades of red, and a normal each."""
    plain = scene()
    (body,) = plain.bodies
    corners = np.arange(18).reshape(6, 3)  # a place for each corner
    face = np.repeat(FACES, 3)
    normals = np.tile([0.0, 0.6, 0.8], (18, 1))
    colours = np.stack([40 * face, 0 * face, 0 * face], axis=1).astype(np.uint8)
    places = Places(CORNERS.ravel(), np.zeros((18, 2)), corners, {"height": 1.0 + face}, normals, colours)
    legend = Legend("height", "height over all", "mm", -6.0, 6.0, 1.0, 5.0)
    return Scene(plain.name, (replace(body, places=places),), plain.roots, (legend,))


@pytest.mark.parametrize("format", ["ply", "glb", "gltf", "vtp", "vtu"])
def test_numbers_at_points_differ_between_faces(format):
    found = readers.arrays(write(painted(), format), format)["height"]
    copies = 1 if format.startswith("gl") else 2
    assert found.tolist() == np.tile(1.0 + np.repeat(FACES, 3), copies).tolist()


@pytest.mark.parametrize("format", ["vtp", "vtu"])
def test_vtk_files_have_units_normals_and_faces(format):
    found = readers.vtk(write(painted(), format), format)
    points, cells = found.GetPointData(), found.GetCellData()
    assert points.GetScalars().GetName() == "height"
    assert points.GetScalars().GetInformation().Get(vtkDataArray.UNITS_LABEL()) == "mm"
    normals = vtk_to_numpy(points.GetNormals())
    assert normals[0] == pytest.approx([0, 0.6, 0.8]) and normals[-1] == pytest.approx([0, 0.6, 0.8])
    assert vtk_to_numpy(cells.GetArray("face")).tolist() == [5, 5, 6, 7, 8, 9] * 2
    bare = readers.vtk(write(scene(), format), format)
    assert bare.GetNumberOfPoints() == 10 and not bare.GetPointData().GetNumberOfArrays()
    assert vtk_to_numpy(bare.GetCellData().GetArray("colour"))[4].tolist() == [0, 255, 0, 128]


def test_3mf_colours_corners_of_a_closed_mesh():
    model = zipfile.ZipFile(io.BytesIO(write(painted(), "3mf"))).read("3D/3dmodel.model")
    root = etree.fromstring(model)
    core, materials = root.nsmap[None], root.nsmap["m"]
    shades = [each.get("color") for each in root.iter(f"{{{materials}}}color")]
    corners = [[shades[int(t.get(p))] for p in ("p1", "p2", "p3")] for t in root.iter(f"{{{core}}}triangle")]
    assert corners == [[f"#{40 * face:02X}0000"] * 3 for face in FACES]
    assert len(list(root.iter(f"{{{core}}}vertex"))) == 5 and b'type="model"' in model
    assert b"colours: height over all from -6 to 6 mm" in model


def test_ply_and_gltf_have_colours_and_say_what_they_are():
    data = write(painted(), "ply")
    assert b"comment height: height over all, mm\ncomment colours: height over all from -6 to 6 mm\n" in data
    table = readers.arrays(data, "ply")
    assert table["red"][:18].tolist() == (40 * np.repeat(FACES, 3)).tolist()
    assert table["nz"] == pytest.approx(0.8)
    content = json.loads(write(painted(), "gltf"))
    scalars = content["scenes"][0]["extras"]
    assert scalars["scalars"] == {"_HEIGHT": {"title": "height over all", "unit": "mm"}}
    attributes = content["meshes"][0]["primitives"][0]["attributes"]
    assert set(attributes) == {"POSITION", "NORMAL", "COLOR_0", "_HEIGHT"}
    accessor = content["accessors"][attributes["COLOR_0"]]
    assert (accessor["type"], accessor["normalized"]) == ("VEC4", True)
    view = content["bufferViews"][accessor["bufferView"]]
    buffer = base64.b64decode(content["buffers"][0]["uri"].partition(",")[2])
    light = np.frombuffer(buffer[view["byteOffset"] :], "<u2", 72).reshape(18, 4) / 65535
    assert light[-1] == pytest.approx([((160 / 255 + 0.055) / 1.055) ** 2.4, 0, 0, 1], abs=1e-4), "linear, not sRGB"


@pytest.mark.parametrize("format", ["stl", "3mf", "obj", "ply", "gltf", "glb", "vtp", "vtu"])
def test_the_same_bytes(format):
    assert write(scene(), format) == write(scene(), format)


def test_3mf_holds_faces_colours_and_the_tree():
    with zipfile.ZipFile(io.BytesIO(write(scene(), "3mf"))) as archive:
        assert archive.testzip() is None and archive.namelist()[0] == "[Content_Types].xml"
        root = etree.fromstring(archive.read("3D/3dmodel.model"))
    core, sets = root.nsmap[None], root.nsmap["t"]
    body, group = root.iter(f"{{{core}}}object")
    assert body.get("type") == "model" and body.get("name") == NAME.replace("\x01", "")
    ranges = [(r.get("startindex"), r.get("endindex")) for r in root.iter(f"{{{sets}}}refrange")]
    assert ranges == [("0", "1"), ("2", "2"), ("3", "3"), ("4", "4"), ("5", "5")]
    assert [s.get("identifier") for s in root.iter(f"{{{sets}}}triangleset")] == [f"face{i}" for i in range(5, 10)]
    bases = [base.get("displaycolor") for base in root.iter(f"{{{core}}}base")]
    coloured = [bases[int(t.get("p1"))] if t.get("p1") else None for t in root.iter(f"{{{core}}}triangle")]
    assert coloured == ["#FF0000FF", "#FF0000FF", None, None, "#00FF0080", None]
    assert [c.get("objectid") for c in group.iter(f"{{{core}}}component")] == [body.get("id")]
    assert [i.get("objectid") for i in root.iter(f"{{{core}}}item")] == [body.get("id"), group.get("id")]
    opened = zipfile.ZipFile(io.BytesIO(write(scene(closed=False), "3mf"))).read("3D/3dmodel.model")
    assert b'type="surface"' in opened


def test_obj_groups_its_faces_and_names_write_no_lines():
    text = write(scene(), "obj").decode()
    assert {line.split(" ")[0] for line in text.splitlines()} == {"#", "o", "v", "g", "f"}
    groups = re.findall(r"^g (face\d+)", text, re.MULTILINE)
    assert groups == [f"face{i}" for i in range(5, 10)] * 2
    assert text.count("\nv ") == 10 and text.count("\nf ") == 12


def test_ply_holds_faces_and_colours():
    data = write(scene(), "ply")
    head, body = data.split(b"end_header\n")
    assert b"element vertex 10" in head and b"element face 12" in head
    layout = np.dtype([("count", "u1"), ("corners", "<i4", 3), ("face", "<i4"), ("colour", "u1", 4)])
    table = np.frombuffer(body[10 * 24 :], layout)
    assert table["face"].tolist() == [5, 5, 6, 7, 8, 9] * 2
    assert table["colour"][[0, 4]].tolist() == [[255, 0, 0, 255], [0, 255, 0, 128]]
    assert np.array_equal(np.frombuffer(body[: 5 * 24], "<f8").reshape(-1, 3), POINTS)


def test_gltf_holds_faces_colours_and_the_tree():
    content = json.loads(write(scene(), "gltf"))
    (mesh,) = content["meshes"]
    assert [p["extras"]["face"].split(" ")[0] for p in mesh["primitives"]] == [f"#{i}" for i in range(5, 10)]
    assert len({p["attributes"]["POSITION"] for p in mesh["primitives"]}) == 1
    shades = [content["materials"][p["material"]] for p in mesh["primitives"]]
    assert shades[0]["pbrMetallicRoughness"]["baseColorFactor"] == [1, 0, 0, 1]
    assert shades[3]["alphaMode"] == "BLEND" and shades[1]["name"] == "#b3b3b3"
    assert [node.get("mesh") for node in content["nodes"]] == [0, 0, None, None]
    assert content["nodes"][2]["children"] == [1] and content["nodes"][3]["children"] == [0, 2]
    for view in content["bufferViews"]:
        assert (
            view["byteOffset"] % 4 == 0
            and view["byteOffset"] + view["byteLength"] <= content["buffers"][0]["byteLength"]
        )


def test_text_stl_says_the_same():
    text = write(scene(), "stl", ascii=True).decode()
    assert text.startswith("solid mracad\n") and text.count("facet normal") == 12
    found = trimesh.load_mesh(io.BytesIO(text.encode()), file_type="stl_ascii")
    assert found.volume == pytest.approx(2 * VOLUME, rel=1e-6)
