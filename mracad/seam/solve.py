"""The one solver: displacements of joined surfaces nearest to the target of an edit, under exact conditions.

    filtered   (M + aK) δ = −aK f         gain 1 / (1 + x),   x = (ℓ ω)⁴,  a = ℓ⁴   (m2)
               Re (M + iaK) δ = −i aK f   gain 1 / (1 + x²)                          (b4)
               for bands of wavelength    gain 1 / (1 + x⁴)
    nearest    δ = argmin (δ − w)ᵀ M (δ − w)

over all δ that vanish on held control points and satisfy L δ = r; contacts add Cᵀ W C to the form.  With B = M + aK
(and contacts) on that space and C = B⁻¹ M, whose eigenvalues lie in (0, 1),

    δ_m2 = −B⁻¹ aK f,      δ_b4 = p(C) δ_m2,      p(c) = (1 − c) / (1 − 2c + 2c²),

so one factorisation serves all.  p is expanded in Chebyshev polynomials (:mod:`mracad.seam.gain`).  The map from f to
δ is linear: it commutes with rotation, and half the noise gives half the displacement.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mracad.bspline.surface import Net
from mracad.seam.bands import Bands, Blocks, whole
from mracad.seam.constrained import Banded, Constrained, missed
from mracad.seam.divided import LEFT, Divided
from mracad.seam.energy import Forms
from mracad.seam.gain import applied
from mracad.seam.guided import Guided, Guides
from mracad.seam.strips import WIDTH, Division, Layout, about, joints, strips
from mracad.seam.zones import faded

Array = np.ndarray
Alone = Banded | Constrained | Divided
Solver = Alone | Guided

KEPT = 60_000
"""Largest number of control points for which factors are cached, besides the last one."""

OVERLAP = 4.0
"""Largest share of control points in strips for the alternating method."""

FAR = 10.0
"""Distance beyond which a correction is less than a thousandth, in lengths within which the effect of joints fades."""

LESS = 0.5
"""Share of the free control points up to which only they are solved, instead of all."""


@dataclass(frozen=True, eq=False)
class Space:
    """One surface of a problem.

    Attributes
    ----------
    net : Net
        The input, in the spline space of its displacement.
    forms : Forms
    free : ndarray of bool (nu, nv)
        Control points that may move.
    seen : ndarray of bool (nu, nv)
        Control points that the edited faces depend on.
    trend : ndarray (nu, nv, 3), optional
        Control points of the part of the net that is shape, mm; zero by default.
    away : ndarray (nu, nv), optional
        Distance at the Greville points from where the surface is held, mm; infinite by default.
    """

    net: Net
    forms: Forms
    free: Array
    seen: Array
    trend: Array | None = None
    away: Array | None = None


@dataclass(frozen=True)
class Effort:
    """How many joined surfaces are solved.

    Attributes
    ----------
    direct : int
        Largest number of control points that are solved at once.
    left : float
        For larger problems, see :class:`mracad.seam.divided.Divided`.
    domain : int
        Number of control points of a domain, see :mod:`mracad.seam.domains`.
    """

    direct: int = 12_000
    left: float = LEFT
    domain: int = 200_000


@dataclass(frozen=True, eq=False)
class Soft:
    """Conditions that are met only as closely as their weights ask.

    Attributes
    ----------
    form : scipy.sparse matrix (points, points)
        Cᵀ W C.
    pull : ndarray (points, 3), optional
        Cᵀ W c, where contacts are to be mended.
    between : scipy.sparse matrix (points, points), optional
        The part of the form that joins the surfaces to each other; the rest holds them.
    """

    form: Any
    pull: Array | None = None
    between: Any = None


class Problem:
    """Surfaces with the conditions that join them.

    Parameters
    ----------
    spaces : mapping of int to Space
        Surfaces by index.
    rows : scipy.sparse matrix (conditions, points)
        L, on the control points of the spaces laid out one after another.
    goal : ndarray (conditions, 3), optional
        r; zero by default: every joint stays as it is.
    soft : Soft, optional
    effort : Effort
    guides : Guides, optional
        Conditions of edges that slide; such edges are not rims.
    """

    def __init__(
        self,
        spaces: Mapping[int, Space],
        rows: Any = None,
        goal: Array | None = None,
        soft: Soft | None = None,
        effort: Effort = Effort(),
        guides: Guides | None = None,
    ) -> None:
        from scipy.sparse import csr_array

        self.spaces, self.effort, self.guides = spaces, effort, guides
        soft = soft or Soft(None)
        self.soft, self.between = (None if each is None else each.tocsr() for each in (soft.form, soft.between))
        self.rows = csr_array((0, sum(s.free.size for s in spaces.values()))) if rows is None else rows
        self.goal = goal if goal is not None and goal.any() else None
        self.pull = soft.pull if soft.pull is not None and soft.pull.any() else None
        more = [each for each in (self.soft, self.between) if each is not None and len(spaces) == 1]
        self.bands = [_bands(space, more) for space in spaces.values()]
        self.mass, self.bending, self.creases = (Blocks(self.bands, number) for number in range(3))
        self.free, self.seen = (
            np.concatenate([getattr(space, name).ravel() for space in spaces.values()]) for name in ("free", "seen")
        )
        f = np.concatenate([space.net.poles.reshape(-1, 3) for space in spaces.values()])
        self.f = f - f[self.seen].mean(axis=0)
        self._solvers: dict[tuple[float, bytes, bool], Solver] = {}
        self._pull: tuple[Array, Array] | None = None
        self._last: tuple[Array, tuple[float, bool], Array] | None = None
        trends = (np.zeros_like(s.net.poles) if s.trend is None else s.trend for s in spaces.values())
        above = f - np.concatenate([each.reshape(-1, 3) for each in trends])
        self.above = above - above[self.seen].mean(axis=0)

    def filtered(self, stiffness: float, free: Array | None = None, of: Array | None = None, order: int = 2) -> Array:
        """δ of the filter of gain 1 / (1 + xⁿ), n = 2 by default, which leaves the bending of trends alone.

        Parameters
        ----------
        stiffness : float
            a = ℓ⁴, mm⁴.
        free : ndarray of bool (points,), optional
            Control points that may move, instead of those of the spaces; only contacts between surfaces count then.
        of : ndarray (points, 3), optional
            Displacements to filter, instead of the part above trends.
        order : int
            n.

        Returns
        -------
        ndarray (points, 3)
        """
        solve = self._solver(stiffness, self.free if free is None else free)
        mended: Array | float = 0.0
        pull = self.pull if free is None else None
        if of is None and (self.goal is not None or pull is not None):
            mended = solve(np.zeros_like(self.above) if pull is None else pull, goal=self.goal)
        above = self.above if of is None else of
        first = solve(-stiffness * (self.bending @ (above + mended)), exactly=False)
        return mended + solve.settled(applied(order, lambda x: solve(self.mass @ x, exactly=False), first))

    def faired(self, stiffness: float, free: Array | None = None, of: Array | None = None) -> Array:
        """δ of the filter of gain 1 / (1 + x), ``(points, k)``; arguments as for :meth:`filtered`."""
        above, free = self.f if of is None else of, self.free if free is None else free
        return self._solver(stiffness, free)(-stiffness * (self.bending @ above))

    def nearest(self, wanted: Array, stiffness: float = 0.0, beyond: bool = False) -> Array:
        """The admissible δ nearest to ``wanted``, both ``(points, 3)``, over the faces.

        The distance is ‖δ − w‖²_M + a |δ − w|²_K, with ``stiffness`` a (mm⁴): δ − w is then smooth.
        ``beyond``: control points that the faces hardly depend on also move as wanted; otherwise they stay.
        """
        if self._last is None or self._last[0] is not wanted or self._last[1] != (stiffness, beyond):
            self._last = wanted, (stiffness, beyond), self._nearest(wanted, stiffness, beyond)
        return self._last[2]

    def _nearest(self, wanted: Array, stiffness: float, beyond: bool) -> Array:
        kept = np.where((self.free | ~self.seen if beyond else self.free)[:, None], wanted, 0.0)
        held = wanted - kept
        pull = np.zeros_like(held)
        if held.any():
            pull = self.mass @ held
            if stiffness:
                pull += stiffness * (self.bending @ held + self.creases @ held)
        if self.soft is not None:
            pull -= Blocks(self.bands, 3) @ kept if len(self.spaces) == 1 else self.soft @ kept
        if self.pull is not None:
            pull = pull + self.pull
        return self._corrected(kept, stiffness, pull)

    def response(self, rows: Any, stiffness: float) -> Array:
        """P M P Φᵀ for rows Φ, ``(points, rows)``: P takes pulls to displacements, by the form M + ``stiffness`` K."""
        solve = self._solver(stiffness, self.free)
        return np.asarray(solve(self.mass @ solve(rows.T.toarray())))

    def settled(self, delta: Array, stiffness: float = 0.0, free: Array | None = None) -> Array:
        """A displacement ``(points, k)`` corrected as smoothly as possible to meet the conditions."""
        return self._corrected(delta, stiffness, np.zeros_like(delta), free)

    def _corrected(self, start: Array, stiffness: float, pull: Array, free: Array | None = None) -> Array:
        """A displacement corrected by pulls, and to meet the conditions."""
        near = self._near(start, stiffness, pull, self.free if free is None else free)
        if not (near.any() or self.guides):
            return start
        own = np.where(near[:, None], start, 0.0)
        goal = (0.0 if self.goal is None else self.goal) - self.rows @ (start - own)
        solve = self._solver(stiffness, near, held=free is None)
        return np.asarray(start + solve(pull, start=own, goal=goal if goal.any() else None))

    def _near(self, start: Array, stiffness: float, pull: Array, free: Array) -> Array:
        """The free control points that pulls on a displacement, or conditions that it does not meet, may move; of
        smaller problems all, if any."""
        if free.sum() <= self.effort.direct or self.guides is not None:
            return free if pull.any() or self.rows.shape[0] or self.guides else np.zeros_like(free)
        moved = np.asarray(pull.any(axis=1))
        moved[self.rows[missed(self.rows, start, self.goal)].indices] = True
        layout = self._layout(stiffness)
        near = free & about(layout, np.flatnonzero(moved), FAR / WIDTH * layout.reach)
        return near if near.sum() < LESS * free.sum() else free

    def aimed(self, delta: Array, stiffness: float, ways: Array, off: Array) -> Array:
        """A displacement ``(points, 3)`` corrected as smoothly as possible, for edges that left what they slide along.

        Parameters
        ----------
        delta : ndarray (points, 3)
        stiffness : float
            mm⁴.
        ways, off : ndarray (conditions, 3), (conditions,)
            Directions of the conditions of edges that slide, and their distances in them, mm.
        """
        solve = self._solver(stiffness, self.free)
        assert isinstance(solve, Guided)
        goal = replace(solve.guides, ways=ways).of(delta) - off
        return np.asarray(delta + solve.aimed(ways, goal)(np.zeros_like(delta), start=delta, goal=self.goal))

    def forget(self) -> None:
        """Drop the factors of a large problem, which will hardly be solved again."""
        if len(self.free) > KEPT:
            self._solvers.clear()
            self._last = None

    def _solver(self, stiffness: float, free: Array, held: bool | None = None) -> Solver:
        """The solver of the form M + stiffness · K and the contacts, with sliding edges unless all rims are free."""
        held = free is self.free if held is None else held
        key = stiffness, free.tobytes(), held
        if key not in self._solvers:
            while self._solvers and (len(self._solvers) + 1) * len(free) > KEPT:
                del self._solvers[next(iter(self._solvers))]
            base = self._factored(stiffness, free, self.soft if held else self.between)
            self._solvers[key] = Guided(base, self.guides) if held and self.guides is not None else base
        return self._solvers[key]

    def _factored(self, stiffness: float, free: Array, soft: Any) -> Alone:
        if not self.rows.shape[0] and len(self.spaces) == 1 and self.bands[0].holds(free):
            others = [float(each is soft) for each in (self.soft, self.between) if each is not None]
            with suppress(np.linalg.LinAlgError):
                return Banded(self.bands[0], [1.0, stiffness, stiffness, *others], free)
        if len(self.spaces) > 1 and free.sum() > self.effort.direct:
            layout = self._layout(stiffness)
            joined = joints(layout, self.rows, soft, free)
            along = strips(layout, joined, free, OVERLAP * free.sum())
            if along is not None:
                whole_form = self._form(stiffness)
                return Divided(*whole_form, soft, self.rows, free, Division(layout, joined, along), self.effort.left)
        form = whole([each.forms.sum(stiffness) for each in self.spaces.values()])
        alone = [np.indices(space.free.shape).reshape(2, -1).T for space in self.spaces.values()]
        places = alone[0] if len(alone) == 1 else None
        return Constrained(form if soft is None else form + soft, self.rows, free, places=places)

    def _form(self, stiffness: float) -> tuple[Callable[[int], Any], Array]:
        """M + stiffness · K of the surface of a number, and its diagonal over all."""
        spaces = list(self.spaces.values())
        mass, bending, creases = (each.diagonal() for each in (self.mass, self.bending, self.creases))
        return lambda i: spaces[i].forms.sum(stiffness), mass + stiffness * (bending + creases)

    def _layout(self, stiffness: float) -> Layout:
        return Layout.of([space.net for space in self.spaces.values()], stiffness)

    @property
    def rimmed(self) -> bool:
        """Whether the surfaces are held, or edges slide, anywhere."""
        led = self.soft is not None or self.guides is not None
        return led or bool((self.seen & ~self.free).any())

    def fading(self, width: float) -> Array:
        """0 where held, 1 farther than ``width`` (mm) from there, smooth in between, ``(points, 1)``."""
        every = [np.full(s.free.shape, np.inf) if s.away is None else s.away for s in self.spaces.values()]
        away = np.concatenate([each.ravel() for each in every])
        return faded(away, width)[:, None]

    def products(self, delta: Array, target: Array) -> tuple[Array, Array]:
        """δᵀ M t and δᵀ M δ of displacements ``(points, 3)``, by surface."""
        if self._pull is None or self._pull[0] is not target:
            self._pull = target, self.mass @ target
        ends = np.cumsum([0, *(each.size for each in self.bands)])[:-1]
        both = (np.einsum("ij,ij->i", delta, each) for each in (self._pull[1], self.mass @ delta))
        linear, square = (np.add.reduceat(each, ends) for each in both)
        return linear, square

    def split(self, values: Array) -> dict[int, Array]:
        """Values of all points, ``(points, k)``, by surface, ``(nu, nv, k)`` each."""
        parts = np.split(values, np.cumsum([space.free.size for space in self.spaces.values()])[:-1])
        return {i: part.reshape(*s.free.shape, -1) for (i, s), part in zip(self.spaces.items(), parts, strict=True)}


def _bands(space: Space, more: Sequence[Any]) -> Bands:
    """The forms of a surface, and others over its control points alone."""
    form, places = space.forms, np.indices(space.free.shape).reshape(2, -1).T
    return Bands([form.mass, form.bending, form.creases, *more], places)
