"""Units, structure, names, colours, layers, materials and annotations of two documents."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mracad.inspect.compare.subject import EQUAL, Match, Subject, layer, paired
from mracad.inspect.verdict import Figure, Finding, Layer
from mracad.model.facts import Carrier, Contents, Occurrence

_Key = tuple[tuple[str, Figure], ...]  # the figures of one counted thing


def noted(layer: Layer, format: str) -> Layer:
    """A layer that a format cannot hold: its differences are one note."""
    if not layer.findings:
        return layer
    figures: dict[str, Figure] = {"format": format, "what": layer.name, "count": len(layer.findings)}
    return replace(layer, status="pass", findings=(), notes=(*layer.notes, Finding("not-held", figures=figures)))


def units(ref: str, new: str) -> Layer:
    """The units of the files; lengths are always compared in millimetres."""
    return layer("units", new if ref == new else f"{new}, was {ref}", [], {"ref": ref, "new": new})


def assembly(ref: Subject, new: Subject) -> Layer:
    """Placed products, and their places."""
    before = {(p.path, p.product, k): p.frame for p, k in _numbered(ref.contents)}
    after = {(p.path, p.product, k): p.frame for p, k in _numbered(new.contents)}
    findings = _differences("assembly", map(_placed, before), map(_placed, after))
    slack = EQUAL * max(ref.model.diagonal, 1.0)
    for place in sorted(before.keys() & after.keys()):
        shift = float(np.abs(np.subtract(before[place], after[place])).max())
        if shift > slack:
            findings.append(Finding("placement", figures={**dict(_placed(place)), "by": shift}))
    was, now = ref.contents.usages, new.contents.usages
    if was != now:
        findings.append(Finding("usages", figures={"was": was, "now": now}))
    text = f"{len(new.contents.products)} products, {now} usages, {len(new.contents.tree)} placed"
    return layer("assembly", text, findings, {"ref": was, "new": now})


def _numbered(contents: Contents) -> Iterator[tuple[Occurrence, int]]:
    """Everything placed, and the number of earlier ones with the same path and product."""
    seen: Counter[tuple[tuple[str, ...], str]] = Counter()
    for placed in contents.tree:
        yield placed, seen[placed.path, placed.product]
        seen[placed.path, placed.product] += 1


def _placed(place: tuple[tuple[str, ...], str, int]) -> _Key:
    path, product, _ = place
    spelled = "/".join(name or "(no name)" for name in path)
    return ("path", spelled), ("product", "" if product == path[-1] else product)


def names(ref: Subject, new: Subject, groups: Sequence[Match]) -> Layer:
    """Names of products and faces."""
    products = [[(("product", name),) for name in subject.contents.products] for subject in (ref, new)]
    findings = _differences("product", *products)
    for i, j in _pairs(groups):
        was, now = ref.model.faces[i].name, new.model.faces[j].name
        if was != now:
            findings.append(paired(ref, new, i, j, "face-name", was=was, now=now))
    named = sum(bool(face.name) for face in new.model.faces)
    text = f"{len(new.contents.products)} products, {named} named faces"
    return layer("names", text, findings, {"products": list(new.contents.products)})


def colours(ref: Subject, new: Subject, groups: Sequence[Match], lacks: Mapping[str, str]) -> Layer:
    """Colours of products, instances and faces: if a format has no products, the colour of each face."""
    marked = _marked("colours", ref, new, groups) if "assembly" not in lacks else []
    opaque = "transparency" in lacks
    findings, notes = list(marked), []
    for i, j in _pairs(groups):
        was, now = ref.model.faces[i].colour, new.model.faces[j].colour
        if was == now:
            continue
        if opaque and was[:7] == now[:7]:
            notes.append(paired(ref, new, i, j, "face-colour", was=was, now=now))
        else:
            findings.append(paired(ref, new, i, j, "face-colour", was=was, now=now))
    if notes:
        figures: dict[str, Figure] = {"format": lacks["transparency"], "what": "transparency", "count": len(notes)}
        notes = [Finding("not-held", figures=figures)]
    return layer("colours", f"{len(new.contents.colours)}", findings, {}, notes)


def marks(name: str, ref: Subject, new: Subject, groups: Sequence[Match]) -> Layer:
    """Layers or materials of products, instances and faces."""
    return layer(name, f"{len(getattr(new.contents, name))}", _marked(name, ref, new, groups), {})


_VALUES = {"colours": ("of", "colour"), "layers": ("layer",), "materials": ("density",)}


def _marked(name: str, ref: Subject, new: Subject, groups: Sequence[Match]) -> list[Finding]:
    """Attributes that only one document has; faces of the reference have their number in the new document."""
    numbers = {ref.face_numbers[i]: new.face_numbers[j] for i, j in _pairs(groups)}
    old = [_key(name, mark, numbers) for mark in getattr(ref.contents, name)]
    fresh = [_key(name, mark, None) for mark in getattr(new.contents, name)]
    return _differences(name, old, fresh)


def _key(name: str, mark: tuple[Any, ...], numbers: Mapping[int, int] | None) -> _Key:
    place: Carrier = mark[0]
    face = None if place.face < 0 else place.face if numbers is None else numbers.get(place.face)
    inside = place.inside or (place.face >= 0 and face is None)
    where = ("product", place.product), ("component", place.component), ("face", face), ("inside", inside)
    return (*where, *zip(_VALUES[name], mark[1:], strict=True))


def pmi(ref: Mapping[str, int], new: Mapping[str, int]) -> Layer:
    """Dimensions, tolerances and datums."""
    findings = [
        Finding(kind, figures={"was": count, "now": new[kind]}) for kind, count in ref.items() if new[kind] != count
    ]
    text = ", ".join(f"{count} {kind}" for kind, count in new.items())
    return layer("annotations", text, findings, {"ref": dict(ref), "new": dict(new)})


def _pairs(groups: Sequence[Match]) -> list[tuple[int, int]]:
    return [pair for group in groups for pair in group.pairs()]


def _differences(rule: str, ref: Iterable[_Key], new: Iterable[_Key]) -> list[Finding]:
    """Entries that only one of two lists has."""
    old, fresh = Counter(ref), Counter(new)
    return [
        Finding(rule, figures={"change": change, **dict(key)})
        for change, only in (("lost", old - fresh), ("new", fresh - old))
        for key in sorted(only.elements(), key=str)
    ]
