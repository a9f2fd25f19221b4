"""IGES files that state less than they should: splines without limits."""

import io
from collections import defaultdict

import numpy as np
import pytest

from mracad.occ.files import read, write
from mracad.occ.load import Text
from mracad.occ.view import view
from tests.occ import shapes

BEHIND = {b"126": 5, b"128": 4}  # limits, and for a curve its normal
WIDTH = 64


def without_limits(text, kind, blank):
    """An IGES file in which B-splines of one kind end with their control points, or have blanks for limits."""
    lines = text.splitlines()
    places = defaultdict(list)
    for number, line in enumerate(lines):
        if line[72:73] == b"P":
            places[line[WIDTH:72]].append(number)
    for numbers in places.values():
        data = b"".join(lines[number][:WIDTH] for number in numbers)
        if data.split(b",", 1)[0] == kind:
            values = data.partition(b";")[0].split(b",")[: -BEHIND[kind]]
            values += [b""] * BEHIND[kind] if blank else []
            short = (b",".join(values) + b";").ljust(len(data))
            for place, number in enumerate(numbers):
                lines[number] = short[WIDTH * place : WIDTH * (place + 1)] + lines[number][WIDTH:]
    return b"\n".join([*lines, b""])


@pytest.mark.parametrize("kind", BEHIND)
@pytest.mark.parametrize("blank", [False, True])
@pytest.mark.parametrize("bounds", [(), (0.1, 0.9, 0.2, 0.7)])
def test_splines_without_limits_have_the_range_of_their_knots(kind, blank, bounds):
    face = shapes.face_on(shapes.bspline(shapes.wavy_poles(9, 7)), *bounds)
    stream = io.BytesIO()
    write(shapes.document(face), stream, "iges")
    right = view(read(Text(stream.getvalue(), "right.igs")))
    document = read(Text(without_limits(stream.getvalue(), kind, blank), "x.igs"))
    model = view(document)
    assert np.array_equal(model.surfaces[0].net.poles, right.surfaces[0].net.poles)
    assert model.diagonal == right.diagonal and len(model.edges) == len(right.edges)
    assert "without limits" in document.warnings[0]
