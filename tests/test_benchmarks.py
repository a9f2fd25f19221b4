"""Benchmarks measure functions by name."""

import importlib
from operator import attrgetter

import pytest

from benchmarks.seams import PARTS


@pytest.mark.parametrize("function", [each for every in PARTS.values() for each in every])
def test_parts_of_the_edit_are_known(function):
    module, _, name = function.partition(":")
    assert callable(attrgetter(name)(importlib.import_module(module)))
