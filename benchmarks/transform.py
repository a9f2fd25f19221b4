"""Speed of the wavelet transform against PyWavelets, one thread each.

Run as a script.  Decomposes and recomposes a cubic net of 1027 × 1027 control points on uneven knots over five levels,
then nets of growing size, and prints a line of ratios.  ``bior4.4`` is the transform that compares: like cubic splines
and their wavelets, it has order 4 and four vanishing moments; ``bior3.3`` and ``bior2.2``, of order 3 and 2, are given
beside it.
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
THEIRS = ("bior4.4", "bior3.3", "bior2.2")


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

    def theirs(name: str) -> Callable[[], np.ndarray]:
        return lambda: pywt.waverec2(pywt.wavedec2(nets[SIZE], name, level=LEVELS, axes=(0, 1)), name, axes=(0, 1))

    nets = {size: np.random.default_rng(3).standard_normal((size, size, 3)) for size in SIZES}
    error = np.abs(ours(SIZE)() - nets[SIZE]).max() / np.abs(nets[SIZE]).max()
    here, *others = best(ours(SIZE), *map(theirs, THEIRS))
    ratios = ", ".join(f"{name} {t:.3f} s, ratio {here / t:.2f}" for name, t in zip(THEIRS, others, strict=True))
    print(f"{SIZE}×{SIZE}×3, {LEVELS} levels: {here:.3f} s, error {error:.1e}; PyWavelets: {ratios}")
    growth = best(*map(ours, SIZES))
    each = ", ".join(f"{n}²: {1e9 * t / n**2:.0f}" for n, t in zip(SIZES, growth, strict=True))
    print(f"ns per control point by size {each}")


if __name__ == "__main__":
    main()
