"""Where the real models lie (environment variable MRACAD_CORPUS), and the command line run in this process."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import mracad_cli  # noqa: F401  # before numpy: it keeps linear algebra to one thread
import pytest

os.environ["MRACAD_CACHE"] = "off"

SAMPLES = Path(__file__).parents[1] / "samples"
CORPUS = Path(os.environ["MRACAD_CORPUS"]) if os.environ.get("MRACAD_CORPUS") else None


LONG = 10**6
"""Real models of more bytes than this take part in some tests only where ``--long`` asks for it."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--long", action="store_true", help="more scales, and the largest real models everywhere")


class Outcome(NamedTuple):
    """Exit code, standard output and standard error of a command."""

    code: int
    out: str
    err: str


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Run a test that asks for ``corpus_file`` once for every real model; skip it, saying why, without them."""
    if "corpus_file" not in metafunc.fixturenames:
        return
    files = sorted(CORPUS.glob("*.step")) if CORPUS else []
    reason = "MRACAD_CORPUS does not name a folder of STEP models"
    values = files or [pytest.param(None, marks=pytest.mark.skip(reason=reason))]
    metafunc.parametrize("corpus_file", values, ids=[f.stem for f in files] or ["none"])


@pytest.fixture
def refined_file(corpus_file: Path, pytestconfig: pytest.Config) -> Path:
    """A real model that is not among the largest."""
    if corpus_file.stat().st_size > LONG and not pytestconfig.getoption("--long"):
        pytest.skip("more than 1 MB: pytest --long takes it")
    return corpus_file


@pytest.fixture
def mracad(capfd: pytest.CaptureFixture[str]) -> Callable[..., Outcome]:
    """Run the command line with the given words."""
    from mracad_cli.__main__ import main

    def run(*words: object) -> Outcome:
        capfd.readouterr()
        code = main([str(word) for word in words])
        return Outcome(code, *capfd.readouterr())

    return run


@pytest.fixture(scope="session")
def samples() -> Path:
    """The folder of sample models."""
    return SAMPLES
