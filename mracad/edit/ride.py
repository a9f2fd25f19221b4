"""Details on a surface whose coarse shape c moves to c + δ: they turn with it.

    f ↦ c + δ + R (f − c) = f + δ + (R − 1)(f − c),      c = L f

L is the low-pass of the solver, R the rotation from the tangent frame of c to that of c + δ
(:func:`mracad.edit.carry.turns`).  A detail on the surface keeps its height and its angle to it.  Where c shrinks (a
tube thinner than the scale becomes a line), the whole tube is a detail and turns; its tangents are then taken at
shorter wavelengths.
"""

from __future__ import annotations

import numpy as np

from mracad.bspline.fit import through
from mracad.bspline.surface import Net
from mracad.bspline.vectors import cross
from mracad.edit.carry import turns
from mracad.edit.target import stiffness
from mracad.model.region import grown
from mracad.seam.solve import Problem, Space

Array = np.ndarray

HALVINGS = 4
"""How often the wavelength is halved at most to find tangents."""

AREA = 0.9
"""Share of its area that a surface must keep for its tangents to be used."""

AROUND = 12
"""Number of nearest places whose mean rotation is taken where a surface has no coarse shape of its own."""


class Rider:
    """The details of joined surfaces.

    Parameters
    ----------
    problem : Problem
    wavelength : float
        Waves longer than this (mm) are coarse shape.
    """

    def __init__(self, problem: Problem, wavelength: float) -> None:
        self.problem = problem
        self.details = problem.split(-_low(problem, wavelength))
        for shorter in range(HALVINGS + 1):
            low = problem.split(_low(problem, wavelength / 2**shorter))
            self.coarse = {i: s.net.with_poles(s.net.poles + low[i]) for i, s in problem.spaces.items()}
            if not any(_shrunk(s.net, self.coarse[i], s.seen) for i, s in problem.spaces.items()):
                break
        self.odd = {i: _beside(s) for i, s in problem.spaces.items()}

    def carried(self, delta: Array) -> Array:
        """(R − 1)(f − c) for a displacement of the coarse shape, both ``(points, 3)``."""
        found = []
        for (i, space), part in zip(self.problem.spaces.items(), self.problem.split(delta).values(), strict=True):
            net, before = space.net, self.coarse[i]
            at = net.u.greville(), net.v.greville()
            turned = _mended(turns(before, before.with_poles(before.poles + part)), net, self.odd[i])
            detail = np.asarray(net.with_poles(self.details[i]).grid(*at))
            found.append(through(net, np.einsum("uvij,uvj->uvi", turned, detail) - detail).reshape(-1, 3))
        return np.concatenate(found)


def _low(problem: Problem, wavelength: float) -> Array:
    """L f − f, ``(points, 3)``."""
    return problem.filtered(stiffness(wavelength), problem.seen, of=problem.f)


def _shrunk(net: Net, coarse: Net, seen: Array) -> bool:
    """Whether a coarse surface has clearly less area than the surface itself, within its faces."""
    at = net.u.greville(), net.v.greville()
    areas = [
        np.linalg.norm(cross(each.tangents(*at, 0), each.tangents(*at, 1)), axis=-1)[seen].sum()
        for each in (coarse, net)
    ]
    return bool(areas[0] < AREA * areas[1])


def _beside(space: Space) -> Array:
    """The Greville points at which the surface depends on control points that its faces do not: those stay."""
    knots = space.net.u, space.net.v
    return grown(~space.seen, knots, max(each.degree for each in knots)) if not space.seen.all() else ~space.seen


def _mended(turned: Array, net: Net, odd: Array) -> Array:
    """Rotations ``(nu, nv, 3, 3)`` at the Greville points; at odd ones, means of those nearby."""
    if not odd.any() or odd.all():
        return turned
    from scipy.spatial import KDTree

    places = np.asarray(net.grid(net.u.greville(), net.v.greville()))
    count = min(AROUND, int((~odd).sum()))
    near = KDTree(places[~odd]).query(places[odd], k=[*range(1, count + 1)])[1]
    u, _, vt = np.linalg.svd(turned[~odd][near].mean(axis=1))
    u[:, :, 2] *= np.linalg.det(u @ vt)[:, None]
    turned = turned.copy()
    turned[odd] = u @ vt
    return turned
