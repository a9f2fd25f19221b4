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
    """A plane with the mean chord lengths of a surface along its parameters, rolled up along one that is periodic; the
    surface itself if both are."""
    if net.u.periodic and net.v.periodic:
        return Net(net.u, net.v, net.poles)
    points = np.zeros(net.poles.shape)
    for axis, knots in enumerate((net.u, net.v)):
        chords = np.diff(net.poles, axis=axis, append=np.take(net.poles, [0], axis))
        steps = np.linalg.norm(chords, axis=2).mean(axis=1 - axis)
        steps = np.maximum(steps, 1e-9 * steps.max(initial=1e-300))
        walked = np.append(0.0, np.cumsum(steps[:-1]))
        if knots.periodic:
            radius = float(steps.sum()) / (2 * np.pi)
            both = np.stack([np.cos(walked / radius), np.sin(walked / radius)], axis=1) * radius
            points[..., [axis, 2]] = np.expand_dims(both, 1 - axis)
        else:
            points[..., axis] = np.expand_dims(walked, 1 - axis)
    return Net(net.u, net.v, points)


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
