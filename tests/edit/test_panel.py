"""The sample panel with frozen seams: error to the truth and bending energy, beside those of the plain mask."""

from pathlib import Path

import numpy as np
import pytest

from mracad.bspline.gram import gram
from mracad.edit import smooth as module
from mracad.edit.smooth import smooth
from mracad.model import Model
from mracad.occ.step import read_step
from mracad.occ.view import view
from mracad.options import Smooth

SAMPLES = Path(__file__).parents[2] / "samples"


@pytest.fixture(scope="module")
def panels() -> dict[str, Model]:
    return {name: view(read_step(SAMPLES / f"{name}.step")) for name in ("panel_clean", "panel_inside", "panel")}


def form(poles, a, b):
    """Sum over coordinates of cᵀ (A ⊗ B) c."""
    return float(np.einsum("ijk,il,jm,lmk->", poles, a, b, poles, optimize=True))


def error(model, truth):
    """Root mean square distance to the truth over the surfaces, mm."""
    total = area = 0.0
    for a, b in zip(model.surfaces, truth.surfaces, strict=True):
        g = [gram(k).toarray() for k in (a.net.u, a.net.v)]
        total += form(a.net.poles - b.net.poles, *g)
        area += g[0].sum() * g[1].sum()
    return float(np.sqrt(total / area))


def energy(model):
    """Thin-plate energy ∫ S_uu² + 2 S_uv² + S_vv² (the parameters are millimetres)."""
    total = 0.0
    for surface in model.surfaces:
        g, d1, d2 = ([gram(k, r).toarray() for k in (surface.net.u, surface.net.v)] for r in (0, 1, 2))
        poles = surface.net.poles
        total += form(poles, d2[0], g[1]) + 2 * form(poles, *d1) + form(poles, g[0], d2[1])
    return total


@pytest.mark.parametrize(("name", "rms_ratio", "energy_ratio"), [("panel_inside", 0.85, 0.95), ("panel", 1.02, 1.0)])
@pytest.mark.parametrize("scale", ["12mm", "16mm", "20mm"])
def test_the_fairing_solve_beats_the_mask(panels, monkeypatch, name, rms_ratio, energy_ratio, scale):
    truth, noisy = panels["panel_clean"], panels[name]
    fair = smooth(noisy, Smooth(scale=scale, edges="frozen")).displacement.applied(noisy)
    monkeypatch.setattr(module, "border_noise", lambda *_: 1.0)
    mask = smooth(noisy, Smooth(scale=scale, edges="frozen")).displacement.applied(noisy)
    monkeypatch.undo()
    figures = error(fair, truth) / error(mask, truth), energy(fair) / energy(mask)
    print(f"{name} at {scale}: rms {figures[0]:.3f} of the mask's, energy {figures[1]:.3f} of it")
    assert figures[0] <= rms_ratio and figures[1] <= energy_ratio
    assert error(fair, truth) < 0.8 * error(noisy, truth)


def test_scale_and_reference_agree(panels):
    assert len(panels["panel"].surfaces) == 6
    assert 0.02 < error(panels["panel"], panels["panel_clean"]) < 0.03
