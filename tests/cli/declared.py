"""Every command with its options as declared, small models to try them on, and a value or two for each option."""

from __future__ import annotations

import itertools
import math
from collections.abc import Container, Iterator, Mapping, Sequence
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import click
import numpy as np
from mracad_cli.__main__ import group

Words = tuple[str, ...]

COVERED_ELSEWHERE = {
    "debug": "tests/cli/test_errors.py",
    "cluster": "it starts one: tests/job/batch/test_cluster.py",
}


def commands() -> dict[str, click.Command]:
    """The commands by their words, those of groups among them."""
    context = click.Context(group)
    found: dict[str, click.Command] = {}
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        if isinstance(command, click.Group):
            found |= {f"{name} {below}": each for below, each in command.commands.items()}
        elif command:
            found[name] = command
    return found


def options(command: click.Command, without: Container[str] = COVERED_ELSEWHERE) -> dict[str, click.Option]:
    """The options of a command by name."""
    every = (p for p in command.params if isinstance(p, click.Option) and p.name not in without)
    return {str(option.name): option for option in every}


_LEVEL = [(), ("--band", "0mm:8mm"), ("--base", "level", "--band", "0mm:8mm")]
_OUT = "outputs format schema chord angle ascii_stl scalar show view fit picture_size stripes before wipe section comb"
_DONE = [
    ("-o", "out.step", "--schema", "AP242"),
    ("-o", "out.brep", "-o", "out.stl", "--chord", "1mm", "--angle", "30", "--ascii"),
    ("-o", "out.vtp", "--chord", "1mm", "--scalar", "curvature:gauss", "--scalar", "roughness"),
    ("-o", "-", "--format", "iges"),
    ("-o", "out.png", "--picture-size", "64x48", "--show", "zebra", "--stripes", "10", "--view", "top", "--fit", "#1"),
    ("-o", "out.png", "--picture-size", "96x48", "--show", "treatment", "--section", "x=5mm", "--comb"),
    ("-o", "out.png", "--picture-size", "64x48", "--wipe"),
    ("--dry-run",),
]

_RIMS = (
    "free_edges corners",
    [(), ("--free-edges", "hold"), ("--free-edges", "smooth"), ("--free-edges", "smooth", "--corners", "move")],
)

_FORMATS = [
    *(
        ("--format", name)
        for name in ("iges", "brep", "binbrep", "3mf", "obj", "gltf", "glb", "vtu", "png", "gif", "mp4")
    ),
    ("--format", "step", "--schema", "AP242"),
    ("--format", "stl", "--chord", "1mm", "--angle", "30", "--ascii"),
    ("--format", "ply", "--chord", "1mm", "--scalar", "curvature:gauss"),
    ("--format", "vtp", "--angle", "30", "--scalar", "deviation", "--scalar", "roughness"),
]

TOGETHER: Mapping[str, Sequence[tuple[str, Sequence[Words]]]] = {
    "batch": [("format schema chord angle ascii_stl scalar", [(), *_FORMATS])],
    "smooth": [
        (
            "scale across along level limit_by_curvature max_deviation",
            [
                ("--scale", "4mm"),
                ("--scale", "4mm", "--max-deviation", "0.01mm"),
                ("--scale", "20%", "--no-limit-by-curvature"),
                ("--scale", "4mm", "--across", "2mm"),
                ("--scale", "4mm", "--across", "10%", "--along", "Y"),
                ("--level", "1.5"),
                ("--max-deviation", "0.02mm"),
            ],
        ),
        _RIMS,
    ],
    "denoise": [_RIMS],
    "equalize": [
        _RIMS,
        (
            "band amount",
            [
                ("--band", ":3mm=0"),
                ("--band", "0.5mm:3mm=2", "--band", "3mm:50%=0.5", "--amount", "1.5"),
                ("--band", ":2mm=1.2", "--amount", "0"),
            ],
        ),
    ],
    "level": [("scale level", [("--scale", "4mm"), ("--level", "1.5")])],
    "report": [("output", [("-o", "out.html")])],
    "spectrum": [("outputs", [(), ("-o", "out.csv"), ("-o", "out.json")])],
    "move": [("base band", _LEVEL), ("to", [("--to", "5,7,0"), ("--to", "#1@0.6,0.7")])],
    "repeat": [
        ("base band", _LEVEL),
        (
            "at grid polar along fill margin skip_off align size_by height_by",
            [
                ("--at", "5,7,0"),
                ("--at", "@places.csv", "--at", "#1@0.6,0.7"),
                ("--grid", "2x2,2,2"),
                ("--polar", "3,6,6,0,0,0,1"),
                ("--along", "edge#1,3,3"),
                ("--fill", "poisson,spacing:4mm", "--margin", "1mm"),
                ("--fill", "hexagons,spacing:20%", "--align", "X"),
                ("--fill", "grid,spacing:5", "--size-by", "distance-to:edge#1,from:0=0.5,to:9mm=1"),
            ],
        ),
    ],
    "transfer": [
        (
            "from_ to map base band mode blend grow seed clip taper rotate size height mirror amount max_deviation "
            "refine gap_tolerance fit_g1 close_gaps free_edges corners",
            [
                ("--from", "#1", "--to", "#1", "--band", "0mm:8mm"),
                ("--map", "place", "--band", "0mm:8mm", "--mode", "replace", "--amount", "0.5"),
                ("--map", "#1=#1", "--blend", "0.3", "--band", "0mm:8mm", "--refine", "never", "--mirror"),
                ("--map", "#1=#1", "--blend", ":2mm=0", "--blend", "2mm:8mm=0.3", "--free-edges", "smooth"),
                ("--map", "#1=#1", "--band", ":8mm", "--max-deviation", "0.01mm", "--rotate", "30", "--fit-g1", "10"),
                ("--map", "#1=#1", "--band", ":8mm", "--gap-tolerance", "0.01mm", "--size", "0.8", "--taper", "0.5mm"),
                ("--map", "#1=#1", "--band", ":3mm", "--grow", "--seed", "3"),
                ("--from", "near:5,5,0,radius:1.5", "--to", "5,7,0"),
                ("--from", "near:5,5,0,radius:1.5", "--to", "5,7,0", "--clip", "--height", "0.5"),
                ("--from", "near:5,5,0,radius:1.5", "--to", "5,7,0", "--base", "level", "--band", "0mm:8mm"),
            ],
        )
    ],
    "sweep": [
        (
            "at by to radius rotate stretch",
            [
                ("--at", "#1@0.5,0.5", "--by", "0,0,0.2"),
                ("--at", "#1@0.5,0.5", "--at", "#2@0.3,0.4", "--by", "0,0,0.2", "--by", "0,0.1,0"),
                ("--at", "#1@0.4,0.6", "--to", "4,6,0.5"),
                ("--at", "#1@0.5,0.5", "--radius", "2mm", "--rotate", "normal,10", "--stretch", "1.1"),
                ("--at", "edge#1", "--by", "0.2"),
            ],
        )
    ],
    "convert": [(_OUT, [*_DONE[:4], _DONE[5]])],
    "feature extract": [("base band", _LEVEL)],
    "render": [
        ("output size", [("-o", "out.png", "--size", "120x80"), ("-o", "-", "--size", "64x64")]),
        (
            "show stripes",
            [(), ("--show", "zebra", "--stripes", "10"), ("--show", "isophotes"), ("--show", "curvature:gauss")],
        ),
        ("before wipe", [()]),
        ("section comb", [(), ("--section", "x=5mm"), ("--section", "x=5mm", "--section", "y=5mm", "--comb")]),
    ],
}
"""By command, options that need or exclude each other, and ways to give them."""

VALUES: Mapping[str, Sequence[Any]] = {
    "amount": ["0.5", "0"],
    "angle": ["30"],
    "assignments": ["smooth.scale=3mm"],
    "chord": ["1mm"],
    "depfile": ["out.d"],
    "details": ["out.mra"],
    "distance": ["0.01mm"],
    "encoding": ["utf-8"],
    "expect": ["1", "report.json"],
    "faces": ["#1", "type:bspline", "!#2"],
    "feature": ["near:5,5,0,radius:1.5"],
    "fit": ["#1", "type:bspline"],
    "fit_g1": ["10"],
    "folder": ["out"],
    "gap_tolerance": ["0.01mm"],
    "height": ["0.5"],
    "hold": ["#2", "edge#1", "near:5,5,0,radius:2", "radius<0.5mm"],
    "input_unit": ["mm"],
    "instance": ["part"],
    "jitter": ["0.1mm"],
    "jobs": ["1"],
    "junit": ["junit.xml"],
    "kink": ["5"],
    "layer_limit": ["50"],
    "log": ["run.log"],
    "max_angle": ["1"],
    "max_angle_growth": ["1"],
    "max_deviation": ["0.01mm"],
    "max_gap": ["0.01mm"],
    "max_gap_growth": ["0.01mm"],
    "max_tolerance": ["0.01mm"],
    "max_volume_change": ["1"],
    "memory_limit": ["16GB"],
    "min_wall": ["0.5mm"],
    "noise": ["0.01mm"],
    "outliers": ["0.5%"],
    "output": ["out.feature"],
    "places": ["1,2,3"],
    "reference_unit": ["mm"],
    "report": ["report.json"],
    "retry": ["1"],
    "report_html": ["out.html"],
    "rotate": ["30"],
    "sarif": ["out.sarif"],
    "scale": ["4mm", "20%"],
    "seed": ["3"],
    "show": ["zebra"],
    "size": ["0.8"],
    "spin": ["20"],
    "strength": ["2"],
    "taper": ["0.5mm"],
    "time_limit": ["10min"],
    "view": ["top", "iso,1,2,3"],
}
"""Values to try for options that are no flags and no choices, by name."""

NEEDED = {"feature"}
"""Options without which a command has nothing to do."""

RECIPE = '[[step]]\nuse = "smooth"\nscale = "20%"\n\n[[step]]\nuse = "check"\n'
PIPELINE = "smooth --scale 20% ! check ! compare --max-deviation 1mm"
ARGUMENTS = {
    "batch": ("recipe.toml", "IN"),
    "compare": ("REF", "IN"),
    "completion": ("bash",),
    "compose": ("IN", "MRA"),
    "env": (),
    "feature make": ("formula:0.2*cos(x)*cos(y),radius:3mm",),
    "man": (".",),
    "pipeline": (PIPELINE, "IN"),
    "recipe check": ("recipe.toml",),
    "recipe schema": (),
    "run": ("recipe.toml", "IN"),
    "transfer": ("REF", "IN"),
}
"""The arguments of commands that take others than one model."""


def values(option: click.Option) -> list[Words]:
    """Ways to give an option; the first is to leave it out where that is possible.

    Raises
    ------
    KeyError
        For an option of which no value is known here: a new one needs some.
    """
    flag = max(option.opts, key=len)
    if option.is_flag:
        given = [(flag,), *((off,) for off in option.secondary_opts)]
    elif isinstance(option.type, click.Choice):
        given = [(flag, str(getattr(choice, "value", choice))) for choice in option.type.choices]
    else:
        given = [(flag, value) for value in VALUES[str(option.name)]]
    return given if option.required or option.name in NEEDED else [(), *given]


def choices(command: str) -> list[list[Words]]:
    """For each option of a command, or several that belong together, the ways to give it."""
    every = options(commands()[command])
    sets = list(TOGETHER.get(command, ()))
    if "dry_run" in every and "outputs" in every:
        sets.append((f"{_OUT} dry_run", _DONE))
    for names, _ in sets:
        for name in names.split():
            every.pop(name, None)
    return [*(list(ways) for _, ways in sets), *map(values, every.values())]


def pairwise(ways: Sequence[Sequence[Any]]) -> Iterator[list[Any]]:
    """Rows that take one of each list, so that every two from different lists stand together in some row."""
    open_ = {
        ((i, a), (j, b))
        for i, j in itertools.combinations(range(len(ways)), 2)
        for a in range(len(ways[i]))
        for b in range(len(ways[j]))
    }
    while open_:
        row = dict(min(open_))
        for i in range(len(ways)):
            if i not in row:
                row[i] = max(
                    range(len(ways[i])), key=lambda a, i=i: sum(_pair((i, a), x) in open_ for x in row.items())
                )
        open_ -= {_pair(x, y) for x, y in itertools.combinations(row.items(), 2)}
        yield [ways[i][a] for i, a in sorted(row.items())]


def _pair(one: tuple[int, int], other: tuple[int, int]) -> tuple[tuple[int, int], ...]:
    return tuple(sorted((one, other)))


def heights(x, y):
    """A wave that every scale sees, a ripple to be smoothed, and a bump to be carried about."""
    bump = 0.3 * np.exp(-((x - 5) ** 2 + (y - 5) ** 2) / 0.5)
    return 0.1 * np.sin(x / 2) + 0.03 * np.sin(2 * math.pi * x / 1.7) * np.sin(2 * math.pi * y / 1.7) + bump


def small_models(folder: Path) -> list[Path]:
    """Two sewn patches, one with a hole, a slab, and two products."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder, BRepPrimAPI_MakePrism
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Vec

    from mracad.edit.details import Details
    from mracad.edit.level import level
    from mracad.edit.mra import save
    from mracad.job.look import snapshot
    from mracad.occ.files import read, write
    from mracad.spec.steps import Level
    from tests.occ.shapes import bspline, document, face_on, sewn

    def patch(x0: float) -> Any:
        x, y = np.meshgrid(np.linspace(x0, x0 + 10, 16), np.linspace(0, 10, 16), indexing="ij")
        return face_on(bspline(np.stack([x, y, heights(x, y)], axis=-1)))

    hole = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(8, 8, -5), gp_Dir(0, 0, 1)), 0.8, 10).Shape()
    slab = BRepPrimAPI_MakePrism(patch(0), gp_Vec(0, 0, -3)).Shape()
    shapes = {
        "sheet": [sewn(patch(0), patch(10))],
        "holed": [BRepAlgoAPI_Cut(patch(0), hole).Shape()],
        "slab": [slab],
        "two": [patch(0), patch(10)],
    }
    paths = []
    for name, parts in shapes.items():
        paths.append(folder / f"{name}.step")
        write(document(*parts, names={0: "part", 1: "other"}), paths[-1])
    model = snapshot(read(paths[0]))
    edit = level(model, Level(scale="4mm"))
    details = Details.of(model, edit.displacement)
    paths[0].with_suffix(".mra").write_bytes(save(details))
    return paths


class Here:
    """The pool of a batch, in this process."""

    workers = 1

    def __init__(self, *_):
        pass

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def submit(self, fn, *args):
        future = Future()
        try:
            future.set_result(fn(*args))
        except Exception as error:
            future.set_exception(error)
        return future

    def shutdown(self, wait=True, cancel_futures=False):
        pass
