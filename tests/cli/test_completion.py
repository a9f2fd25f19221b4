"""Completion in shells: of commands, options, their values, and files that fit."""

import os
import shutil
import subprocess
import sys

import pytest
from click.shell_completion import BashComplete
from mracad_cli.__main__ import group

TREE = ("part.step", "part.stl", "part.mra", "fair.toml", "old.iges", "leather.png", "notes.txt", ".hidden.step")


@pytest.fixture
def here(tmp_path, monkeypatch):
    for name in TREE:
        (tmp_path / name).touch()
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "lid.step").touch()
    monkeypatch.chdir(tmp_path)
    return tmp_path


def completed(*words):
    *args, incomplete = words
    return [i.value for i in BashComplete(group, {}, "mracad", "_MRACAD_COMPLETE").get_completions(args, incomplete)]


def test_commands_options_and_choices():
    assert completed("smo") == ["smooth"] and completed("feature", "") == ["extract", "list", "make"]
    assert completed("smooth", "--sc") == ["--scale", "--schema", "--scalar"]
    assert completed("smooth", "--keep", "g") == ["g0", "g1", "g2"]
    assert completed("completion", "z") == ["zsh"]


@pytest.mark.parametrize(
    ("words", "found"),
    [
        (("info", ""), ["old.iges", "part.step", "parts/"]),
        (("info", "parts/"), ["parts/lid.step"]),
        (("info", "."), [".hidden.step"]),
        (("run", ""), ["fair.toml", "parts/"]),
        (("run", "fair.toml", "p"), ["part.step", "parts/"]),
        (("compare", "part.step", "o"), ["old.iges"]),
        (("smooth", "part.step", "-o", "p"), ["part.step", "part.stl", "parts/"]),
        (("batch", "fair.toml", "-O", ""), ["parts/"]),
        (("compose", "part.step", "part.m"), ["part.mra"]),
        (("repeat", "--feature", "l"), ["leather.png"]),
        (("check", "--junit", ""), ["parts/"]),
        (("info", "nowhere/"), []),
    ],
)
def test_files_that_fit(here, words, found):
    assert completed(*words) == found


def test_texts_of_options(here):
    assert completed("smooth", "--faces", "t") == ["type:bspline"]
    assert "curvature:gauss" in completed("render", "--show", "curv")
    assert completed("render", "--show", "deviation:part.s") == ["deviation:part.step", "deviation:part.stl"]
    assert completed("repeat", "--fill", "h") == ["hexagons,spacing:"]


def test_what_only_edits_show_is_offered_to_them_alone():
    assert completed("smooth", "--show", "t") == ["treatment"] and completed("render", "--show", "t") == []
    assert completed("smooth", "--show", "dev")[:2] == ["deviation", "deviation:"]
    assert completed("convert", "--scalar", "dev") == completed("render", "--show", "dev") == ["deviation:"]


def test_no_numerical_library_is_loaded_and_no_default_is_read(here):
    (here / "mracad.toml").write_text("this is wrong")
    words = {"_MRACAD_COMPLETE": "bash_complete", "COMP_WORDS": "mracad smooth --keep g", "COMP_CWORD": "3"}
    probe = (
        "import sys, atexit; from mracad_cli.__main__ import main\n"
        "atexit.register(lambda: print([m for m in ('OCP', 'numpy', 'scipy', 'numba') if m in sys.modules]))\n"
        "main(['smooth'])"
    )
    result = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, env={**os.environ, **words})
    assert result.stdout == "plain,g0\nplain,g1\nplain,g2\n[]\n", result


SHELLS = {
    "bash": ("-n",),
    "zsh": ("-n",),
    "fish": ("--no-execute",),
    "powershell": (),
}


@pytest.mark.parametrize("shell", SHELLS)
def test_a_script_is_understood_by_its_shell(mracad, here, shell):
    result = mracad("completion", shell)
    assert result.code == 0 and result.err == "" and "_MRACAD_COMPLETE" in result.out
    assert f"{shell}_complete" in result.out
    if shell in ("bash", "zsh"):
        assert "*/ ]]" in result.out  # nothing follows a folder
    if SHELLS[shell] and shutil.which(shell):
        path = here / "script"
        path.write_text(result.out)
        assert subprocess.run([shell, *SHELLS[shell], path], capture_output=True).returncode == 0


@pytest.mark.skipif(not shutil.which("bash"), reason="there is no bash")
def test_bash_completes(mracad, here):
    (here / "script").write_text(mracad("completion", "bash").out)
    (here / "bin").mkdir()
    (here / "bin" / "mracad").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m mracad_cli "$@"\n')
    (here / "bin" / "mracad").chmod(0o755)
    probe = (
        "compopt() { :; }; . ./script; COMP_WORDS=(mracad info pa); COMP_CWORD=2; "
        '_mracad_completion mracad; echo "${COMPREPLY[@]}"'
    )
    path = {"PATH": f"{here / 'bin'}{os.pathsep}{os.environ['PATH']}"}
    result = subprocess.run(["bash", "-c", probe], capture_output=True, text=True, env={**os.environ, **path})
    assert result.stdout == "part.step parts/\n", result
