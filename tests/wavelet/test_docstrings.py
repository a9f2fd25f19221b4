"""Every public name says what it takes, gives and raises, and its example runs."""

import doctest
import inspect
import subprocess
import sys

import pytest

from mracad import wavelet
from mracad.wavelet import Pyramid

METHODS = [name for name, each in vars(Pyramid).items() if inspect.isfunction(each) and name[0] != "_"]


def runs(told, name):
    example = doctest.DocTestParser().get_doctest(told, {}, name, None, 0)
    return len(example.examples) > 0 and doctest.DocTestRunner().run(example).failed == 0


@pytest.mark.parametrize("name", wavelet.__all__)
def test_public_names_are_described_and_their_examples_run(name):
    told = inspect.getdoc(getattr(wavelet, name))
    heads = ["Attributes"] if inspect.isclass(getattr(wavelet, name)) else ["Parameters", "Returns"]
    assert all(f"\n{head}\n{'-' * len(head)}\n" in told for head in (*heads, "Examples"))
    assert runs(told, name)


@pytest.mark.parametrize("name", METHODS)
def test_methods_of_pyramids_are_described_and_their_examples_run(name):
    assert runs(inspect.getdoc(getattr(Pyramid, name)), name)


def test_the_room_and_its_splines_need_only_numpy_and_scipy():
    assert runs(wavelet.__doc__, "wavelet")
    code = (
        "import sys, numpy, scipy.interpolate; before = set(sys.modules)\n"
        "from mracad.wavelet import *\n"
        "waverec(wavedec(scipy.interpolate.make_interp_spline(range(9), numpy.eye(9))))\n"
        "print(*{each.split('.')[0] for each in set(sys.modules) - before} - set(sys.stdlib_module_names))"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert set(found) <= {"mracad", "numpy", "scipy"}
    with pytest.raises(AttributeError):
        _ = wavelet.nothing
