"""Splines to pyramids and back: curves and surfaces, alone or joined."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mracad.bspline.knots import KnotVector
from mracad.errors import UsageError
from mracad.wavelet.ladder import rungs_by_level
from mracad.wavelet.lift import Form, Spline, lifted
from mracad.wavelet.patches import matched
from mracad.wavelet.pyramid import Pyramid
from mracad.wavelet.transform import decompose, reconstruct


def wavedec(spline: Spline, levels: int | None = None) -> Pyramid:
    """Decompose a spline curve or surface into its coarse shape and details on levels.

    Each level drops every second knot of the one before, whatever the knots; the coarse spline is the least-squares
    approximation over the parameters, and the details are splines orthogonal to all coarse ones (where knots are not
    clamped, over the whole support of the functions).

    Parameters
    ----------
    spline : BSpline, NdBSpline, Curve or Net
        A curve or a surface with values of any shape, on any knots of degree 1 or more; of a rational one the Euclidean
        control points are decomposed, and the weights stay.
    levels : int, optional
        Largest number of levels; by default all, down to one span (a closed curve: ``degree + 1`` spans, at least 3).

    Returns
    -------
    Pyramid

    Raises
    ------
    UsageError
        What is given is no such spline.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.interpolate import make_interp_spline
    >>> from mracad.wavelet import wavedec, waverec
    >>> x = np.sort(np.random.default_rng(1).uniform(0, 10, 40))
    >>> spline = make_interp_spline(x, np.sin(x))
    >>> pyramid = wavedec(spline)
    >>> len(pyramid.levels), pyramid.coarse.shape
    (6, (4, 1))
    >>> bool(np.allclose(waverec(pyramid)(x), spline(x), rtol=0, atol=1e-12))
    True
    """
    form, poles = lifted(spline)
    pyramid = decompose(poles, *(_ladder(knots, levels) for knots in form.knots))
    return replace(pyramid, form=form)


def waverec(pyramid: Pyramid, level: float = 0.0, coarse: Spline | None = None) -> Spline:
    """The spline of a pyramid, of the type and over the knots of the one that was decomposed.

    Parameters
    ----------
    pyramid : Pyramid
        From :func:`wavedec`.
    level : float
        How many of the finest levels to leave out; ``k + t`` blends the splines without ``k`` and ``k + 1`` of them.
        ``waverec(pyramid.coarser(k))`` is that without ``k``, over fewer knots.
    coarse : BSpline, NdBSpline, Curve or Net, optional
        Another coarse shape, over the knots of ``pyramid.coarser(k)``, on which the ``k`` finest levels are put.

    Returns
    -------
    BSpline, NdBSpline, Curve or Net

    Raises
    ------
    UsageError
        A level outside 0 … number of levels, a pyramid that is not from a spline, or a coarse spline over other knots.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.interpolate import make_interp_spline
    >>> from mracad.wavelet import wavedec, waverec
    >>> x = np.linspace(0, 10, 41) ** 1.5
    >>> pyramid = wavedec(make_interp_spline(x, np.sin(x)))
    >>> waverec(pyramid, 1.5).t.shape, waverec(pyramid.coarser(2)).t.shape
    ((45,), (17,))
    >>> coarse = waverec(pyramid.coarser(2))
    >>> coarse.c = coarse.c + 3.0
    >>> bool(np.allclose(waverec(pyramid, coarse=coarse)(x), np.sin(x) + 3.0))
    True
    """
    form = pyramid.form
    if form is None:
        raise UsageError("this pyramid was not made from a spline: take mracad.wavelet.reconstruct")
    if coarse is not None:
        pyramid = _on(pyramid, form, coarse)
    return form.spline(reconstruct(pyramid, level))


def _on(pyramid: Pyramid, form: Form, coarse: Spline) -> Pyramid:
    """The finest levels of a pyramid on another coarse shape."""
    own, poles = lifted(coarse)
    for finer in range(len(pyramid.levels) + 1):
        if form.over(pyramid.ladders, pyramid.knots(finer)).knots == own.knots:
            zero = np.zeros(poles.shape[-1])
            return replace(pyramid, coarse=form.flipped(poles), levels=pyramid.levels[:finer], centroid=zero)
    raise UsageError("the coarse spline is not over the knots of a level of this pyramid")


def wavedec_patches(splines: Sequence[Spline], levels: int | None = None, order: int = 0) -> list[Pyramid]:
    """Decompose curves that meet at their ends, or surface patches that meet along whole sides.

    The transform of a patch, restricted to one of its sides, is the transform of that side alone: all levels keep their
    ends.  Patches that share a side share the knots that go, level by level, and so have the same coefficients there.
    Seams therefore stay closed whatever is done to the details of all patches alike: fractional levels, gains by level,
    thresholds.

    Parameters
    ----------
    splines : sequence of BSpline, NdBSpline, Curve or Net
        All curves, or all surfaces.  Sides that coincide are found, whichever way they run; knots that one patch has
        there and another lacks are inserted, and degrees raised.  Closed sides must begin at the same place and run the
        same way.
    levels : int, optional
        Largest number of levels.
    order : int
        Number of derivatives across sides that are kept on all levels in the same way: with 1, patches whose first
        derivatives across a seam are in a constant proportion keep it, so the seam stays smooth.  At most the lowest
        degree.

    Returns
    -------
    list of Pyramid
        Wavelets are orthogonal to those coarse splines that vanish, with ``order`` derivatives, at the ends.

    Raises
    ------
    UsageError
        What is given are no such splines, ``order`` is above a degree, or patches form a band with a half twist.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.interpolate import NdBSpline
    >>> from mracad.wavelet import wavedec_patches, waverec_patches
    >>> rng = np.random.default_rng(1)
    >>> t = np.concatenate([[0] * 3, np.sort(rng.uniform(0, 1, 20)), [1] * 3])
    >>> left, right = rng.normal(size=(2, 23, 23))
    >>> right[0] = left[-1]
    >>> pyramids = wavedec_patches([NdBSpline((t, t), c, 2) for c in (left, right)])
    >>> a, b = waverec_patches([pyramid.thresholded(0.5) for pyramid in pyramids], level=1.5)
    >>> v = np.linspace(0, 1, 50)
    >>> one, two = a(np.stack([0 * v + 1, v], axis=1)), b(np.stack([0 * v, v], axis=1))
    >>> bool(np.abs(one - two).max() < 1e-12)
    True
    """
    found = []
    for form, poles, common in matched([lifted(spline) for spline in splines]):
        if not 0 <= order <= min(knots.degree for knots in common):
            raise UsageError(f"order {order} is not between 0 and the degree of every patch")
        ladders = [_ladder(knots, levels, order + 1) for knots in common]
        found.append(replace(decompose(form.flipped(poles), *ladders, pinned=order + 1), form=form))
    return found


def waverec_patches(pyramids: Sequence[Pyramid], level: float = 0.0) -> list[Spline]:
    """The splines of the pyramids of joined curves or patches.

    Parameters
    ----------
    pyramids : sequence of Pyramid
        From :func:`wavedec_patches`.
    level : float
        As for :func:`waverec`; a patch that has fewer levels is at its coarsest.

    Returns
    -------
    list of BSpline, NdBSpline, Curve or Net
        Of the types that came in; knots may have been inserted.

    Raises
    ------
    UsageError
        A level that no patch has.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.interpolate import BSpline
    >>> from mracad.wavelet import wavedec_patches, waverec_patches
    >>> t = np.array([0, 0, 0, 1, 3, 4, 7, 8, 8, 8.0])
    >>> one, two = BSpline(t, [0, 1, 0, 2, 0, 1, 3], 2), BSpline(t, [3, 1, 4, 1, 5, 9, 2], 2)
    >>> a, b = waverec_patches(wavedec_patches([one, two]), level=2)
    >>> bool(np.isclose(a(8.0), b(0.0)))
    True
    """
    most = max((len(each.levels) for each in pyramids), default=0)
    if not 0 <= level <= most:
        raise UsageError(f"level {level} is outside 0 … {most}")
    return [waverec(each, min(level, len(each.levels))) for each in pyramids]


def _ladder(knots: KnotVector, levels: int | None, pinned: int = 0) -> list[KnotVector]:
    """The rungs of a direction, with room for functions that do not vanish at the ends."""
    if levels is not None and levels < 0:
        raise UsageError(f"{levels} levels cannot be made")
    rungs = rungs_by_level(knots)
    room = [rung for rung in rungs[1:] if knots.periodic or rung.count > 2 * pinned]
    return [knots, *room][: None if levels is None else levels + 1]
