"""Identifiers, names and descriptions of products and instances in STEP files.

The kernel keeps only one name of each: it takes the identifier if the name has no ASCII letter, and writes the name as
the identifier too.  So it gets marks instead of names, both on reading and on writing; the names are put in here.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label

from mracad.occ.document import Document
from mracad.occ.labels import Title, components, label_key, label_name, labels, name_label
from mracad.occ.literals import decoded

_STRING = rb"'([^']*+(?:''[^']*+)*+)'"
_STATED = tuple(  # each begins with its word, so that the search is fast
    re.compile(word + rb"(\s*\(\s*)" + _STRING + rb"(\s*,\s*)" + _STRING + rb"\s*,\s*(?:" + _STRING + rb"|\$)")
    for word in (b"PRODUCT", b"NEXT_ASSEMBLY_USAGE_OCCURRENCE")
)
_WORD = re.compile(rb"[A-Z]+(?:_[A-Z]+)*")
_MARK = "mracad title "


def marked(text: bytes) -> tuple[bytes, list[Title]]:
    """A STEP file with marks for the names of products and instances, and the title of each mark."""
    titles: list[Title] = []

    def mark(found: re.Match[bytes]) -> bytes:
        start = found.start()
        if text[start - 1 : start] in (b"_", b"'"):  # the end of another word, or part of a text
            return found[0]
        opening, identifier, comma, name, description = found.groups()
        titles.append(Title(*map(decoded, (identifier, name, description or b""))))
        word = _WORD.match(found[0])[0]  # type: ignore[index]
        return b"%s%s'%s'%s'%s',''" % (word, opening, identifier, comma, _mark(len(titles) - 1))

    for pattern in _STATED:
        text = pattern.sub(mark, text)
    return text, titles


def put_names(document: Document, titles: list[Title]) -> None:
    """Replace the marks that the kernel has read by names; the document keeps the titles."""
    for label in _labels(document):
        name = label_name(label)
        if name.startswith(_MARK):
            title = titles[int(name[len(_MARK) :])]
            document.titles[label_key(label)] = title
            name_label(label, title.shown)


@contextmanager
def marking(document: Document) -> Iterator[Mapping[bytes, Title]]:
    """Give products and instances marks for names inside the block; yields the title of each mark.

    Products that no file has named are named by their label, or by a number.
    """
    tool = document.shape_tool
    unnamed = (f"part {count}" for count in itertools.count(1))
    titles: dict[bytes, Title] = {}
    names: list[tuple[TDF_Label, str | None]] = []
    for number, label in enumerate(_labels(document)):
        title, name = document.titles.get(label_key(label)), label_name(label)
        if title is None and tool.IsComponent_s(label):
            title = Title(None, name)
        elif title is None:
            own = name or next(unnamed)
            title = Title(own, own)
        titles[_mark(number)] = title
        names.append((label, name if label.IsAttribute(TDataStd_Name.GetID_s()) else None))
    try:
        for number, (label, _) in enumerate(names):
            name_label(label, _mark(number).decode())
        yield titles
    finally:
        for label, before in names:
            if before is None:
                label.ForgetAttribute(TDataStd_Name.GetID_s())
            else:
                name_label(label, before)


def _mark(number: int) -> bytes:
    return f"{_MARK}{number}".encode()


def _labels(document: Document) -> Iterator[TDF_Label]:
    """The labels of the products of a document, each followed by those of the instances in it."""
    for label in list(labels(document.shape_tool.GetShapes)):
        yield label
        yield from components(label)
