"""Faces in STEP files, compared entity by entity."""

import re
from dataclasses import replace

import numpy as np
import pytest

from mracad.job.output import Target, written
from mracad.job.produce import _Copies
from mracad.occ.check import centres
from mracad.occ.entities import alike
from mracad.occ.files import read
from tests.conftest import SAMPLES


@pytest.fixture(scope="module")
def document():
    return read(SAMPLES / "assembly.step")


@pytest.fixture(scope="module")
def made(document):
    return written(document, Target("part.step"))


def test_numbers_do_not_matter(document, made):
    places = np.array(centres(document)) / document.units.mm
    more = re.sub(rb"#(\d+)", lambda found: b"#%d" % (int(found[1]) + 1000), made.data)
    assert alike(made.data, more, places, 1e-9)
    assert not alike(made.data, more, places + 1.0, 1e-9)


@pytest.mark.parametrize(
    ("what", "by"),
    [(rb"(CARTESIAN_POINT\('',\(-?)(\d)", rb"\g<1>9\2"), (rb"(DIRECTION\('',\()(0|1)\.", rb"\g<1>0.\2"),
     (rb"(ADVANCED_FACE.*)\.T\.", rb"\1.F."), (rb"(CIRCLE\('',#\d+,)", rb"\g<1>7"),
     (rb"(LINE\('',#)(\d+)", rb"\g<1>\g<2>1")],
)  # fmt: skip
def test_a_damaged_entity_is_found_on_the_faces_that_consist_of_it_alone(document, made, what, by):
    copies, faces = _Copies(lambda: document), range(len(document.faces))
    assert copies.states(made, document, faces)
    found = list(re.finditer(what, made.data))
    differ = []
    for each in (found[len(found) // 3], found[len(found) // 2]):
        data = made.data[: each.start()] + each.expand(by) + made.data[each.end() :]
        damaged = replace(made, data=data)
        differ.append([face for face in faces if not copies.states(damaged, document, [face])])
    assert any(differ) and all(len(each) < len(faces) for each in differ)
