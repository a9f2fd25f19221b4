"""Texts in STEP files: read in any character set, written as ISO 10303-21 requires."""

from __future__ import annotations

import codecs
import re

from mracad.errors import UsageError
from mracad.occ.charset import detect

_STRINGS = re.compile(rb"'[^']*'|/\*.*?\*/", re.DOTALL)
_BEYOND = re.compile("[\x00-\x1f\x7f-\uffff]+|[^\x00-\uffff]+")
_DIRECTIVE = re.compile(
    r"''|\\\\|\\X2\\(?P<two>(?:[0-9A-F]{4})*)\\X0\\|\\X4\\(?P<four>(?:[0-9A-F]{8})*)\\X0\\|\\X\\(?P<one>[0-9A-F]{2})"
    r"|\\P(?P<page>[A-I])\\|\\S\\(?P<high>.)|\\(?P<control>[NT])\\",
    re.DOTALL,
)


def conforming(text: bytes, name: str, encoding: str | None = None) -> tuple[bytes, str]:
    """A STEP file with its strings in ASCII, and a warning, or ``""``.

    Parameters
    ----------
    text : bytes
    name : str
        Name of the file, for the message.
    encoding : str, optional
        The character set of its strings; by default UTF-8 if that fits, else the most likely one.

    Raises
    ------
    UsageError
        For an unknown character set.
    """
    if encoding is not None:
        encoding = known(encoding)
    if text.isascii():
        return text, ""
    strings = {_joined(found[0]) for found in _STRINGS.finditer(text) if found[0][:1] == b"'"}
    strings = {string for string in strings if not string.isascii()}
    encoding, warning = chosen(strings, name, encoding)

    def plain(found: re.Match[bytes]) -> bytes:
        piece = found[0]
        if piece.isascii():
            return piece
        if piece[:1] == b"/":
            return b"/**/"
        return escaped(_joined(piece).decode(encoding, errors="replace"))

    return _STRINGS.sub(plain, text), warning


def chosen(strings: set[bytes], name: str, encoding: str | None) -> tuple[str, str]:
    """The character set of the texts of a file that are not ASCII (``encoding`` if given), and a warning or ``""``."""
    if encoding is None:
        if all(_is(string, "utf-8") for string in strings):
            return "utf-8", ""
        guess = detect(strings)
        count = f"{len(strings)} text{'s are' if len(strings) > 1 else ' is'}"
        return guess, f"{name}: {count} neither ASCII nor UTF-8, read as {guess}; --encoding NAME overrides this"
    bad = sum(not _is(string, encoding) for string in strings)
    return encoding, f"{name}: {bad} of {len(strings)} texts are not {encoding}: characters are lost" if bad else ""


def known(encoding: str) -> str:
    """The name in Python of a character set; raises UsageError if it cannot be that of a model file."""
    try:
        found = codecs.lookup(encoding).name
        if b"'A\\".decode(found) == "'A\\":
            return found
    except (LookupError, UnicodeError, TypeError):
        pass
    raise UsageError(
        f"encoding: {encoding!r} is not a character set of model files",
        "give one, such as utf-8, gb18030, cp932 or latin-1",
    )


def escaped(content: str) -> bytes:
    """The content of a quoted string in ASCII: other characters as ``\\X2\\…\\X0\\``, or ``\\X4\\…\\X0\\`` beyond 16
    bits."""
    return _BEYOND.sub(_hexadecimal, content).encode()


def encoded(text: str) -> bytes:
    """A text as the content of a quoted string in a STEP file."""
    return escaped(text.replace("\\", "\\\\").replace("'", "''"))


def decoded(content: bytes) -> str:
    """The text of the content of a quoted string in a STEP file."""
    page = "1"

    def sign(found: re.Match[str]) -> str:
        nonlocal page
        if found["page"]:
            page = str(ord(found["page"]) - ord("A") + 1)
            return ""
        if found["high"]:
            return bytes([ord(found["high"]) | 0x80]).decode(f"iso8859-{page}", errors="replace")
        if found["control"]:
            return {"N": "\n", "T": "\t"}[found["control"]]
        for kind, codec in (("one", "latin-1"), ("two", "utf-16-be"), ("four", "utf-32-be")):
            if found[kind] is not None:
                return bytes.fromhex(found[kind]).decode(codec, errors="replace")
        return found[0][0]

    return _DIRECTIVE.sub(sign, re.sub(r"[\r\n]+", "", content.decode(errors="replace")))


def _hexadecimal(run: re.Match[str]) -> str:
    kind, codec = (4, "utf-32-be") if run[0][0] > "\uffff" else (2, "utf-16-be")
    return f"\\X{kind}\\{run[0].encode(codec, errors='replace').hex().upper()}\\X0\\"


def _joined(string: bytes) -> bytes:
    """A string without its line breaks, which are not part of it and may split a character."""
    return string.replace(b"\r", b"").replace(b"\n", b"")


def _is(string: bytes, encoding: str) -> bool:
    try:
        string.decode(encoding)
    except UnicodeError:
        return False
    return True
