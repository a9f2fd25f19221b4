"""The one solver: displacements of joined surfaces that are nearest to what an edit wants, under exact conditions.

    filtered   (M + aK) δ = −aK f         gain 1 / (1 + x),   x = (ℓ ω)⁴,  a = ℓ⁴   (m2)
               Re (M + iaK) δ = −i aK f   gain 1 / (1 + x²)                          (b4)
    nearest    δ = argmin (δ − w)ᵀ M (δ − w)

over all δ that vanish on held control points and satisfy L δ = r; contacts add Cᵀ W C to the form.  With B = M + aK
(and contacts) on that space and C = B⁻¹ M, whose eigenvalues lie in (0, 1),

    δ_m2 = −B⁻¹ aK f,      δ_b4 = p(C) δ_m2,      p(c) = (1 − c) / (1 − 2c + 2c²),

so that one factorisation serves both.  p is expanded in Chebyshev polynomials on [0, 1]: its poles at (1 ± i) / 2 make
the error fall by 2.4 with every term.  The map from f to δ is linear: it commutes with rotation, and half the noise
gives half the displacement.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial.chebyshev import chebinterpolate

from mracad.bspline.net import Net
from mracad.seam.energy import Forms

Array = np.ndarray

SLACK = 1e-9
"""Proximal parameter of the conditions, relative: rows may depend on each other; each pass divides what is left of
``L δ`` by about as much."""

PASSES = 3

TERMS = 11
"""Degree of the Chebyshev expansion of p: an error of the gain of 1e-4."""

LEAST = 1e-10
"""Share of the largest diagonal entry that is added to the form: functions that barely reach into a face stay put."""


def _bent(t: Any) -> Any:
    """p((t + 1) / 2)."""
    return (1 - t) / (1 + t * t)


_EXPANSION = chebinterpolate(_bent, TERMS)


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
        Control points of what is shape in the net, mm; none of it by default.
    away : ndarray (nu, nv), optional
        Distance of the surface at the Greville points from what holds it, mm; infinite by default.
    """

    net: Net
    forms: Forms
    free: Array
    seen: Array
    trend: Array | None = None
    away: Array | None = None


class Problem:
    """Surfaces with the conditions that join them.

    Parameters
    ----------
    spaces : mapping of int to Space
        By surface index.
    rows : scipy.sparse matrix (conditions, points)
        L, on the control points of the spaces laid out one after another.
    goal : ndarray (conditions, 3), optional
        r; zero by default: every joint stays what it is.
    soft : scipy.sparse matrix (points, points), optional
        Cᵀ W C.
    pull : ndarray (points, 3), optional
        Cᵀ W c, where contacts are to be mended.
    """

    def __init__(
        self,
        spaces: Mapping[int, Space],
        rows: Any = None,
        goal: Array | None = None,
        soft: Any = None,
        pull: Array | None = None,
    ) -> None:
        from scipy.sparse import block_diag, csr_array

        self.spaces, self.soft = spaces, soft
        self.rows = csr_array((0, sum(s.free.size for s in spaces.values()))) if rows is None else rows
        self.goal = goal if goal is not None and goal.any() else None
        self.pull = pull if pull is not None and pull.any() else None
        self.mass, self.bending, self.creases = (
            block_diag([getattr(space.forms, name) for space in spaces.values()], format="csr")
            for name in ("mass", "bending", "creases")
        )
        self.free, self.seen = (
            np.concatenate([getattr(space, name).ravel() for space in spaces.values()]) for name in ("free", "seen")
        )
        f = np.concatenate([space.net.poles.reshape(-1, 3) for space in spaces.values()])
        self.f = f - f[self.seen].mean(axis=0)
        self.above = np.concatenate(
            [(s.net.poles - (0.0 if s.trend is None else s.trend)).reshape(-1, 3) for s in spaces.values()]
        )

    def filtered(self, stiffness: float, free: Array | None = None, trended: bool = False) -> Array:
        """δ of the filter of gain 1 / (1 + x²).

        Parameters
        ----------
        stiffness : float
            a = ℓ⁴, mm⁴.
        free : ndarray of bool (points,), optional
            Control points that may move, instead of those of the spaces; contacts then hold nothing.
        trended : bool
            Whether the trends of the spaces are shape, whose bending is not taken away.

        Returns
        -------
        ndarray (points, 3)
        """
        solve = self._solver(stiffness, self.free if free is None else free)
        base = self.above if trended else self.f
        mended = np.zeros_like(base)
        if self.goal is not None or self.pull is not None:
            mended = solve(mended if self.pull is None else self.pull, goal=self.goal)
        first = solve(-stiffness * (self.bending @ (base + mended)), exactly=False)
        delta = _chebyshev(lambda x: solve(self.mass @ x, exactly=False), first)
        return mended + solve.settled(delta)

    def faired(self, stiffness: float) -> Array:
        """δ of the filter of gain 1 / (1 + x), ``(points, 3)``; stiffness in mm⁴."""
        return self._solver(stiffness, self.free)(-stiffness * (self.bending @ self.f))

    def nearest(self, wanted: Array) -> Array:
        """The admissible δ nearest to ``wanted``, both ``(points, 3)``, over the faces."""
        kept = np.where(self.free[:, None], wanted, 0.0)
        pull = self.mass @ (wanted - kept)
        if self.soft is not None:
            pull = pull - self.soft @ kept
        if self.pull is not None:
            pull = pull + self.pull
        return kept + self._solver(0.0, self.free)(pull, start=kept, goal=self.goal)

    def _solver(self, stiffness: float, free: Array) -> Constrained:
        """The solver of the form M + stiffness · K and the contacts."""
        form = self.mass + stiffness * (self.bending + self.creases) if stiffness else self.mass
        if self.soft is not None and free is self.free:
            form = form + self.soft
        return Constrained(form, self.rows, free)

    @property
    def rimmed(self) -> bool:
        """Whether something holds the surfaces."""
        return self.soft is not None or bool((self.seen & ~self.free).any())

    def fading(self, width: float) -> Array:
        """0 at what is held, 1 farther than ``width`` (mm) from it, smooth between, ``(points, 1)``."""
        every = [np.full(s.free.shape, np.inf) if s.away is None else s.away for s in self.spaces.values()]
        away = np.concatenate([each.ravel() for each in every])
        share = np.minimum(away / width, 1.0)[:, None]
        return share**3 * (10 - 15 * share + 6 * share**2)

    def split(self, values: Array) -> dict[int, Array]:
        """Values of all points by surface, ``(nu, nv, 3)`` each."""
        sizes = [space.free.size for space in self.spaces.values()]
        parts = np.split(values, np.cumsum(sizes)[:-1])
        return {i: part.reshape(s.net.poles.shape) for (i, s), part in zip(self.spaces.items(), parts, strict=True)}


class Constrained:
    """argmin ½ xᵀ A x − bᵀ x under L x = r, x = 0 off ``free``.

    By one sparse factorisation of the quasi-definite [[A, Lᵀ], [L, −ε]] and proximal passes, which also bear rows of L
    that depend on each other.

    Parameters
    ----------
    form : scipy.sparse matrix (n, n)
        A, positive semidefinite.
    rows : scipy.sparse matrix (m, n)
    free : ndarray of bool (n,)
    """

    def __init__(self, form: Any, rows: Any, free: Array) -> None:
        from scipy.sparse import block_array, diags_array, eye_array
        from scipy.sparse.linalg import splu

        self.free, self.size = np.flatnonzero(free), len(free)
        form = form.tocsr()[self.free][:, self.free]
        diagonal = form.diagonal()
        self.scale = 1.0 / np.sqrt(diagonal + LEAST * diagonal.max(initial=0.0) + 1e-300)
        scaling = diags_array(self.scale)
        self.form = (scaling @ form @ scaling + LEAST * eye_array(len(self.free))).tocsr()
        rows = (rows.tocsr()[:, self.free] @ scaling).tocsr()
        length = np.sqrt(np.asarray(rows.multiply(rows).sum(axis=1)).ravel())
        self.there = np.flatnonzero(length > 0)
        self.length = length[self.there]
        self.rows = (diags_array(1.0 / self.length) @ rows[self.there]).tocsr()
        count = self.rows.shape[0]
        matrix = self.form
        if count:
            matrix = block_array([[self.form, self.rows.T], [self.rows, -SLACK * eye_array(count)]])
        self._factor = splu(
            matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )

    def __call__(
        self, right: Array, start: Array | None = None, goal: Array | None = None, exactly: bool = True
    ) -> Array:
        """x − start, of which b is the right-hand side.

        Parameters
        ----------
        right : ndarray (n, k)
            b.
        start : ndarray (n, k), optional
            Zero by default.
        goal : ndarray (m, k), optional
            r; zero by default.
        exactly : bool
            Whether the conditions are met to rounding; otherwise one pass is made.

        Returns
        -------
        ndarray (n, k)
        """
        b = self.scale[:, None] * right[self.free]
        owed = np.zeros((self.rows.shape[0], right.shape[1]))
        if goal is not None:
            owed += goal[self.there] / self.length[:, None]
        if start is not None:
            owed -= self.rows @ (start[self.free] / self.scale[:, None])
        x, y = np.zeros_like(b), np.zeros_like(owed)
        for _ in range(PASSES if exactly and len(y) else 1):
            residual = b - self.form @ x - self.rows.T @ y
            step = self._factor.solve(np.concatenate([residual, owed - self.rows @ x]))
            x += step[: len(x)]
            y += step[len(x) :]
        return self._whole(x)

    def settled(self, x: Array) -> Array:
        """What is nearest to x, ``(n, k)``, with L x = 0: what one pass has left of it is taken away."""
        return x + self(np.zeros_like(x), start=x) if len(self.there) else x

    def _whole(self, x: Array) -> Array:
        out = np.zeros((self.size, x.shape[1]))
        out[self.free] = self.scale[:, None] * x
        return out


def _chebyshev(power: Callable[[Array], Array], first: Array) -> Array:
    """p(C) first, by Clenshaw's recursion; ``power`` applies C."""
    last, before = np.zeros_like(first), np.zeros_like(first)
    for k in range(TERMS, 0, -1):
        last, before = _EXPANSION[k] * first + 2 * (2 * power(last) - last) - before, last
    return _EXPANSION[0] * first + (2 * power(last) - last) - before
