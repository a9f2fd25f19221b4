"""What Python's prompt and notebooks say of objects: one line each, and tables in which names are text."""

import io
from dataclasses import fields, is_dataclass

import pytest
from scipy.interpolate import make_interp_spline

import mracad
from mracad.report import notebook
from mracad.wavelet import wavedec
from tests.report.conftest import HOSTILE
from tests.report.test_page import Read

ROOTS = "document", "report", "snapshot", "info", "check", "compare", "render", "spectrum", "pyramid"


def stream(shape):
    """A STEP file."""
    file = io.BytesIO()
    mracad.write(shape, file)
    file.seek(0)
    return file


@pytest.fixture(scope="module")
def made(slab):
    """One of each of what functions return."""
    document = mracad.smooth(mracad.read(stream(slab)), scale=4)
    return {
        "document": document,
        "report": mracad.report_of(document),
        "snapshot": mracad.snapshot(slab),
        "info": mracad.info(slab, all=True, at=(5, 5, 2)),
        "check": mracad.check(slab),
        "compare": mracad.compare(document, slab),
        "render": mracad.render(slab, size="60x40"),
        "spectrum": mracad.spectrum(slab),
        "pyramid": wavedec(make_interp_spline(range(40), range(40))),
    }


def within(thing, found):
    """All dataclasses in a thing, one of each kind with the longest ``repr``."""
    if is_dataclass(thing):
        if len(repr(thing)) > len(found.get(type(thing).__name__, "")):
            found[type(thing).__name__] = repr(thing)
        for each in fields(thing):
            within(getattr(thing, each.name), found)
    elif isinstance(thing, dict):
        within(list(thing.values()), found)
    elif isinstance(thing, list | tuple | set | frozenset):
        for each in thing:
            within(each, found)
    return found


@pytest.mark.parametrize("root", ROOTS)
def test_everything_is_one_short_line(made, root):
    found = within(made[root], {})
    assert found and all(len(text) < 200 and text.isprintable() for text in found.values()), found
    assert root != "report" or {"Report", "Model", "Edit", "Net", "Edge", "Offset", "FaceOutcome"} <= set(found)


def test_lines_say_what_matters(made, slab):
    surface = made["snapshot"].surfaces[0]
    assert repr(made["document"]) == "Document(stdin: 2 NURBS faces of 6, mm, AP214, 1 edit)"
    assert repr(surface.net).endswith("poles=array(12×12×3), weights=None)")
    assert repr(surface) == "Surface(index=0, net=Net, faces=(4,), origin='bspline')"
    assert repr(made["check"]).endswith(": passed)")
    assert "2 of 6 faces edited" in repr(made["report"])


def test_long_and_strange_names_end_and_are_escaped(slab):
    document = mracad.read(stream(slab))
    document.name = "a\nb\x1b[31m" + 500 * "x"
    assert repr(document).startswith(r"Document(a\nb\x1b[31mxxx") and len(repr(document)) < 200


@pytest.mark.parametrize("name", ["document", "report", "info", "check"])
def test_notebooks_get_tables_in_which_names_are_text(slab, name, monkeypatch):
    monkeypatch.setattr(notebook, "_frame", lambda document: f"the model of {document.name}")
    document = mracad.read(stream(slab))
    document.name = HOSTILE
    looks = {"info": mracad.info, "check": mracad.check, "document": lambda it: it}
    shown = looks[name](document) if name in looks else mracad.report_of(mracad.smooth(document, scale=4))
    text = shown._repr_html_()
    read = Read(text)
    assert HOSTILE in read.texts and HOSTILE not in text and not read.scripts and not read.addresses
    assert ("<iframe" in text) == (name in ("document", "info")) and len(text) < 6000
