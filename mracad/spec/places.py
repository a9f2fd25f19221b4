"""Places, features and patterns as texts, read: what they mean on a model says :mod:`mracad.edit.feature`."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

from mracad.errors import FileError, UsageError
from mracad.spec import sources
from mracad.spec.files import Naming
from mracad.spec.quantity import NUMBER, length

PLACE = "write a place as X,Y,Z in millimetres or #FACE@u,v"
VECTOR = "write X,Y,Z in millimetres: 0,0,-2.5"
FEATURE = (
    "write a feature as near:X,Y,Z,radius:R (mm), #FACE@u0:u1,v0:v1, the name of a .feature file or a source such as "
    "logo.png,width:30mm,height:0.4mm"
)
ZONE = "write a region as near:X,Y,Z,radius:R or box:X,Y,Z,X,Y,Z (mm), or radius<25mm"
GRID = "write it as NxM,DX,DY: 4x3,25,25"
POLAR = "write it as N,x|y|z or N,X,Y,Z,DX,DY,DZ: 6,z"
HEADING = "write it as X, Y, Z, u, v or edge#4"
ALONG = "write it as EDGE,N or EDGE,N,OFFSET: edge#4,10,15"

FAR = 1e12
"""Numbers of this size are no places and no distances, mm."""

MOST_PLACES = 10_000
"""Places that one edit takes."""

AXES = {"x": (0.0, 0.0, 0.0, 1.0, 0.0, 0.0), "y": (0.0, 0.0, 0.0, 0.0, 1.0, 0.0), "z": (0.0, 0.0, 0.0, 0.0, 0.0, 1.0)}


@dataclass(frozen=True)
class Point:
    """A point in space, mm."""

    xyz: tuple[float, ...]


@dataclass(frozen=True)
class OnFace:
    """A place by the parameters of a face, which is named or numbered (``#3``)."""

    face: str
    uv: tuple[float, ...]


@dataclass(frozen=True)
class Listed:
    """The places in a CSV file."""

    path: str


@dataclass(frozen=True)
class Disc:
    """What lies within a radius (mm) of a place."""

    middle: Point | OnFace
    radius: float


@dataclass(frozen=True)
class Box:
    """What lies between two corners, mm."""

    low: tuple[float, ...]
    high: tuple[float, ...]


@dataclass(frozen=True)
class Tight:
    """Where a face bends with a smaller radius, mm."""

    radius: float


Zone = Disc | Box | Tight
"""A region in space: a disc is a ball here."""


@dataclass(frozen=True)
class Rectangle:
    """What lies between two corners in the parameters of a face."""

    face: str
    low: tuple[float, float]
    high: tuple[float, float]


@dataclass(frozen=True)
class Stored:
    """A feature in a file."""

    path: str


@dataclass(frozen=True)
class Grid:
    """Numbers of places, and the steps between them, mm."""

    counts: tuple[int, int]
    steps: tuple[float, ...]


@dataclass(frozen=True)
class Polar:
    """Places around an axis: a point on it (mm), and its direction."""

    count: int
    centre: tuple[float, ...]
    axis: tuple[float, ...]


@dataclass(frozen=True)
class Along:
    """Places along an edge (its number), beside it by an offset, mm."""

    edge: int
    count: int
    offset: float


def numbers(text: str, counts: Sequence[int]) -> tuple[float, ...] | None:
    """Finite numbers between commas; None where these are no such, or other than ``counts`` of them."""
    parts = [part.strip() for part in text.split(",")]
    right = len(parts) in counts and all(re.fullmatch(NUMBER, part) and abs(float(part)) < FAR for part in parts)
    return tuple(map(float, parts)) if right else None


def whole(text: str) -> int | None:
    """A whole number written in digits; None for anything else, and for what nothing has so many of."""
    return int(text) if re.fullmatch(r"[0-9]{1,9}", text) else None


def spot(text: str, name: str) -> Point | OnFace:
    """A place from ``X,Y,Z``, ``near:X,Y,Z`` or ``#3@u,v``; raises UsageError."""
    face, at, rest = text.partition("@")
    found = numbers(rest, (2,)) if at else numbers(text.removeprefix("near:"), (3,))
    if found is None:
        raise _wrong(name, text, "a place", PLACE)
    return OnFace(face, found) if at else Point(found)


def place(text: str, name: str) -> Point | OnFace | Listed:
    """The same, or ``@FILE``; raises UsageError."""
    return Listed(text[1:]) if text.startswith("@") else spot(text, name)


def feature(text: str, name: str) -> Disc | Rectangle | Stored | sources.Source:
    """A feature from ``near:X,Y,Z,radius:R``, ``#3@u0:u1,v0:v1``, ``FILE.feature`` or the text of a source; raises
    UsageError."""
    if text.endswith(".feature"):
        return Stored(text)
    if sources.is_source(text):
        return sources.source(text, name)
    if disc := _disc(text, name, FEATURE):
        return disc
    box = re.fullmatch(rf"(.+)@({NUMBER}):({NUMBER}),({NUMBER}):({NUMBER})", text.replace(" ", ""))
    if not box:
        raise _wrong(name, text, "a feature", FEATURE)
    u0, u1, v0, v1 = map(float, box.groups()[1:])
    if not (u0 < u1 and v0 < v1):
        raise UsageError(f"{name}: the window {text} is empty", FEATURE)
    return Rectangle(box[1], (u0, v0), (u1, v1))


def _disc(text: str, name: str, hint: str) -> Disc | None:
    """A disc from ``near:X,Y,Z,radius:R``; None for another text."""
    disc = re.fullmatch(rf"near:(.*),\s*radius:\s*({NUMBER})\s*(?:mm)?", text)
    if disc is None:
        return None
    radius = float(disc[2])
    if not 0 < radius < FAR:
        raise UsageError(f"{name}: radius {radius:g} is not greater than zero", hint)
    return Disc(spot(disc[1], name), radius)


def is_zone(text: str) -> bool:
    """Whether a text means a region, and not a face."""
    return text.startswith("box:") or re.match(r"radius\s*[<>=]|near:.*radius", text) is not None


def zone(text: str, name: str, diagonal: float) -> Zone:
    """A region from ``near:X,Y,Z,radius:R``, ``box:X,Y,Z,X,Y,Z`` or ``radius<25mm``; raises UsageError.

    ``diagonal`` is that of the model, mm, of which a radius may be a share.
    """
    if text.startswith("box:"):
        corners = numbers(text.removeprefix("box:"), (6,))
        if corners is None:
            raise _wrong(name, text, "a box", ZONE)
        low, high = zip(*(sorted(pair) for pair in zip(corners[:3], corners[3:], strict=True)), strict=True)
        return Box(low, high)
    if disc := _disc(text, name, ZONE):
        if isinstance(disc.middle, OnFace):
            raise _wrong(name, text, "a region", ZONE)
        return disc
    if limit := re.fullmatch(r"radius\s*<\s*(.*)", text):
        return Tight(length(limit[1], diagonal, name))
    raise _wrong(name, text, "a region", ZONE)


def is_feature(text: str) -> bool:
    """Whether a text means a feature, and not a face."""
    return text.startswith("near:") or "@" in text or is_made(text)


def is_made(text: str) -> bool:
    """Whether a text means a feature that no model contains: that of a file, or of a source."""
    return text.endswith(".feature") or sources.is_source(text)


def table(path: str) -> list[tuple[str, tuple[float, ...]]]:
    """The rows of a CSV file: x, y, z and as the file goes on rotate (degrees), size, height; with their names.

    A first line that begins with a letter is its heading; empty lines and those that begin with # do not count.

    Raises
    ------
    FileError
        When it cannot be read, or for a bad line.
    """
    hint = "write x,y,z or x,y,z,rotate,size,height, with numbers in millimetres and degrees"
    found = _rows(path, (3, 4, 5, 6), "a place", "x,y,z", hint)
    for where, row in found:
        if any(factor <= 0 for factor in row[4:5]):
            raise FileError(f"{where}: size {row[4]:g} is not greater than zero", "give a factor such as 1")
        if any(factor == 0 for factor in row[5:6]):
            raise FileError(f"{where}: height 0 makes no copy", "leave the line out, or give a factor such as 1")
    return found


def moves(path: str) -> list[tuple[str, tuple[float, ...]]]:
    """The rows of a CSV file of points and their moves: x, y, z, dx, dy, dz (mm), with their names; errors as for
    :func:`table`."""
    columns = "x,y,z,dx,dy,dz"
    return _rows(path, (6,), "a point and its move", columns, f"write {columns}, with numbers in millimetres")


def _rows(path: str, counts: Sequence[int], noun: str, columns: str, hint: str) -> list[tuple[str, tuple[float, ...]]]:
    """The rows of a CSV file of places, with their names."""
    try:
        with open(path, encoding="utf-8") as file:
            lines = file.read().splitlines()
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
        raise FileError(
            f"cannot read '{path}': {why}", f"give the path of a CSV file with columns {columns}"
        ) from error
    name = path.replace("\\", "/").rpartition("/")[2]
    rows: list[tuple[str, tuple[float, ...]]] = []
    for number, line in enumerate(lines, 1):
        if not line.strip() or line.lstrip().startswith("#") or (not rows and re.match(r"\s*[\"A-Za-z]", line)):
            continue
        where = f"{name}:{number}"
        row = numbers(line, counts)
        if row is None:
            raise FileError(f"{where}: {line.strip()!r} is not {noun}", hint)
        rows.append((where, row))
        if len(rows) > MOST_PLACES:
            raise FileError(f"'{path}' names more than {MOST_PLACES} places", "give several files, one edit each")
    if not rows:
        raise FileError(f"'{path}' names no places", f"write lines {columns}")
    return rows


def vector(text: str, name: str) -> tuple[float, ...]:
    """Three coordinates of a point or a vector, mm, from ``X,Y,Z``; raises UsageError."""
    found = numbers(text, (3,))
    if found is None:
        raise _wrong(name, text, "three numbers", VECTOR)
    return found


def grid(text: str, name: str) -> Grid:
    """A grid from ``NxM,DX,DY``; raises UsageError."""
    match = re.fullmatch(r"\s*([0-9]+)\s*[xX]\s*([0-9]+)\s*,(.*)", text)
    steps = numbers(match[3], (2,)) if match else None
    if match is None or steps is None:
        raise _wrong(name, text, "a grid", GRID)
    wide, high = (_count(match[i], name, text, GRID) for i in (1, 2))
    _count(str(wide * high), name, text, GRID)
    return Grid((wide, high), steps)


def polar(text: str, name: str) -> Polar:
    """Places around an axis from ``N,AXIS``; raises UsageError."""
    first, _, rest = text.partition(",")
    count = _count(first.strip(), name, text, POLAR)
    six = AXES.get(rest.strip().lower()) or numbers(rest, (6,))
    if six is None:
        raise _wrong(name, text, "a circle of places", POLAR)
    if not any(six[3:]):
        raise UsageError(f"{name}: {text!r} has no direction", POLAR)
    return Polar(count, six[:3], six[3:])


def heading(text: str, name: str) -> str:
    """A direction from ``X``, ``Y``, ``Z``, ``u``, ``v`` or ``edge#4``, in small letters; raises UsageError."""
    found = text.strip().lower()
    if found in (*AXES, "u", "v") or (found.startswith("edge#") and whole(found.removeprefix("edge#"))):
        return found
    raise _wrong(name, text, "a direction", HEADING)


def along(text: str, name: str) -> Along:
    """Places along an edge from ``EDGE,N[,OFFSET]``; raises UsageError."""
    edge, _, rest = text.partition(",")
    first, comma, last = rest.partition(",")
    number = whole(edge.strip().removeprefix("edge#").removeprefix("#"))
    offset = numbers(last, (1,)) if comma else (0.0,)
    if number is None or offset is None:
        raise _wrong(name, text, "a row of places", ALONG)
    return Along(number, _count(first.strip(), name, text, ALONG), offset[0])


def _count(text: str, name: str, whole_text: str, hint: str) -> int:
    """How many places are asked for; raises UsageError."""
    count = whole(text)
    if not count:
        raise _wrong(name, whole_text, "a number of places", hint)
    if count > MOST_PLACES:
        raise UsageError(f"{name}: {whole_text!r}: more than {MOST_PLACES} places", "do them in several edits")
    return count


def _wrong(name: str, text: str, noun: str, hint: str) -> UsageError:
    return UsageError(f"{name}: {text!r} is not {noun}", hint)


Place = Annotated[str, Naming(prefix="@"), place]
"""The type of a field that is a place, or names a file of places."""

Vector = Annotated[str, vector]
"""The type of a field of three coordinates."""

Spot = Annotated[str, spot]
"""The type of a field that is a place."""

NAMED = Naming(ending=(".feature", *sources.IMAGES, *sources.GRIDS, *sources.OUTLINES), keyed=True)
"""How the text of a feature names a file."""

Feature = Annotated[str, NAMED, feature]
"""The type of a field that is a feature, or names the file of one."""
