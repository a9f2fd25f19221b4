"""What notebooks show: the model in a frame that can reach nothing, or its picture."""

from html.parser import HTMLParser

import pytest
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox

from mracad.api.document import of
from mracad.report import notebook
from mracad.report.notebook import ROWS, cell
from tests.occ import shapes
from tests.report.conftest import HOSTILE
from tests.report.test_page import Read


class Frames(HTMLParser):
    """The attributes of the frames in a text."""

    def __init__(self, text):
        super().__init__()
        self.found = []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        if tag == "iframe":
            self.found.append(dict(attributes))


def framed(text):
    """What is in the only frame."""
    [frame] = Frames(text).found
    assert frame["sandbox"] == "allow-scripts", "it can neither reach the notebook nor open anything"
    return frame["srcdoc"]


def test_the_frame_is_a_whole_page_of_its_own():
    document = shapes.document(BRepPrimAPI_MakeBox(1.0, 2.0, 3.0).Shape(), names={0: HOSTILE})
    text = of(document, lambda: document)._repr_html_()
    assert len(text) < 600_000
    inner = framed(text)
    read = Read(inner)
    assert [given.get("id") or given.get("type") for given, _ in read.scripts] == ["head", "mesh", "three", "module"]
    assert read.addresses and all(each.startswith("data:") for each in read.addresses)
    assert "default-src 'none'" in inner and HOSTILE not in inner and HOSTILE not in text
    assert "\\u003cscript" in inner, "the name is in the data of the model"


@pytest.mark.parametrize("most", [1, notebook.MOST])
def test_models_with_too_many_faces_get_a_picture(monkeypatch, most):
    monkeypatch.setattr(notebook, "MOST", most)
    document = shapes.document(BRepPrimAPI_MakeBox(1.0, 2.0, 3.0).Shape())
    inner = framed(cell([("Model", "box")], document=document))
    assert "data:image/png" in inner
    assert ("too many faces to turn" in inner) == (most == 1) == (not Read(inner).scripts)


def test_long_tables_end_and_say_so():
    read = Read(cell([], ["A"], [[f"row {k}"] for k in range(ROWS + 3)]))
    assert f"row {ROWS - 1}" in read.texts and f"row {ROWS}" not in read.texts
    assert "and 3 more" in read.texts
