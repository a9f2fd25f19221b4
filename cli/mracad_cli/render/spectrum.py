"""Spectra as JSON-ready values, as a table of comma-separated values, and as lines of text with bars."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from mracad_cli.render.text import mm, plural

if TYPE_CHECKING:
    from mracad.inspect.spectrum import Band, Direction, Spectrum

WIDTH = 20
"""Number of characters of the longest bar."""

DECADES = 5.0
"""Number of decades of height that bars show."""

BAND = {
    "from": "low",
    "to": "high",
    "wavelength": "middle",
    "rms": "rms",
    "noise": "floor",
    "energy": "energy",
    "share": "share",
}
"""What is written about a band."""

HEAD = "face,direction,from_mm,to_mm,wavelength_mm,rms_mm,noise_mm,energy_mm4,share"


def body(name: str, each: Sequence[Spectrum]) -> dict[str, Any]:
    """Everything, as JSON-ready values; lengths in millimetres."""
    from mracad.inspect.spectrum import together

    whole = {"model": _values(together(each))} if each else {}
    return {"file": name, **whole, "faces": [{"face": s.faces[0] + 1, **_values(s)} for s in each]}


def _values(spectrum: Spectrum) -> dict[str, Any]:
    return {
        "area": spectrum.area,
        "noise": spectrum.noise,
        "scale": spectrum.scale,
        "u": _way(spectrum.u),
        "v": _way(spectrum.v),
    }


def _way(way: Direction) -> dict[str, Any]:
    bands = [{name: getattr(band, own) for name, own in BAND.items()} for band in way.bands]
    return {"shape": way.shape or None, "detail": way.detail, "bands": bands}


def csv(each: Sequence[Spectrum]) -> str:
    """One line per band, face and direction; for the whole model the face is empty."""
    from mracad.inspect.spectrum import together

    rows = [("", together(each))] if each else []
    rows += [(str(spectrum.faces[0] + 1), spectrum) for spectrum in each]
    found = [HEAD]
    for face, spectrum in rows:
        for name in ("u", "v"):
            bands = getattr(spectrum, name).bands
            values = ([getattr(band, own) for own in BAND.values()] for band in bands)
            found += [",".join([face, name, *(f"{value:.9g}" for value in row)]) for row in values]
    return "\n".join(found) + "\n"


def lines(name: str, each: Sequence[Spectrum]) -> list[str]:
    """The model as a table of bands, and a line for each face."""
    from mracad.inspect.spectrum import together

    if not each:
        return [f"{name}: no NURBS face"]
    whole = together(each)
    said = [f"{name}: {plural(len(each), 'NURBS face')}, {whole.area:.4g} mm²", *_table(whole)]
    said += [f"{'model' if len(each) > 1 else f'#{each[0].faces[0] + 1}'}: {_words(whole)}"]
    return said + ([f"#{s.faces[0] + 1}: {_words(s)}" for s in each] if len(each) > 1 else [])


def _table(spectrum: Spectrum) -> list[str]:
    """One line per band, with both directions side by side."""
    ways = spectrum.u, spectrum.v
    both: dict[float, list[Band | None]] = {low: [None, None] for low in sorted(b.low for w in ways for b in w.bands)}
    for k, way in enumerate(ways):
        for band in way.bands:
            both[band.low][k] = band
    most = max((b.rms for way in ways for b in way.bands), default=0.0)
    said = [f"{'wavelengths mm':>16}  {'along u: rms mm, share':{WIDTH + 19}}  along v: rms mm, share"]
    seen = [low for low, pair in both.items() if any(b and b.rms > 10**-DECADES * most for b in pair)]
    for low, pair in both.items() if seen else ():
        if low < seen[0]:
            continue
        said.append(f"{f'{low:.4g} to {2 * low:.4g}':>16}  " + "  ".join(_cell(b, most) for b in pair).rstrip())
    return said


def _cell(band: Band | None, most: float) -> str:
    """A band: its height, its share, and a bar with the number of decades above the smallest height shown."""
    if band is None:
        return " " * (WIDTH + 19)
    share = max(0.0, 1.0 + math.log10(max(band.rms, 1e-300) / most) / DECADES) if most > 0.0 else 0.0
    told = f"{100 * band.share:.2f} %" if band.share >= 5e-5 else "< 0.01 %"
    return f"{band.rms:9.3g} {told:>8} {'█' * round(WIDTH * share):{WIDTH}}"


def _words(spectrum: Spectrum) -> str:
    """The main results of a spectrum in words."""
    noise = f"noise {mm(spectrum.noise)}" if spectrum.noise else "no noise found"
    if spectrum.scale is None:
        return f"{noise}; nothing shorter stands out from the shape"
    ways = [f"{mm(w.shape)} along {n}" for n, w in (("u", spectrum.u), ("v", spectrum.v)) if w.shape]
    detail = max(spectrum.u.detail, spectrum.v.detail)
    begins = ", ".join(ways)
    return f"{noise}; {mm(detail)} rms below the shape, which begins at {begins}: try --scale {spectrum.scale:.3g}mm"
