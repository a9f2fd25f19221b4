"""Speed of the wavelet transform against PyWavelets' ``bior4.4``, one thread each.

Run as a script.  Decomposes and recomposes a cubic net of 1027 × 1027 poles on uneven knots over five levels, then nets
of growing size, and prints one line of ratios.
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


def best(run: Callable[[], object], repeats: int = 5) -> float:
    """Least time of several runs, s."""
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        run()
        times.append(time.perf_counter() - begin)
    return min(times)


def ladder(poles: int, seed: int) -> list[KnotVector]:
    """Five levels below a cubic knot vector with spans that vary by a factor of 5."""
    spans = np.random.default_rng(seed).uniform(0.2, 1.0, poles - 3)
    return rungs_by_level(KnotVector.clamped(np.concatenate([[0.0], np.cumsum(spans)]), 3))[: LEVELS + 1]


def both_ways(size: int) -> tuple[float, float, np.ndarray]:
    """Seconds to decompose and recompose a square net, relative error, and its poles."""
    u, v = ladder(size, 1), ladder(size, 2)
    poles = np.random.default_rng(3).standard_normal((size, size, 3))
    back = reconstruct(decompose(poles, u, v))
    error = float(np.abs(back - poles).max() / np.abs(poles).max())
    return best(lambda: reconstruct(decompose(poles, u, v))), error, poles


def main() -> None:
    """Measure and print."""
    ours, error, poles = both_ways(1027)

    def theirs() -> np.ndarray:
        return pywt.waverec2(pywt.wavedec2(poles, "bior4.4", level=LEVELS, axes=(0, 1)), "bior4.4", axes=(0, 1))

    reference = best(theirs)
    sizes = (515, 1027, 2003)
    each = [1e9 * (ours if n == 1027 else both_ways(n)[0]) / n**2 for n in sizes]
    growth = ", ".join(f"{n}²: {ns:.0f}" for n, ns in zip(sizes, each, strict=True))
    print(
        f"1027×1027×3, {LEVELS} levels: {ours:.3f} s, PyWavelets bior4.4 {reference:.3f} s, "
        f"ratio {ours / reference:.2f}; error {error:.1e}; ns a pole by size {growth}"
    )


if __name__ == "__main__":
    main()
