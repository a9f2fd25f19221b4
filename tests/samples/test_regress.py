"""The reference figures of the samples hold, and a change is found and named."""

import importlib.util

import pytest

from tests.conftest import SAMPLES


@pytest.fixture(scope="module")
def regress():
    spec = importlib.util.spec_from_file_location("regress", SAMPLES / "regress.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_samples_are_as_their_figures_say(regress, capsys):
    assert regress.main([str(path) for path in sorted(SAMPLES.glob("*.step"))]) == 0
    assert capsys.readouterr().out == "8 models are unchanged\n"


def test_a_change_is_named(regress, tmp_path, capsys):
    other = tmp_path / "panel.step"
    other.write_bytes((SAMPLES / "panel_clean.step").read_bytes())
    assert regress.main([str(other)]) == 1
    assert "panel area: " in capsys.readouterr().out


def test_figures_are_equal_but_for_rounding(regress):
    assert not list(regress.differences({"a": [1.0, "x"]}, {"a": [1.0 + 1e-9, "x"]}, "m"))
    assert list(regress.differences({"a": 1.0, "b": None}, {"a": 1.1}, "m")) == ["m a: 1.1, was 1.0"]
