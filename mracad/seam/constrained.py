"""Minima of quadratic forms under exact linear conditions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mracad.seam.bands import Bands, Cholesky
from mracad.seam.eliminate import Eliminated
from mracad.seam.factor import Definite, nested

Array = np.ndarray

SLACK = 1e-9
"""Proximal parameter of the conditions, relative: rows may be dependent; each pass divides the remaining ``L δ`` by
about as much."""

PASSES, MOST, MET = 2, 24, 1e-14
"""Number of proximal passes (one leaves errors of 1e-6 where lengths are many spans), and the largest number until
conditions are met to a share of the motion: nearly dependent rows converge slowly."""

HELD = 1e-9
"""Share of a condition's row that must be on points that may move: below it only rounding is left."""

LEAST = 1e-10
"""Share of the largest diagonal entry that is added to the form, so that functions that barely reach into a face
stay."""

ROUNDING = 1e-13
"""Share of the motion by which conditions may be missed."""

MANY = 1000
"""Number of unknowns above which conditions are eliminated if possible."""


class Constrained:
    """argmin ½ xᵀ A x − bᵀ x subject to L x = r, and x = 0 outside ``free``.

    Conditions take one sparse factorisation of the quasi-definite [[A, Lᵀ], [L, −ε]] and proximal passes, which
    tolerate dependent rows of L.  Those of many unknowns are eliminated where they tie few of them at a time.

    Parameters
    ----------
    form : scipy.sparse matrix (n, n)
        A, positive semidefinite.
    rows : scipy.sparse matrix (m, n)
    free : ndarray of bool (n,)
    slack : float
        ε, relative: the weight of the form against contradictory conditions in a single pass.
    places : ndarray (n, 2) of int, optional
        Places of the unknowns, if they are the control points of one net.
    """

    def __init__(self, form: Any, rows: Any, free: Array, slack: float = SLACK, places: Array | None = None) -> None:
        from scipy.sparse import block_array, diags_array, eye_array

        self.free, self.size = np.flatnonzero(free), len(free)
        form = part(form.tocsr(), self.free)
        diagonal = form.diagonal()
        self.scale = 1.0 / np.sqrt(diagonal + LEAST * diagonal.max(initial=0.0) + 1e-300)
        self.form = scaled(form, self.scale)
        count = rows.shape[0]
        if count:
            rows = rows.tocsr()
            whole, rows = lengths(rows), rows[:, self.free]
            some, rows = lengths(rows), (rows @ diags_array(self.scale)).tocsr()
            length = lengths(rows)
            self.there = np.flatnonzero((length > 0) & (some > HELD * whole))
            self.length, count = length[self.there], len(self.there)
            self.rows = (diags_array(1.0 / self.length) @ rows[self.there]).tocsr()
        else:
            self.there, self.length, self.rows = np.arange(0), np.ones(0), rows
        many = count and len(self.free) > MANY and slack <= SLACK
        self._eliminated = Eliminated.of(self.rows) if many else None
        self._solve: Callable[[Array], Array]
        if self._eliminated is not None:
            basis = self._eliminated.basis
            self._solve = Definite(basis.T @ (self.form @ basis))
        elif count:
            self._solve = nested(block_array([[self.form, self.rows.T], [self.rows, -slack * eye_array(count)]]))
        else:
            self._solve = Definite(self.form, None if places is None else places[self.free])

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
            Whether the conditions are met to rounding.

        Returns
        -------
        ndarray (n, k)
        """
        b = self.scale[:, None] * right[self.free]
        if not len(self.there):
            return self._whole(self._solve(b))
        owed = np.zeros((self.rows.shape[0], right.shape[1]))
        if goal is not None:
            owed += goal[self.there] / self.length[:, None]
        size = 0.0
        if start is not None:
            begun = start[self.free] / self.scale[:, None]
            owed, size = owed - self.rows @ begun, float(np.abs(begun).max(initial=0.0))
        if self._eliminated is not None:
            least, basis = self._eliminated.least @ owed, self._eliminated.basis
            return self._whole(least + basis @ self._solve(basis.T @ (b - self.form @ least)))
        x, y = np.zeros_like(b), np.zeros_like(owed)
        most = MOST if exactly else PASSES
        residual, lacking, missed = b, owed, np.inf
        for done in range(1, most + 1):
            step = self._solve(np.concatenate([residual, lacking]))
            x += step[: len(x)]
            y += step[len(x) :]
            lacking = owed - self.rows @ x
            last, missed = missed, float(np.abs(lacking).max(initial=0.0))
            if done == most or missed <= MET * max(size, np.abs(x).max(initial=0.0)) or not missed < last:
                break
            residual = b - self.form @ x - self.rows.T @ y
        return self._whole(x)

    def settled(self, x: Array) -> Array:
        """The point nearest to x with L x = 0, ``(n, k)``, after further passes on the remainder."""
        return x + self(np.zeros_like(x), start=x) if len(self.there) else x

    def _whole(self, x: Array) -> Array:
        out = np.zeros((self.size, x.shape[1]))
        out[self.free] = self.scale[:, None] * x
        return out


class Banded:
    """The same without conditions, for sums of forms whose bands are kept.

    Parameters
    ----------
    bands : Bands
    weights : sequence of float
        Factors on its matrices, whose sum is A.
    free : ndarray of bool (n,)

    Raises
    ------
    numpy.linalg.LinAlgError
        A is not positive definite.
    """

    def __init__(self, bands: Bands, weights: Sequence[float], free: Array) -> None:
        form = bands.sum(weights)
        self.free = free[:, None]
        held = np.flatnonzero(~free[bands.points])
        form[held] = 0.0
        row = held[:, None] - np.arange(1, bands.width + 1)
        form.ravel()[(row * bands.width + held[:, None])[row >= 0]] = 0.0
        diagonal = form[:, 0]
        diagonal += LEAST * (diagonal + LEAST * diagonal.max(initial=0.0) + 1e-300)
        diagonal[held] = 1.0
        self._solve = Cholesky(bands, form)

    def __call__(
        self, right: Array, start: Array | None = None, goal: Array | None = None, exactly: bool = True
    ) -> Array:
        """x − start, of which b is the right-hand side; see :class:`Constrained`."""
        found = self._solve(right)
        found *= self.free
        return found

    def settled(self, x: Array) -> Array:
        """The same point: there are no conditions."""
        return x


def missed(rows: Any, x: Array, goal: Array | None) -> Array:
    """Numbers of the conditions L x = r, r zero by default, that x ``(n, k)`` misses by more than rounding."""
    lacking = np.abs((0.0 if goal is None else goal) - rows @ x).max(axis=1, initial=0.0)
    return np.flatnonzero(lacking > ROUNDING * (abs(rows) @ np.abs(x).max(axis=1, initial=0.0)).max(initial=0.0))


def lengths(rows: Any) -> Array:
    """Euclidean norms of the rows of a ``scipy.sparse.csr_array``."""
    row = np.repeat(np.arange(rows.shape[0]), np.diff(rows.indptr))
    return np.asarray(np.sqrt(np.bincount(row, rows.data * rows.data, rows.shape[0])))


def part(form: Any, points: Array) -> Any:
    """Some rows and the same columns of a ``scipy.sparse.csr_array``."""
    if len(points) == form.shape[1]:
        return form
    form = form[points]
    place = np.full(form.shape[1], -1, np.int32)
    place[points] = np.arange(len(points))
    column = place[form.indices]
    return taken(form, column >= 0, column, len(points))


def taken(form: Any, which: Array, columns: Array | None = None, width: int | None = None) -> Any:
    """Some entries of a matrix, moved to other columns if given."""
    from scipy.sparse import csr_array

    ends = np.append(0, np.cumsum(which))[form.indptr].astype(np.int32)
    columns = form.indices if columns is None else columns
    return csr_array((form.data[which], columns[which], ends), shape=(form.shape[0], width or form.shape[1]))


def scaled(form: Any, scale: Array) -> Any:
    """A matrix scaled from both sides, with :data:`LEAST` added to its diagonal."""
    from scipy.sparse import csr_array, eye_array

    row = np.repeat(np.arange(len(scale), dtype=form.indices.dtype), np.diff(form.indptr))
    data = scale[row]
    data *= form.data
    data *= scale[form.indices]
    own = np.flatnonzero(row == form.indices)
    scaled = csr_array((data, form.indices, form.indptr), shape=form.shape)
    if len(own) < len(scale):
        return (scaled + LEAST * eye_array(len(scale))).tocsr()
    data[own] += LEAST
    return scaled
