"""Files of details (``.mra``): a zip file of numpy arrays and a header; see ``docs/mra.md``."""

from __future__ import annotations

import io
import math
import os
import zipfile
import zlib
from itertools import pairwise
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta

from mracad.bspline.knots import KnotVector
from mracad.bspline.refine import is_nested
from mracad.bspline.surface import Net
from mracad.edit.details import Detail, Details
from mracad.errors import FileError, MracadError

Array = np.ndarray

FORMAT = "mracad details 1"
HEADER = "header.json"
HINT = "make one with mracad level --details"

MOST = 1 << 30
"""Largest number of bytes in all parts of a file: enough for about ten million control points."""

MOST_HEADER, MOST_KNOTS = 1 << 25, 1 << 20
"""Largest number of bytes of a header, and of knots of a knot vector."""

MOST_FACES = 1_000_000
"""Largest number of a face."""

SPARE = 4096
"""Largest number of bytes of an array besides its numbers."""

BAD = (
    zipfile.BadZipFile, zlib.error, msgspec.MsgspecError, EOFError, KeyError, NotImplementedError, RuntimeError,
    OverflowError, ValueError, SyntaxError,
)  # fmt: skip
"""Exceptions that reading a damaged zip file, header or array raises."""


_Degree = Annotated[int, Meta(ge=1, le=25)]


class _Surface(msgspec.Struct, forbid_unknown_fields=True):
    """The details of one surface."""

    faces: list[Annotated[int, Meta(ge=1, le=MOST_FACES)]]
    product: str
    names: list[str]
    degrees: tuple[_Degree, _Degree]
    periodic: tuple[bool, bool]
    levels: Annotated[int, Meta(ge=1, le=64)]
    wavelength: Annotated[float, Meta(gt=0.0)]


class _Header(msgspec.Struct, forbid_unknown_fields=True):
    """The content of ``header.json``; lengths in mm."""

    format: str
    unit: str
    model: str
    diagonal: Annotated[float, Meta(gt=0.0)]
    made: str
    surfaces: list[_Surface]


def save(details: Details) -> bytes:
    """Details as the bytes of a file."""
    surfaces, stream = [], io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for number, each in enumerate(details.surfaces):
            u, v, count = each.net.u, each.net.v, len(each.levels)
            faces, names = [face + 1 for face in each.faces], list(each.names)
            ends, degrees = (u.periodic, v.periodic), (u.degree, v.degree)
            surfaces.append(_Surface(faces, each.product, names, degrees, ends, count, each.wavelength))
            for name, array in _arrays(each).items():
                part = io.BytesIO()
                np.lib.format.write_array(part, np.ascontiguousarray(array, dtype="<f8"), allow_pickle=False)
                _put(archive, f"{number}/{name}.npy", part.getvalue())
        header = _Header(FORMAT, "mm", details.model, details.diagonal, details.made, surfaces)
        _put(archive, HEADER, msgspec.json.format(msgspec.json.encode(header)) + b"\n")
    return stream.getvalue()


def _put(archive: zipfile.ZipFile, name: str, data: bytes) -> None:
    """Add a part without its time, so that the same details give the same bytes."""
    info = zipfile.ZipInfo(name)
    archive.writestr(info, data, zipfile.ZIP_DEFLATED, compresslevel=1)


def _arrays(detail: Detail) -> dict[str, Array]:
    """The arrays of a surface by name."""
    found = {"points": detail.net.poles}
    for number, level in enumerate(detail.levels):
        found |= {f"u{number}": level.u.knots, f"v{number}": level.v.knots, f"d{number}": level.poles}
    found |= {} if detail.net.weights is None else {"weights": detail.net.weights}
    found |= {} if detail.rest is None else {"rest": detail.rest}
    return found


def load(path: str | os.PathLike[str]) -> Details:
    """Details from a file.

    Raises
    ------
    FileError
        For a file that cannot be read, is not one of details, is damaged, or contains more than :data:`MOST` bytes.
    """
    file = Path(path)
    try:
        with zipfile.ZipFile(file) as archive:
            return _Reader(archive).details()
    except OSError as error:
        raise FileError(f"cannot read '{file}': {error.strerror or error}", HINT) from error
    except MracadError as error:
        raise FileError(f"'{file.name}' is damaged: {error.message}", HINT) from error
    except BAD as error:
        said = error.args[0] if isinstance(error, KeyError) else str(error)
        raise FileError(f"'{file.name}' holds no details: {' '.join(str(said).split())[:200]}", HINT) from error


class _Reader:
    """Reads the parts of an archive, and refuses those that are too large."""

    def __init__(self, archive: zipfile.ZipFile) -> None:
        self.archive = archive
        self.left = MOST

    def details(self) -> Details:
        """All details in the file."""
        header = msgspec.json.decode(self._part(HEADER, MOST_HEADER), type=_Header)
        if header.format != FORMAT or header.unit != "mm":
            raise FileError(f"its format is {header.format!r} in {header.unit!r}, not {FORMAT!r} in 'mm'")
        surfaces = tuple(self._detail(str(number), each) for number, each in enumerate(header.surfaces))
        return Details(header.model, header.diagonal, header.made, surfaces)

    def _detail(self, place: str, told: _Surface) -> Detail:
        levels = []
        for number in range(told.levels):
            u, v = (
                KnotVector(self._numbers(f"{place}/{axis}{number}"), degree, periodic)
                for axis, degree, periodic in zip("uv", told.degrees, told.periodic, strict=True)
            )
            levels.append(Net(u, v, self._array(f"{place}/d{number}", (u.count, v.count, 3))))
        u, v = levels[0].u, levels[0].v
        weights = self._array(f"{place}/weights", (u.count, v.count)) if self._has(f"{place}/weights") else None
        rest = self._array(f"{place}/rest", (u.count, v.count, 3)) if self._has(f"{place}/rest") else None
        net = Net(u, v, self._array(f"{place}/points", (u.count, v.count, 3)), weights)
        for fine, coarse in pairwise(levels):
            if not (is_nested(coarse.u, fine.u) and is_nested(coarse.v, fine.v)):
                raise FileError(f"the knots of the levels of surface {place} are not nested")
        faces = tuple(face - 1 for face in told.faces)
        return Detail(net, tuple(levels), rest, told.wavelength, faces, told.product, tuple(told.names))

    def _has(self, name: str) -> bool:
        return f"{name}.npy" in self.archive.NameToInfo

    def _array(self, name: str, shape: tuple[int, ...]) -> Array:
        """An array of a known shape."""
        found = self._read(name, math.prod(shape))
        if found.shape != shape:
            raise FileError(f"{name} has the shape {found.shape}, not {shape}")
        return found

    def _numbers(self, name: str) -> Array:
        """A list of numbers of any length."""
        found = self._read(name, MOST_KNOTS)
        if found.ndim != 1:
            raise FileError(f"{name} has the shape {found.shape}")
        return found

    def _read(self, name: str, most: int) -> Array:
        """An array of at most ``most`` numbers."""
        stream = io.BytesIO(self._part(f"{name}.npy", 8 * most + SPARE))
        version = np.lib.format.read_magic(stream)
        header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, fortran, kind = header(stream)
        data = stream.read()
        if kind != np.dtype("<f8") or fortran or len(data) != 8 * math.prod(shape):
            raise FileError(f"{name} is not an array of {8 * math.prod(shape)} bytes")
        found = np.frombuffer(data, dtype="<f8").reshape(shape).astype(float)
        if not np.isfinite(found).all():
            raise FileError(f"{name} has a number that is not finite")
        return found

    def _part(self, name: str, most: int) -> bytes:
        """The bytes of a part, at most ``most``."""
        info = self.archive.getinfo(name)
        if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise FileError(f"{name} is compressed in an unknown way")
        self.left -= info.file_size
        if info.file_size > most or self.left < 0:
            raise FileError(f"{name} has {info.file_size} bytes, which is too many")
        return self.archive.read(info)
