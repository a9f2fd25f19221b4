"""Find detail features in a model, save one to a file for use on others, or make one."""

from __future__ import annotations

import click

from mracad.errors import UsageError
from mracad.spec.quantity import LENGTH
from mracad.spec.sources import source
from mracad.spec.steps import Extract, Make, Selection
from mracad.store import Location, location
from mracad_cli import options, running
from mracad_cli.command import Group
from mracad_cli.options import Reading
from mracad_cli.outputs import check_target, deliver, read
from mracad_cli.say import json_text, say

OTHERS = "instance hold keep edges"
"""Options of edits that do not apply here."""


@click.group(cls=Group, help=__doc__)
def command() -> None:
    pass


@command.command("list", examples="mracad feature list part.step")
@options.apply(options.reading(), options.of(Selection, "chosen", OTHERS), running.printing)
def list_(reading: Reading, chosen: Selection, as_json: bool) -> None:
    """List features: places where the detail of a face stands out, with size, height and scales."""
    from mracad.edit.feature.find import found
    from mracad.job.look import looked_at
    from mracad_cli.render.json import plain
    from mracad_cli.render.text import mm

    model, scope = looked_at(read(reading), chosen)
    features = found(model, scope.chosen)
    if as_json:
        own = ("place", "size", "height", "scales")
        body = [{"face": f.face + 1, **{k: plain(f)[k] for k in own}, "feature": f.text} for f in features]
        say(json_text({"file": model.name, "features": body}))
        return
    for f in features:
        scales = f"{mm(f.scales[0])} to {mm(f.scales[1])}"
        say(f"{f.text} on #{f.face + 1}: {mm(f.height)} high, {mm(f.size)} across, scales {scales}")
    if not features:
        say(f"{model.name}: nothing stands out")


@command.command(help=Extract.__doc__, examples=Extract.example)
@options.apply(
    options.reading(),
    options.of(Extract, "chosen", OTHERS),
    options.option("-o", "--output", metavar="F.feature", required=True, type=options.feature, help="File to write."),
    options.section(options.Title.OUTPUT, options.overwrite),
    running.printing,
)
def extract(reading: Reading, chosen: Extract, output: str, overwrite: bool, as_json: bool) -> None:
    from mracad.edit.feature.detail import save
    from mracad.edit.feature.extract import feature_of
    from mracad.job.look import looked_at
    from mracad_cli.render.text import mm

    path = _target(output, overwrite)
    model, scope = looked_at(read(reading), chosen)
    found = feature_of(model, chosen, scope.chosen, chosen.feature)
    body = {
        "file": model.name,
        "radius": found.radius,
        "reach": found.reach,
        "height": found.height,
        "base": found.base,
        "written": path.name,
    }
    said = f"{model.name}: {mm(found.height)} high, {mm(2 * found.radius)} across; wrote {path.name}"
    deliver({output: save(found)}, [json_text(body) if as_json else said])


@command.command(help=Make.__doc__, examples=Make.example)
@options.apply(
    options.of(Make, "given", arguments={"source": "SOURCE"}),
    options.option("-o", "--output", metavar="F.feature", required=True, type=options.feature, help="File to write."),
    options.section(options.Title.OUTPUT, options.overwrite),
    running.printing,
)
def make(given: Make, output: str, overwrite: bool, as_json: bool) -> None:
    from mracad.edit.feature.detail import save
    from mracad.edit.feature.source import heights
    from mracad.edit.feature.source.relief import tabulated
    from mracad_cli.render.text import mm

    path = _target(output, overwrite)
    width = None if given.taper is None else LENGTH.read(given.taper, "taper")
    asked = source(given.source, "source")
    relief = heights(asked, width)
    found = tabulated(relief, given.source, asked.spacing)
    body = {
        "radius": found.radius,
        "reach": found.reach,
        "sides": None if relief.disc else relief.sides.tolist(),
        "height": found.height,
        "spacing": found.spacing,
        "notes": found.notes,
        "written": path.name,
    }
    sides = " × ".join(f"{side:.3g}" for side in relief.sides)
    across, apart = mm(2 * found.radius) if relief.disc else f"{sides} mm", mm(found.spacing)
    said = [f"{mm(found.height)} high, {across} across, knots {apart} apart; wrote {path.name}"]
    said += [f"note: {note}" for note in found.notes]
    deliver({output: save(found)}, [json_text(body)] if as_json else said)


def _target(output: str, overwrite: bool) -> Location:
    """The path of a feature file to write; refuses others."""
    path = location(output)
    if path.suffix != ".feature":
        raise UsageError(f"cannot write {path}: unknown extension {path.suffix!r}", "use .feature")
    check_target(path, overwrite)
    return path
