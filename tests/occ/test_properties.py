"""What a file states of its own size stays true; annotations that cannot be written are named."""

import io

import numpy as np
import pytest
from OCP.gp import gp_Pnt
from OCP.TDF import TDF_AttributeIterator
from OCP.XCAFDoc import XCAFDoc_Area, XCAFDoc_Centroid, XCAFDoc_Volume

from mracad.model.displacement import Displacement, Offset
from mracad.occ.apply import apply
from mracad.occ.files import read, write
from mracad.occ.labels import label_key, label_name, labels
from mracad.occ.load import Text
from mracad.occ.sizes import mass_of
from mracad.occ.view import view
from tests.conftest import CORPUS

EXACT = 1e-6  # what areas and volumes are measured to
KINDS = (XCAFDoc_Area, XCAFDoc_Volume, XCAFDoc_Centroid)


def stated(document):
    """Area, volume and centroid that a document states, by product."""
    found = {}
    for label in labels(document.shape_tool.GetShapes):
        attributes = TDF_AttributeIterator(label)
        while attributes.More():
            value = attributes.Value()
            if isinstance(value, KINDS):
                number = value.Get().Coord() if isinstance(value, XCAFDoc_Centroid) else value.Get()
                found.setdefault(label_name(label), {})[type(value)] = number
            attributes.Next()
    return found


def state(document, factor=1.0):
    """State what is so, or wrongly by a factor, of every product."""
    for label in labels(document.shape_tool.GetShapes):
        size = mass_of(document.shape_tool.GetShape_s(label))
        XCAFDoc_Area.Set_s(label, factor * size.area)
        XCAFDoc_Volume.Set_s(label, factor * size.volume)
        XCAFDoc_Centroid.Set_s(label, gp_Pnt(*(factor * x for x in size.centre)))


def again(document):
    stream = io.BytesIO()
    write(document, stream)
    return read(Text(stream.getvalue(), "again.step"))


def holds(document):
    for label in labels(document.shape_tool.GetShapes):
        size = mass_of(document.shape_tool.GetShape_s(label))
        said = stated(document)[label_name(label)]
        assert said[XCAFDoc_Area] == pytest.approx(size.area, rel=EXACT)
        assert said[XCAFDoc_Volume] == pytest.approx(size.volume, rel=EXACT)
        assert said[XCAFDoc_Centroid] == pytest.approx(size.centre, abs=100 * EXACT)


def test_what_moved_is_measured_again_in_inches(samples):
    document = read(samples / "assembly.step")
    state(document)
    before = stated(document)
    model = view(document)
    pushed = np.zeros_like(model.surfaces[0].net.poles)
    pushed[10:-10, 6:-6, 2] = 0.5
    apply(document, model, Displacement({0: Offset(pushed)}))
    found = again(document)
    holds(found)
    after = stated(found)
    for product, moved in (("base plate", False), ("pin", False), ("pad", True), ("pad pair", True), ("fixture", True)):
        assert (abs(after[product][XCAFDoc_Volume] / before[product][XCAFDoc_Volume] - 1) > 1e-4) == moved


def test_what_did_not_move_keeps_what_the_file_says(samples):
    document = read(samples / "bottle.step")
    state(document, factor=2.0)
    (said,) = stated(document).values()
    (kept,) = stated(again(document)).values()
    assert kept == {kind: pytest.approx(number, rel=1e-15) for kind, number in said.items()}
    document.moved.add(label_key(document.parts[0].label))
    holds(again(document))


PMI = b"""#9001=DIMENSIONAL_SIZE(#1,'bore (1)');
#9002=(GEOMETRIC_TOLERANCE('flat','',#1,#2)GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE((#3))POSITION_TOLERANCE());
#9003=DATUM('','',#1,.F.,'A');
#9004=PLUS_MINUS_TOLERANCE(#1,#9001);
ENDSEC;
END-ISO-10303-21;"""


def test_lost_annotations_are_named(mracad, samples, tmp_path):
    source = tmp_path / "in.step"
    text = (samples / "trimmed.step").read_bytes()
    source.write_bytes(text.replace(b"ENDSEC;\nEND-ISO-10303-21;", PMI))
    words = ("--scale", "8mm", "-o", tmp_path / "out.step", "-o", tmp_path / "out.stl", "--report", tmp_path / "r.json")
    result = mracad("smooth", source, *words)
    assert result.code == 0
    expected = "warning: out.step lacks 1 of 1 dimensions (bore (1)), 1 of 1 tolerances (flat), 1 of 1 datums (A)\n"
    assert result.err == expected
    assert '"what": "tolerances"' in (tmp_path / "r.json").read_text()
    assert mracad("smooth", samples / "trimmed.step", *words, "--overwrite").err == ""


@pytest.mark.skipif(CORPUS is None, reason="MRACAD_CORPUS does not name a folder of STEP models")
def test_ap242_keeps_its_annotations_and_ap214_does_not(mracad, tmp_path):
    source = CORPUS / "nist_ctc02_pmi_ap242.step"
    assert mracad("convert", source, "-o", tmp_path / "out.step").err == ""
    assert "AP242" in mracad("info", tmp_path / "out.step").out
    assert "22 of 22 tolerances" in mracad("convert", source, "--schema", "AP214", "-o", tmp_path / "14.step").err
