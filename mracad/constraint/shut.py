"""Trimmed seams shut on the fine nets.

With f the input of all surfaces, s where the edit would have them, C the conditions of the trimmed seams at the Gauss
points of their pieces between knot lines and L those of the other seams,

    x = argmin Σ q(x − s) / (σ Λ)² + Σ w |C x − c|² / (τ² Λ),      c = C f, its gaps made a little smaller,

over the free control points within a wavelength of the trimmed seams, on whatever surface, L x kept; q(x − s) the
fairing form of :mod:`mracad.constraint.fairing`, σ the largest displacement wanted, Λ the wavelength of the edit, w arc
lengths (all mm), τ the tolerance of a condition.  The form makes the change as smooth as the edit is: it can be had on
both sides of a seam alike, and what is left of a gap falls with the fourth power of the spans.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mracad.bspline.net import Net
from mracad.constraint.definite import definite
from mracad.constraint.fairing import Fairing
from mracad.constraint.region import meeting, supported
from mracad.constraint.trimmed import Trace, TrimmedSeam, across, collocation, fine_sites
from mracad.wavelet.ladder import arc_lengths

Array = np.ndarray

BORDER = 0.5
"""The noise that the fairing form expects at frozen points: between none and as much as everywhere."""

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

    def near(self, traces: Sequence[Trace], points: Array) -> Array:
        """Free points (nu, nv) that traces on the surface depend on or within a wavelength of ``points`` (q, 3)."""
        from scipy.spatial import KDTree

        cells = np.zeros((self.net.u.spans, self.net.v.spans), bool)
        for trace in traces:
            uv = trace.places(np.linspace(0.0, 1.0, 4 * max(cells.shape) + 1))
            cells |= meeting(self.net, np.stack([uv, uv], axis=1))
        apart = KDTree(points).query(self.net.poles.reshape(-1, 3), distance_upper_bound=self.scale)[0]
        return self.free & (supported(self.net, cells) | np.isfinite(apart).reshape(self.free.shape))

    def fairing(self) -> Fairing:
        """The fairing form; without the energy where the spans are too uneven for it."""
        parts = self.net.u, self.net.v, (arc_lengths(self.net, 0), arc_lengths(self.net, 1)), self.scale
        try:
            return Fairing(*parts, BORDER)
        except ValueError:
            return Fairing(*parts, 1.0)


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

    nets = {i: sheet.net for i, sheet in sheets.items()}
    spaces = {i: (net.u, net.v) for i, net in nets.items()}
    places = [fine_sites((seam.a, seam.b), spaces) for seam in seams]
    f = np.concatenate([net.poles.reshape(-1, 3) for net in nets.values()])
    f = f - f.mean(axis=0)
    loose = collocation(nets, nets, seams, [share for share, _ in places])
    scale = min(sheet.scale for sheet in sheets.values())
    curves = [nets[seam.a.surface].evaluate(seam.a.places(_EVENLY)) for seam in seams]
    weight = np.concatenate(
        [
            np.linalg.norm(np.diff(curve, axis=0), axis=1).sum() * share / (tolerances[order] ** 2 * scale)
            for seam, (_, share), curve in zip(seams, places, curves, strict=True)
            for order in range(seam.order + 1)
        ]
    )
    defect, first = loose @ f, 0
    for seam, (share, _) in zip(seams, places, strict=True):
        gap, tilt, _ = (slice(first + k * len(share), first + (k + 1) * len(share)) for k in range(3))
        along = _tangents(nets[seam.a.surface], seam.a, share)
        defect[gap] -= (1.0 if seam.close else EASED) * amount * across(defect[gap], along)
        if seam.fit:
            defect[tilt] *= 1.0 - amount
        first += (seam.order + 1) * len(share)
    traces = [trace for seam in seams for trace in (seam.a, seam.b)]
    masks = {
        i: sheet.near([t for t in traces if t.surface == i], np.concatenate(curves)) for i, sheet in sheets.items()
    }
    inside = np.flatnonzero(np.concatenate([mask.ravel() for mask in masks.values()]))
    start = f + np.concatenate([sheet.offset.reshape(-1, 3) for sheet in sheets.values()])
    size = max(np.linalg.norm(sheet.wanted, axis=-1)[sheet.free].max(initial=0.0) for sheet in sheets.values())
    size = max(size, tolerances[0], *(seam.opening[0].max() for seam in seams))
    form, pull = [], []
    for i, sheet in sheets.items():
        if masks[i].any():
            fairing = sheet.fairing()
            form.append(fairing.matrix(masks[i]) / (size * scale) ** 2)
            pull.append(fairing.apply(sheet.wanted - sheet.offset)[masks[i]] / (size * scale) ** 2)
    matrix = vstack([loose, exact], format="csr")
    missing = np.concatenate([defect, exact @ start]) - matrix @ start
    weights = diags_array(np.append(weight, np.full(exact.shape[0], STRICT * weight.max())))
    rows = matrix[:, inside]
    normal = block_diag(form, format="csr") + rows.T @ weights @ rows
    change = np.zeros_like(f)
    change[inside] = definite(normal)(np.concatenate(pull) + rows.T @ (weights @ missing))
    parts = np.split(change, np.cumsum([mask.size for mask in masks.values()])[:-1])
    return {i: s.offset + part.reshape(s.offset.shape) for (i, s), part in zip(sheets.items(), parts, strict=True)}


def _tangents(net: Net, trace: Trace, share: Array) -> Array:
    _, su, sv = net.evaluate(trace.places(share), 1)
    way = trace.way(share)
    return su * way[:, :1] + sv * way[:, 1:]
