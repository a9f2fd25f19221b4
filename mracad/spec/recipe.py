"""Recipes: the steps that a model goes through, from a TOML file or one line of text.

A step has the name and the options of its command (:data:`mracad.spec.steps.STEPS`).  All errors in a recipe are found
before a model is read, and reported with file and line::

    [[step]]
    use = "smooth"
    scale = "2%"

    [[step]]
    use = "check"
    max-gap = "0.01mm"
"""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from msgspec import structs

from mracad.brief import line
from mracad.errors import FileError, UsageError
from mracad.spec.fields import dashed, fields, named, nearest
from mracad.spec.steps import STEPS, Options
from mracad.spec.text import braced, filled, options, place_of, places_of_steps, toml, toml_value
from mracad.store import Location, Url, is_url, location
from mracad.version import __version__

OWN = ("use", "id")
"""The keys of a step that are not options."""


@dataclass(frozen=True)
class Step:
    """A resolved step: the name of its command, its options, and its own name within the recipe."""

    id: str
    use: str
    options: Options

    __repr__ = line

    def text(self) -> str:
        """The step as text for ``mracad pipeline``; files by name, without their folders."""
        words = [self.use]
        options = self.options.relocated({file: Path(file).name for file in self.options.files()})
        for name, given in options.given().items():
            value = braced(given)
            flag = f"--{dashed(name)}"
            if value is True:
                words.append(flag)
            elif isinstance(value, list):
                words += [word for member in value for word in (flag, str(member))]
            else:
                words += [flag, f"{value:g}" if isinstance(value, float) else str(value)]
        return shlex.join(words)


@dataclass(frozen=True)
class _Table:
    """A step as written: its values, and the place of each in the file (``""`` for the step itself)."""

    values: Mapping[str, Any]
    places: Mapping[str, str]

    def place(self, key: str) -> str:
        return self.places.get(key, self.places[""])

    def assigned(self, key: str, value: Any, place: str) -> _Table:
        return _Table({**self.values, key: value}, {**self.places, key: place})


@dataclass(frozen=True)
class Recipe:
    """A list of steps whose values may still hold variables.

    Attributes
    ----------
    tables : tuple
        The steps as written.
    file : Path or None
        The file that it was read from; paths in its options are relative to its folder.
    """

    tables: tuple[_Table, ...]
    file: Path | None = None

    @property
    def name(self) -> str:
        """Name of the file; ``"pipeline"`` without one."""
        return self.file.name if self.file else "pipeline"

    @property
    def ids(self) -> list[str]:
        """The name of each step: its ``id``, or that of its command, numbered from the second on (``smooth-2``)."""
        found: list[str] = []
        for table in self.tables:
            own = str(table.values.get("id") or table.values["use"])
            count = 2
            name = own
            while name in found and "id" not in table.values:
                name, count = f"{own}-{count}", count + 1
            found.append(name)
        return found

    def with_values(self, assignments: Iterable[str]) -> Recipe:
        """The recipe with options set from texts ``"step.option=value"``.

        Raises
        ------
        UsageError
            For a malformed text, or a step or option that does not exist.
        """
        tables = list(self.tables)
        for text in assignments:
            left, equals, value = text.partition("=")
            name, dot, option = left.strip().rpartition(".")
            if not (equals and dot):
                raise UsageError(f"--set {text}: not an assignment", "write --set step.option=value")
            if name not in self.ids:
                raise UsageError(f"--set {text}: no step {name!r} in {self.name}", nearest(name, self.ids))
            index = self.ids.index(name)
            tables[index] = tables[index].assigned(dashed(option), toml_value(value), f"--set {text}")
        recipe = Recipe(tuple(tables), self.file)
        recipe._check()
        return recipe

    def steps(self, source: str) -> tuple[Step, ...]:
        """The steps for one input, whose name and folder replace ``{name}`` and ``{folder}``.

        Raises
        ------
        UsageError
            For a value that an option does not take.
        """
        path = location("stdin" if source == "-" else source)
        folder = self.file.parent if self.file else Path()
        variables = {"name": path.stem, "folder": str(path.parent)}
        found = []
        for name, table in zip(self.ids, self.tables, strict=True):
            values = {
                key: filled(value, variables, table.place(key)) for key, value in table.values.items() if key not in OWN
            }
            given = options(STEPS[table.values["use"]], values, table.place)
            given = given.relocated({file: _from(folder, file) for file in given.files()})
            found.append(Step(name, table.values["use"], given))
        return tuple(found)

    def _check(self) -> None:
        """Refuse unknown steps and options, and names that are not unique."""
        for table in self.tables:
            use = table.values.get("use")
            if not isinstance(use, str):
                hint = f'write use = "{next(iter(STEPS))}"'
                raise UsageError(f"{table.place('use')}: the step has no 'use'", hint)
            if use not in STEPS:
                raise UsageError(f"{table.place('use')}: no step {use!r}", nearest(use, STEPS))
            known = [*OWN, *map(dashed, STEPS[use].__struct_fields__)]
            for key in table.values:
                if key not in known:
                    hint = nearest(key, known, f"see mracad {use} --help")
                    raise UsageError(f"{table.place(key)}: {use} has no option {key!r}", hint)
        for index, name in enumerate(self.ids):
            if name in self.ids[:index]:
                place = self.tables[index].place("id")
                raise UsageError(f"{place}: another step has the id {name!r}", "give one of them another id")


def load(path: str | os.PathLike[str]) -> Recipe:
    """Read a recipe from a TOML file.

    Raises
    ------
    FileError
        When it cannot be read.
    UsageError
        When it is not a recipe; the message begins with the file and the line.
    """
    import tomllib

    file = Path(path)
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
        raise FileError(f"cannot read '{file}': {why}", "give the path of a recipe (TOML)") from error
    try:
        body = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        line = re.search(r"\(at line (\d+)", str(error))
        number = line[1] if line else str(text.count("\n") + 1)
        raise UsageError(f"{file.name}:{number}: {str(error).split(' (at')[0]}", "write it as TOML") from error
    places = places_of_steps(text, file.name)
    for key in body:
        if key not in ("step", "versions"):
            hint = nearest(key, ["step"], "a recipe is a list of [[step]]")
            raise UsageError(f"{place_of(text, key, file.name)}: unknown key {key!r}", hint)
    steps = body.get("step", [])
    if not isinstance(steps, list) or not steps or not all(isinstance(step, dict) for step in steps):
        raise UsageError(f"{place_of(text, 'step', file.name)}: the recipe has no steps", "write a list of [[step]]")
    first = {"": place_of(text, "step", file.name)}
    tables = tuple(
        _Table({dashed(key): value for key, value in step.items()}, places[i] if i < len(places) else first)
        for i, step in enumerate(steps)
    )
    recipe = Recipe(tables, file)
    recipe._check()
    return recipe


def pipeline(text: str) -> Recipe:
    """A recipe from one line: steps as on the command line, between exclamation marks that stand alone.

    Raises
    ------
    UsageError
        When it is not a list of steps.

    Examples
    --------
    >>> [step.use for step in pipeline("smooth --scale 5mm ! check").steps("part.step")]
    ['smooth', 'check']
    """
    try:
        words = shlex.split(text)
    except ValueError as error:
        raise UsageError(f"pipeline: {error}", "close the quotes") from error
    parts: list[list[str]] = [[]]
    for word in words:
        if word == "!":
            parts.append([])
        else:
            parts[-1].append(word)
    recipe = Recipe(tuple(_table(part, f"step {i}") for i, part in enumerate(parts, 1)))
    recipe._check()
    return recipe


def _table(words: list[str], place: str) -> _Table:
    """A step of a pipeline."""
    if not words:
        raise UsageError(f"pipeline, {place}: the step is empty", "write steps as 'smooth --scale 5mm ! check'")
    use, *rest = words
    values: dict[str, Any] = {"use": use}
    known = fields(STEPS[use]) if use in STEPS else {}
    while rest:
        flag, equals, value = rest.pop(0).partition("=")
        if not flag.startswith("--"):
            raise UsageError(f"pipeline, {place}: {flag!r} is not an option", f"see mracad {use} --help")
        key = dashed(flag[2:])
        field = named(known, key)
        if field and field.type is bool and not equals:
            values[key] = True
            continue
        if not equals:
            if not rest:
                raise UsageError(f"pipeline, {place}: {flag} needs a value", f"see mracad {use} --help")
            value = rest.pop(0)
        values[key] = [*values.get(key, []), value] if field and field.many else value
    return _Table(values, {"": f"pipeline, {place}"})


def title(steps: Iterable[Step]) -> str:
    """The steps in one line that ``mracad pipeline`` can read: for the header of the file."""
    return " ! ".join(step.text() for step in steps)


def record_of(steps: Iterable[Step], place: str | os.PathLike[str] | Url) -> str:
    """The steps as a recipe, with every option resolved and the versions of the packages.

    Parameters
    ----------
    steps : iterable of Step
    place : path or Url
        Path of the recipe to be written; files that options name are written relative to it (in a store: absolute).

    Raises
    ------
    UsageError
        For text that is not valid Unicode, which TOML cannot hold.
    """
    lines = ["[versions]", *(f"{toml(name)} = {toml(version)}" for name, version in versions().items())]
    for step in steps:
        lines += ["", "[[step]]", f"use = {toml(step.use)}", f"id = {toml(step.id)}"]
        near = {file: _seen(file, location(place).parent) for file in step.options.files()}
        lines += [
            f"{dashed(name)} = {toml(braced(value))}"
            for name, value in structs.asdict(step.options.relocated(near)).items()
            if value is not None
        ]
    return "\n".join(lines) + "\n"


def _from(folder: Path, file: str) -> str:
    """A file that is named relative to a folder."""
    return file if is_url(file) else os.path.normpath(folder / file)


def _seen(file: str, folder: Location) -> str:
    """A file as named in a folder."""
    if is_url(file):
        return file
    return os.path.abspath(file) if isinstance(folder, Url) else os.path.relpath(file, folder)


@cache
def versions() -> dict[str, str]:
    """Versions of the packages that affect the result."""
    from importlib import metadata  # slow to load, and not needed for help

    def version(name: str) -> str:
        try:
            return metadata.version(name)
        except metadata.PackageNotFoundError:  # other packagers may have other names
            return "unknown"

    return {"mracad": __version__, **{name: version(name) for name in ("cadquery-ocp", "numpy", "scipy")}}
