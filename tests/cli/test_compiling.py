"""A first run that has to compile says so, once."""

import pytest
from mracad_cli.progress import compiling
from mracad_cli.say import voice

from mracad import note


@pytest.mark.parametrize(("words", "lines"), [((), 1), (("--quiet",), 0)])
def test_a_first_run_says_that_it_compiles(mracad, samples, monkeypatch, words, lines):
    from mracad.occ import view

    seen = view.view

    def viewed(*arguments, **options):
        for _ in range(2):
            note.doing(note.COMPILING)
        return seen(*arguments, **options)

    monkeypatch.setattr(view, "view", viewed)
    result = mracad("check", samples / "bottle.step", *words)
    assert result.code == 0 and "compiling" not in result.out
    assert sum(note.COMPILING in line for line in result.err.splitlines()) == lines


def test_processes_that_compile_together_say_it_once(capfd, monkeypatch):
    import os

    monkeypatch.setattr(voice, "quiet", False)
    with compiling():
        for _ in range(2):
            child = os.fork()
            if not child:
                note.doing(note.COMPILING)
                os._exit(0)
            os.waitpid(child, 0)
        note.doing(note.COMPILING)
    note.doing(note.COMPILING)
    assert capfd.readouterr().err.count(note.COMPILING) == 1
