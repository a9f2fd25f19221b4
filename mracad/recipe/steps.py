"""Steps ready to be done, and what is recorded of them."""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from msgspec import structs

from mracad import __version__
from mracad.options import Options, dashed
from mracad.recipe.values import braced, toml


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
            value = braced(given)
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
    lines = ["[versions]", *(f"{toml(name)} = {toml(version)}" for name, version in versions().items())]
    for step in steps:
        lines += ["", "[[step]]", f"use = {toml(step.use)}", f"id = {toml(step.id)}"]
        near = {file: os.path.relpath(file, Path(place).parent) for file in step.options.files()}
        lines += [
            f"{dashed(name)} = {toml(braced(value))}"
            for name, value in structs.asdict(step.options.relocated(near)).items()
            if value is not None
        ]
    return "\n".join(lines) + "\n"


@cache
def versions() -> dict[str, str]:
    """Versions of what decides the result."""
    from importlib import metadata  # slow to load, as the command line's help need not be

    return {"mracad": __version__, **{name: metadata.version(name) for name in ("cadquery-ocp", "numpy", "scipy")}}
