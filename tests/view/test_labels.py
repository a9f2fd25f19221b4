"""Numbers on pictures do not cover each other."""

import io

import numpy as np
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from OCP.gp import gp_Pnt
from PIL import Image

from mracad.spec.pictures import Picture
from mracad.view.labels import Label, placed
from mracad.view.picture import render
from tests.occ import shapes


def test_texts_take_the_next_place_that_is_free_or_none():
    at = np.array([[50, 50]])
    labels = [Label("a", at), Label("b", np.array([[55, 52], [50, 70]])), Label("c", at + 3), Label("d", at * 0 + 2)]
    found, left_out = placed(labels, lambda text: (20, 10), np.array([[0, 0], [100, 100]]))
    assert found == [("a", 50, 50), ("b", 50, 70)]
    assert left_out == 2, "one has no room, one would leave the picture"


def counted(count):
    """Whether something is written in the lower right corner of a picture of a row of cubes."""
    cubes = [BRepPrimAPI_MakeBox(gp_Pnt(15 * k, 0, 0), 10.0, 10.0, 10.0).Shape() for k in range(count)]
    drawn = render(shapes.document(*cubes), Picture(show="faces", view=("top",), size="400x300"))
    picture = np.asarray(Image.open(io.BytesIO(drawn.data)).convert("L"))
    return bool((picture[275:, 200:] < 128).any())


def test_faces_without_number_are_counted():
    assert counted(20) and not counted(3)
