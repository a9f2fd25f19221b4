"""The content of a model, as JSON-ready values and as lines of text."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from mracad_cli.render import json, text

if TYPE_CHECKING:
    import numpy as np

    from mracad.inspect.scales import FaceScales
    from mracad.inspect.seams import SeamMeasure
    from mracad.job.info import Info
    from mracad.model.brep import Face, Model
    from mracad.model.facts import Mass, Spot


def body(seen: Info) -> dict[str, Any]:
    """Everything, as JSON-ready values; lengths in millimetres."""
    from mracad.inspect.seams import summary
    from mracad.occ.boxes import face_boxes
    from mracad.occ.instance import instances

    model = seen.model
    return {
        "file": model.name,
        "unit": model.unit,
        "schema": model.schema,
        "products": list(model.products),
        "instances": list(instances(seen.document)),
        "diagonal": model.diagonal,
        "scale": seen.width,
        "faces": [
            {**_facts(model, face, own), **_size(*size), **_judged(face, seen.scales.get(face.index))}
            for face, own, size in zip(model.faces, face_boxes(seen.document, model), seen.sizes, strict=True)
        ],
        "places": [_place(each) for each in seen.spots],
        "seams": {**json.plain(summary(seen.seams)), "each": [json.seam(m) for m in seen.seams]},
        "valid": json.validity(seen.valid),
    }


def summary(seen: Info, everything: bool = False) -> list[str]:
    """The content in a few lines; with ``everything`` also instances."""
    from mracad.inspect.seams import summary as totals
    from mracad.occ.instance import instances

    model, kinds = seen.model, Counter(face.kind for face in seen.model.faces)
    said = [f"{model.name}: {model.schema or 'unknown schema'}, unit {model.unit}, diagonal {text.mm(model.diagonal)}"]
    if model.products:
        said.append(f"products: {len(model.products)}: {', '.join(name or '(no name)' for name in model.products)}")
    if everything:
        said += [f"  {path}" for path in instances(seen.document)]
    said.append(f"faces: {len(model.faces)}: " + ", ".join(f"{n} {kind}" for kind, n in kinds.most_common()))
    said.append(text.seam_line(totals(seen.seams)))
    return [
        *said,
        f"valid: {text.verdict(seen.valid.valid)}",
        *(f"  {failure}" for failure in seen.valid.failures[:10]),
    ]


def lines(seen: Info, everything: bool) -> list[str]:
    """A summary, and the NURBS faces; with ``everything`` also instances, other faces and every seam."""
    from mracad.occ.boxes import face_boxes

    model, said = seen.model, summary(seen, everything)
    shown = [face for face in model.faces if everything or face.surface is not None]
    if shown:
        said.append(f"detail below {text.mm(seen.width)}, free with all edges held at {seen.keep.upper()}")
        head = ["face", "type", "degree", "net", "shape", "free", "spans mm", "at this scale", "from", "name"]
        said += _table([head, *(_row(model, face, seen.scales.get(face.index)) for face in shown)])
    if everything and seen.sizes:
        head = ["face", "area mm²", "centre", "box", "u runs along"]
        boxes = face_boxes(seen.document, model)
        said += _table([head, *(_size_row(i, *seen.sizes[i], box) for i, box in enumerate(boxes))])
    if everything and seen.seams:
        head = ["edge", "faces", "gap mm", "angle °", "curvature jump 1/mm", "relative", "at"]
        said += _table([head, *map(_seam_row, seen.seams)])
    for each in seen.spots:
        said += _spot_lines(model.faces[each.face], each)
    return said


def _size(mass: Mass, middle: Spot) -> dict[str, Any]:
    """Area and centre of a face (mm), and the direction of u in the middle of its parameters."""
    along = None if middle.along is None else middle.along.tolist()
    return {"area": mass.area, "centre": list(mass.centre), "along_u": along}


def _size_row(index: int, mass: Mass, middle: Spot, box: np.ndarray) -> Sequence[str]:
    low, high = box
    along = "" if middle.along is None else _vector(middle.along)
    return f"#{index + 1}", f"{mass.area:.6g}", _vector(mass.centre), f"{_vector(low)} to {_vector(high)}", along


def _place(spot: Spot) -> dict[str, Any]:
    """A place on a face; lengths in millimetres, curvatures in 1/mm, positive where convex."""
    ways = {"normal": spot.normal, "along_u": spot.along}
    return {
        "face": spot.face + 1,
        "uv": list(spot.uv),
        "point": spot.point.tolist(),
        "distance": spot.distance,
        **{name: None if way is None else way.tolist() for name, way in ways.items()},
        "curvature": [{"value": k, "along": way.tolist()} for k, way in spot.bends],
    }


def _spot_lines(face: Face, spot: Spot) -> list[str]:
    u, v = spot.uv
    said = [
        f"#{spot.face + 1} ({face.kind}) at u {u:.6g}, v {v:.6g}: {_vector(spot.point)}, {text.mm(spot.distance)} away"
    ]
    ways = {"normal": spot.normal, "u runs along": spot.along}
    frame = [f"{name} {_vector(way)}" for name, way in ways.items() if way is not None]
    bends = [f"{k:.4g} 1/mm along {_vector(way)}" if k else "0" for k, way in spot.bends]
    curvature = f"curvature {' and '.join(bends)}" if bends else "no curvature there"
    return [*said, "  " + "; ".join([*frame, curvature])]


def _vector(values: Sequence[float] | np.ndarray) -> str:
    return ",".join(f"{round(float(x), 6) + 0.0:.6g}" for x in values)


def _seam_row(m: SeamMeasure) -> Sequence[str]:
    return (
        f"edge#{m.edge + 1}" + ("" if m.sewn else " (not sewn)"),
        "#{} #{}".format(*(i + 1 for i in m.faces)),
        f"{m.gap:.2g}",
        f"{m.angle:.3g}",
        f"{m.bend:.2g}",
        f"{m.relative_bend:.2g}",
        " ".join(f"{x:.4g}" for x in m.where),
    )


def _facts(model: Model, face: Face, box: np.ndarray) -> dict[str, Any]:
    """Type, net and bounding box of a face; lengths in millimetres."""
    facts: dict[str, Any] = {
        "face": face.index + 1,
        "name": face.name,
        "product": face.product,
        "colour": face.colour,
        "kind": face.kind,
        "instances": face.instances,
        "box": box.tolist(),
    }
    if face.surface is not None:
        net = model.surfaces[face.surface].net
        facts |= {
            "degree": [net.u.degree, net.v.degree],
            "net": list(net.poles.shape[:2]),
            "rational": net.weights is not None,
            "periodic": [net.u.periodic, net.v.periodic],
            "shared": len(model.surfaces[face.surface].faces) > 1,
        }
    return facts


def _judged(face: Face, scales: FaceScales | None) -> dict[str, Any]:
    """Whether smoothing at the given scale would change a face, and the detail that it would remove."""
    status, reason = _status(face, scales)
    return {
        "smoothing": status,
        "reason": reason,
        "detail": scales.detail if scales else 0.0,
        "free_poles": scales.free if scales else 0,
        "visible_poles": scales.points if scales else 0,
        "spans": list(scales.spans) if scales else [0.0, 0.0],
        "shortest_wavelength": scales.first if scales else 0.0,
        "crease_lines": scales.creases if scales else 0,
    }


def _status(face: Face, scales: FaceScales | None) -> tuple[str, str]:
    """Whether smoothing at the given scale would change a face, as one word, and the reason if not."""
    from mracad.inspect.scales import LEAST

    if scales is None:
        return "analytic", f"{face.kind}, not a NURBS face"
    if scales.detail <= LEAST:
        return "unchanged", "no waves below the scale" if scales.first else "no waves"
    return "changes", ""


def _row(model: Model, face: Face, scales: FaceScales | None) -> Sequence[str]:
    name = face.name or face.product
    status, reason = _status(face, scales)
    if scales is None or face.surface is None:
        return f"#{face.index + 1}", face.kind, "", "", "", "", "", reason, "", name
    net = model.surfaces[face.surface].net
    shape = [
        word
        for word, true in (
            ("rational", net.weights is not None),
            ("periodic", net.u.periodic or net.v.periodic),
            (f"{scales.creases} crease lines", scales.creases),
        )
        if true
    ]
    change = f"changes by {scales.detail:.2g} mm rms"
    return (
        f"#{face.index + 1}",
        face.kind,
        f"{net.u.degree}x{net.v.degree}",
        "x".join(map(str, net.poles.shape[:2])),
        " ".join(shape),
        f"{scales.free}/{scales.points}",
        f"{scales.spans[0]:.3g}–{scales.spans[1]:.3g}",
        change if status == "changes" else reason,
        f"{scales.first:.3g} mm" if scales.first else "never",
        name,
    )


def _table(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows as lines with aligned columns."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
