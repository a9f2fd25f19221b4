"""The environment of mracad as a report."""

from __future__ import annotations

import json
import os
import platform
import re
import sys
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

import click

from mracad import cache
from mracad.errors import MracadError
from mracad.version import __version__
from mracad_cli.defaults import Default, check, found, option, options_of, taken, value
from mracad_cli.say import size

THREADS = "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS", "MRACAD_WORKERS"


def body(commands: Mapping[str, click.Command]) -> dict[str, Any]:
    """Everything, as plain data."""
    try:
        defaults, wrong = [_default(default, commands) for default in found()], []
    except MracadError as error:
        defaults, wrong = [], [str(error)]
    if trouble := cache.trouble():
        hint = "name another folder with MRACAD_CACHE, or off"
        wrong.append(f"the cache of documents cannot be written to {_folder()}: {trouble}; {hint}")
    return {
        "mracad": __version__,
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.release()} {platform.machine()}",
        "kernel": _version("cadquery-ocp"),
        "packages": _packages(),
        "threads": {"processors": os.cpu_count(), **{name: os.environ.get(name) for name in THREADS}},
        "encoding": {"files": sys.getfilesystemencoding(), "output": sys.stdout.encoding},
        "caches": {"documents": _documents(), "compiled code": _compiled()},
        "defaults": defaults,
        "problems": [*wrong, *(default["problem"] for default in defaults if default["problem"])],
    }


def lines(body: Mapping[str, Any]) -> list[str]:
    """The same as text."""
    found = [
        f"mracad {body['mracad']}, Python {body['python']}, {body['system']}",
        f"kernel: cadquery-ocp {body['kernel']}",
        "packages: " + ", ".join(f"{name} {version or 'missing'}" for name, version in body["packages"].items()),
    ]
    for title in ("threads", "encoding", "caches"):
        found += [f"{title}: " + ", ".join(f"{name} {value}" for name, value in body[title].items() if value)]
    for default in body["defaults"]:
        key = f"{default['command']} {default['option']}".strip()
        found.append(f"default: {key} = {json.dumps(default['value'], default=str)} from {default['from']}")
    return [*found, *(f"problem: {text}" for text in body["problems"])]


def _default(default: Default, commands: Mapping[str, click.Command]) -> dict[str, Any]:
    """A default, with what is wrong with it for one of the commands that it is for."""
    problem = None
    try:
        check(default, commands)
        if default.value != "" and not taken(default, commands):
            _refused(default, commands)
    except MracadError as error:
        problem = str(error)
    told = {"command": default.command, "option": default.option, "value": default.value}
    return {**told, "from": default.place, "problem": problem}


def _refused(default: Default, commands: Mapping[str, click.Command]) -> None:
    """Raise the error of the first command that has the option."""
    for name, command in commands.items():
        options = options_of(command)
        own = option(default, name, options)
        if own is not None:
            value(default, options[own], click.Context(command))


def _packages() -> dict[str, str | None]:
    """The versions of the packages that mracad needs, by name."""
    try:
        needs = metadata.requires("mracad") or []
    except metadata.PackageNotFoundError:
        return {}
    names = [re.split(r"[^\w.-]", need)[0] for need in needs if "extra ==" not in need]
    return {name: _version(name) for name in names}


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _documents() -> str:
    """How much the cache of healed documents holds, and where."""
    if cache.folder() is None:
        return "off"
    entries, total = cache.size()
    return f"{entries} of {size(total)} in {_folder()}, {'not ' if cache.trouble() else ''}writable"


def _folder() -> str:
    """The folder of the cache of documents, from the user's own."""
    path, home = str(cache.folder()), str(Path.home())
    return f"~{path.removeprefix(home)}" if path.startswith(f"{home}{os.sep}") else path


def _compiled() -> str:
    """Where compiled code is kept between runs."""
    return "NUMBA_CACHE_DIR" if os.environ.get("NUMBA_CACHE_DIR") else "beside the package"
