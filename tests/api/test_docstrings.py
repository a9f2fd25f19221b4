"""Every public name says what it takes, gives and raises, and its example runs."""

import doctest
import inspect
import re
import shutil

import pytest

import mracad

FUNCTIONS = [name for name in mracad.__all__ if not name.startswith("_") and name[0].islower()]
CLASSES = [name for name in mracad.__all__ if name[0].isupper()]


@pytest.fixture(scope="module")
def folder(tmp_path_factory, samples):
    place = tmp_path_factory.mktemp("samples")
    for file in samples.glob("*.step"):
        shutil.copy(file, place)
    return place


@pytest.mark.parametrize("name", FUNCTIONS)
def test_functions_are_described_and_their_examples_run(name, folder, monkeypatch):
    monkeypatch.chdir(folder)
    told = inspect.getdoc(getattr(mracad, name))
    assert all(f"\n{head}\n{'-' * len(head)}\n" in told for head in ("Parameters", "Returns", "Raises", "Examples"))
    assert not re.search(r"--\w", told) and max(map(len, told.splitlines())) <= 120
    example = doctest.DocTestParser().get_doctest(told, {"mracad": mracad}, name, None, 0)
    assert len(example.examples) and doctest.DocTestRunner().run(example).failed == 0


@pytest.mark.parametrize("name", CLASSES)
def test_classes_are_described(name):
    assert getattr(mracad, name).__doc__.strip()
