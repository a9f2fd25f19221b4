"""3MF: objects, components and colours, in mm; the triangles of a face are a named triangle set.

Core specification 1.3 with the triangle sets extension of 2021/07, https://github.com/3MFConsortium.  Where the scene
has numbers at points, the corners of triangles have their colours, in a colour group of the materials extension.
"""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Iterator
from xml.sax.saxutils import quoteattr

import numpy as np

from mracad.mesh.scene import Body, Node, Scene, rgba
from mracad.version import __version__

Array = np.ndarray
_TYPES = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">\n'
    ' <Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>\n'
    ' <Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>\n'
    "</Types>\n"
)
_RELATIONS = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">\n'
    ' <Relationship Target="/3D/3dmodel.model" Id="rel0" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>\n'
    "</Relationships>\n"
)
_HEAD = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<model unit="millimeter" xml:lang="en-US" '
    'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" '
    'xmlns:t="http://schemas.microsoft.com/3dmanufacturing/trianglesets/2021/07"'
)
_MATERIALS = ' xmlns:m="http://schemas.microsoft.com/3dmanufacturing/material/2015/02"'
_FORBIDDEN = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff]")
_COLOURS = 1  # number of the resource with the colours


def write(scene: Scene) -> bytes:
    """A scene as 3MF, with reproducible bytes."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for path, text in (
            ("[Content_Types].xml", _TYPES), ("_rels/.rels", _RELATIONS), ("3D/3dmodel.model", _model(scene)),
        ):  # fmt: skip
            entry = zipfile.ZipInfo(path)  # dated 1980
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, text.encode())
    return packed.getvalue()


def _model(scene: Scene) -> str:
    colours = list(dict.fromkeys(colour for body in scene.bodies for colour in body.colours if colour))
    shades = np.unique(np.concatenate([_shades(body) for body in scene.bodies]))
    lines = [f"{_HEAD}{_MATERIALS if len(shades) else ''}>"]
    lines += [f' <metadata name="Description">{each.key}</metadata>' for each in scene.legends[:1]]
    lines += [f' <metadata name="Application">mracad {__version__}</metadata>', " <resources>"]
    if len(shades):
        lines.append(f'  <m:colorgroup id="{_COLOURS}">')
        lines += [f'   <m:color color="#{shade:06X}"/>' for shade in shades.tolist()]
        lines.append("  </m:colorgroup>")
    elif colours:
        lines.append(f'  <basematerials id="{_COLOURS}">')
        for colour in colours:
            display = "#" + bytes(rgba(colour)).hex().upper()
            lines.append(f'   <base name="{colour}" displaycolor="{display}"/>')
        lines.append("  </basematerials>")
    place = {colour: number for number, colour in enumerate(colours)}
    for number, body in enumerate(scene.bodies):
        lines += _object(_COLOURS + 1 + number, body, _looks(body, place, shades))
    groups: list[str] = []
    items = [_reference("item", node, scene, groups) for node in scene.roots]
    lines += [*groups, " </resources>", " <build>", *(f"  {item}" for item in items), " </build>", "</model>", ""]
    return "\n".join(lines)


def _shades(body: Body) -> Array:
    """The colours of the places of a body as numbers, 0xRRGGBB."""
    if body.places is None:
        return np.zeros(0, int)
    return np.asarray(body.places.colours @ np.array([1 << 16, 1 << 8, 1]))


def _looks(body: Body, place: dict[str, int], shades: Array) -> list[str]:
    """The colours of triangles, as attributes: one each, or one of ``shades`` for each corner."""
    if len(shades) and body.places is not None:
        corners = np.searchsorted(shades, _shades(body))[body.places.corners].tolist()
        return [f' pid="{_COLOURS}" p1="{p}" p2="{q}" p3="{r}"' for p, q, r in corners]
    own = [f' pid="{_COLOURS}" p1="{place[colour]}"' if colour else "" for colour in body.colours]
    return [own[face] for face in body.faces.tolist()]


def _object(number: int, body: Body, looks: list[str]) -> Iterator[str]:
    """A body as a mesh, with the attributes of its triangles."""
    ends = np.sort(np.concatenate([body.corners[:, [i, (i + 1) % 3]] for i in range(3)]), axis=1)
    closed = (np.unique(ends, axis=0, return_counts=True)[1] == 2).all()
    kind = "model" if closed else "surface"
    yield f'  <object id="{number}" type="{kind}" name={_quoted(body.name or "part")}>'
    yield "   <mesh>\n    <vertices>"
    for x, y, z in body.points.tolist():
        yield f'     <vertex x="{x!r}" y="{y!r}" z="{z!r}"/>'
    yield "    </vertices>\n    <triangles>"
    for (a, b, c), look in zip(body.corners.tolist(), looks, strict=True):
        yield f'     <triangle v1="{a}" v2="{b}" v3="{c}"{look}/>'
    yield "    </triangles>\n    <t:trianglesets>"
    for face, triangles in body.groups():
        label = body.labels[face]
        yield f'     <t:triangleset name={_quoted(label)} identifier="face{label.partition(" ")[0][1:]}">'
        yield f'      <t:refrange startindex="{triangles.start}" endindex="{triangles.stop - 1}"/>'
        yield "     </t:triangleset>"
    yield "    </t:trianglesets>\n   </mesh>\n  </object>"


def _reference(tag: str, node: Node, scene: Scene, groups: list[str]) -> str:
    """An element that places the content of a node; objects with components are added to ``groups``."""
    if node.body is not None:
        number = _COLOURS + 1 + node.body
    else:
        parts = [_reference("component", child, scene, groups) for child in node.children]
        number = _COLOURS + 1 + len(scene.bodies) + len(groups)
        head = f'  <object id="{number}" type="model" name={_quoted(node.name or "assembly")}>'
        parts = ["   <components>", *(f"    {part}" for part in parts), "   </components>"]
        groups.append("\n".join([head, *parts, "  </object>"]))
    frame = " ".join(map(repr, node.frame[:3].T.ravel().tolist()))
    return f'<{tag} objectid="{number}" transform="{frame}"/>'


def _quoted(name: str) -> str:
    return quoteattr(_FORBIDDEN.sub("", name))
