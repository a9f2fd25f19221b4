"""Recipes: the steps that a model goes through, from a TOML file or one line of text.

A step has the name and the options of its command (:data:`mracad.options.STEPS`).  Everything that can be wrong in a
recipe is found before a model is read, and named with its place::

    [[step]]
    use = "smooth"
    scale = "2%"

    [[step]]
    use = "check"
    max-gap = "0.01mm"
"""

from __future__ import annotations

import json
import math
import os
import re
import shlex
import typing
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal, TypeVar

import msgspec
from msgspec import structs

from mracad import __version__
from mracad.errors import FileError, UsageError
from mracad.options import STEPS, Options, dashed, lengths, plain_types

Given = TypeVar("Given", bound=Options)

OWN = ("use", "id")
"""The keys of a step that are not options."""


@dataclass(frozen=True)
class Step:
    """One step, ready to be done: the name of its command, its options, and its own name within the recipe."""

    id: str
    use: str
    options: Options

    def text(self) -> str:
        """The step as a line of ``mracad pipeline``; files by name, without their folders."""
        words = [self.use]
        options = self.options.relocated({file: Path(file).name for file in self.options.files()})
        for name, given in options.given().items():
            value = _braced(given)
            flag = f"--{dashed(name)}"
            if value is True:
                words.append(flag)
            elif isinstance(value, list):
                words += [word for member in value for word in (flag, str(member))]
            else:
                words += [flag, f"{value:g}" if isinstance(value, float) else str(value)]
        return shlex.join(words)


def title(steps: Iterable[Step]) -> str:
    """What was done, in one line that ``mracad pipeline`` understands: for the header of the file."""
    return " ! ".join(step.text() for step in steps)


@dataclass(frozen=True)
class _Table:
    """One step as it is written: its values, and where each of them stands (``""`` for the step itself)."""

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
        The steps as they are written.
    file : Path or None
        Where it was read from; files that its options name are relative to its folder.
    """

    tables: tuple[_Table, ...]
    file: Path | None = None

    @property
    def name(self) -> str:
        """Name of the file, or ``"pipeline"``."""
        return self.file.name if self.file else "pipeline"

    @property
    def ids(self) -> list[str]:
        """The name of each step: its ``id``, or that of its command, counted from the second on (``smooth-2``)."""
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
            For a text of another form, or a step or option that does not exist.
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
            tables[index] = tables[index].assigned(dashed(option), _toml_value(value), f"--set {text}")
        recipe = Recipe(tuple(tables), self.file)
        recipe._check()
        return recipe

    def steps(self, source: str) -> tuple[Step, ...]:
        """The steps for one input, its name and folder put in for ``{name}`` and ``{folder}``.

        Raises
        ------
        UsageError
            For a value that an option does not take.
        """
        path = Path("stdin" if source == "-" else source)
        folder = self.file.parent if self.file else Path()
        variables = {"name": path.stem, "folder": str(path.parent)}
        found = []
        for name, table in zip(self.ids, self.tables, strict=True):
            values = {
                key: _filled(value, variables, table.place(key))
                for key, value in table.values.items()
                if key not in OWN
            }
            given = options(STEPS[table.values["use"]], values, table.place)
            given = given.relocated({file: os.path.normpath(folder / file) for file in given.files()})
            found.append(Step(name, table.values["use"], given))
        return tuple(found)

    def _check(self) -> None:
        """Refuse unknown steps and options, and names that are not unique."""
        for table in self.tables:
            use = table.values.get("use")
            if not isinstance(use, str):
                hint = f'write use = "{next(iter(STEPS))}"'
                raise UsageError(f"{table.place('use')}: the step does not say what it uses", hint)
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
                raise UsageError(f"{place}: another step has the id {name!r}", "give it another")


def load(path: str | os.PathLike) -> Recipe:
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
    places = _places(text, file.name)
    for key in body:
        if key not in ("step", "versions"):
            hint = nearest(key, ["step"], "a recipe is a list of [[step]]")
            raise UsageError(f"{_line(text, key, file.name)}: unknown key {key!r}", hint)
    steps = body.get("step", [])
    if not isinstance(steps, list) or not steps or not all(isinstance(step, dict) for step in steps):
        raise UsageError(f"{_line(text, 'step', file.name)}: the recipe has no steps", "write a list of [[step]]")
    first = {"": _line(text, "step", file.name)}
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
    kinds = plain_types(STEPS[use]) if use in STEPS else {}
    while rest:
        flag, equals, value = rest.pop(0).partition("=")
        if not flag.startswith("--"):
            raise UsageError(f"pipeline, {place}: {flag!r} is not an option", f"see mracad {use} --help")
        key = dashed(flag[2:])
        kind = kinds.get(key.replace("-", "_"))
        if kind is bool and not equals:
            values[key] = True
            continue
        if not equals:
            if not rest:
                raise UsageError(f"pipeline, {place}: {flag} needs a value", f"see mracad {use} --help")
            value = rest.pop(0)
        values[key] = [*values.get(key, []), value] if typing.get_origin(kind) is tuple else value
    return _Table(values, {"": f"pipeline, {place}"})


def options(struct: type[Given], values: Mapping[str, Any], place: Callable[[str], str] | None = None) -> Given:
    """The options of a step from plain values, by their names on the command line or in Python.

    Parameters
    ----------
    struct : type
        One of :data:`mracad.options.STEPS`.
    values : mapping
    place : callable, optional
        Says where the value of a name stands, for messages.

    Raises
    ------
    UsageError
        For a value that an option does not take.
    """
    kinds, in_mm = plain_types(struct), lengths(struct)
    plain: dict[str, Any] = {}
    for key, value in values.items():
        name = key.replace("-", "_")
        name = f"{name}_" if f"{name}_" in kinds else name
        if typing.get_origin(kinds.get(name)) is tuple and isinstance(value, str):
            value = [value]
        elif name in in_mm and isinstance(value, int | float) and not isinstance(value, bool):
            value = str(value)
        plain[name] = value
    try:
        return msgspec.convert(plain, struct, strict=False)
    except msgspec.ValidationError as error:
        where = re.search(r"`\$\.(\w+)", str(error))
        cause = error.__cause__ if isinstance(error.__cause__, UsageError) else None
        name = where[1] if where else cause.message.partition(":")[0].replace("-", "_") if cause else ""
        at = f"{place(dashed(name))}: " if place else ""
        if cause:
            raise UsageError(f"{at}{cause.message}", cause.hint) from error
        raise _refused(at, struct, name, plain.get(name), kinds.get(name), str(error)) from error


def _refused(at: str, struct: type[Options], name: str, value: Any, kind: Any, reason: str) -> UsageError:
    """The error for a value that is not of its option's type."""
    if typing.get_origin(kind) is tuple:
        kind = typing.get_args(kind)[0]
    if typing.get_origin(kind) is Literal:
        choices = [str(choice) for choice in typing.get_args(kind)]
        wrong = next((v for v in (value if isinstance(value, list) else [value]) if v not in choices), value)
        hint = nearest(str(wrong), choices, "use one of " + ", ".join(choices))
        return UsageError(f"{at}{dashed(name)}: {wrong!r} is not known", hint)
    said = reason.split(" - at")[0].replace("`", "").replace(" | null", "").lower()
    return UsageError(
        f"{at}{dashed(name)}: {value!r} is not right, {said}", f"see mracad {struct.__name__.lower()} --help"
    )


def record_of(steps: Iterable[Step], place: str | os.PathLike) -> str:
    """The steps as a recipe with every option resolved and the versions of what did them.

    Parameters
    ----------
    steps : iterable of Step
    place : path
        Of the file that it is for; the files that options name are named from there.

    Raises
    ------
    UsageError
        For a text that is not Unicode, which TOML cannot hold.
    """
    lines = ["[versions]", *(f"{_toml(name)} = {_toml(version)}" for name, version in versions().items())]
    for step in steps:
        lines += ["", "[[step]]", f"use = {_toml(step.use)}", f"id = {_toml(step.id)}"]
        near = {file: os.path.relpath(file, Path(place).parent) for file in step.options.files()}
        lines += [
            f"{dashed(name)} = {_toml(_braced(value))}"
            for name, value in structs.asdict(step.options.relocated(near)).items()
            if value is not None
        ]
    return "\n".join(lines) + "\n"


def _toml(value: Any) -> str:
    """A value as TOML."""
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    text = json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if not text.isascii():
        try:
            text.encode()
        except UnicodeEncodeError as error:
            raise UsageError(f"record: {value!r} is not Unicode", "rename it, or leave out --record") from error
    return text


def _braced(value: Any) -> Any:
    """A value that :func:`_filled` leaves as it is."""
    if isinstance(value, list | tuple):
        return [_braced(member) for member in value]
    return value.replace("{", "{{").replace("}", "}}") if isinstance(value, str) else value


@cache
def versions() -> dict[str, str]:
    """Versions of what decides the result."""
    from importlib import metadata  # slow to load, as the command line's help need not be

    return {"mracad": __version__, **{name: metadata.version(name) for name in ("cadquery-ocp", "numpy", "scipy")}}


def schema() -> dict[str, Any]:
    """The JSON schema of recipes."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "mracad recipe",
        "type": "object",
        "properties": {
            "step": {
                "type": "array",
                "minItems": 1,
                "items": {"oneOf": [{"$ref": f"#/$defs/{use}"} for use in STEPS]},
            },
            "versions": {"type": "object", "description": "What made a recorded recipe; for information."},
        },
        "required": ["step"],
        "additionalProperties": False,
        "$defs": {use: _step_schema(use, struct) for use, struct in STEPS.items()},
    }


def _step_schema(use: str, struct: type[Options]) -> dict[str, Any]:
    own = {
        "use": {"const": use},
        "id": {"type": "string", "description": "The step's name, for --set and reports."},
    }
    body = msgspec.json.schema(struct)["$defs"][struct.__name__]
    properties = {dashed(name): _property(part, name in lengths(struct)) for name, part in body["properties"].items()}
    return {
        "description": body["description"],
        "type": "object",
        "properties": {**own, **properties},
        "required": ["use", *map(dashed, body.get("required", []))],
        "additionalProperties": False,
    }


def _property(part: dict[str, Any], is_length: bool) -> dict[str, Any]:
    """An option's schema: without null, which TOML lacks; a length may be a number, a list one text."""
    kinds = [kind for kind in part.get("anyOf", []) if kind != {"type": "null"}]
    found = {key: value for key, value in part.items() if key != "anyOf" and value is not None}
    found |= kinds[0] if len(kinds) == 1 else {"anyOf": kinds} if kinds else {}
    if is_length:
        found["type"] = ["string", "number"]
    elif found.get("type") == "array":
        extra = {key: found.pop(key) for key in ("type", "items")}
        found["anyOf"] = [extra, extra["items"]]
    return found


def page() -> str:
    """Every step with its options, as the Markdown page ``docs/steps.md``."""
    lines = ["# Steps of recipes", "", "Made by `make docs` from `mracad/options`; see [recipes](recipes.md).", ""]
    for use, definition in schema()["$defs"].items():
        lines += [f"## {use}", "", definition["description"], "", "| option | default | |", "|---|---|---|"]
        for name, part in definition["properties"].items():
            if name not in OWN:
                default = json.dumps(part["default"]) if "default" in part else ""
                words = f"`{'`, `'.join(part['enum'])}`: " if "enum" in part else ""
                text = (words + part.get("description", "")).replace("|", "\\|")
                lines.append(f"| `{name}` | {f'`{default}`' if default else ''} | {text} |")
        lines.append("")
    return "\n".join(lines)


def nearest(word: str, known: Iterable[str], otherwise: str = "") -> str:
    """``did you mean 'scale'?``, or what else to do."""
    import difflib

    names = list(known)
    near = difflib.get_close_matches(word, names, n=1)
    return f"did you mean {near[0]!r}?" if near else otherwise or "use one of " + ", ".join(names)


def _toml_value(text: str) -> Any:
    """A text as the TOML value that it is, or as itself."""
    import tomllib

    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text.strip()


def _filled(value: Any, variables: Mapping[str, str], place: str) -> Any:
    """A value with its variables replaced, and double braces by single ones."""
    if isinstance(value, list):
        return [_filled(member, variables, place) for member in value]
    if not isinstance(value, str):
        return value

    def replacement(match: re.Match[str]) -> str:
        if match[1] is None:
            return match[0][0]
        if match[1] not in variables:
            raise UsageError(f"{place}: no variable {match[0]}", nearest(match[1], variables))
        return variables[match[1]]

    return re.sub(r"\{\{|\}\}|\{(\w+)\}", replacement, value)


def _places(text: str, name: str) -> list[dict[str, str]]:
    """For each ``[[step]]``, the place of the step and of each of its keys."""
    found: list[dict[str, str]] = []
    inside = False
    for number, line in enumerate(_without_long_strings(text).splitlines(), 1):
        if line.lstrip().startswith("["):
            inside = bool(re.match(r"\s*\[\[\s*[\"']?step[\"']?\s*\]\]", line))
            if inside:
                found.append({"": f"{name}:{number}"})
        elif inside and (match := re.match(r"\s*[\"']?([\w-]+)[\"']?\s*=", line)):
            found[-1].setdefault(dashed(match[1]), f"{name}:{number}")
    return found


def _line(text: str, key: str, name: str) -> str:
    """The place of a key or table at the top of a recipe."""
    lines = _without_long_strings(text).splitlines()
    pattern = rf"\s*\[?\[?\s*[\"']?{re.escape(key)}[\"']?\s*(=|\]|\.)"
    return f"{name}:{next((i for i, line in enumerate(lines, 1) if re.match(pattern, line)), 1)}"


def _without_long_strings(text: str) -> str:
    """A TOML text whose strings of several lines are only their line ends."""
    return re.sub(r'"""[\s\S]*?"""|\'\'\'[\s\S]*?\'\'\'', lambda match: "\n" * match[0].count("\n"), text)
