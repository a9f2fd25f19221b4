"""The noise of faces: by differences of control points, or of few by the likelihoods with noise and without.

Differences of order m of the shape (:mod:`mracad.seam.white`) count as independent, with variances τ_u² and τ_v², and
some control points W as noisy, with variance σ².  With Q = τ_u⁻² D_uᵀD_u + τ_v⁻² D_vᵀD_v of rank r, b = (Q y)_W and the
part Q_W of W, each coordinate of the control points y has, but for a constant, −2 log of the restricted likelihood

    yᵀ Q y − bᵀ (Q_W + σ⁻²)⁻¹ b + log |1 + σ² Q_W| − log |Q|₊

(H. D. Patterson, R. Thompson, Biometrika 58, 1971).  Points without noise tell how smooth the shape is, so that two
noisy ones among them are enough.  Of several orders that with the least variance of what smoothing leaves is taken.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mracad.bspline.surface import Net
from mracad.inspect.noise import Noise, calm, even, noise
from mracad.model.brep import Face
from mracad.seam.hold import separate
from mracad.seam.ladders import Creases
from mracad.seam.metric import creases
from mracad.seam.white import white

Array = np.ndarray

FEW = 60
"""Number of control points below which the likelihood, not differences, tells the noise."""

ORDERS = 2, 3, 4
"""Orders of differences."""

RATIOS = 10.0 ** np.arange(-3.0, 4.0)
"""τ_v² over τ_u²."""

NOISES = 10.0 ** np.arange(-6.0, 8.1, 0.25)
"""σ² over τ_u τ_v."""

FINER = 10.0 ** np.linspace(-0.25, 0.25, 21)
"""Factors on the best value that are tried."""

LIKELIER, EACH = 40.0, 1.0
"""Least 2 log of the likelihood ratio that shows noise: in all, and for each noisy control point."""

LEFT = 0.2
"""Largest share of the variance of noise that smoothing may be expected to leave: beyond it the shape is too rough."""

AGREE = 2.5
"""Largest factor between the noise by neighbouring orders."""

LARGE = 2.0
"""Largest noise over the distance of neighbours."""

MOST = 640
"""Largest number of control points that are used."""

UNLIKELY = 4.0
"""Number of standard deviations by which sizes must differ to count as different."""

POSITIVE = 1e-12
"""Share of the largest eigenvalue below which others count as zero."""


@dataclass(frozen=True, eq=False)
class _Fit:
    """The best for one order of differences."""

    order: int
    where: Array
    size: float
    precision: tuple[float, float]
    gain: float
    left: float


def noises(surfaces: Mapping[int, tuple[Net, Sequence[Face]]], stated: float | None = None) -> dict[int, Noise | None]:
    """The noise of the faces of surfaces, each a net and faces on it; None where none is found.

    Parameters
    ----------
    surfaces : mapping of int to (Net, sequence of Face)
    stated : float, optional
        Standard deviation of the noise, mm, if known.
    """
    found = {i: _noise(net, faces, stated) for i, (net, faces) in surfaces.items()}
    if stated is None:
        found |= pooled({i: each for i, each in found.items() if each is not None and each.precision})
    return found


def _noise(net: Net, faces: Sequence[Face], stated: float | None) -> Noise | None:
    """The noise of the faces of a surface, if any."""
    numbers = [face.index for face in faces]
    parts = separate(net, faces, numbers, "g0")
    inner = separate(net, faces, numbers, "g1").free
    if parts.free.any() and inner.sum() < FEW:
        sharp = creases(net, np.ones(net.poles.shape[:2], bool))
        told = evidence(net, (inner, parts.free, parts.visible), parts.visible, sharp, stated)
        if told is not None or stated is None:
            return told
    found = noise(net, parts.free, parts.visible)
    if found:
        still = next(
            (each for each in (inner, parts.free) if calm(net, parts.visible & ~each, found.size)), found.where
        )
        found = replace(found, where=found.where & still)
    if stated is None:
        return found
    return Noise(stated, found.where if found else parts.visible, (net.u.greville(), net.v.greville()))


def evidence(
    net: Net, roles: Sequence[Array], seen: Array, creases: Creases, stated: float | None = None
) -> Noise | None:
    """The noise of a net of few control points; None if none is found.

    Parameters
    ----------
    net : Net
    roles : sequence of ndarray of bool (nu, nv)
        Candidate sets of noisy control points, one of which is chosen: points without noise would reduce its size.
    seen : ndarray of bool (nu, nv)
        Control points on which the faces depend.
    creases : pair of frozenset of float
    stated : float, optional
        Standard deviation of the noise, mm, if known.
    """
    if seen.sum() > MOST or not any(where.any() for where in roles):
        return None
    every = [fit for order in ORDERS for fit in _fits(net, roles, seen, creases, order, stated)]
    found = []
    for where in roles:
        fits = [fit for fit in every if fit.where is where]
        told = fits if stated else _telling(fits, LARGE * _spacing(net, seen))
        if told and (stated or even(net, where, seen)):
            found.append(min(told, key=lambda fit: fit.left))
    if not found:
        return None
    best = max(found, key=lambda fit: fit.gain if stated else fit.size)
    return Noise(best.size, best.where, (net.u.greville(), net.v.greville()), best.order, best.precision)


def _telling(fits: Sequence[_Fit], most: float) -> list[_Fit]:
    """The fits that show noise, and that neighbouring orders confirm."""
    found = [f for f in fits if f.gain > max(LIKELIER, EACH * f.where.sum()) and f.size < most]
    found = [f for f in found if any(abs(f.order - g.order) == 1 and _agree(f.size, g.size) for g in found)]
    return [f for f in found if f.left < LEFT * f.size**2 * f.where.sum()]


def _agree(one: float, other: float) -> bool:
    return max(one, other) < AGREE * min(one, other)


def _spacing(net: Net, seen: Array) -> float:
    """Median distance of neighbours, mm."""
    steps = []
    for axis in (0, 1):
        first, second = (np.delete(seen, end, axis) for end in (-1, 0))
        steps.append(np.linalg.norm(np.diff(net.poles, axis=axis), axis=2)[first & second])
    return float(np.median(np.concatenate(steps)))


def _fits(
    net: Net, roles: Sequence[Array], seen: Array, creases: Creases, order: int, stated: float | None
) -> Iterable[_Fit]:
    """The likeliest fits for an order of differences and each role, if the net has such differences."""
    points = np.flatnonzero(seen.ravel())
    along = [each[points][:, points].toarray() for each in white(net, net, seen, creases, order).along]
    ratios = RATIOS if all(each.any() for each in along) else RATIOS[RATIOS == 1.0]
    if not any(each.any() for each in along):
        return
    y = net.poles.reshape(-1, 3)[points]
    y = y - y.mean(axis=0)
    values = np.linalg.eigvalsh(along[0] + along[1])
    rank = int((values > POSITIVE * values[-1]).sum())
    found: dict[int, tuple[float, _Fit]] = {}
    least = np.inf
    for ratio in ratios:
        balance = ratio**0.5, ratio**-0.5
        form = balance[0] * along[0] + balance[1] * along[1]
        values = np.linalg.eigvalsh(form)[-rank:]
        constant = -3 * float(np.log(values).sum())
        bent = form @ y
        energy = float((y * bent).sum())
        if not energy > 0.0:
            continue
        least = min(least, 3 * rank * (1 + np.log(energy / (3 * rank))) + constant)
        for k, where in enumerate(roles):
            noisy = where.ravel()[points]
            if noisy.any():
                score, size, spread, left = _likeliest(form[np.ix_(noisy, noisy)], bent[noisy], energy, rank, stated)
                score += constant
                if k not in found or score < found[k][0]:
                    precision = balance[0] / spread, balance[1] / spread
                    found[k] = score, _Fit(order, where, size, precision, score, left)
    for score, fit in found.values():
        yield replace(fit, gain=float(least - score))


def _likeliest(
    part: Array, bent: Array, energy: float, rank: int, stated: float | None
) -> tuple[float, float, float, float]:
    """−2 log of the largest likelihood, σ, τ_u τ_v, and the variance of the smoothed result."""
    stiff, modes = np.linalg.eigh(part)
    stiff = np.maximum(stiff, 0.0)
    power = ((modes.T @ bent) ** 2).sum(axis=1)

    def scores(noises: Array) -> tuple[Array, Array]:
        kept = energy - (power / (stiff + 1 / noises[:, None])).sum(axis=1)
        kept = np.maximum(kept, 1e-14 * energy)
        spread = kept / (3 * rank) if stated is None else stated**2 / noises
        return 3 * rank * np.log(spread) + kept / spread + 3 * np.log1p(noises[:, None] * stiff).sum(axis=1), spread

    near = NOISES[scores(NOISES)[0].argmin()] * FINER
    score, spread = scores(near)
    best = int(score.argmin())
    left = float(spread[best] * (1 / (stiff + 1 / near[best])).sum())
    return float(score[best]), float(np.sqrt(near[best] * spread[best])), float(spread[best]), left


def pooled(noises: dict[int, Noise]) -> dict[int, Noise]:
    """Noises with one common size, if that is plausible (M. S. Bartlett, Proc. R. Soc. A 160, 1937).

    A file usually has noise from one source, and few control points show its size only roughly.
    """
    if len(noises) < 2:
        return noises
    weight = np.array([3.0 * each.where.sum() for each in noises.values()])
    sizes = np.array([each.size for each in noises.values()])
    size = float(np.sqrt((weight * sizes**2).sum() / weight.sum()))
    apart = float((weight * np.log(size**2 / sizes**2)).sum())
    expected = len(sizes) - 1.0
    if apart > expected + UNLIKELY * np.sqrt(2 * expected):
        return noises
    return {i: replace(each, size=size) for i, each in noises.items()}
