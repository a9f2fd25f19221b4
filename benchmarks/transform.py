"""Speed of the wavelet transform against PyWavelets' ``bior4.4``, one thread each.

Run as a script.  Decomposes and recomposes a cubic net of 1027 × 1027 control points on uneven knots over five levels,
then nets of growing size, and prints one line of ratios.
"""

# ruff: noqa: E402
from __future__ import annotations

import os

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[name] = "1"

import time
from collections.abc import Callable

import numpy as np
import pywt

from mracad.bspline.knots import KnotVector
from mracad.wavelet.ladder import rungs_by_level
from mracad.wavelet.transform import decompose, reconstruct

LEVELS = 5
SIZE = 1027
SIZES = (515, SIZE, 2003)


def best(*runs: Callable[[], object], repeats: int = 7) -> list[float]:
    """Least processor time of each run, s; runs alternate, so that other load on the machine affects all of them."""
    times = []
    for _ in range(repeats):
        for run in runs:
            begin = time.process_time()
            run()
            times.append(time.process_time() - begin)
    return [min(times[i :: len(runs)]) for i in range(len(runs))]


def ladder(poles: int, seed: int) -> list[KnotVector]:
    """Five levels below a cubic knot vector with spans that vary by a factor of 5."""
    spans = np.random.default_rng(seed).uniform(0.2, 1.0, poles - 3)
    return rungs_by_level(KnotVector.clamped(np.concatenate([[0.0], np.cumsum(spans)]), 3))[: LEVELS + 1]


def main() -> None:
    """Measure and print."""

    def ours(size: int) -> Callable[[], np.ndarray]:
        u, v = ladder(size, 1), ladder(size, 2)
        return lambda: reconstruct(decompose(nets[size], u, v))

    def theirs() -> np.ndarray:
        parts = pywt.wavedec2(nets[SIZE], "bior4.4", level=LEVELS, axes=(0, 1))
        return pywt.waverec2(parts, "bior4.4", axes=(0, 1))

    nets = {size: np.random.default_rng(3).standard_normal((size, size, 3)) for size in SIZES}
    error = np.abs(ours(SIZE)() - nets[SIZE]).max() / np.abs(nets[SIZE]).max()
    *growth, reference = best(*map(ours, SIZES), theirs)
    each = ", ".join(f"{n}²: {1e9 * t / n**2:.0f}" for n, t in zip(SIZES, growth, strict=True))
    here = growth[SIZES.index(SIZE)]
    print(
        f"{SIZE}×{SIZE}×3, {LEVELS} levels: {here:.3f} s, PyWavelets bior4.4 {reference:.3f} s, "
        f"ratio {here / reference:.2f}; error {error:.1e}; ns per control point by size {each}"
    )


if __name__ == "__main__":
    main()
