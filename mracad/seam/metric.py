"""The surface in whose metric displacements are measured: a smoothed copy of the edited one.

In a surface's own metric its second derivatives are purely normal: noise along the surface is invisible, and the noise
of the Christoffel symbols is differentiated.  So there are two passes: a plane net of mean chord lengths first, then,
in its metric, the surface smoothed at a few wavelengths.
"""

from __future__ import annotations

import numpy as np

from mracad.bspline.crease import crease_lines
from mracad.bspline.gram import gram
from mracad.bspline.surface import Net
from mracad.bspline.vectors import cross
from mracad.memo import kept
from mracad.model.cells import Quadrature
from mracad.seam.energy import Forms, forms
from mracad.seam.solve import Problem, Space
from mracad.seam.stretch import EVEN, Stretch

Array = np.ndarray

SMOOTHER = 2.5
"""Wavelength at which the metric is smoothed, over that of the edit."""

BARELY = 1e-6
"""Share of a function's mass that must lie in a face: others could move anywhere, with hardly any effect."""


def planar(net: Net) -> Net:
    """A plane with the mean chord lengths of a surface along its parameters."""
    columns = np.linalg.norm(np.diff(net.poles, axis=0), axis=2).mean(axis=1)
    rows = np.linalg.norm(np.diff(net.poles, axis=1), axis=2).mean(axis=0)
    points = np.zeros(net.poles.shape)
    points[..., 0] = _walked(net.u.count, columns)[:, None]
    points[..., 1] = _walked(net.v.count, rows)
    return Net(net.u, net.v, points)


def _walked(count: int, steps: Array) -> Array:
    """Positions ``(count,)`` after steps from 0; steps are kept positive."""
    steps = np.maximum(steps, 1e-9 * steps.max(initial=1e-300))
    return np.append(0.0, np.cumsum(steps))[:count]


def seen(net: Net, masses: Forms) -> Array:
    """Mask ``(nu, nv)`` of the control points that reach into the faces over which masses were taken."""
    whole = _whole(net)
    mass = masses.mass.diagonal().reshape(whole.shape)
    return np.asarray((mass > BARELY * whole) & (mass > 0))


@kept(16)
def _whole(net: Net) -> Array:
    """About the mass of each function over the whole surface, ``(nu, nv)``."""
    us, vs = net.u.greville(), net.v.greville()
    area = np.linalg.norm(cross(net.tangents(us, vs, 0), net.tangents(us, vs, 1)), axis=-1)
    area = np.minimum(area, np.median(area))  # unusually large areas say little about the function
    return np.asarray(gram(net.u).diagonal()[:, None] * gram(net.v).diagonal() * area)


def creases(net: Net, points: Array) -> tuple[frozenset[float], frozenset[float]]:
    """Crease lines of a surface in u and v, on which one of ``points`` (nu, nv) lies."""
    return crease_lines(net, 0, points), crease_lines(net, 1, points)


def smoothed(net: Net, rule: Quadrature, stiffness: float, stretch: Stretch = EVEN) -> Net:
    """The surface smoothed alone, in the metric of its mean chord lengths.

    Parameters
    ----------
    net : Net
    rule : Quadrature
        Gauss points over its faces.
    stiffness : float
        ℓ⁴, mm⁴, of the filter of gain 1 / (1 + (ℓ ω)⁴).
    stretch : Stretch
        Lengths by direction over ℓ.
    """
    flat = planar(net)
    form = forms(net, flat, rule, stretch=stretch)
    points = seen(net, form)
    problem = Problem({0: Space(net, form, points, points)})
    moved = net.poles + problem.faired(stiffness).reshape(net.poles.shape)
    return net.with_poles(moved)
