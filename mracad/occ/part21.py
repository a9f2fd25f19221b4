"""The text of STEP files: the kernel's output made shorter and reproducible, and annotations in it."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Mapping

from mracad.occ.labels import Title
from mracad.occ.literals import decoded, encoded, escaped

_STYLES = b" = MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION("
_ENTITY = re.compile(rb"#(\d+) = (?:[^';]|'[^']*')*;\n")
_COUNTED = re.compile(rb" = (?:PRODUCT|NEXT_ASSEMBLY_USAGE_OCCURRENCE)\([^;]*;")  # broken if the number is long
_REFERENCE = re.compile(rb"'[^']*'|#(\d+)")
_PMI = {  # each begins with a word, so that the search is fast
    "dimensions": (rb"DIMENSIONAL_(?:SIZE|LOCATION)\w*\s*\(", rb"ANGULAR_(?:SIZE|LOCATION)\w*\s*\("),
    "tolerances": (rb"_TOLERANCE\s*\((?=\s*')",),
    "datums": (rb"DATUM\s*\(",),
    "notes": (rb"ANNOTATION(?:_[A-Z]+)?_OCCURRENCE\s*\(",),
}
_ARGUMENTS = re.compile(rb"(?:'(?:[^']|'')*'|[^';()])*")
_TEXTS = re.compile(rb"'((?:[^']|'')*)'")


def pmi(text: bytes) -> dict[str, tuple[str, ...]]:
    """The names of the dimensions, tolerances, datums and notes in a STEP file; ``""`` for one without a name."""
    found = {}
    for kind, patterns in _PMI.items():
        names = []
        for match in (match for pattern in patterns for match in re.finditer(pattern, text)):
            texts = [name for name in _TEXTS.findall(_ARGUMENTS.match(text, match.end())[0]) if name]  # type: ignore[index]
            names.append(decoded(texts[-1 if kind == "datums" else 0]) if texts else "")
        if names:
            found[kind] = tuple(names)
    return found


def tidy(text: bytes, titles: Mapping[bytes, Title] | None = None) -> bytes:
    """Remove from a STEP file what differs from process to process and what is redundant, and put in the titles.

    Groups of styles are sorted by the parts that they colour, reals have no trailing zeros, points and strings no line
    breaks, and strings are ASCII.

    Parameters
    ----------
    text : bytes
        The output of the kernel.
    titles : mapping, optional
        Titles of products and instances, by the marks that the kernel wrote for their names.
    """
    pieces = text.split(b"'")  # every second one is within quotes
    for i in range(1, len(pieces), 2):
        if b"\n" in pieces[i] or not pieces[i].isascii():
            pieces[i] = escaped(pieces[i].replace(b"\n", b"").decode())
    _entitle(pieces, titles or {})
    plain = re.sub(rb"\n {4}(?=[-.0-9])", b"", b"'".join(pieces[::2]))
    plain = _COUNTED.sub(lambda found: re.sub(rb"\n *", b"", found[0]), plain)
    pieces[::2] = b"".join(re.split(rb"(\.(?:[0-9]*[1-9])?)0+(?=[,)E])", plain)).split(b"'")
    return _styles_in_order(b"'".join(pieces))


def _entitle(pieces: list[bytes], titles: Mapping[bytes, Title]) -> None:
    """Replace marks by titles: the mark of a product is also its identifier, that of an instance is not."""
    known = {title.identifier for title in titles.values()}
    unused = (number for number in map(str, itertools.count(1)) if number not in known)
    for i in range(1, len(pieces), 2):
        title = titles.get(pieces[i])
        if title is None:
            continue
        head = i if pieces[i - 1].endswith(b"PRODUCT(") else i - 2
        if head == i or pieces[head - 1].endswith(b"NEXT_ASSEMBLY_USAGE_OCCURRENCE("):
            identifier = next(unused) if title.identifier is None else title.identifier
            pieces[head : head + 5 : 2] = map(encoded, (identifier, title.name, title.description))
        else:
            pieces[i] = encoded(title.name)


def _styles_in_order(text: bytes) -> bytes:
    """Sort the groups of styles by what they colour, and renumber all entities from the first of them.

    The kernel writes them in the order of addresses in memory, which differs from process to process.
    """
    if text.count(_STYLES) < 2:
        return text
    start, end = text.rfind(b"\n#", 0, text.find(_STYLES)) + 1, text.rfind(b"ENDSEC;")
    entities = {int(entity[1]): entity[0] for entity in _ENTITY.finditer(text, start, end)}
    first = min(entities)
    groups = [number for number, entity in entities.items() if _STYLES in entity]

    def below(number: int, seen: set[int]) -> Iterator[int]:
        """An entity and all that it refers to, depth first, without those before the styles."""
        if number in seen:
            return
        seen.add(number)
        yield number
        for found in _REFERENCE.finditer(entities[number], len(b"#%d" % number)) if number in entities else ():
            if found[1]:
                yield from below(int(found[1]), seen)

    groups.sort(key=lambda group: [number for number in below(group, set()) if number < first])
    seen: set[int] = set()
    order = [number for root in (*groups, *entities) for number in below(root, seen) if number in entities]
    anew = {old: b"#%d" % new for old, new in zip(order, entities, strict=True)}
    body = text[:start] + b"".join(entities[number] for number in order) + text[end:]
    return _REFERENCE.sub(lambda found: anew.get(int(found[1]), found[0]) if found[1] else found[0], body)
