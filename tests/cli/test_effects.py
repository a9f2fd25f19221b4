"""Every option of every command has an effect: what a command does with it differs from what it does without."""

import json
import os
import re
from pathlib import Path

import pytest

from mracad.occ.files import write
from tests.cli import declared
from tests.edit import blocks, halves
from tests.occ import shapes

TESTS = Path(__file__).parents[1]

ELSEWHERE = {
    "batch cluster": "job/batch/test_cluster.py::test_a_lost_worker_costs_nothing",
    "batch if_changed": "job/batch/test_batch.py::test_a_changed_input_or_recipe_is_done_again_and_nothing_else",
    "batch jobs": "job/batch/test_batch.py::test_the_outputs_do_not_depend_on_the_number_of_workers",
    "batch keep_going": "job/batch/test_batch.py::test_fail_fast_stops_and_retry_tries_again",
    "batch memory_limit": "job/batch/test_batch.py::test_five_bad_files_of_forty_cost_five",
    "batch report_html": "job/batch/test_batch.py::test_pages_come_from_the_workers_and_a_missing_one_is_made_again",
    "batch retry": "job/batch/test_batch.py::test_fail_fast_stops_and_retry_tries_again",
    "batch time_limit": "job/batch/test_batch.py::test_five_bad_files_of_forty_cost_five",
}
"""Options whose effect needs more than two calls, and the tests of it."""

MEMORY = "robust/test_robust.py::test_limits_on_the_command_line"

FEATURE = ("--feature", "near:5,5,0,radius:1.5")
TEXTURE = "--from #1 --to #1 --band 0mm:8mm"
TEXTURES = "LESS --from LESS --to --map #1=#1,#1=#2 --band 0mm:8mm"
SWEPT = ("--at", "#1@0.5,0.5", "--by", "0,0,0.4")
BASE = {
    "batch": ("batch", "recipe.toml", "sheet.step", "--folder", "out", "--json"),
    "check": ("check", "sheet.step", "--json"),
    "compare": ("compare", "sheet.step", "smooth.step", "--json"),
    "compose": ("compose", "coarse.step", "sheet.mra", "-o", "a.step", "--json"),
    "convert": ("convert", "sheet.step", "-o", "a.step", "--json"),
    "denoise": ("denoise", "sheet.step", "--noise", "0.05mm", "-o", "a.step", "--json"),
    "env": ("env", "--json"),
    "equalize": ("equalize", "sheet.step", "--band", "0.5mm:3mm=2", "-o", "a.step", "--json"),
    "feature extract": ("feature", "extract", "sheet.step", *FEATURE, "-o", "a.feature", "--json"),
    "feature list": ("feature", "list", "sheet.step", "--json"),
    "feature make": ("feature", "make", "formula:0.2*cos(x)*cos(y),radius:3mm", "-o", "a.feature", "--json"),
    "info": ("info", "sheet.step", "--json"),
    "level": ("level", "sheet.step", "--scale", "4mm", "-o", "a.step", "--json"),
    "move": ("move", "sheet.step", *FEATURE, "--to", "15,5,0", "-o", "a.step", "--json"),
    "offset": ("offset", "sheet.step", "--distance", "0.5mm", "-o", "a.step", "--json"),
    "pipeline": ("pipeline", declared.PIPELINE, "sheet.step", "-o", "a.step", "--json"),
    "recipe check": ("recipe", "check", "recipe.toml", "--json"),
    "render": ("render", "sheet.step", "-o", "a.png", "--size", "120x80", "--json"),
    "repeat": ("repeat", "sheet.step", *FEATURE, "--at", "14,5,0", "-o", "a.step", "--json"),
    "report": ("report", "sheet.step", "-o", "a.html", "--json"),
    "run": ("run", "recipe.toml", "sheet.step", "-o", "a.step", "--json"),
    "smooth": ("smooth", "sheet.step", "--scale", "4mm", "-o", "a.step", "--json"),
    "spectrum": ("spectrum", "sheet.step", "--json"),
    "sweep": ("sweep", "sheet.step", *SWEPT, "--scale", "4mm", "-o", "a.step", "--json"),
    "transfer": (
        "transfer",
        "sheet.step",
        "flat.step",
        "--from",
        FEATURE[1],
        "--to",
        "5,7,0",
        "-o",
        "a.step",
        "--json",
    ),
}
"""What each command is called with."""

WAYS = {
    "across": ("--across 9mm",),
    "amount": ("--amount 0.5",),
    "angle": ("--angle 2", "-o a.stl --chord 5mm"),
    "as_json": (None, ""),
    "ascii_stl": ("--ascii", "-o a.stl"),
    "assignments": ("--set smooth.scale=3mm",),
    "at": ("--at 5,8,0",),
    "band": ("--band 0mm:3mm", "--base level --band 0mm:8mm"),
    "base": ("--base level", "--band 0mm:8mm"),
    "corners": ("--corners move", "--free-edges smooth"),
    "chord": ("--chord 1mm", "-o a.stl"),
    "clip": ("--clip", "--at 0.3,5,0"),
    "details": ("--details a.mra",),
    "depfile": ("--depfile a.d",),
    "distance": ("--distance 0.6mm",),
    "dry_run": ("--dry-run",),
    "edges": ("--edges frozen",),
    "encoding": ("--encoding iso8859-5", "IN latin.step"),
    "everything": ("--all", "LESS --json"),
    "expect": ("--expect 3",),
    "faces": ("--faces #1",),
    "fail_on": ("--fail-on free-edges",),
    "feature": ("--feature near:5,5,0,radius:1",),
    "fit_g1": ("--fit-g1 20",),
    "folder": ("--folder other",),
    "format": ("--format brep", "-o -"),
    "free_edges": ("--free-edges smooth",),
    "from_": ("--from near:5,5,0,radius:1",),
    "grid": ("--grid 1x2,1,2",),
    "height": ("--height 0.5",),
    "hold": ("--hold edge#1 --hold edge#2 --hold edge#3 --hold edge#4",),
    "if_changed": ("--if-changed", "OLD a.step"),
    "ignore": ("--ignore deviation",),
    "input_unit": ("--input-unit in",),
    "instance": ("--instance part", "IN two.step"),
    "inward": ("--inward",),
    "jitter": ("--jitter 0.3mm",),
    "junit": ("--junit a.xml",),
    "keep": ("--keep g2",),
    "kink": ("--kink 45", "--max-angle 0"),
    "layer_limit": ("--layer-limit 1e-4",),
    "log": ("--log a.log",),
    "limit_by_curvature": ("--no-limit-by-curvature", "IN tube.step --scale 9mm"),
    "level": ("--level 2", "LESS --scale"),
    "max_angle": ("--max-angle 0", "--kink 45"),
    "max_angle_growth": ("--max-angle-growth 0",),
    "max_deviation": ("--max-deviation 0.01mm",),
    "max_gap": ("--max-gap 1e-5mm", "IN gaping.step"),
    "max_gap_growth": ("--max-gap-growth 1e-6mm", "IN gaping.step"),
    "max_tolerance": ("--max-tolerance 1e-9mm",),
    "max_volume_change": ("--max-volume-change 1e-9", "REF slab.step IN smoothslab.step"),
    "min_wall": ("--min-wall 9mm", "IN slab.step"),
    "method": ("--method spline",),
    "mirror": ("--mirror", "--rotate 20"),
    "mode": ("--mode replace", f"IN sheet.step {TEXTURE} --rotate 20"),
    "outliers": ("--outliers 2%", "IN spiky.step"),
    "output": ("-o b.feature",),
    "noise": ("--noise 0.2mm",),
    "outputs": ("-o b.brep",),
    "overlap": ("--overlap max", "--grid 2x1,0.8,0.8"),
    "overwrite": ("--overwrite", "OLD a.step"),
    "polar": ("--polar 2,6,6,0,0,0,1",),
    "along": ("--along edge#1,1,3",),
    "quiet": ("--quiet", "LESS --json"),
    "record": ("--record",),
    "reference_unit": ("--reference-unit in",),
    "refine": ("--refine never", "IN strips.step --scale 8mm --faces #2"),
    "report": ("--report a.json",),
    "report_html": ("--report-html a.html",),
    "rotate": ("--rotate 40",),
    "sarif": ("--sarif a.sarif",),
    "scalar": ("--scalar curvature", "-o a.ply --chord 1mm"),
    "scale": ("--scale 9mm",),
    "schema": ("--schema AP203",),
    "show": ("--show zebra", "-o a.png --picture-size 90x60"),
    "seed": ("--seed 5", "--jitter 0.3mm"),
    "fit": ("--fit #1", "-o a.png --picture-size 90x60"),
    "before": ("--before smooth.step", "-o a.png --picture-size 90x60"),
    "picture_size": ("--picture-size 64x64", "-o a.png"),
    "comb": ("--comb", "-o a.png --picture-size 90x60 --section x=5mm"),
    "section": ("--section x=5mm", "-o a.png --picture-size 90x60"),
    "wipe": ("--wipe", "-o a.png --picture-size 90x60"),
    "stripes": ("--stripes 9", "-o a.png --show zebra --picture-size 90x60"),
    "size": ("--size 0.7",),
    "places": ("--at 1,2,3",),
    "skip_off": ("--skip-off", "--at 500,5,0"),
    "spin": ("--spin 60",),
    "strength": ("--strength 4",),
    "taper": ("--taper 1.2mm",),
    "time_limit": ("--time-limit 1e-3s",),
    "to": ("--to 5,8,0",),
    "verbose": ("--verbose",),
    "verify": ("--verify off",),
    "view": ("--view top", "-o a.png --picture-size 90x60"),
    "close_gaps": ("--close-gaps", "IN gaping.step"),
    "gap_tolerance": ("--gap-tolerance 1mm", "IN halves.step --scale 40mm"),
}
"""For each option, words that give it, and others that it needs; IN, REF and OLD stand for files, LESS for less."""

OWN = {
    "batch angle": ("--angle 2", "--chord 5mm --format stl"),
    "batch ascii_stl": ("--ascii", "--format stl"),
    "batch chord": ("--chord 1mm", "--format stl"),
    "batch format": ("--format brep",),
    "batch scalar": ("--scalar deviation", "--format ply --chord 1mm"),
    "batch overwrite": ("--overwrite", "OLD out/sheet.step"),
    "check overwrite": ("--overwrite", "OLD a.xml --junit a.xml"),
    "compare overwrite": ("--overwrite", "OLD a.xml --junit a.xml"),
    "compose gap_tolerance": ("--gap-tolerance 1mm", "IN coarsehalves.step DETAILS halves.mra --amount 0.9"),
    "compose instance": ("--instance part", "IN coarsetwo.step DETAILS two.mra"),
    "compose refine": ("--refine never", "IN strips.step"),
    "compose keep": ("--keep g0", "IN coarsetangent.step DETAILS tangent.mra --amount 0.9"),
    "render before": ("--before smooth.step",),
    "render comb": ("--comb", "--section x=5mm"),
    "render section": ("--section x=5mm",),
    "render wipe": ("--wipe", "--before smooth.step"),
    "render fit": ("--fit #1",),
    "render output": ("-o b.png",),
    "render overwrite": ("--overwrite", "OLD a.png"),
    "render size": ("--size 64x64",),
    "render stripes": ("--stripes 9", "--show zebra"),
    "report output": ("-o b.html",),
    "report overwrite": ("--overwrite", "OLD a.html"),
    "spectrum outputs": ("-o b.csv",),
    "spectrum overwrite": ("--overwrite", "OLD a.csv -o a.csv"),
    "feature extract overwrite": ("--overwrite", "OLD a.feature"),
    "feature make overwrite": ("--overwrite", "OLD a.feature"),
    "compare max_deviation": ("--max-deviation 1mm",),
    "smooth along": ("--along Y", "--across 9mm"),
    "denoise keep": ("--keep g2", "IN tangent.step --noise 0.2mm"),
    "denoise gap_tolerance": ("--gap-tolerance 1mm", "IN halves.step --noise 0.1mm"),
    "denoise refine": ("--refine never", "IN strips.step --noise 0.2mm --faces #2"),
    "equalize band": ("--band 3mm:6mm=0",),
    "equalize keep": ("--keep g2", "IN tangent.step"),
    "equalize gap_tolerance": ("--gap-tolerance 1mm", "IN halves.step --band 5mm:20mm=3"),
    "equalize refine": ("--refine never", "IN strips.step --band :8mm=0 --faces #2"),
    "level gap_tolerance": ("--gap-tolerance 1mm", "IN halves.step --scale 40mm"),
    "level keep": ("--keep g2", "IN tangent.step"),
    "level refine": ("--refine never", "IN strips.step --scale 8mm --faces #2"),
    "sweep at": ("--at #1@0.6,0.4",),
    "sweep by": ("--by 0,0,0.3",),
    "sweep to": ("--to 5,5,0.7", "LESS --by --to 5,5,0.5"),
    "sweep radius": ("--radius 2mm",),
    "sweep rotate": ("--rotate normal,10", "LESS --by --radius 2mm --rotate x,10"),
    "sweep stretch": ("--stretch 1.2", "LESS --by --radius 2mm --stretch x,1.2"),
    "sweep keep": ("--keep g2", "IN tangent.step --at #1@0.9,0.5"),
    "sweep gap_tolerance": ("--gap-tolerance 1mm", "IN halves.step --scale 40mm --by 0,0,3"),
    "sweep fit_g1": ("--fit-g1 20", "--at #1@0.9,0.5"),
    "sweep max_deviation": ("--max-deviation 0.1mm",),
    "sweep refine": ("--refine never", "--scale 2mm"),
    "offset gap_tolerance": ("--gap-tolerance 1mm", "IN halves.step --distance 2mm"),
    "offset refine": ("--refine never", "IN halves.step --distance 2mm"),
    "compare max_angle_growth": ("--max-angle-growth 0", "REF smooth.step IN sheet.step"),
    "info keep": ("--keep g2",),
    "feature extract keep": ("--keep g2",),
    "feature extract faces": ("--faces #2",),
    "transfer amount": ("--amount 0.5", TEXTURE),
    "transfer band": ("--band 0mm:3mm", "LESS --from LESS --to --map #1=#1 --mode replace --band 0mm:8mm"),
    "transfer blend": ("--blend 0.3", TEXTURE),
    "transfer close_gaps": ("--close-gaps", f"IN gaping.step {TEXTURE}"),
    "transfer corners": ("--corners move", f"--free-edges smooth {TEXTURE}"),
    "transfer faces": ("--faces #2",),
    "transfer fit_g1": ("--fit-g1 20", f"IN sheet.step {TEXTURES}"),
    "transfer free_edges": ("--free-edges smooth", TEXTURE),
    "transfer gap_tolerance": ("--gap-tolerance 1mm", f"IN halves.step {TEXTURES}"),
    "transfer grow": ("--grow", "LESS --from LESS --to --map #1=#1 --band 0mm:3mm"),
    "transfer seed": ("--seed 5", "LESS --from LESS --to --map #1=#1 --band 0mm:3mm --grow"),
    "transfer map": ("--map #1=#2", "LESS --from LESS --to --map #1=#1 --band 0mm:8mm"),
    "transfer max_deviation": ("--max-deviation 0.01mm", TEXTURE),
    "transfer refine": ("--refine never", f"IN strips.step {TEXTURE}"),
    "transfer edges": ("--edges frozen", "--to 10,5,0 --clip"),
    "transfer hold": ("--hold #1",),
    "repeat edges": ("--edges frozen", "--at 10,5,0 --clip"),
    "move edges": ("--edges frozen", "--to 10,5,0 --clip"),
    "move clip": ("--clip", "--to 19.8,5,0"),
    "transfer clip": ("--clip", "--to 0.3,5,0"),
    "move to": ("--to 15,4,0",),
    "move keep": ("--keep g2", "IN tangent.step --to 9.4,5,0 --clip --faces #1"),
    "repeat keep": ("--keep g2", "IN tangent.step --at 9.4,5,0 --clip --faces #1"),
    "transfer keep": ("--keep g2", "IN tangent.step --to 9.4,5,0 --clip --faces #1"),
    "repeat fill": ("--fill poisson,spacing:5mm", "LESS --at --fill poisson,spacing:4mm"),
    "repeat margin": ("--margin 1mm", "LESS --at --fill poisson,spacing:4mm"),
    "repeat align": ("--align 1,2,0", "LESS --at --fill grid,spacing:4mm"),
    "repeat size_by": ("--size-by distance-to:edge#5,from:1mm=0.5,to:15mm=1", "LESS --at --fill grid,spacing:4mm"),
    "repeat height_by": ("--height-by distance-to:edge#5,from:1mm=0.5,to:15mm=1", "LESS --at --fill grid,spacing:4mm"),
    "repeat polar": ("--polar 2,8,5,0,0,0,1",),
}

VALUES = {
    "smooth edges=slide": ("--edges slide", "IN block.step --scale 30mm"),
    "denoise edges=coupled": ("--edges coupled", "IN block.step --noise 0.05mm"),
    "smooth keep=g0": ("--keep g0", "IN tangent.step"),
    "smooth keep=g1": ("--keep g1", "IN tangent.step --keep g0"),
    "repeat overlap=replace": ("--overlap replace", "--grid 2x1,0.8,0.8"),
}
"""Further values of options that choose among several."""


@pytest.fixture(scope="session")
def folder(small, tmp_path_factory):
    """Models by name, and a recipe."""
    import numpy as np
    from mracad_cli.__main__ import main

    place = tmp_path_factory.mktemp("effects")
    for path in small:
        (place / path.name).write_bytes(path.read_bytes())
    (place / "recipe.toml").write_text(declared.RECIPE)
    shapes.save(shapes.zigzag_strips(6, 6, 6), place / "strips.step")
    write(halves.document(*halves.surfaces(0.05, (10, 14))[1:]), place / "halves.step")
    x, y = np.meshgrid(np.linspace(0, 10, 16), np.linspace(0, 10, 16), indexing="ij")
    near = [np.stack([x + dx, y, declared.heights(x + dx, y) + dz], axis=-1) for dx, dz in ((0, 0), (10, 4e-4))]
    bare = shapes.document(shapes.compound(*(shapes.face_on(shapes.bspline(poles)) for poles in near)))
    write(bare, place / "gaping.step")
    flat = shapes.document(shapes.compound(*(shapes.face_on(shapes.bspline(0.0 * p + [1, 1, 0] * p)) for p in near)))
    write(flat, place / "flat.step")
    one, two = (net - [0, 0, z] for net, z in zip(near, (0, 4e-4), strict=True))
    two[0], two[1] = one[-1], 2 * one[-1] - one[-2]
    sewn = shapes.sewn(*(shapes.face_on(shapes.bspline(poles)) for poles in (one, two)))
    write(shapes.document(sewn), place / "tangent.step")
    angle, along = np.meshgrid(np.linspace(0, 3, 60), np.linspace(0, 20, 24), indexing="ij")
    bent = np.stack([2 * np.cos(angle), 2 * np.sin(angle), along + 0.02 * np.sin(9 * angle) * np.sin(along)], axis=-1)
    write(shapes.document(shapes.face_on(shapes.bspline(bent))), place / "tube.step")
    x, y = np.meshgrid(np.arange(20.0), np.arange(20.0), indexing="ij")
    spiky = np.stack([x, y, 0.1 * x], axis=-1) + 0.05 * np.random.default_rng(0).standard_normal((20, 20, 3))
    spiky[[5, 12], [14, 7], 2] += 1.0
    write(shapes.document(shapes.face_on(shapes.bspline(spiky))), place / "spiky.step")
    shapes.save(blocks.block(blocks.nets(16)[1]).wrapped, place / "block.step")
    text = (place / "sheet.step").read_bytes()
    (place / "latin.step").write_bytes(text.replace(b"'part'", b"'t\xe9t\xe9'"))
    for name, more in (("sheet", []), ("slab", ["--faces", "#6"])):
        words = ["--scale", "20%", "--keep", "g0", *more, "-o", str(place / f"smooth{name}.step")]
        assert main(["smooth", str(place / f"{name}.step"), *words]) == 0
    (place / "smoothsheet.step").rename(place / "smooth.step")
    for name, scale in (("sheet", "4mm"), ("two", "4mm"), ("halves", "40mm"), ("tangent", "4mm")):
        words = ["--scale", scale, "-o", str(place / f"coarse{name}.step"), "--details", str(place / f"{name}.mra")]
        assert main(["level", str(place / f"{name}.step"), *words]) == 0
    (place / "coarsesheet.step").rename(place / "coarse.step")
    return place


def cases():
    """Every option of every command, and whether it is the first that has it just so."""
    seen = set()
    for name, command in sorted(declared.commands().items(), key=lambda each: each[0] not in ("check", "convert")):
        for option, declaration in declared.options(command, ()).items():
            case, kind = f"{name} {option}", (option, declaration.help)
            if option == "memory_limit":
                ELSEWHERE.setdefault(case, MEMORY)
            if case not in ELSEWHERE and option != "debug":
                yield pytest.param(case, kind not in seen, id=case)
            seen.add(kind)
    for case in VALUES:
        yield pytest.param(case, True, id=case)


_known = {}


def once(mracad, folder, place, given, old):
    """What a command does without the option, from the first time that it was asked."""
    key = (*given, None, *old)
    if key not in _known:
        _known[key] = observed(mracad, folder, place, given, old)
    return _known[key]


REPLACED = (
    *("scale", "by", "to", "from_", "feature", "folder", "output", "keep", "map", "fill"),
    *("band", "distance", "noise", "rotate", "size", "stretch"),
)
"""Options whose values take the place of those that commands have anyway."""


def words(case):
    """The words of a command with and without an option, and files that are there before."""
    command, _, option = case.partition("=")[0].rpartition(" ")
    given, *needs = VALUES.get(case) or OWN.get(case) or WAYS[option]
    base, old, more = list(BASE[command]), [], " ".join(needs).split()
    while more:
        word = more.pop(0)
        if word == "OLD":
            old.append(more.pop(0))
        elif word in ("IN", "REF"):
            place = next(i for i, w in enumerate(base) if w.endswith(".step"))
            base[place + (word == "IN" and command in ("compare", "transfer"))] = more.pop(0)
        elif word == "DETAILS":
            base[2] = more.pop(0)
        elif word == "LESS":
            at = base.index(more.pop(0))
            del base[at : at + 2]
        else:
            _give(base, [word, *([more.pop(0)] if more and not more[0].startswith("--") else [])])
    if given is None:
        base.remove("--json")
        return base, [*base, "--json"], old
    changed, own = list(base), given.split()
    if option in REPLACED and own[0] in changed:
        _give(changed, own)
    else:
        changed += own
    if option == "level":
        base += ["--scale", "4mm"]
    return base, changed, old


def _give(base, option):
    """Give an option, in place of the value that it has."""
    if option[0] in base:
        at = base.index(option[0])
        del base[at : at + len(option)]
    base += option


def observed(mracad, folder, place, given, old):
    """What a command says, writes and returns, without what the options are called and how long it took."""
    place.mkdir()
    for path in folder.iterdir():
        os.link(path, place / path.name)
    for name in old:
        (place / name).parent.mkdir(exist_ok=True)
        (place / name).write_text("precious")
    before = {path.relative_to(place) for path in place.rglob("*")}
    os.chdir(place)
    result = mracad(*given)
    text = result.out
    if text.startswith("{"):
        body = json.loads(text.splitlines()[0])
        for part in (body, *body.get("steps", ())):
            part.pop("options", None)
        text = json.dumps(body)
    text = re.sub(r'"seconds": [\d.e-]+|\d+\.\d s\b', "", text)
    files = {
        str(path.relative_to(place)): path.read_bytes().partition(b"FILE_NAME")[2].partition(b"DATA;")[2]
        if path.suffix == ".step" and b"FILE_NAME" in path.read_bytes()
        else path.read_bytes()
        for path in place.rglob("*")
        if path.is_file() and (path.relative_to(place) not in before or path.read_bytes()[:8] != b"ISO-1030")
    }
    schemas = [p.read_bytes().partition(b"FILE_SCHEMA")[2][:40] for p in sorted(place.rglob("a.step"))]
    return result.code, text, re.sub(r"[\d.]+ s\b", "", result.err), files, schemas


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize(("case", "first"), list(cases()))
def test_an_option_has_an_effect(case, first, mracad, folder, tmp_path, monkeypatch, pytestconfig):
    if not (first or pytestconfig.getoption("--long")):
        pytest.skip("declared once for several commands: pytest --long tries it on each")
    monkeypatch.chdir(tmp_path)
    base, changed, old = words(case)
    without = once(mracad, folder, tmp_path / "without", base, old)
    given = observed(mracad, folder, tmp_path / "with", changed, old)
    assert without != given, changed
    assert 70 not in (without[0], given[0]), (without[:3], given[:3])
    assert re.search("clip|refine|overwrite|if_changed|skip_off", case) or without[0] in (0, 1), (base, without[:3])
    assert given[0] != 2, (changed, given[:3])


def test_the_effects_that_need_more_are_tested_where_it_is_said():
    for case, place in ELSEWHERE.items():
        file, _, name = place.partition("::")
        assert f"def {name}(" in (TESTS / file).read_text(), case
