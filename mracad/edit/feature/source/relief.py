"""Heights on a rectangle, and the feature that knots of a chosen width hold of them.

A spline through a source holds it if its spectrum ends well below that of the knots.  Where it does not (edges, noise),
the source is first rounded by a Gaussian, which has no negative part and so rings nowhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mracad.bspline.fit import SPARE
from mracad.edit.feature.detail import Feature, taper
from mracad.errors import EditError, UsageError

Array = np.ndarray

CELLS, MOST_CELLS = 1024, 2048
"""Largest number of cells across a table, and where its spacing is given."""

HELD, NEARLY, LOSS = 1e-3, 2e-3, 5e-3
"""Root mean square errors, as shares of the height where something stands out: of a spline through a source, of one
whose knots cannot be closer, and of rounding."""

ROUND, SHARP = 0.7, 1.2
"""Standard deviations of the rounding, over the width of a span: at 0.7 a step overshoots by 0.3 %, at 0.5 by 3 %.
Edges as steep as that cannot be matched across the seams of patches of other parameters; at 1.2 they can."""

BLUR = 3.5
"""Standard deviations at which the Gaussian of the rounding ends."""

STEEP = 4.0
"""Where rounding takes more than so many times its allowed error, edges are sharp."""

FINER = 1.5
"""Least width of a span, in cells of the source, where it is rounded."""

LEVEL = 1e-3
"""Share of the height up to which a border counts as level."""

FEWEST = 8
"""Least number of spans from the middle to the rim."""

_BINS = 4096


@dataclass(frozen=True, eq=False)
class Relief:
    """Heights.

    Attributes
    ----------
    heights : ndarray (nx, ny)
        At the middles of square cells around 0, 0; x along the first axis, mm.
    cell : float
        Side of a cell, mm.
    window : ndarray (nx, ny)
        1 inside, 0 at the rim.
    grain : float
        Error of the heights, root mean square, mm.
    notes : tuple of str
        What was taken for what.
    disc : float or None
        Radius outside which the window is 0, mm; None for a rectangle.
    called : str
        What a note calls the rectangle.
    """

    heights: Array
    cell: float
    window: Array
    grain: float = 0.0
    notes: tuple[str, ...] = ()
    disc: float | None = None
    called: str = "it is"

    @property
    def height(self) -> float:
        return float(np.abs(self.heights).max())

    @property
    def sides(self) -> Array:
        """Its width and depth, mm."""
        return self.cell * np.array(self.heights.shape)

    @property
    def radius(self) -> float:
        """Radius of the disc that holds it, mm."""
        return float(np.linalg.norm(self.sides)) / 2 if self.disc is None else self.disc


def bordered(
    heights: Array, cell: float, width: float | None, grain: float = 0.0, notes: tuple[str, ...] = ()
) -> Relief:
    """Heights on a rectangle that fade out inside its border where they are not level there.

    Parameters
    ----------
    heights, cell, grain, notes
        As in :class:`Relief`.
    width : float or None
        Width of the fading, mm; None for an eighth of the shorter side.
    """
    short = cell * min(heights.shape)
    width = short / 8 if width is None else width
    if width > short / 2:
        raise UsageError(f"taper: {width:g} mm is more than half of the feature's {short:g} mm", "use a smaller one")
    ramps = []
    for count in heights.shape:
        apart = cell * (0.5 + np.minimum(np.arange(count), np.arange(count)[::-1]))
        ramps.append(1.0 - taper(apart / max(width, 1e-9)))
    window = np.outer(*ramps)
    rim = np.concatenate([heights[[0, -1]].ravel(), heights[:, [0, -1]].ravel()])
    if np.abs(rim).max() > LEVEL * np.abs(heights).max() + 3 * grain:
        heights = heights * window
        notes = (*notes, f"it fades out over {width:.3g} mm inside its border, which is not level")
    return Relief(heights, cell, window, grain, notes)


def tabulated(relief: Relief, name: str, spacing: float | None = None) -> Feature:
    """The feature that a relief becomes.

    Parameters
    ----------
    relief : Relief
    name : str
    spacing : float, optional
        Width of knot spans, mm; by default the largest that holds the relief.

    Raises
    ------
    EditError
        If nothing stands out.
    UsageError
        For a spacing that is too small or too large.
    """
    if not relief.height > 1e-7:
        raise EditError(f"feature {name}: nothing stands out in it", "give one with heights")
    radius = relief.radius
    least = 4 * radius / ((CELLS if spacing is None else MOST_CELLS) - 16)
    spectrum = _Spectrum.of(relief)
    if spacing is not None and not least <= spacing <= radius / FEWEST:
        raise UsageError(
            f"feature {name}: spacing {spacing:g} mm is not between {least:.3g} and {radius / FEWEST:.3g} mm",
            "give one in between, or leave it out",
        )
    width, rounding = spectrum.chosen(least, radius / FEWEST) if spacing is None else spectrum.at(spacing)
    loss = spectrum.loss(rounding)
    notes = relief.notes
    if loss > LOSS * relief.height:
        coarser = 2 * width if spacing is None and 2 * width <= radius / FEWEST else None
        notes = (*notes, _rounded(width, loss / relief.height, coarser))
    if relief.disc is None:
        wide, deep = relief.sides
        notes = (*notes, f"{relief.called} {wide:.4g} × {deep:.4g} mm, {2 * radius:.3g} mm from corner to corner")
    pad = int(np.ceil(BLUR * rounding / relief.cell)) + 2
    reach = radius + (pad * relief.cell if relief.disc is None else BLUR * rounding)
    table = _table(relief, reach, width, rounding, pad)
    return Feature(radius, reach, width if rounding or spacing else width / SPARE, table, name, notes=notes)


def _rounded(width: float, share: float, coarser: float | None) -> str:
    """The note for edges that knots round, and the spacing that makes a smaller file, if there is one."""
    note = (
        f"its edges are rounded, because knots are no closer than {width:.3g} mm: "
        f"it differs from the source by {100 * share:.1f} % of its height (rms)"
    )
    return (
        note if coarser is None else f"{note}; a coarser spacing, such as spacing:{coarser:.2g}mm, makes files smaller"
    )


def _table(relief: Relief, reach: float, width: float, rounding: float, pad: int) -> Array:
    """The table of a feature over the square of its reach."""
    from scipy.ndimage import gaussian_filter, map_coordinates

    cells = int(np.clip(np.ceil(4 * reach / width), 32, MOST_CELLS))
    side = np.linspace(-reach, reach, cells + 1)
    table = np.zeros((cells + 1, cells + 1, 4))
    axes = [side / relief.cell + pad + (count - 1) / 2 for count in relief.heights.shape]
    at = np.meshgrid(*axes, indexing="ij")
    for channel, values, order in ((2, relief.heights, 3), (3, relief.window, 1)):
        padded = np.pad(values, pad)
        if channel == 2 and rounding:
            padded = gaussian_filter(padded, rounding / relief.cell, mode="constant", truncate=BLUR)
        table[..., channel] = map_coordinates(padded, at, order=order, mode="constant")
    table[..., 3] = np.clip(table[..., 3], 0.0, 1.0)
    return table


@dataclass(frozen=True, eq=False)
class _Spectrum:
    """The power of a relief by wave number.

    Attributes
    ----------
    numbers, power : ndarray (bins,)
        Radians by mm; mean squares where something stands out, mm².
    height, cell, grain : float
        Of the relief, mm.
    """

    numbers: Array
    power: Array
    height: float
    cell: float
    grain: float

    @classmethod
    def of(cls, relief: Relief) -> _Spectrum:
        shape = relief.heights.shape
        power = np.abs(np.fft.rfft2(relief.heights)) ** 2
        power[:, 1 : (shape[1] + 1) // 2] *= 2
        along = 2 * np.pi / relief.cell * np.fft.fftfreq(shape[0])
        across = 2 * np.pi / relief.cell * np.fft.rfftfreq(shape[1])
        number = np.hypot(along[:, None], across)
        width = np.sqrt(2) * np.pi / relief.cell / _BINS
        bins = np.minimum((number / width).astype(int), _BINS - 1)
        stands = np.count_nonzero(np.abs(relief.heights) > 0.02 * relief.height)
        sums = np.bincount(bins.ravel(), power.ravel(), _BINS) / (relief.heights.size * stands)
        return cls(width * (np.arange(_BINS) + 0.5), sums, relief.height, relief.cell, relief.grain)

    def loss(self, rounding: float) -> float:
        """What rounding takes, root mean square, mm."""
        return float(np.sqrt((self.power * (1 - np.exp(-((rounding * self.numbers) ** 2) / 2)) ** 2).sum()))

    def missed(self, width: float) -> float:
        """By how much cubic splines with spans of a width miss what they are through, root mean square, mm."""
        phase = width * self.numbers
        parts = [_cardinal(phase + 2 * np.pi * k) for k in range(-3, 4)]
        error = (1 - parts[3]) ** 2 + sum(p**2 for k, p in enumerate(parts) if k != 3)
        return float(np.sqrt((self.power * error).sum()))

    def at(self, width: float) -> tuple[float, float]:
        """A width of spans, and the rounding that it needs, mm."""
        exact = self.grain <= HELD * self.height and self.missed(width) <= NEARLY * self.height
        if exact:
            return width, 0.0
        least = max(width, self.cell)
        sharp = self.loss(ROUND * least) > STEEP * LOSS * self.height
        return width, (SHARP if sharp else ROUND) * least

    def chosen(self, least: float, most: float) -> tuple[float, float]:
        """The largest width of spans between two that holds the relief, and the rounding that it needs, mm."""
        widths = np.geomspace(most, least, 1 + int(np.ceil(12 * np.log2(most / least))))
        for width in widths if self.grain <= HELD * self.height else ():
            if self.missed(float(width)) <= HELD * self.height:
                return float(width), 0.0
        rounded = widths[widths >= FINER * self.cell]
        for width in rounded:
            if self.loss(ROUND * float(width)) <= LOSS * self.height:
                return float(width), ROUND * float(width)
        return self.at(float(rounded[-1]) if len(rounded) else least)


def _cardinal(phase: Array) -> Array:
    """The spectrum of the cubic spline that is 1 at 0 and 0 at all other whole numbers."""
    return np.asarray(np.sinc(phase / (2 * np.pi)) ** 4 * 3 / (2 + np.cos(phase)))
