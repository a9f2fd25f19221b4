"""Places, features and patterns are read as they are written."""

import pytest

from mracad.errors import FileError, UsageError
from mracad.spec.places import (
    Along,
    Disc,
    Grid,
    Listed,
    OnFace,
    Point,
    Polar,
    Rectangle,
    Stored,
    along,
    feature,
    grid,
    place,
    polar,
    table,
)  # fmt: skip


@pytest.mark.parametrize(
    ("read", "text", "found"),
    [
        (place, "1, -2,3e1", Point((1.0, -2.0, 30.0))),
        (place, "near:1,2,3", Point((1.0, 2.0, 3.0))),
        (place, "#3@0.5,1", OnFace("#3", (0.5, 1.0))),
        (place, "@a/places.csv", Listed("a/places.csv")),
        (feature, "near:1,2,3,radius:4 mm", Disc(Point((1.0, 2.0, 3.0)), 4.0)),
        (feature, "near:#2@0,1,radius:4", Disc(OnFace("#2", (0.0, 1.0)), 4.0)),
        (feature, "lid @ 0:1, 2:3", Rectangle("lid", (0.0, 2.0), (1.0, 3.0))),
        (feature, "a.feature", Stored("a.feature")),
        (grid, "4x3,25,-5", Grid((4, 3), (25.0, -5.0))),
        (polar, "6,z", Polar(6, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))),
        (polar, "6,1,2,3,0,1,0", Polar(6, (1.0, 2.0, 3.0), (0.0, 1.0, 0.0))),
        (along, "edge#4,10", Along(4, 10, 0.0)),
        (along, "4,10,1.5", Along(4, 10, 1.5)),
    ],
)
def test_what_is_written_is_read(read, text, found):
    assert read(text, "x") == found


@pytest.mark.parametrize(
    ("read", "text"),
    [
        (place, "1,2"),
        (place, "1e999,0,0"),
        (place, "#3@1"),
        (feature, "near:1,2,3"),
        (feature, "near:1,2,3,radius:0"),
        (feature, "#3@1:0,0:1"),
        (grid, "3by3,1,1"),
        (grid, "200x200,1,1"),
        (polar, "6,0,0,0,0,0,0"),
        (polar, "²,z"),
        (along, "edge#1"),
        (along, "edge#1,0"),
    ],
)
def test_what_is_not_right_is_refused_by_name(read, text):
    with pytest.raises(UsageError, match=r"^x: "):
        read(text, "x")


def test_tables_of_places(tmp_path):
    path = tmp_path / "places.csv"
    path.write_text("x,y,z\n\n# none\n1,2,3\n4,5,6,90,2,-1\n")
    assert table(str(path)) == [("places.csv:4", (1.0, 2.0, 3.0)), ("places.csv:5", (4.0, 5.0, 6.0, 90.0, 2.0, -1.0))]
    for text in ("1,2\n", "1,2,3,0,0\n", "1,2,3,0,1,0\n", "x,y,z\n"):
        path.write_text(text)
        with pytest.raises(FileError):
            table(str(path))
