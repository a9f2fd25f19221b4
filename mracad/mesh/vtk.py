"""VTK's XML files: all instances in place, mm, as polygons (VTP) or as a grid of triangles (VTU).

https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html: arrays are compressed by zlib, in base64.
"""

from __future__ import annotations

import base64
import zlib

import numpy as np

from mracad.mesh.scene import GREY, Scene, rgba
from mracad.version import __version__

Array = np.ndarray
_TYPES = {"f4": "Float32", "f8": "Float64", "i4": "Int32", "i8": "Int64", "u1": "UInt8"}
_TRIANGLE = 5


def write(scene: Scene, grid: bool = False) -> bytes:
    """A scene as VTP, or as VTU: faces of triangles, and at points numbers and normals where the scene has any."""
    bodies = list(scene.placed())
    points = np.concatenate([body.points for body in bodies])
    before = np.cumsum([0, *(len(body.points) for body in bodies)])
    corners = np.concatenate([body.corners + first for body, first in zip(bodies, before, strict=False)])
    cells = [_array("face", np.concatenate([body.numbers for body in bodies]).astype("i4"))]
    shown = []
    if scene.legends:
        places = [body.places for body in bodies if body.places is not None]
        for legend in scene.legends:
            values = np.concatenate([each.values[legend.name] for each in places])
            shown.append(_array(legend.name, values.astype("f8"), legend.unit))
        shown.append(_array("normals", np.concatenate([each.normals for each in places]).astype("f4")))
    else:
        looks = [np.array([rgba(c or GREY) for c in body.colours], np.uint8)[body.faces] for body in bodies]
        cells.append(_array("colour", np.concatenate(looks)))
    ends = _array("offsets", 3 * np.arange(1, len(corners) + 1, dtype="i8"))
    listed = [_array("connectivity", corners.ravel().astype("i8")), ends]
    kind, topology, count = ("UnstructuredGrid", "Cells", "Cells") if grid else ("PolyData", "Polys", "Polys")
    if grid:
        listed.append(_array("types", np.full(len(corners), _TRIANGLE, np.uint8)))
    active = f' Scalars="{scene.legends[0].name}" Normals="normals"' if scene.legends else ""
    lines = [
        '<?xml version="1.0"?>',
        f"<!-- mracad {__version__}, millimetres{''.join(f'; {each.key}' for each in scene.legends[:1])} -->",
        f'<VTKFile type="{kind}" version="1.0" byte_order="LittleEndian" header_type="UInt64" '
        'compressor="vtkZLibDataCompressor">',
        f"<{kind}>",
        f'<Piece NumberOfPoints="{len(points)}" NumberOf{count}="{len(corners)}">',
        f"<PointData{active}>", *shown, "</PointData>",
        '<CellData Scalars="face">', *cells, "</CellData>",
        "<Points>", _array("points", points.astype("f8")), "</Points>",
        f"<{topology}>", *listed, f"</{topology}>",
        "</Piece>", f"</{kind}>", "</VTKFile>", "",
    ]  # fmt: skip
    return "\n".join(lines).encode()


def _array(name: str, values: Array, unit: str = "") -> str:
    """An array with its unit, if it has one."""
    data = values.tobytes()
    packed = zlib.compress(data)
    head = np.array([1, len(data), 0, len(packed)], "<u8").tobytes()  # one block, which is full
    told = f'<InformationKey name="UNITS_LABEL" location="vtkDataArray">{unit}</InformationKey>' if unit else ""
    wide = f' NumberOfComponents="{values.shape[1]}"' if values.ndim > 1 else ""
    start = f'<DataArray type="{_TYPES[values.dtype.str[1:]]}" Name="{name}"{wide} format="binary">'
    return f"{start}{base64.b64encode(head).decode()}{base64.b64encode(packed).decode()}{told}</DataArray>"
