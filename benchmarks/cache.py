"""A second read of a file, from the cache of healed documents, beside the first: CPU time.

Usage: python benchmarks/cache.py FILE…
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path


def main(paths: list[str]) -> None:
    """Print one line for each file."""
    from mracad.occ.files import read

    with tempfile.TemporaryDirectory() as folder:
        os.environ["MRACAD_CACHE"] = folder
        for path in paths:
            took = []
            for _ in range(2):
                start = time.process_time()
                read(path)
                took.append(time.process_time() - start)
            print(f"{Path(path).name:42s} first {took[0]:6.3f} s   second {took[1]:6.3f} s   {took[1] / took[0]:.3f}")


if __name__ == "__main__":
    main(sys.argv[1:])
