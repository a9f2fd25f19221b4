"""Write the sample models: ``python samples/make.py [OUTDIR] [names…]``.

The models are built from control points and knots here, not with mracad, so that they can judge it. The bytes are
reproducible: noise is from a seeded PCG64, products and header are named, and everything that a mathematics library may
round differently on another machine (sines, the kernel's evaluations) is put on a dyadic grid, which also keeps the
text short. Lengths are millimetres.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from models.assembly import assembly
from models.documents import write
from models.panel import panel, panel_clean, panel_inside
from models.parts import blade, bottle, trimmed
from models.shell import shell

from mracad.occ.document import Document

HERE = Path(__file__).resolve().parent

SAMPLES: dict[str, Callable[[], Document]] = {
    build.__name__: build for build in (panel, panel_clean, panel_inside, shell, trimmed, bottle, blade, assembly)
}


def main(arguments: Sequence[str]) -> int:
    """Write the named samples (all when none is named) into a folder, this one by default."""
    known = [argument for argument in arguments if argument in SAMPLES]
    folders = [argument for argument in arguments if argument not in SAMPLES]
    if len(folders) > 1:
        print(f"no such sample: {' '.join(folders[1:])}; there are {' '.join(SAMPLES)}", file=sys.stderr)
        return 2
    folder = Path(folders[0]) if folders else HERE
    folder.mkdir(parents=True, exist_ok=True)
    for key in known or SAMPLES:
        path = folder / f"{key}.step"
        write(SAMPLES[key](), path)
        print(f"{path}  {path.stat().st_size / 1e6:.2f} MB")
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
