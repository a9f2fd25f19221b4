"""Trimmed seams shut on the fine nets.

With f the input of all surfaces, s where the edit would have them, C the conditions of the trimmed seams at the Gauss
points of their pieces between knot lines and L those of the other seams,

    x = argmin (x − s)ᵀ K (x − s) / (σ Λ)² + Σ w |C x − c|² / (τ² Λ),      c = C f, its gaps made a little smaller,
    K = M_u ⊗ M_v + ℓ² (T_u ⊗ M_v + M_u ⊗ T_v),   M = diag(∫ N_i),   T_ij = ∫ N_i' N_j'   (arc length, mm),   ℓ = Λ / 5,

over the free control points within a wavelength of the trimmed seams, on whatever surface, L x kept; σ the largest
displacement wanted, Λ the wavelength of the edit, w arc lengths (all mm), τ the tolerance of a condition.  Where points
nearby are frozen, x − s fades within ℓ and never exceeds what they miss (the energy is that of a membrane: a plate's
would go on beyond a noisy frozen border in its slope).  A change that fades so is much the same on both sides of a
seam; what is left of a gap falls as the spans are halved.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mracad.bspline.gram import gram
from mracad.bspline.net import Net
from mracad.constraint.definite import definite
from mracad.constraint.region import supported
from mracad.constraint.trimmed import Trace, TrimmedSeam, across, collocation, fine_sites
from mracad.wavelet.ladder import arc_lengths

if TYPE_CHECKING:
    from scipy.spatial import KDTree

Array = np.ndarray

FADE = 5.0
"""The wavelength is so many times the length ℓ in which a change fades."""

STRICT = 1e3
"""How much heavier than the conditions of trimmed seams those of the others are."""

EASED = 0.1
"""Share of a gap that is closed, so that what the solution leaves of the conditions does not widen it."""


_EVENLY = np.linspace(0.0, 1.0, 257)


@dataclass(frozen=True, eq=False)
class Sheet:
    """A surface of the edit.

    Attributes
    ----------
    net : Net
        The input.
    wanted, offset : ndarray (nu, nv, 3)
        Offsets of its control points were nothing frozen, and those found so far, mm.
    free : ndarray of bool (nu, nv)
    scale : float
        Wavelength of the edit, mm.
    """

    net: Net
    wanted: Array
    offset: Array
    free: Array
    scale: float

    def near(self, traces: Sequence[Trace], points: KDTree) -> Array:
        """Free points (nu, nv) that traces on the surface depend on or within a wavelength of ``points``."""
        cells = np.zeros((self.net.u.spans, self.net.v.spans), bool)
        for trace in traces:
            cells |= trace.cells(self.net, np.linspace(0.0, 1.0, 4 * max(cells.shape) + 1))
        apart = points.query(self.net.poles.reshape(-1, 3), distance_upper_bound=self.scale)[0]
        return self.free & (supported(self.net, cells) | np.isfinite(apart).reshape(self.free.shape))

    def form(self) -> Any:
        """K, on the control points in row-major order."""
        from scipy.sparse import diags_array, kron

        mass, stretch = [], []
        for axis, knots in enumerate((self.net.u, self.net.v)):
            lengths = arc_lengths(self.net, axis)
            speed = np.maximum(lengths, 1e-6 * lengths.max()) / np.diff(knots.breaks)
            mass.append(diags_array(gram(knots, weights=speed).apply(np.ones(knots.count))))
            stretch.append((self.scale / FADE) ** 2 * gram(knots, 1, weights=1.0 / speed).tocsr())
        return (kron(*mass) + kron(stretch[0], mass[1]) + kron(mass[0], stretch[1])).tocsr()


def shut(
    sheets: Mapping[int, Sheet], seams: Sequence[TrimmedSeam], exact: Any, tolerances: Sequence[float], amount: float
) -> dict[int, Array]:
    """Offsets of the control points with which trimmed seams are as tight as the nets allow.

    Parameters
    ----------
    sheets : mapping of int to Sheet
        All surfaces that move together.
    seams : sequence of TrimmedSeam
    exact : scipy.sparse.csr_array
        L, on the control points of the sheets laid out one after another.
    tolerances : sequence of float
        Gap (mm), angle, curvature jump (1/mm).
    amount : float
        How much of the edit is made.
    """
    from scipy.sparse import block_diag, diags_array, vstack
    from scipy.spatial import KDTree

    nets = {i: sheet.net for i, sheet in sheets.items()}
    f = np.concatenate([net.poles.reshape(-1, 3) for net in nets.values()])
    f = f - f.mean(axis=0)
    near = KDTree(np.concatenate([nets[seam.a.surface].evaluate(seam.a.places(_EVENLY)) for seam in seams]))
    masks = {
        i: sheet.near([t for seam in seams for t in (seam.a, seam.b) if t.surface == i], near)
        for i, sheet in sheets.items()
    }
    inside = np.flatnonzero(np.concatenate([mask.ravel() for mask in masks.values()]))
    if not len(inside):
        return {i: sheet.offset for i, sheet in sheets.items()}
    scale = min(sheet.scale for sheet in sheets.values())
    size = max(np.linalg.norm(sheet.wanted, axis=-1)[sheet.free].max(initial=0.0) for sheet in sheets.values())
    size = max(size, tolerances[0], *(float(seam.opening[0]) for seam in seams))
    form, pull = [], []
    for i, sheet in sheets.items():
        if masks[i].any():
            own = np.flatnonzero(masks[i])
            rows = sheet.form()[own] / (size * scale) ** 2
            form.append(rows[:, own])
            pull.append(rows @ (sheet.wanted - sheet.offset).reshape(-1, 3))
    loose, goal, weight = _conditions(nets, seams, f, tolerances, amount)
    weight /= scale
    start = f + np.concatenate([sheet.offset.reshape(-1, 3) for sheet in sheets.values()])
    matrix = vstack([loose, exact], format="csr")
    missing = np.concatenate([goal, exact @ start]) - matrix @ start
    weights = diags_array(np.append(weight, np.full(exact.shape[0], STRICT * weight.max())))
    rows = matrix[:, inside]
    normal = block_diag(form, format="csr") + rows.T @ weights @ rows
    change = np.zeros_like(f)
    change[inside] = definite(normal)(np.concatenate(pull) + rows.T @ (weights @ missing))
    parts = np.split(change, np.cumsum([mask.size for mask in masks.values()])[:-1])
    return {i: s.offset + part.reshape(s.offset.shape) for (i, s), part in zip(sheets.items(), parts, strict=True)}


def _conditions(
    nets: Mapping[int, Net], seams: Sequence[TrimmedSeam], f: Array, tolerances: Sequence[float], amount: float
) -> tuple[Any, Array, Array]:
    """C, c, and the lengths (mm) that the conditions stand for over their squared tolerances."""
    spaces = {i: (net.u, net.v) for i, net in nets.items()}
    places = [fine_sites((seam.a, seam.b), spaces) for seam in seams]
    matrix = collocation(nets, nets, seams, [share for share, _ in places])
    goal, weight = matrix @ f, np.empty(matrix.shape[0])
    first = 0
    for seam, (share, part) in zip(seams, places, strict=True):
        net, curve = nets[seam.a.surface], nets[seam.a.surface].evaluate(seam.a.places(_EVENLY))
        length = np.linalg.norm(np.diff(curve, axis=0), axis=1).sum()
        orders = [slice(first + k * len(share), first + (k + 1) * len(share)) for k in range(seam.order + 1)]
        for own, tolerance in zip(orders, tolerances, strict=False):
            weight[own] = length * part / tolerance**2
        gap = goal[orders[0]]
        gap -= (1.0 if seam.close else EASED) * amount * across(gap, _tangents(net, seam.a, share))
        if seam.fit:
            goal[orders[1]] *= 1.0 - amount
        first = orders[-1].stop
    return matrix, goal, weight


def _tangents(net: Net, trace: Trace, share: Array) -> Array:
    _, su, sv = trace.on(net, share, 1)
    way = trace.way(share)
    return su * way[:, :1] + sv * way[:, 1:]
