"""Curves and surfaces in wavelet space.

A *pyramid* holds the coarsest control points and its levels from the finest to the coarsest.  A level has the bands
``LH`` (coarse in u, detail in v), ``HL`` (detail in u, coarse in v) and ``HH``, without those of a direction that does
not change there; a curve, or a level where v does not change, has only ``HL``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mracad.brief import line
from mracad.bspline.knots import Array, KnotVector
from mracad.errors import UsageError, needing
from mracad.wavelet.lift import Form
from mracad.wavelet.step import Chain, TwoScale

SHAPES: dict[str, tuple[bool, bool]] = {"HL": (True, False), "LH": (False, True), "HH": (True, True)}
"""Whether the details of each band are wavelets in u and in v."""


@dataclass(frozen=True, eq=False)
class LevelBands:
    """The detail that one level adds to the next coarser surface.

    Attributes
    ----------
    u, v : TwoScale or Chain or None
        The steps taken; None where a direction does not change.
    bands : dict
        ``"LH"``, ``"HL"``, ``"HH"``: details (see the module).
    residual : ndarray or None
        The rounding loss, in control points of the finer net, if it is more than 1e-13 of the whole net.
    """

    u: TwoScale | Chain | None
    v: TwoScale | Chain | None
    bands: dict[str, Array]
    residual: Array | None = None

    __repr__ = line

    def scaled(self, gain: float) -> LevelBands:
        """The level with its details times ``gain``."""
        bands = {name: gain * band for name, band in self.bands.items()}
        return replace(self, bands=bands, residual=None if self.residual is None else gain * self.residual)

    @property
    def heights(self) -> dict[str, Array]:
        """Height of each detail by band: the largest offset of a control point in its wavelet, in units of the control
        points, ``(band.shape[:-1])``."""
        found = {}
        for name, band in self.bands.items():
            height = np.linalg.norm(band, axis=-1)
            for axis, each in enumerate((self.u, self.v)):
                if each is not None and SHAPES[name][axis]:
                    height *= each.heights.reshape([-1 if a == axis else 1 for a in range(height.ndim)])
            found[name] = height
        return found

    def thresholded(self, limit: float, soft: bool = False) -> LevelBands:
        """The level without details lower than a limit; see :meth:`Pyramid.thresholded`."""
        heights = self.heights
        bands = {name: band * _kept(heights[name], limit, soft)[..., None] for name, band in self.bands.items()}
        rest = self.residual
        if rest is not None:
            rest = rest * _kept(np.linalg.norm(rest, axis=-1), limit, soft)[..., None]
        return replace(self, bands=bands, residual=rest)

    def synthesise(self, coarse: Array, compiled: bool = False) -> Array:
        """Control points of the finer net from those of the coarser one; for ``compiled`` see
        :meth:`mracad.wavelet.step.TwoScale.analyse`."""
        if self.u is not None and self.v is not None:
            poles = np.empty((self.u.fine.count, self.v.fine.count, *coarse.shape[2:]))
            low, high = poles[: len(coarse)], poles[len(coarse) :]
            self.v.synthesise(coarse, self.bands["LH"], 1, low, compiled)
            self.v.synthesise(self.bands["HL"], self.bands["HH"], 1, high, compiled)
            self.u.synthesise(low, high, 0, poles, compiled)
        elif self.u is not None:
            poles = self.u.synthesise(coarse, self.bands["HL"], 0, compiled=compiled)
        elif self.v is not None:
            poles = self.v.synthesise(coarse, self.bands["LH"], 1, compiled=compiled)
        if self.residual is not None:
            poles += self.residual
        return poles


@dataclass(frozen=True, eq=False)
class Pyramid:
    """A curve or surface in wavelet space.  Get it from :func:`mracad.wavelet.wavedec`.

    Attributes
    ----------
    coarse : ndarray (nu, nv, k), or (n, k) for a curve
        Control points of the coarsest net, centroid subtracted.
    levels : tuple of LevelBands
        From the finest to the coarsest; ``levels[j].bands`` maps ``"HL"`` (wavelets in u), ``"LH"`` (in v) and
        ``"HH"`` (in both) to arrays of details ``(…, …, k)``, in units of the control points (∫ψ² = 1 for each wavelet
        ψ, over its whole support).  A curve has only ``"HL"``, ``(n, k)``.
    centroid : ndarray (k,)
        Mean of the control points.
    ladders : tuple of tuple of KnotVector
        Knots of each direction, from the finest to the coarsest.
    form : Form, optional
        How to give back a spline of the type that came in.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.interpolate import make_interp_spline
    >>> from mracad.wavelet import wavedec, waverec
    >>> x = np.sort(np.random.default_rng(1).uniform(0, 10, 40))
    >>> pyramid = wavedec(make_interp_spline(x, np.sin(x)))
    >>> pyramid
    Pyramid(40 control points in 6 levels: 18, 9, 5, 2, 1, 1 details on 4)
    >>> [band.shape for band in pyramid.levels[0].bands.values()], pyramid.places(0)["HL"][0].shape
    ([(18, 1)], (18,))
    """

    coarse: Array
    levels: tuple[LevelBands, ...]
    centroid: Array
    ladders: tuple[tuple[KnotVector, ...], ...]
    form: Form | None = None

    def __repr__(self) -> str:
        shape, least = (" × ".join(str(ladder[at].count) for ladder in self.ladders) for at in (0, -1))
        counts = ", ".join(str(sum(b[..., 0].size for b in level.bands.values())) for level in self.levels)
        return f"Pyramid({shape} control points in {len(self.levels)} levels: {counts or 'no'} details on {least})"

    def knots(self, level: int) -> tuple[KnotVector, ...]:
        """The knots of each direction without the finest levels, over the parameters of the pyramid.

        Examples
        --------
        >>> from mracad.bspline.knots import KnotVector
        >>> from mracad.wavelet import decompose, reconstruct
        >>> ladder = KnotVector.clamped([0, 1, 3, 4, 9], 2), KnotVector.clamped([0, 3, 9], 2)
        >>> decompose([[0.0], [1], [2], [1], [5], [0]], ladder).knots(1)[0].breaks
        array([0., 3., 9.])
        """
        return tuple(ladder[min(level, len(ladder) - 1)] for ladder in self.ladders)

    def places(self, level: int) -> dict[str, tuple[Array, ...]]:
        """Where the details of a level are.

        Parameters
        ----------
        level : int
            0 for the finest.

        Returns
        -------
        dict of str to tuple of ndarray
            For each band, a parameter for each index of each direction: ``places["HH"][0][i]`` is the u, and
            ``places["HH"][1][j]`` the v, of the detail ``bands["HH"][i, j]``.  A wavelet is where its control points
            are largest; functions that are no wavelets are at their Greville abscissae.  Both may be beyond the ends of
            knots that are not clamped.

        Examples
        --------
        >>> import numpy as np
        >>> from scipy.interpolate import make_interp_spline
        >>> from mracad.wavelet import wavedec
        >>> wavedec(make_interp_spline(np.arange(12.0), np.ones(12))).places(0)["HL"][0].round(2)
        array([1.28, 4.08, 6.92, 9.72])
        """
        fine = self.levels[level]
        coarse, found = self.knots(level + 1), {}
        for name in fine.bands:
            at = []
            for axis, (each, knots) in enumerate(zip((fine.u, fine.v), coarse, strict=False)):
                own = each.places if each is not None and SHAPES[name][axis] else knots.greville()
                at.append(own if self.form is None else self.form.place(axis, own, self.ladders[axis][0]))
            found[name] = tuple(at)
        return found

    def scaled(self, gains: Sequence[float]) -> Pyramid:
        """The pyramid with the details of each level (the finest first) times a gain.

        Examples
        --------
        >>> from mracad.bspline.knots import KnotVector
        >>> from mracad.wavelet import decompose, reconstruct
        >>> ladder = KnotVector.clamped([0, 1, 3], 1), KnotVector.clamped([0, 3], 1)
        >>> reconstruct(decompose([[0.0], [3.0], [0.0]], ladder).scaled([0.0])).ravel().round(3)
        array([2.   , 1.667, 1.   ])
        """
        if len(gains) != len(self.levels):
            raise UsageError(f"{len(gains)} gains for {len(self.levels)} levels")
        return replace(self, levels=tuple(level.scaled(g) for level, g in zip(self.levels, gains, strict=True)))

    def thresholded(self, limit: float, soft: bool = False) -> Pyramid:
        """The pyramid without low details.

        Parameters
        ----------
        limit : float
            Height up to which details go, in units of the control points: the largest offset of a control point in the
            wavelet.  On the two sides of a seam of :func:`mracad.wavelet.wavedec_patches` it is the same.
        soft : bool
            Whether the others get lower by the limit; otherwise they stay as they are.

        Returns
        -------
        Pyramid

        Raises
        ------
        UsageError
            A negative limit.

        Examples
        --------
        >>> import numpy as np
        >>> from scipy.interpolate import make_interp_spline
        >>> from mracad.wavelet import wavedec, waverec
        >>> x = np.linspace(0, 10, 101)
        >>> pyramid = wavedec(make_interp_spline(x, np.exp(-((x - 3) ** 2))))
        >>> lean = pyramid.thresholded(1e-3)
        >>> sum(int((level.heights["HL"] > 0).sum()) for level in lean.levels)
        23
        >>> bool(np.abs(waverec(lean)(x) - waverec(pyramid)(x)).max() < 2e-3)
        True
        """
        if not limit >= 0:
            raise UsageError(f"limit {limit} of a threshold is negative")
        return replace(self, levels=tuple(level.thresholded(limit, soft) for level in self.levels))

    def coarser(self, levels: int = 1) -> Pyramid:
        """The pyramid of the coarse curve or surface without the finest levels, over fewer knots.

        Raises
        ------
        UsageError
            More levels than there are, or a rational spline, whose weights are on the finest knots.

        Examples
        --------
        >>> import numpy as np
        >>> from scipy.interpolate import make_interp_spline
        >>> from mracad.wavelet import wavedec, waverec
        >>> x = np.linspace(0, 10, 35)
        >>> waverec(wavedec(make_interp_spline(x, np.sin(x))).coarser(2)).c.shape
        (11,)
        """
        if not 0 <= levels <= len(self.levels):
            raise UsageError(f"{levels} levels of {len(self.levels)} cannot be left out")
        ladders = tuple(ladder[min(levels, len(ladder) - 1) :] for ladder in self.ladders)
        form = self.form and self.form.over(self.ladders, self.knots(levels))
        return replace(self, levels=self.levels[levels:], ladders=ladders, form=form)

    def plot(self) -> Any:
        """Draw the heights of the details of each level where they are.

        Returns
        -------
        matplotlib.figure.Figure
            One panel for each level, from the finest: heights over the parameter of a curve; over (u, v), as colours,
            of a surface.

        Examples
        --------
        >>> import numpy as np
        >>> from scipy.interpolate import make_interp_spline
        >>> from mracad.wavelet import wavedec
        >>> x = np.linspace(0, 10, 35)
        >>> len(wavedec(make_interp_spline(x, np.sin(x)), levels=3).plot().axes)
        3
        """
        with needing("view", "cannot plot"):
            from mracad.wavelet.plot import figure

        levels = [(self.places(i), level.heights) for i, level in enumerate(self.levels)]
        domains = [ladder[0].domain for ladder in self.ladders] if self.form is None else self.form.domains
        return figure(levels, domains)


def _kept(heights: Array, limit: float, soft: bool) -> Array:
    """The factors by which a threshold multiplies details."""
    stay = heights > limit
    return 1.0 - limit / np.where(stay, heights, limit or 1.0) if soft else stay.astype(float)
