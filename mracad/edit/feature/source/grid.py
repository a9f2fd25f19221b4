"""Heightmaps: grids of levels or heights from images, numpy arrays and tables of numbers.

Images come from anywhere: nothing is decoded before its size is known, and nothing in them is executed.
"""

from __future__ import annotations

import struct
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mracad.edit.feature.source.relief import Relief, bordered
from mracad.errors import FileError
from mracad.spec.sources import IMAGES, Heightmap

Array = np.ndarray

MOST = 40_000_000
"""Largest number of pixels of a heightmap."""

SIDE = 2048
"""Longest side that is worked on; larger heightmaps are averaged."""

FEWEST = 4
"""Least number of pixels in each direction."""

MOST_BYTES = 200_000_000
"""Largest table of numbers."""

LUMINANCE = (0.299, 0.587, 0.114)
"""Weights of red, green and blue."""

_ROWS = 128
"""Rows of squares averaged at a time."""


def heightmap(given: Heightmap, taper: float | None) -> Relief:
    """The relief of a heightmap; ``taper`` (mm) as in :func:`~mracad.edit.feature.source.relief.bordered`.

    Raises
    ------
    FileError
        For a file that is none.
    """
    file = Path(given.path)
    suffix = file.suffix.lower()
    full = None
    if suffix in IMAGES:
        levels, full = _image(file)
    else:
        levels = _array(file) if suffix == ".npy" else _table(file)
    _large_enough(file, levels.shape)
    if not np.isfinite(levels).all():
        row, column = np.argwhere(~np.isfinite(levels))[0]
        raise FileError(
            f"'{file.name}': row {row + 1}, column {column + 1} is not a finite number", "give heights in mm"
        )
    return _relief(levels, full, given, taper)


def _relief(levels: Array, full: float | None, given: Heightmap, taper: float | None) -> Relief:
    """Levels (row 0 at the top) as heights, mm; ``full`` is the step between them as a share of their range, if they
    have one."""
    scale = 1.0
    if given.height is not None:
        scale = given.height / (1.0 if full is not None else float(np.ptp(levels)) or 1.0)
    rim = np.concatenate([levels[[0, -1]].ravel(), levels[:, [0, -1]].ravel()])
    base = float(np.median(rim))
    notes: tuple[str, ...] = ()
    level = np.abs(rim - base) <= max(0.01 * float(np.ptp(levels)), full or 0.0)
    if np.count_nonzero(level) < len(rim) / 2:
        base = 0.0
    elif base:
        shown = f"{100 * base:.3g} %" if full is not None else f"{scale * base:.3g}"
        notes = (f"the level of its border, {shown}, is the face",)
    heights = scale * (levels - base)[::-1].T.astype(float)
    grain = 0.0 if full is None else scale * full / np.sqrt(12)
    return bordered(heights, given.width / levels.shape[1], taper, grain, notes)


def _image(file: Path) -> tuple[Array, float]:
    """Levels of an image, 0 to 1, and the step between them."""
    from PIL import Image, UnidentifiedImageError

    hint = "give a PNG or TIFF image in grey, 8 or 16 bits"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with Image.open(file, formats=("PNG", "TIFF")) as image:
                _small_enough(file, image.size[::-1])
                image.load()
                return _levels(image)
    except FileError:
        raise
    except UnidentifiedImageError as error:
        raise FileError(f"'{file.name}' is not a PNG or TIFF image", hint) from error
    except Image.DecompressionBombError as error:
        raise FileError(f"'{file.name}' has more than {MOST // 10**6} million pixels", "make it smaller") from error
    except FileNotFoundError as error:
        raise FileError(f"cannot read '{file}': {error.strerror}", "give the path of a PNG or TIFF image") from error
    except (OSError, SyntaxError, ValueError, TypeError, KeyError, IndexError, EOFError, struct.error) as error:
        raise FileError(f"'{file.name}' is a damaged image", hint) from error


def _levels(image: Any) -> tuple[Array, float]:
    """Levels of an image, and the step between them, as shares of their range."""
    if image.mode == "F":
        levels = _averaged(np.array(image, np.float32), _as_they_are)
        return _spread(levels), 0.0
    if image.mode.startswith("I"):
        levels = np.array(image)
        most = 65535 if levels.dtype.itemsize <= 2 or levels.max() <= 65535 else 2**31 - 1
        return _averaged(levels, _as_they_are) / most, 1.0 / most
    if image.mode in ("LA", "La", "PA", "RGBA", "RGBa") or "transparency" in image.info:
        pixels = np.array(image.convert("RGBA"))
        grey, clear = _averaged(pixels, _luminance), _averaged(pixels[..., 3:], _luminance)
        seen = grey[clear > 0.5]
        alike = not seen.size or float(np.ptp(seen)) < 0.02
        return clear if alike else grey * clear, 1 / 255
    return _averaged(np.array(image.convert("L" if image.mode in ("1", "L") else "RGB")), _luminance), 1 / 255


def _as_they_are(pixels: Array) -> Array:
    return pixels.astype(np.float32)


def _luminance(pixels: Array) -> Array:
    """Luminance ``(m, n)`` of grey or coloured pixels of 8 bits, 0 to 1."""
    if pixels.ndim == 2 or pixels.shape[2] == 1:
        return pixels.reshape(pixels.shape[:2]).astype(np.float32) / 255
    return np.asarray(pixels[..., :3].astype(np.float32) @ np.array(LUMINANCE, np.float32) / 255)


def _spread(levels: Array) -> Array:
    """Levels as shares of their range."""
    low, high = float(levels.min()), float(levels.max())
    return np.asarray((levels - low) / ((high - low) or 1.0))


def _averaged(pixels: Array, grey: Callable[[Array], Array]) -> Array:
    """Levels of pixels, averaged in squares so that no side is longer than :data:`SIDE`; some rows at a time."""
    step = -(-max(pixels.shape[:2]) // SIDE)
    high, wide = (max(count // step, 1) for count in pixels.shape[:2])
    found = np.empty((high, wide), np.float32)
    for k in range(0, high, _ROWS):
        part = grey(pixels[k * step : (k + _ROWS) * step, : wide * step])[: (high - k) * step]
        found[k : k + _ROWS] = part.reshape(-1, min(step, len(part)), wide, min(step, pixels.shape[1])).mean(
            axis=(1, 3)
        )
    return found


def _array(file: Path) -> Array:
    """The numbers of a numpy file, which is mapped, not read, until its size is known."""
    hint = "save a 2D array of numbers with numpy.save"
    try:
        found = np.load(file, mmap_mode="r", allow_pickle=False)
    except FileNotFoundError as error:
        raise FileError(f"cannot read '{file}': {error.strerror}", "give the path of a .npy file") from error
    except (OSError, ValueError, EOFError, SyntaxError, MemoryError, OverflowError) as error:
        raise FileError(f"'{file.name}' is not a numpy file of plain numbers", hint) from error
    if not isinstance(found, np.ndarray) or found.ndim != 2 or found.dtype.kind not in "fiub":
        raise FileError(f"'{file.name}' is not a 2D array of numbers", hint)
    _small_enough(file, found.shape)
    return _averaged(found, _as_they_are)


def _table(file: Path) -> Array:
    """The numbers of a text file, a row a line."""
    try:
        if file.stat().st_size > MOST_BYTES:
            raise FileError(f"'{file.name}' is larger than {MOST_BYTES // 10**6} MB", "give it as .npy, or coarser")
        with open(file, encoding="utf-8") as stream:
            lines = list(_rows(stream, file.name))
    except FileError:
        raise
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
        raise FileError(f"cannot read '{file}': {why}", "give the path of a grid of numbers") from error
    if not lines:
        raise FileError(f"'{file.name}' contains no numbers", "write a row of heights (mm) a line")
    return _averaged(np.array(lines), _as_they_are)


def _rows(lines: Iterable[str], name: str) -> Iterator[Array]:
    """The rows of a grid of numbers; raises FileError for another one."""
    first = 0
    for number, line in enumerate(lines, 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        words = line.replace(";", ",").strip().strip(",").split(",") if "," in line or ";" in line else line.split()
        try:
            row = np.array(words, np.float64)
        except ValueError as error:
            raise FileError(f"{name}:{number}: not a row of numbers", "separate numbers by commas") from error
        if first and len(row) != first:
            message = f"{name}:{number}: {len(row)} numbers in a row, {first} in those before"
            raise FileError(message, "give every row as many")
        first = len(row)
        yield row


def _small_enough(file: Path, shape: Sequence[int]) -> None:
    """Raise FileError for too many pixels."""
    if shape[0] * shape[1] > MOST:
        message = f"'{file.name}' has {shape[1]} × {shape[0]} pixels, more than {MOST // 10**6} million"
        raise FileError(message, "make it smaller")


def _large_enough(file: Path, shape: Sequence[int]) -> None:
    if min(shape) < FEWEST:
        message = f"'{file.name}' has {shape[1]} × {shape[0]} pixels, too few"
        raise FileError(message, f"give {FEWEST} × {FEWEST} at least")
