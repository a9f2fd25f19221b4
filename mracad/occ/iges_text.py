"""Preparing the text of IGES files for the kernel: names in ASCII, and missing limits of surfaces and curves."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mracad.occ.literals import chosen

_WIDTH = 64  # columns of a line that hold parameters
_LABEL = slice(56, 64)  # of the second line of a directory entry
_BEYOND = re.compile(rb"[\x80-\xff]")
_HOLLERITH = re.compile(rb"\s*(\d+)H")
_DIGITS = b"zyxwvutsrqponmlkjihgfedcbaZYXWVUTSRQPONMLKJIHGFEDCBA"
_POLES = {b"126": 1, b"128": 2}  # B-spline curves and surfaces: directions


@dataclass(frozen=True)
class Prepared:
    """A file as the kernel can read it.

    Attributes
    ----------
    text : bytes
    names : dict
        The names that the kernel reads as marks, by mark.
    warnings : tuple of str
    """

    text: bytes
    names: dict[str, str]
    warnings: tuple[str, ...]


def prepared(text: bytes, name: str, encoding: str | None) -> Prepared:
    """Replace names beyond ASCII by marks of the same length, and give B-spline surfaces and curves without limits the
    range of their knots.

    Parameters
    ----------
    text : bytes
        The whole file.
    name : str
        Name of the file, for warnings.
    encoding : str, optional
        The character set of its names; by default UTF-8 if that fits, else the most likely one.
    """
    try:
        file = _File(text)
        marks = {} if text.isascii() else file.mark()
        limited = file.limit()
    except (ValueError, IndexError):  # the kernel will report what is wrong
        return Prepared(text, {}, ())
    said = ""
    if marks:
        encoding, said = chosen(set(marks.values()), name, encoding)
    if limited:
        count = f"{limited} surface{'s' * (limited > 1)} or curve{'s' * (limited > 1)}"
        count += " without limits: the range of their knots was taken"
        said = f"{said}; {count}" if said else f"{name}: {count}"
    names = {mark.decode(): given.decode(encoding or "ascii", errors="replace") for mark, given in marks.items()}
    return Prepared(file.text() if marks or limited else text, names, (said,) if said else ())


class _File:
    """The sections of an IGES file."""

    def __init__(self, text: bytes) -> None:
        self.lines: dict[bytes, list[bytes]] = {kind: [] for kind in (b"S", b"G", b"D", b"P", b"T")}
        for line in text.splitlines():
            self.lines.setdefault(line[72:73], []).append(line)
        self.comma, self.end = self._delimiters()
        self.data: dict[int, list[bytes]] = {}
        for line in self.lines[b"P"]:
            self.data.setdefault(int(line[_WIDTH:72]), []).append(line[:_WIDTH])

    def _delimiters(self) -> tuple[bytes, bytes]:
        """The delimiters between parameters and after the last one."""
        head = b"".join(line[:72] for line in self.lines[b"G"])
        comma = head[2:3] if head.startswith(b"1H") else b","
        rest = head[4:] if head.startswith(b"1H") else head[1:]
        return comma, rest[2:3] if rest.startswith(b"1H") else b";"

    def mark(self) -> dict[bytes, bytes]:
        """Replace names beyond ASCII by marks; returns the names by mark."""
        marks: dict[bytes, bytes] = {}
        fresh = _marks(b"".join(itertools.chain.from_iterable(self.data.values())))

        def marked(given: bytes) -> bytes:
            if given.isascii():
                return given
            known = next((mark for mark, name in marks.items() if name == given), None)
            mark = known or next(mark for mark in fresh(len(given)) if mark not in marks)
            marks[mark] = given
            return mark

        for entry, lines in self.data.items():
            if not b"".join(lines).isascii():
                whole = b"".join(self._strings(b"".join(line.ljust(_WIDTH) for line in lines), marked))
                self.data[entry] = [whole[i : i + _WIDTH] for i in range(0, len(whole), _WIDTH)]
        for number, line in enumerate(self.lines[b"D"]):
            label = line[_LABEL].strip()
            self.lines[b"D"][number] = line[:56] + marked(label).rjust(8) + line[64:] if label else line
        for kind in (b"S", b"G"):
            self.lines[kind] = [_BEYOND.sub(b"?", line) for line in self.lines[kind]]
        return marks

    def _strings(self, data: bytes, changed) -> Iterator[bytes]:
        """The pieces of parameter data, with its strings changed."""
        at = 0
        while at < len(data):
            found = _HOLLERITH.match(data, at)
            if found:
                stop = found.end() + int(found[1])
                yield data[at : found.end()] + changed(data[found.end() : stop])
            else:
                ends = [end for end in (data.find(self.comma, at), data.find(self.end, at)) if end >= 0]
                stop = min(ends, default=len(data) - 1) + 1
                yield data[at:stop]
            at = stop

    def limit(self) -> int:
        """Give surfaces and curves without limits the range of their knots; returns their number."""
        count = 0
        for entry, lines in self.data.items():
            directions = _POLES.get(lines[0].split(self.comma, 1)[0].strip())
            if directions is None:
                continue
            whole = b"".join(lines)
            values = [value.strip() for value in whole.split(self.end, 1)[0].split(self.comma)]
            stated = _limited(values, directions)
            if stated is not None:
                count += 1
                self.data[entry] = list(_broken(stated, self.comma, self.end))
        return count

    def text(self) -> bytes:
        """The file with its lines renumbered."""
        entries = list(self.lines[b"D"])
        parameters: list[bytes] = []
        for entry, lines in self.data.items():
            first, second = entry - 1, entry
            entries[first] = entries[first][:8] + b"%8d" % (len(parameters) + 1) + entries[first][16:]
            entries[second] = entries[second][:24] + b"%8d" % len(lines) + entries[second][32:]
            for line in lines:
                number = len(parameters) + 1
                parameters.append(line.ljust(_WIDTH) + b"%8dP%7d" % (entry, number))
        last = self.lines[b"T"][0]
        last = last[:25] + b"%7d" % len(parameters) + last[32:]
        return b"\n".join([*self.lines[b"S"], *self.lines[b"G"], *entries, *parameters, last, b""])


def _limited(values: list[bytes], directions: int) -> list[bytes] | None:
    """The parameters of a B-spline with the limits that it lacks; None if it states them."""
    sums = [int(value) for value in values[1 : 1 + directions]]
    degrees = [int(value) for value in values[1 + directions : 1 + 2 * directions]]
    start = 6 + 3 * (directions - 1) + 1
    ranges: list[bytes] = []
    at, poles = start, 1
    for upper, degree in zip(sums, degrees, strict=True):
        knots = values[at : at + upper + degree + 2]
        ranges += [knots[degree], knots[upper + 1]]
        at, poles = at + len(knots), poles * (upper + 1)
    at += 4 * poles  # weights and points
    given = values[at : at + len(ranges)]
    if len(given) == len(ranges) and all(given) and _within(given, ranges):
        return None
    blank = len(given) < len(ranges) or not any(value.strip(b"0.") for value in given)
    rest = values[at + len(ranges) :] if blank and len(given) == len(ranges) else values[at:]
    return [*values[:at], *ranges, *(rest if any(rest) else [])]


def _within(given: list[bytes], ranges: list[bytes]) -> bool:
    """Whether values are limits, and not the numbers of other entities that follow in a file without limits."""
    (low, high), (first, last) = (
        np.array([value.upper().replace(b"D", b"E") for value in values]).astype(float).reshape(-1, 2).T
        for values in (given, ranges)
    )
    slack = 1e-6 * (last - first)
    return bool(((low < high) & (low >= first - slack) & (high <= last + slack)).all())


def _broken(values: list[bytes], comma: bytes, end: bytes) -> Iterator[bytes]:
    """Parameters broken into lines."""
    line = b""
    for value in [*(value + comma for value in values[:-1]), values[-1] + end]:
        if len(line) + len(value) > _WIDTH:
            yield line
            line = b""
        line += value
    yield line


def _marks(taken: bytes):
    """Makes marks of a given length that do not occur in the text, if there are any."""

    def of(length: int) -> Iterator[bytes]:
        every = (bytes(mark) for mark in itertools.product(_DIGITS, repeat=length))
        short = length < 3
        return (mark for mark in every if short or mark not in taken)

    return of
