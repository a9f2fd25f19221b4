"""Find detail features in a model, or save one to a file for use on others."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from mracad.errors import UsageError
from mracad.spec.steps import Selection, Single
from mracad_cli import options
from mracad_cli.files import check_target, deliver, read


@click.group(help=__doc__)
def command() -> None:
    pass


@command.command("list")
@options.apply(options.reading, options.of(Selection, "instance hold keep edges"), options.printing)
def list_(source: str, input_unit: str | None, encoding: str | None, faces: tuple[str, ...], as_json: bool) -> None:
    """Propose features: places where the detail of a face stands out, with size, height and scales."""
    from mracad.edit.feature.find import found
    from mracad.occ.look import looked_at
    from mracad_cli.render import json_text, mm, plain, say

    model, scope = looked_at(read(source, input_unit, encoding), Selection(faces=faces))
    features = found(model, scope.chosen)
    if as_json:
        body = [{**plain(f), "face": f.face + 1, "feature": f.text} for f in features]
        say(json_text({"file": model.name, "features": body}))
        return
    for f in features:
        scales = f"{mm(f.scales[0])} to {mm(f.scales[1])}"
        say(f"{f.text} on #{f.face + 1}: {mm(f.height)} high, {mm(f.size)} across, scales {scales}")
    if not features:
        say(f"{model.name}: nothing stands out")


@command.command()
@options.apply(
    options.reading,
    click.option("--feature", required=True, help="near:X,Y,Z,radius:R (mm) or #3@u0:u1,v0:v1."),
    options.of(Single, " ".join(f for f in Single.__struct_fields__ if f not in ("faces", "taper", "base", "band"))),
    click.option(
        "-o", "--output", "output", metavar="F.feature", required=True, type=click.Path(), help="File to write."
    ),
    options.overwrite,
    options.printing,
)
def extract(
    source: str,
    input_unit: str | None,
    encoding: str | None,
    feature: str,
    output: str,
    overwrite: bool,
    as_json: bool,
    **given: Any,
) -> None:
    """Save a feature to a file: a library of details that mracad repeat and mracad transfer lay elsewhere."""
    from mracad.edit.feature.detail import save
    from mracad.edit.feature.extract import feature_of
    from mracad.occ.look import looked_at
    from mracad.spec.text import options as options_of
    from mracad_cli.render import json_text, mm

    path = Path(output)
    if path.suffix != ".feature":
        raise UsageError(f"cannot write {path}: unknown ending {path.suffix!r}", "end it in .feature")
    check_target(path, overwrite)
    chosen_options = options_of(Single, {**given, "feature": feature})
    model, scope = looked_at(read(source, input_unit, encoding), chosen_options)
    found = feature_of(model, chosen_options, scope.chosen, feature)
    body = {
        "file": model.name,
        "radius": found.radius,
        "reach": found.reach,
        "height": found.height,
        "written": path.name,
    }
    said = f"{model.name}: {mm(found.height)} high, {mm(2 * found.radius)} across; wrote {path.name}"
    deliver({output: save(found)}, [json_text(body) if as_json else said])
