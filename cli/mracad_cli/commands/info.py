"""Say what is in a model: units, products, faces, scales, seams, validity."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import click

from mracad_cli import options, render
from mracad_cli.progress import Progress

if TYPE_CHECKING:
    from mracad.edit.result import FaceOutcome
    from mracad.model import Face, Model


@click.command(help=__doc__)
@options.apply(
    options.reading,
    click.option(
        "--scale", metavar="LENGTH", default="2%", show_default=True, help="Scale at which to judge smoothing."
    ),
    click.option(
        "--keep",
        type=click.Choice(["g0", "g1", "g2"]),
        default="g1",
        show_default=True,
        help="Continuity that smoothing would keep; it decides which poles are free.",
    ),
    click.option(
        "--all",
        "everything",
        is_flag=True,
        help="List the instances, the faces that are not NURBS and every seam, too.",
    ),
    options.printing,
)
def command(source: str, input_unit: str | None, scale: str, keep: Any, everything: bool, as_json: bool) -> int:
    from mracad.audit.continuity import seams, summary
    from mracad.edit.smooth import smooth
    from mracad.occ.check import check
    from mracad.occ.instance import instances
    from mracad.occ.view import view
    from mracad.options import Smooth, length
    from mracad_cli.files import read

    with Progress() as progress:
        progress("reading", 0, 1)
        document = read(source, input_unit)
        model = view(document)
        outcomes = smooth(
            model,
            Smooth(scale=scale, keep=keep),
            progress=lambda done, total: progress("looking at faces", done, total),
        ).outcomes
        measures = seams(model)
        progress("checking", 0, 1)
        valid = check(document)
    width = length(scale, model.diagonal, "scale")
    if as_json:
        body = {
            "file": model.name,
            "unit": model.unit,
            "schema": model.schema,
            "products": list(model.products),
            "instances": list(instances(document)),
            "diagonal": model.diagonal,
            "scale": width,
            "faces": [{**_facts(model, f), **_judged(o)} for f, o in zip(model.faces, outcomes, strict=True)],
            "seams": {**render.plain(summary(measures)), "each": [render.seam(m) for m in measures]},
            "valid": render.validity(valid),
        }
        print(render.json_text(body))
        return 0
    kinds = Counter(face.kind for face in model.faces)
    print(f"{model.name}: {model.schema or 'unknown schema'}, unit {model.unit}, diagonal {render.mm(model.diagonal)}")
    if model.products:
        print(f"products: {len(model.products)}: {', '.join(name or '(no name)' for name in model.products)}")
    if everything:
        print(*(f"  {path}" for path in instances(document)), sep="\n")
    print(f"faces: {len(model.faces)}: " + ", ".join(f"{n} {kind}" for kind, n in kinds.most_common()))
    print(render.seam_line(summary(measures)))
    print(f"valid: {render.verdict(valid.valid)}" + "".join(f"\n  {failure}" for failure in valid.failures[:10]))
    rows = [
        _row(model, face, outcome)
        for face, outcome in zip(model.faces, outcomes, strict=True)
        if everything or face.surface is not None
    ]
    if rows:
        print(f"smoothing is judged at {render.mm(width)}, keeping {keep.upper()}")
        _table(["face", "type", "degree", "net", "shape", "free", "spans mm", "at this scale", "from", "name"], rows)
    if everything and measures:
        _table(
            ["edge", "faces", "gap mm", "angle °", "curvature jump 1/mm", "relative", "at"],
            [
                (
                    f"edge#{m.edge + 1}" + ("" if m.sewn else " (not sewn)"),
                    "#{} #{}".format(*(i + 1 for i in m.faces)),
                    f"{m.gap:.2g}",
                    f"{m.angle:.3g}",
                    f"{m.bend:.2g}",
                    f"{m.relative_bend:.2g}",
                    " ".join(f"{x:.4g}" for x in m.where),
                )
                for m in measures
            ],
        )
    return 0


def _facts(model: Model, face: Face) -> dict[str, Any]:
    """What a face is; lengths in millimetres."""
    facts: dict[str, Any] = {
        "face": face.index + 1,
        "name": face.name,
        "product": face.product,
        "colour": face.colour,
        "kind": face.kind,
        "instances": face.instances,
        "box": face.box.tolist(),
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


def _judged(outcome: FaceOutcome) -> dict[str, Any]:
    """What smoothing at the given scale would do to the face, and why."""
    return {
        "smoothing": "changes" if outcome.status == "edited" else outcome.status,
        "reason": outcome.reason,
        "detail": outcome.detail,
        "free_poles": outcome.free,
        "visible_poles": outcome.points,
        "spans": list(outcome.spans),
        "finest_scale": outcome.scale,
        "crease_lines": outcome.creases,
    }


def _row(model: Model, face: Face, outcome: FaceOutcome) -> Sequence[str]:
    name = face.name or face.product
    if face.surface is None:
        return f"#{face.index + 1}", face.kind, "", "", "", "", "", outcome.reason, "", name
    net = model.surfaces[face.surface].net
    shape = [
        word
        for word, true in (
            ("rational", net.weights is not None),
            ("periodic", net.u.periodic or net.v.periodic),
            (f"{outcome.creases} crease lines", outcome.creases),
        )
        if true
    ]
    verdict = f"changes by {outcome.moved:.2g} mm" if outcome.status == "edited" else outcome.reason
    return (
        f"#{face.index + 1}",
        face.kind,
        f"{net.u.degree}x{net.v.degree}",
        "x".join(map(str, net.poles.shape[:2])),
        " ".join(shape),
        f"{outcome.free}/{outcome.points}",
        f"{outcome.spans[0]:.3g}–{outcome.spans[1]:.3g}",
        verdict,
        f"{outcome.scale:.3g} mm" if outcome.scale else "never",
        name,
    )


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print aligned columns."""
    lines = [list(head), *map(list, rows)]
    widths = [max(len(line[i]) for line in lines) for i in range(len(head))]
    for line in lines:
        print("  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip())
