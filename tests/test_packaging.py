"""What packagers and other projects take: hooks, the citation, the conda recipe."""

import os
import re
import shlex
import subprocess
import sys
import tomllib
from itertools import chain
from pathlib import Path

import pytest

from mracad.formats import READABLE
from mracad.version import __version__

yaml = pytest.importorskip("yaml")

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
HOOKS = {hook["id"]: hook for hook in yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text())}

CONDA = {"cadquery-ocp": "ocp", "matplotlib": "matplotlib-base"}
"""Names of packages on conda-forge that differ."""


@pytest.fixture
def hooked(tmp_path):
    """Run a hook on files as pre-commit does: its words, then their names."""
    (tmp_path / "mracad").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m mracad_cli "$@"\n')
    (tmp_path / "mracad").chmod(0o755)
    path = {"PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"}

    def run(name, *files):
        words = [*shlex.split(HOOKS[name]["entry"]), *map(str, files)]
        return subprocess.run(words, capture_output=True, text=True, env={**os.environ, **path})

    return run


def test_a_hook_fails_for_any_bad_file_and_tries_them_all(hooked, tmp_path):
    good, bad = tmp_path / "good.toml", tmp_path / "bad.toml"
    good.write_text('[[step]]\nuse = "check"\n')
    bad.write_text('[[step]]\nuse = "chek"\n')
    assert hooked("mracad-recipe-check", good, good).returncode == 0
    result = hooked("mracad-recipe-check", bad, good)
    assert result.returncode == 1 and "bad.toml:2" in result.stderr and result.stdout == "1. check: check\n"


def test_a_hook_takes_the_files_that_its_command_reads():
    pattern = HOOKS["mracad-check"]["files"]
    assert all(re.search(pattern, f"parts/lid{extension}") for extension in READABLE)
    assert not re.search(pattern, "step.py") and "mracad check" in HOOKS["mracad-check"]["entry"]
    assert re.search(HOOKS["mracad-recipe-check"]["files"], "samples/batch/recipe.toml")


def test_one_version():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    recipe = yaml.safe_load((ROOT / "packaging" / "conda" / "meta.yaml").read_text())
    assert citation["version"] == recipe["package"]["version"] == __version__
    assert citation["license"] == recipe["about"]["license"] == PROJECT["license"]


def test_conda_needs_what_pip_needs():
    recipe = yaml.safe_load((ROOT / "packaging" / "conda" / "meta.yaml").read_text())
    extras = (PROJECT["optional-dependencies"][name] for name in ("cadquery", "features", "view"))
    needs = {CONDA.get(name, name) for name in chain(PROJECT["dependencies"], *extras)}
    assert set(recipe["requirements"]["run"]) == needs | {f"python {PROJECT['requires-python']}"}


def test_issues_ask_for_what_is_needed():
    fault = yaml.safe_load((ROOT / ".github" / "ISSUE_TEMPLATE" / "fault.yml").read_text())
    assert "mracad env" in next(part for part in fault["body"] if part["id"] == "env")["attributes"]["label"]
