"""Compare models with committed reference figures: ``python samples/regress.py FILE…`` (``make regress``).

The figures of every file are in ``figures.json`` beside this script: results of ``mracad check --json``, and its size.
They are small, and tell what changed, where a golden file could only tell that something did.  For your own models copy
this script beside them; ``--update`` writes new figures.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterator
from pathlib import Path

from mracad.inspect.seams import seams, summary
from mracad.job.look import snapshot
from mracad.occ.check import check
from mracad.occ.contents import contents
from mracad.occ.files import read
from mracad.occ.sizes import mass

FIGURES = Path(__file__).with_name("figures.json")
SLACK = 1e-6  # relative; for lengths that are zero, millimetres


def figures(path: Path) -> dict:
    """A model in a few numbers."""
    document = read(path)
    model, facts, size, seen = snapshot(document), check(document), mass(document), contents(document)
    along = summary(seams(model))
    return {
        "unit": model.unit,
        "valid": facts.valid,
        "counts": [facts.solids, facts.shells, facts.faces, len(model.edges), facts.free_edges],
        "tolerance": max(facts.edge_tolerance, facts.vertex_tolerance),
        "volume": size.volume,
        "area": size.area,
        "centre": list(size.centre),
        "seams": [along.seams, along.smooth, along.gap, along.angle],
        "products": list(seen.products),
        "usages": seen.usages,
        "colours": len(seen.colours),
        "layers": len(seen.layers),
    }


def differences(ref: object, new: object, where: str) -> Iterator[str]:
    """The differences between two figures, in words."""
    if isinstance(ref, dict) and isinstance(new, dict):
        for key in sorted(ref.keys() | new.keys()):
            yield from differences(ref.get(key), new.get(key), f"{where} {key}")
    elif isinstance(ref, list) and isinstance(new, list) and len(ref) == len(new):
        for number, pair in enumerate(zip(ref, new, strict=True), 1):
            yield from differences(*pair, f"{where} {number}")
    elif isinstance(ref, float) or isinstance(new, float):
        if not (isinstance(ref, int | float) and isinstance(new, int | float) and close(ref, new)):
            yield f"{where}: {new}, was {ref}"
    elif ref != new:
        yield f"{where}: {new}, was {ref}"


def close(ref: float, new: float) -> bool:
    """Whether two numbers are the same but for rounding."""
    return math.isclose(ref, new, rel_tol=SLACK, abs_tol=SLACK)


def main(arguments: list[str]) -> int:
    """Compare, or with ``--update`` write; 1 when something differs."""
    files = [Path(word) for word in arguments if word != "--update"]
    found = {path.stem: figures(path) for path in files}
    if "--update" in arguments:
        FIGURES.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n")
        return 0
    reference = json.loads(FIGURES.read_text())
    wrong = [line for name, new in found.items() for line in differences(reference.get(name, {}), new, name)]
    print("\n".join(wrong) if wrong else f"{len(found)} models are unchanged")
    return 1 if wrong else 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
