"""Estimates of surfaces without the noise of their control points, and their risk.

    spline    the smoothing spline of :mod:`mracad.seam.white` over all surfaces that seams join
    shrunk    their details in wavelet space, multiplied by gains from a pilot: the mean of the spline and of the
              thresholded details (:mod:`mracad.wavelet.shrink`); then the nearest that seams and rims allow

For an estimate δ(y) of noisy control points y (standard deviation σ), the expected squared distance to the truth along
the normals n is, up to a constant,

    |δ·n|² + 2 σ² div δ·n

(C. L. Mallows, Technometrics 15, 1973; C. M. Stein, Ann. Statist. 9, 1981; 0 for no change).  The divergence is
estimated with random ±1 (M. F. Hutchinson, Commun. Stat. Simul. Comput. 18, 1989; S. Ramani, T. Blu, M. Unser, IEEE
Trans. Image Process. 17, 2008).  Without σ, generalised cross-validation compares |δ|² / (div δ)² (G. H. Golub,
M. Heath, G. Wahba, Technometrics 21, 1979).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mracad.bspline.fit import through
from mracad.bspline.vectors import cross
from mracad.edit.search import Stiffness, searched
from mracad.edit.target import Sheet
from mracad.inspect.evidence import FEW
from mracad.inspect.noise import Noise
from mracad.model.displacement import lifted
from mracad.seam.solve import Problem
from mracad.seam.white import ORDER, Whitened, white
from mracad.wavelet.shrink import Spin, shrunk, spins, thresholded

Array = np.ndarray
Estimator = Callable[[Array], Array]
"""Maps control points to their change, both ``(points, k)``."""

PROBES, EXACT = 12, 100
"""Number of random probes of the divergence; with no more control points than that it is exact."""

WIENER = 4
"""Number of random probes of the divergence of shrinkage, and their size over σ."""
SMALL = 0.01

SHARES = 0.0, 0.25, 0.5, 0.75, 1.0
"""Shares of the spline in the estimate; finer ones would follow the random probes, and not commute with rotations."""

SURE = 3.0
"""Number of standard deviations of its risk by which an estimate must be better than no change."""

LARGE = 30_000
"""Number of control points above which stiffnesses are not searched, and fewer probes of shrinkage are enough."""

SPOILED, ODD, ROUNDS = 1e-6, 5.0, 4
"""Weight of an outlier, the number of deviations of noise that make one, and how often they are searched for at
most."""

QUIET = 0.03
"""Control points without noise count as if they had this share of the largest noise."""


@dataclass(frozen=True)
class Asked:
    """Options of an estimate.

    Attributes
    ----------
    shrink : bool
        Whether shrinkage is tried; otherwise the wavelengths of the spline are cross-validated.
    outliers : float
        Share of the control points that may be wrong.
    """

    shrink: bool = True
    outliers: float = 0.0


@dataclass(frozen=True, eq=False)
class Risk:
    """The expected squared distance of an estimate δ to the truth, over the faces, less that of no change.

    Attributes
    ----------
    size : ndarray (2,)
        ∫ |δ|² dA and ∫ (δ·n)² dA, mm⁴.
    removed : ndarray (2,)
        −σ² times their divergences, mm⁴.
    spread : float
        Standard deviation of the second part, mm⁴.
    """

    size: Array
    removed: Array
    spread: float

    @property
    def total(self) -> float:
        """The value of the risk, mm⁴; the distance along normals counts twice."""
        return float((self.size - 2 * self.removed).sum())

    @property
    def sure(self) -> bool:
        """Whether it is below 0 along normals for any likely noise."""
        return bool(self.size[1] - 2 * self.removed[1] + SURE * self.spread < 0)

    @property
    def likely(self) -> bool:
        """Whether it is below 0, and along normals not above by more than chance."""
        return self.total < 0 and bool(self.size[1] - 2 * self.removed[1] < self.spread)

    def mixed(self, other: Risk, between: Array) -> tuple[Risk, float]:
        """The least risk of a mean of the estimate and another, and the share of the other: one of :data:`SHARES`.

        Parameters
        ----------
        other : Risk
        between : ndarray (2,)
            ∫ δ·δ' dA and ∫ (δ·n)(δ'·n) dA of both, mm⁴.
        """

        def mean(a: float) -> Risk:
            size = (1 - a) ** 2 * self.size + 2 * a * (1 - a) * between + a**2 * other.size
            removed = (1 - a) * self.removed + a * other.removed
            return Risk(size, removed, (1 - a) * self.spread + a * other.spread)

        share = min(SHARES, key=lambda a: mean(a).total)
        return mean(share), share

    @property
    def validated(self) -> float:
        """The score of generalised cross-validation."""
        return float(self.size.sum() / max(float(self.removed.sum()), 1e-100) ** 2)


@dataclass(frozen=True, eq=False)
class Noisy:
    """Surfaces with noise, joined and held as in a problem.

    Attributes
    ----------
    problem : Problem
    sheets : mapping of int to Sheet
    noise : mapping of int to Noise
        Noise of their own control points; surfaces without noise are left out.
    outliers : ndarray of bool (own points,), optional
        Control points that are wrong; none by default.
    """

    problem: Problem
    sheets: Mapping[int, Sheet]
    noise: Mapping[int, Noise]
    outliers: Array | None = None

    @cached_property
    def white(self) -> Whitened:
        """The problem in the metric of control points."""
        forms = {
            i: white(space.net, self.sheets[i].origin, space.seen, self.sheets[i].creases, self._order(i))
            for i, space in self.problem.spaces.items()
        }
        most = self.most
        ratio = np.where(self.own[:, None], np.maximum(self.sizes / most, QUIET), QUIET)
        precision = np.maximum(self.up(ratio), QUIET) ** -2.0
        if self.outliers is not None:
            precision = np.where(self.up(self.outliers[:, None] * 1.0) > 0.5, SPOILED * precision, precision)
        scale = {i: max(self._size(i) / most, QUIET) ** -2.0 for i in self.problem.spaces}
        return Whitened(self.problem, forms, precision, scale, self.up(self.own[:, None] * 1.0)[:, 0] > 0)

    @cached_property
    def own(self) -> Array:
        """Own control points, of all surfaces, that have noise, ``(own points,)``."""
        return np.concatenate([self._where(i).ravel() for i in self.problem.spaces])

    @cached_property
    def sizes(self) -> Array:
        """Deviation by which each own control point is measured, mm, ``(own points, 1)``."""
        return np.concatenate([np.full((self._count(i), 1), self._size(i) or self.most) for i in self.problem.spaces])

    @property
    def most(self) -> float:
        """The largest standard deviation, mm."""
        return max(each.size for each in self.noise.values())

    def _size(self, i: int) -> float:
        return self.noise[i].size if i in self.noise else 0.0

    def _order(self, i: int) -> int:
        return self.noise[i].order if i in self.noise else ORDER

    def _where(self, i: int) -> Array:
        origin = self.sheets[i].origin
        return self.noise[i].over(origin) if i in self.noise else np.zeros(origin.poles.shape[:2], bool)

    def _count(self, i: int) -> int:
        origin = self.sheets[i].origin
        return origin.u.count * origin.v.count

    def up(self, values: Array) -> Array:
        """Values of own control points, transferred to the control points of the problem."""
        parts, at = [], 0
        for i, space in self.problem.spaces.items():
            origin = self.sheets[i].origin
            part = values[at : at + self._count(i)].reshape(*origin.poles.shape[:2], -1)
            parts.append(lifted(origin, space.net, part).reshape(-1, values.shape[1]))
            at += self._count(i)
        return np.concatenate(parts)

    def down(self, values: Array) -> Array:
        """The reverse of :meth:`up`, by interpolation."""
        parts, at = [], 0
        for i, space in self.problem.spaces.items():
            origin, n = self.sheets[i].origin, space.free.size
            part = values[at : at + n].reshape(*space.free.shape, -1)
            if (space.net.u, space.net.v) != (origin.u, origin.v):
                at_places = space.net.with_poles(part).grid(origin.u.greville(), origin.v.greville())
                part = through(origin, np.asarray(at_places))
            parts.append(part.reshape(-1, values.shape[1]))
            at += n
        return np.concatenate(parts)

    def spline(self, stiffness: Stiffness, held: bool) -> Estimator:
        """The smoothing spline with rims held; or the spline without, and the nearest to it that rims allow."""
        problem = self.white.at(stiffness)
        if held:
            return lambda y: problem.faired(1.0, None, y)
        return lambda y: problem.nearest(problem.faired(1.0, problem.seen, y))

    def shrunk(self, stiffness: Stiffness, held: bool) -> Estimator:
        """Empirical Wiener shrinkage about the spline, and the nearest to it that seams and rims allow; if rims are
        ``held``, with a correction as smooth as that of the spline."""
        problem, spline = self.white.at(stiffness), self.spline(stiffness, held)
        every = {i: spins(self.sheets[i].origin, self.sheets[i].creases) for i in self.noise}

        def estimate(y: Array) -> Array:
            own, pilot = self.down(y), self.down(y + spline(y))
            found, at = [], 0
            for i in self.problem.spaces:
                here = slice(at, at := at + self._count(i))
                shape = self.sheets[i].origin.poles.shape
                found.append(self._shrunk(i, own[here].reshape(shape), pilot[here].reshape(shape), every.get(i)))
            return problem.nearest(self.up(np.concatenate(found)), float(held))

        return estimate

    def _shrunk(self, i: int, poles: Array, pilot: Array, every: list[Spin] | None) -> Array:
        if every is None:
            return np.zeros((self._count(i), 3))
        noise, where = self.noise[i].size, self._where(i)[..., None]
        pilot = (pilot + thresholded(poles, noise, every)) / 2
        return np.where(where, shrunk(poles, noise, every, pilot) - poles, 0.0).reshape(-1, 3)

    @cached_property
    def probes(self) -> Array:
        """Random noise on the problem's control points that seams allow, with mean square σ², mm, ``(points,
        probes)``."""
        own = np.flatnonzero(self.own)
        few = len(own) <= EXACT
        probes = np.zeros((len(self.own), len(own) if few else PROBES))
        probes[own] = np.eye(len(own)) * np.sqrt(len(own)) if few else _signs(len(own), PROBES)
        found = self.up(self.sizes * probes)
        if not self.problem.rows.shape[0]:
            return found
        whole = self.white.at(dict.fromkeys(self.problem.spaces, (0.0, 0.0)))
        return whole.settled(found, free=whole.seen)

    @cached_property
    def _normals(self) -> Array:
        """Unit normals at the Greville points of smoothed surfaces, ``(points, 3)``."""
        found = []
        for i, space in self.problem.spaces.items():
            us, vs = space.net.u.greville(), space.net.v.greville()
            normals = cross(*(self.sheets[i].metric.tangents(us, vs, axis) for axis in (0, 1))).reshape(-1, 3)
            found.append(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300))
        return np.concatenate(found)

    def products(self, one: Array, other: Array) -> Array:
        """∫ a·b dA of two displacements, and ∫ (a·n)(b·n) dA, mm⁴."""
        mass = self.problem.mass
        along = [(each * self._normals).sum(axis=1, keepdims=True) for each in (one, other)]
        return np.array([float((a * (mass @ b)).sum()) for a, b in ((one, other), along)])

    def linear(self, estimate: Estimator, y: Array) -> Risk:
        """The risk of a linear estimate at control points."""
        z, delta = self.probes, estimate(y)
        taken = self.problem.mass @ estimate(z)
        removed = -float((z * taken).sum()) / z.shape[1]
        spread = float(np.sqrt(2 * ((z * z).mean(axis=1, keepdims=True) * taken**2).sum() / z.shape[1]))
        return Risk(self.products(delta, delta), removed * np.array([3.0, 1.0]), spread)

    def nonlinear(self, estimate: Estimator, y: Array, delta: Array, spread: float) -> Risk:
        """The risk of another estimate, whose change of the control points is ``delta``."""
        removed, count = np.zeros(2), int(np.clip(LARGE // len(delta), 1, WIENER))
        for probe in range(count):
            z = np.take(self.probes, np.arange(3 * probe, 3 * probe + 3), axis=1, mode="wrap")
            removed -= self.products(z, estimate(y + SMALL * z) - delta) / SMALL
        return Risk(self.products(delta, delta), removed / count, spread)

    def mended(self, stiffness: Stiffness, share: float) -> tuple[Noisy, Array]:
        """The same surfaces with up to a share of the control points marked as wrong, and the change of these to the
        spline through the others, ``(points, 3)``."""
        y, most = self.down(self.problem.f), int(share * self.own.sum())
        found, now = np.zeros(len(y), bool), self
        delta = np.zeros_like(y)
        for _ in range(ROUNDS):
            problem = now.white.at(stiffness)
            delta = self.down(problem.faired(1.0, problem.seen))
            odd = np.where(self.own, np.linalg.norm(delta / self.sizes, axis=1), 0.0)
            worst = np.zeros_like(found)
            worst[np.argsort(-odd, kind="stable")[:most]] = True
            worst &= odd > ODD
            if (worst == found).all():
                break
            found, now = worst, replace(self, outliers=worst)
        return now, self.up(np.where(found[:, None], delta, 0.0))


def _signs(count: int, columns: int) -> Array:
    return np.random.default_rng(0).choice([-1.0, 1.0], (count, columns))


def best(noisy: Noisy, start: Stiffness, asked: Asked) -> Array:
    """The estimate with the least risk, ``(points, 3)``; 0 if none is surely better than no change."""
    wrong: Array | float = 0.0
    if asked.outliers:
        noisy, wrong = noisy.mended(start, asked.outliers)
    y = noisy.problem.f + wrong

    def score(at: Stiffness) -> float:
        risk = noisy.linear(noisy.spline(at, True), y)
        return risk.total if asked.shrink else risk.validated

    few = noisy.own.sum() < FEW
    at = start if few or len(y) > LARGE else searched(start, score)
    tried = ((at, True), (at, False), (start, False)) if noisy.problem.rimmed else ((at, True),)
    every = [(noisy.linear(noisy.spline(at, held), y), at, held) for at, held in tried]
    risk, at, held = min(every, key=lambda each: each[0].total)
    delta = noisy.spline(at, held)(y)
    if asked.shrink and not few:
        estimate = noisy.shrunk(at, held)
        other = estimate(y)
        risk, share = noisy.nonlinear(estimate, y, other, risk.spread).mixed(risk, noisy.products(other, delta))
        delta = share * delta + (1 - share) * other
    better = risk.likely if few else risk.sure
    return delta + wrong if better else np.zeros_like(delta)
