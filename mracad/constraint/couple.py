"""Coupled projection: smoothing all faces at once in the coarse space whose seams hold.

With f the control points of all surfaces, P the refinement from the coarse spaces and L the seam conditions,

    y = argmin ‖g − P y‖²_G   subject to   L P y = 0,      δ = P y − g,      g = f − e,

where e is the smallest change with L e = L f: the defects that the input has are carried unchanged (or, where they are
to be mended, left out of e).  Without the
conditions the projection y₀ is separable on each surface; with them

    y = y₀ − G_c⁻¹ Cᵀ λ,      (C G_c⁻¹ Cᵀ) λ = C y₀,      C = L P,   G_c = PᵀGP,

solved by conjugate gradients with the sparse C D⁻¹ Cᵀ, D = diag G_c, as preconditioner.  Dependent conditions (they
are the rule at vertices) do no harm: the system stays consistent.

A condition is a spline along the seam; it vanishes when it does at as many points as its space has functions
(Schoenberg–Whitney), whatever the knots, degrees and weights on the two sides.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from mracad.bspline.basis import jet
from mracad.bspline.gram import Gram, gram
from mracad.bspline.knots import KnotVector
from mracad.bspline.knots import Side as Limit
from mracad.bspline.net import Net
from mracad.bspline.refine import refinement
from mracad.constraint.definite import definite
from mracad.constraint.seam import Border, Seam
from mracad.constraint.trimmed import TrimmedSeam, coarse_sites, collocation
from mracad.wavelet.filters import wavelets
from mracad.wavelet.project import projection

Array = np.ndarray

ROUNDING = 1e-14
"""Residual, relative to the right-hand side, at which conditions hold."""

FLOOR = 1e-7
"""Added to the unit diagonal of the conditions' normal matrix, whose rows may be dependent."""

DEPENDENT = 1e-8
"""Singular values below this fraction of the largest count as zero."""

IMPROVED = 20
"""Most steps in which the conditions are fulfilled."""

FILTERS = 3
"""How often the part in nearly dependent conditions, where the joints of a vertex contradict each other a little, is
damped."""

DENSE = 300
"""Most functions in a direction for which the inverse of the Gram matrix is a dense matrix."""

SETTLED = 1e-9
MOST_STEPS = 300


@dataclass(frozen=True, eq=False)
class Patch:
    """One surface of the system.

    Attributes
    ----------
    net : Net
        Its control net, refined so that it holds the coarse space; poles (mm).
    base, lifted : (KnotVector, KnotVector)
        Coarse knots, and those of the control points next to seams: the coarse space is the sum of the splines over
        ``base`` and of those over ``lifted`` along a seam times those over ``base`` that its conditions look at.
    near : (ndarray of bool, ndarray of bool)
        Functions over ``base`` in u and v that the conditions of seams along the other direction look at.
    weight : float
        Area per unit of the parameter plane.
    """

    net: Net
    base: tuple[KnotVector, KnotVector]
    lifted: tuple[KnotVector, KnotVector]
    near: tuple[Array, Array]
    weight: float


class Conditions:
    """The seam conditions L on the control points of some nets, laid out one after another.

    Attributes
    ----------
    matrix : scipy.sparse.csr_array (conditions, points)
    first : dict of int to int
        Where the control points of each surface begin.
    owner : ndarray (conditions,)
        Index of the seam that each condition belongs to.
    mended : ndarray of bool (conditions,)
        Whether the input's defect is to vanish instead of being carried.
    sites : list of int
        How many of the conditions of each seam, the first ones, are on its curve (G0).
    """

    def __init__(self, nets: Mapping[int, Net], seams: Sequence[Seam], spaces: Mapping[int, tuple[KnotVector, ...]]):
        from scipy.sparse import csr_array

        sizes = [net.u.count * net.v.count for net in nets.values()]
        self.first = dict(zip(nets, np.cumsum([0, *sizes[:-1]]).tolist(), strict=True))
        self.size = int(sum(sizes))
        parts: list[tuple[Array, Array, Array]] = [(np.empty(0, int), np.empty(0, int), np.empty(0))]
        owner, mended, count = [np.empty(0, int)], [np.empty(0, bool)], 0
        self.sites: list[int] = []
        for number, seam in enumerate(seams):
            for derivative in range(seam.joint.order + 1):
                share = _sites(seam, derivative, nets, spaces)
                for border, terms in _terms(seam, derivative):
                    column, value = _functional(nets[border.surface], border, share, terms)
                    row = np.repeat(count + np.arange(len(share)), column.shape[1])
                    parts.append((row, self.first[border.surface] + column.ravel(), value.ravel()))
                if derivative == 0:
                    self.sites.append(len(share))
                owner.append(np.full(len(share), number))
                mended.append(np.full(len(share), (seam.joint.close, seam.joint.fit, False)[derivative]))
                count += len(share)
        row, column, value = (np.concatenate(x) for x in zip(*parts, strict=True))
        matrix = csr_array((value, (row, column)), shape=(count, self.size))
        matrix.data[np.abs(matrix.data) < 1e-14 * np.abs(matrix.data).max(initial=0.0)] = 0.0
        matrix.eliminate_zeros()
        self.matrix, self.owner = matrix, np.concatenate(owner)
        self.mended = np.concatenate(mended)


def _terms(seam: Seam, derivative: int) -> list[tuple[Border, list[tuple[int, int, Array]]]]:
    """A condition as functionals on both sides: derivatives (across, along) with polynomial factors of the fraction."""
    joint, one = seam.joint, np.ones(1)
    if derivative == 0:
        return [(seam.b, [(0, 0, one)]), (seam.a, [(0, 0, -one)])]
    if derivative == 1:
        return [(seam.b, [(1, 0, one)]), (seam.a, [(1, 0, -joint.across), (0, 1, -joint.along)])]
    terms = [(2, 0, -(joint.across**2)), (1, 0, np.array([-joint.bend])), (0, 1, np.array([-joint.shear]))]
    return [(seam.b, [(2, 0, one)]), (seam.a, [t for t in terms if t[2].any()])]


def _functional(net: Net, border: Border, share: Array, terms: list[tuple[int, int, Array]]) -> tuple[Array, Array]:
    """Control points ``(q, k)`` and their factors in Σ c(t) ∂ₙⁱ∂ₜʲ of the surface at fractions of a border."""
    pace = border.stop - border.start
    along = (1.0 - share) * border.start + share * border.stop
    column, table = _jet(net, border, along, max(i + j for i, j, _ in terms), "right" if pace > 0 else "left")
    value = np.zeros(column.shape)
    for i, j, factor in terms:
        if factor.size:
            value += (np.polynomial.polynomial.polyval(share, factor) * pace**j)[:, None] * table[i, j]
    return column, value


def _jet(net: Net, border: Border, at: Array, order: int, limit: Limit) -> tuple[Array, dict[tuple[int, int], Array]]:
    """Rational basis functions and derivatives at places ``at`` along a border.

    Returns
    -------
    index : ndarray (q, k)
        Control points.
    table : dict
        For derivatives (across, along) the values ``(q, k)``.
    """
    across, along = (net.u, net.v)[:: 1 - 2 * border.axis]
    place = np.array([border.at])
    first_n, in_n = jet(across, place, range(order + 1), border.limit)
    first_t, in_t = jet(along, at, range(order + 1), limit)
    line = (first_n[:, None] + np.arange(across.degree + 1)) % across.count
    step = (first_t[:, None] + np.arange(along.degree + 1)) % along.count
    stride = (net.v.count, 1)[:: 1 - 2 * border.axis]
    index = (line[:, :, None] * stride[0] + step[:, None, :] * stride[1]).reshape(len(at), -1)
    table = {
        (i, j): (in_n[:, i, :, None] * in_t[:, j, None, :]).reshape(len(at), -1)
        for i in range(order + 1)
        for j in range(order + 1 - i)
    }
    if net.weights is None:
        return index, table
    weights = net.weights.ravel()[index]
    top = {key: value * weights for key, value in table.items()}
    w = {key: value.sum(axis=1, keepdims=True) for key, value in top.items()}
    r = {(0, 0): top[0, 0] / w[0, 0]}
    for key in [k for k in top if sum(k) == 1]:
        r[key] = (top[key] - w[key] * r[0, 0]) / w[0, 0]
    for i, j in [k for k in top if sum(k) == 2]:
        one, two = ((1, 0), (1, 0)) if i == 2 else ((0, 1), (0, 1)) if j == 2 else ((1, 0), (0, 1))
        r[i, j] = (top[i, j] - w[one] * r[two] - w[two] * r[one] - w[i, j] * r[0, 0]) / w[0, 0]
    return index, r


def _sites(seam: Seam, derivative: int, nets: Mapping[int, Net], spaces: Mapping[int, tuple[KnotVector, ...]]) -> Array:
    """Fractions of the edge at which a condition is asked: the Greville points of the spline space it lies in."""
    degree, lost = 0, 1 if derivative and (len(seam.joint.along) or seam.joint.shear) else 0
    own = []
    for border in (seam.a, seam.b):
        knots = spaces[border.surface][1 - border.axis]
        share = (knots.breaks - border.start) / (border.stop - border.start)
        inside = (share > 1e-9) & (share < 1 - 1e-9)
        own.append((share[inside], knots.degree - knots.multiplicities[inside]))
        extra = len(seam.joint.across) - 1 if border is seam.a and derivative else 0
        rational = 0 if nets[border.surface].weights is None else knots.degree
        degree = max(degree, knots.degree + rational + extra * (derivative or 1))
    every = np.sort(np.concatenate([share for share, _ in own]))
    breaks = every[np.append(True, np.diff(every) > 1e-9)] if len(every) else every
    smooth = np.full(len(breaks), degree - 1)
    for share, continuity in own:
        if len(share):
            at = np.abs(share[:, None] - breaks).argmin(axis=1)
            np.minimum.at(smooth, at, continuity - lost)
    mults = np.clip(degree - smooth, 1, degree)
    knots = KnotVector.from_multiplicities(
        np.concatenate([[0.0], breaks, [1.0]]), np.concatenate([[degree + 1], mults, [degree + 1]]), degree
    )
    return knots.greville()


class Restoration:
    """The smallest change that makes conditions hold.

    ``c = argmin Σ d c²`` subject to ``L c = r`` and ``c = 0`` on fixed points, that is c = D⁻¹Lᵀ(L D⁻¹ Lᵀ)⁺ r over the
    free points.

    Parameters
    ----------
    matrix : scipy.sparse.csr_array
        L.
    diagonal : ndarray (points,)
        d, positive.
    free : ndarray of bool (points,), optional
    """

    def __init__(self, matrix: Any, diagonal: Array, free: Array | None = None) -> None:
        from scipy.sparse import diags_array, eye_array

        inverse = 1.0 / diagonal if free is None else np.where(free, 1.0 / diagonal, 0.0)
        size = np.sqrt(np.maximum(matrix.power(2) @ inverse, 0.0))
        whole = np.sqrt(matrix.power(2) @ (1.0 / diagonal))
        self.used = np.flatnonzero(size > 1e-12 * whole)
        self.scale = 1.0 / size[self.used]
        self.rows = diags_array(self.scale).tocsr() @ matrix[self.used]
        self.back = (self.rows @ diags_array(inverse).tocsr()).T.tocsr()
        self.normal = (self.rows @ self.back).tocsr()
        eye = FLOOR * eye_array(len(self.used), format="csr")
        self.inverse = definite(self.normal + eye)

    def solve(self, residual: Array) -> Array:
        """λ with ``(L D⁻¹ Lᵀ) λ = r`` in the scaled rows, nearly; nothing of it in the dependent conditions."""
        return self.inverse(self.attainable(residual))

    def attainable(self, residual: Array) -> Array:
        """The part of a residual that control points can answer for: nothing in (nearly) dependent conditions."""
        return self.normal @ self.inverse(residual)

    def change(self, wanted: Array) -> Array:
        """c ``(points, 3)`` for ``r`` (conditions, 3)."""
        right = self.scale[:, None] * wanted[self.used]
        c = np.zeros((self.back.shape[0], right.shape[1]))
        least = np.abs(right).max(initial=0.0)
        for _ in range(IMPROVED):
            residual = right - self.rows @ c
            worst = np.abs(residual).max(initial=0.0)
            if worst == 0.0 or (worst > 0.5 * least and c.any()):
                break
            least = worst
            c = c + self.back @ self.solve(residual)
        return c


class Coupling:
    """The coupled projection of some surfaces.

    Parameters
    ----------
    patches : mapping of int to Patch
        By surface.
    seams : sequence of Seam
        Those that hold exactly.
    trimmed : sequence of TrimmedSeam
        Those that hold to a tolerance; the coarse spaces meet them at a few points only.
    """

    def __init__(
        self, patches: Mapping[int, Patch], seams: Sequence[Seam], trimmed: Sequence[TrimmedSeam] = ()
    ) -> None:
        self.patches, self.seams, self.trimmed = patches, seams, trimmed
        self.nets = {i: p.net for i, p in patches.items()}
        spaces = {i: (p.net.u, p.net.v) for i, p in patches.items()}
        self.fine = Conditions(self.nets, seams, spaces)
        self.diagonal = np.concatenate(
            [p.weight * np.outer(*(_lumped(k) for k in (p.net.u, p.net.v))).ravel() for p in patches.values()]
        )

    def over(self, nets: Mapping[int, Net]) -> Coupling:
        """The same for surfaces with more knots."""
        patches = {i: replace(p, net=nets[i]) for i, p in self.patches.items()}
        return Coupling(patches, self.seams, self.trimmed)

    @cached_property
    def restoration(self) -> Restoration:
        return Restoration(self.fine.matrix, self.diagonal)

    @cached_property
    def mending(self) -> Array:
        """The smallest change (points, 3) that takes away the defects that are to be mended."""
        if not self.fine.mended.any():
            return np.zeros_like(self.centred)
        defect = np.where(self.fine.mended[:, None], self.fine.matrix @ self.centred, 0.0)
        return -self.restoration.change(defect)

    @cached_property
    def centred(self) -> Array:
        """f, its centroid at the origin."""
        f = self.stacked({i: net.poles for i, net in self.nets.items()})
        return f - f.mean(axis=0)

    def split(self, stacked: Array) -> dict[int, Array]:
        """Stacked points ``(points, 3)`` as nets."""
        return {
            i: stacked[self.fine.first[i] :][: p.net.u.count * p.net.v.count].reshape(p.net.u.count, p.net.v.count, 3)
            for i, p in self.patches.items()
        }

    def stacked(self, nets: Mapping[int, Array]) -> Array:
        """Nets as stacked points."""
        return np.concatenate([nets[i].reshape(-1, 3) for i in self.patches])

    def displacement(self) -> dict[int, Array]:
        """δ of every surface, over its refined net: L δ = 0, or −L f where defects are mended."""
        f = self.centred
        defect = self.fine.matrix @ f
        carried = self.restoration.change(np.where(self.fine.mended[:, None], 0.0, defect))
        nets = self.split(f - carried)
        start = {}
        for i, p in self.patches.items():
            in_u = projection(p.lifted[0], p.net.u).coarse(nets[i], 0)
            start[i] = projection(p.lifted[1], p.net.v).coarse(in_u, 1)
        coarse = self._conditioned(start, f - carried)
        smooth = {}
        for i, p in self.patches.items():
            in_u = refinement(p.lifted[0], p.net.u).apply(coarse[i], 0)
            smooth[i] = refinement(p.lifted[1], p.net.v).apply(in_u, 1)
        delta = self.stacked(smooth) + carried - f
        return self.split(self._restored(delta, None, 1.0))

    def _conditioned(self, start: dict[int, Array], g: Array) -> dict[int, Array]:
        """y from y₀, on the coarse nets; trimmed seams keep the gap and the tilt of g."""
        from scipy.sparse import block_diag, vstack

        spaces = [_Space(p) for p in self.patches.values()]
        lift = block_diag([space.lift for space in spaces], format="csr")
        loose, wanted = self._coarse_trimmed(g)
        matrix = (vstack([self.coarse.matrix, loose]) @ lift).tocsr()
        preconditioner = Restoration(matrix, np.concatenate([space.diagonal for space in spaces]))
        ends = np.cumsum([len(space.diagonal) for space in spaces])[:-1]

        def inverse(b: Array) -> Array:
            return np.concatenate([space.solve(part) for space, part in zip(spaces, np.split(b, ends), strict=True)])

        rows = preconditioner.rows
        y0 = np.concatenate([space.project(x) for space, x in zip(spaces, start.values(), strict=True)])
        wanted = np.concatenate([np.zeros((matrix.shape[0] - len(wanted), 3)), wanted])
        residual = rows @ y0 - preconditioner.scale[:, None] * wanted[preconditioner.used]
        for _ in range(FILTERS):
            residual = preconditioner.attainable(residual)
        multiplier = np.zeros_like(residual)
        down = np.zeros_like(y0)
        direction = step_of = preconditioner.solve(residual)
        rho = (residual * step_of).sum(axis=0)
        goal = SETTLED * np.abs(residual).max(initial=0.0)
        for _ in range(MOST_STEPS):
            if np.abs(residual).max(initial=0.0) <= goal:
                break
            pulled = inverse(rows.T @ direction)
            image = rows @ pulled
            curvature = (direction * image).sum(axis=0)
            step = np.divide(rho, curvature, out=np.zeros_like(rho), where=curvature > 0)
            multiplier += step * direction
            down += step * pulled
            residual = residual - step * image
            step_of = preconditioner.solve(residual)
            rho, before = (residual * step_of).sum(axis=0), rho
            direction = step_of + np.divide(rho, before, out=np.zeros_like(rho), where=before > 0) * direction
        y = lift @ (y0 - down)
        shapes = {i: x.shape for i, x in start.items()}
        ends = np.cumsum([s[0] * s[1] for s in shapes.values()])[:-1]
        return {i: x.reshape(shapes[i]) for i, x in zip(shapes, np.split(y, ends), strict=True)}

    def _coarse_trimmed(self, g: Array) -> tuple[Any, Array]:
        """Conditions of trimmed seams on the coarse nets and their right-hand sides: what is open stays open."""
        shares = [coarse_sites(seam, {i: p.base for i, p in self.patches.items()}) for seam in self.trimmed]
        fine = collocation(self.nets, self.nets, self.trimmed, shares)
        wanted = fine @ g
        if self.rational:
            return fine @ self._refinement(fine), wanted
        return collocation(self._coarse_nets(), self.nets, self.trimmed, shares), wanted

    @property
    def rational(self) -> bool:
        """Whether some surface has weights."""
        return any(net.weights is not None for net in self.nets.values())

    def _coarse_nets(self) -> dict[int, Net]:
        return {i: Net(*p.lifted, np.zeros((p.lifted[0].count, p.lifted[1].count, 3))) for i, p in self.patches.items()}

    @cached_property
    def coarse(self) -> Conditions:
        """C = L P, asked at the points that the coarse spaces need."""
        if not self.rational:
            return Conditions(self._coarse_nets(), self.seams, {i: p.lifted for i, p in self.patches.items()})
        spaces = {i: p.lifted if p.net.weights is None else (p.net.u, p.net.v) for i, p in self.patches.items()}
        conditions = Conditions(self.nets, self.seams, spaces)
        conditions.matrix = conditions.matrix @ self._refinement(conditions.matrix)
        conditions.first = dict(zip(self.patches, np.cumsum([0, *self._coarse_sizes()[:-1]]).tolist(), strict=True))
        return conditions

    def _coarse_sizes(self) -> list[int]:
        return [p.lifted[0].count * p.lifted[1].count for p in self.patches.values()]

    def freedom(self, number: int) -> int:
        """Degrees of freedom of the curve of a seam in the coarse space, its own conditions alone holding.

        The rank of the curve as a function of the coarse nets on which all conditions of the seam vanish.
        """
        seam = self.seams[number]
        rows = self.coarse.matrix[self.coarse.owner == number]
        used = np.unique(rows.indices)
        patch = self.patches[seam.a.surface]
        begin = self.coarse.first[seam.a.surface]
        own = (used >= begin) & (used < begin + patch.lifted[0].count * patch.lifted[1].count)
        dense = rows[:, used].toarray()
        curve = np.where(own, dense, 0.0)[: self.coarse.sites[number]]
        _, size, right = np.linalg.svd(dense)
        free = right[np.count_nonzero(size > DEPENDENT * size[0]) :]
        return int(np.linalg.matrix_rank(curve @ free.T, tol=DEPENDENT * np.linalg.norm(curve)))

    def _refinement(self, matrix: Any) -> Any:
        """Rows of P, the refinement of all surfaces, for the points that ``matrix`` uses."""
        from scipy.sparse import csr_array

        used = np.unique(matrix.indices)
        parts, start = [], 0
        for i, p in self.patches.items():
            nu, nv = p.net.u.count, p.net.v.count
            own = used[(used >= self.fine.first[i]) & (used < self.fine.first[i] + nu * nv)]
            u, v = np.divmod(own - self.fine.first[i], nv)
            in_u, in_v = refinement(p.lifted[0], p.net.u), refinement(p.lifted[1], p.net.v)
            column = in_u.index[u][:, :, None] * p.lifted[1].count + in_v.index[v][:, None, :]
            value = in_u.values[u][:, :, None] * in_v.values[v][:, None, :]
            row = np.broadcast_to(own[:, None, None], column.shape)
            parts.append((row.ravel(), start + column.ravel(), value.ravel()))
            start += p.lifted[0].count * p.lifted[1].count
        row, column, value = (np.concatenate(x) for x in zip(*parts, strict=True))
        return csr_array((value, (row, column)), shape=(self.fine.size, start))

    def held(self, delta: Mapping[int, Array], free: Mapping[int, Array], amount: float) -> dict[int, Array]:
        """δ with zeros where ``free`` is false, and the conditions (by ``amount``) fulfilled all the same."""
        mask = np.concatenate([free[i].ravel() for i in self.patches])
        return self.split(self._restored(np.where(mask[:, None], self.stacked(delta), 0.0), mask, amount))

    def _restored(self, delta: Array, free: Array | None, amount: float) -> Array:
        """δ changed on free points so that its conditions hold."""

        mending = self.mending if free is None else np.where(free[:, None], self.mending, 0.0)
        exact = amount * (self.fine.matrix @ mending)
        fix = self.restoration if free is None else Restoration(self.fine.matrix, self.diagonal, free)
        return delta - fix.change(self.fine.matrix @ delta - exact)


class _Space:
    """The coarse space of one patch.

    Attributes
    ----------
    lift : scipy.sparse.csr_array
        From its coordinates to the control points over the lifted knots; the identity where nothing is lifted.
    diagonal : ndarray
        Of its Gram matrix.
    """

    def __init__(self, patch: Patch) -> None:
        from scipy.sparse import eye_array, hstack, kron

        self.patch = patch
        grams = [gram(k) for k in patch.lifted]
        if patch.base == patch.lifted:
            size = patch.lifted[0].count * patch.lifted[1].count
            self.lift = eye_array(size, format="csr")
            self.inverses = [_inverse(g) for g in grams]
            self.diagonal = patch.weight * np.outer(*(g.diagonal() for g in grams)).ravel()
            return
        in_u, in_v = (refinement(b, k).tocsr() for b, k in zip(patch.base, patch.lifted, strict=True))
        more_u, more_v = (_wavelets(b, k) for b, k in zip(patch.base, patch.lifted, strict=True))
        near_u, near_v = (np.flatnonzero(x) for x in patch.near)
        parts = [kron(in_u, in_v), kron(in_u[:, near_u], more_v), kron(more_u, in_v[:, near_v])]
        self.lift = hstack(parts, format="csr")
        self.gram = patch.weight * kron(*(g.tocsr() for g in grams), format="csr")
        whole = self.lift.T @ self.gram @ self.lift
        self.inverses = [definite(whole)]
        self.diagonal = whole.diagonal()

    def solve(self, b: Array) -> Array:
        """The inverse of the Gram matrix times ``b`` (coordinates, 3)."""
        if len(self.inverses) == 1:
            return self.inverses[0](b)
        nu, nv = (k.count for k in self.patch.lifted)
        along_u = self.inverses[0](b.reshape(nu, -1)).reshape(nu, nv, 3)
        turned = np.ascontiguousarray(along_u.swapaxes(0, 1)).reshape(nv, -1)
        return self.inverses[1](turned).reshape(nv, nu, 3).swapaxes(0, 1).reshape(-1, 3) / self.patch.weight

    def project(self, net: Array) -> Array:
        """Coordinates of the projection of a net over the lifted knots."""
        flat = net.reshape(-1, 3)
        return flat if len(self.inverses) == 2 else self.solve(self.lift.T @ (self.gram @ flat))


@lru_cache(maxsize=64)
def _inverse(matrix: Gram) -> Callable[[Array], Array]:
    """The inverse of a Gram matrix as a function of right-hand sides ``(n, k)``."""
    if matrix.shape[0] > DENSE:
        return definite(matrix.tocsr())
    inverse = np.linalg.inv(matrix.toarray())
    return (0.5 * (inverse + inverse.T)).__matmul__


def _wavelets(base: KnotVector, lifted: KnotVector) -> Any:
    from scipy.sparse import csr_array

    if base == lifted:
        return csr_array((lifted.count, 0))
    found = wavelets(base, lifted)
    row, column, value = found.coo()
    return csr_array((value, (row, column)), shape=found.shape)


@lru_cache(maxsize=256)
def _lumped(knots: KnotVector) -> Array:
    """∫ N_i, the row sums of the Gram matrix, with the same for the outermost functions as for whole ones."""
    return gram(knots).apply(np.ones(knots.count))
