"""Roughness: waves bend a surface by a k² / √2, whatever it is made of; what is shape has none."""

import numpy as np
import pytest
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge
from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism, BRepPrimAPI_MakeSphere
from OCP.gp import gp_Vec

from mracad.bspline.fit import interpolated
from mracad.bspline.knots import KnotVector
from mracad.errors import UsageError
from mracad.occ.facets import facets
from mracad.spec.pictures import Picture, Show, show_of
from mracad.view.picture import render
from mracad.view.rough import Rough
from tests.occ import shapes

WAVELENGTH = 12.0


def wave(length, height=0.05, extruded=False):
    """A strip of 60 mm × 12 mm with a wave along it."""
    u, v = (KnotVector([0] * 3 + list(np.linspace(0, 1, n)) + [1] * 3, 3) for n in (88, 5))
    x, y = np.meshgrid(60 * u.greville(), 12 * v.greville(), indexing="ij")
    poles = interpolated(u, v, np.stack([x, y, height * np.sin(2 * np.pi * x / length)], axis=-1))
    surface = shapes.bspline(poles)
    if not extruded:
        return shapes.document(shapes.face_on(surface))
    edge = BRepBuilderAPI_MakeEdge(surface.VIso(0.0)).Edge()
    return shapes.document(BRepPrimAPI_MakePrism(edge, gp_Vec(0, 12, 0)).Shape())


def rough(document, wavelength=WAVELENGTH):
    """The roughness along the middle of its face."""
    (face,) = facets(document, 1e-3, 30.0).facets.values()
    low, high = face.uv.min(axis=0), face.uv.max(axis=0)
    share = np.linspace(0.25, 0.75, 41)
    found = Rough.of(face, wavelength)
    return found(low + (high - low) * np.stack([share, 0.5 + 0 * share], axis=1))


@pytest.mark.parametrize(("length", "extruded"), [(4.0, False), (6.0, False), (6.0, True)])
def test_a_wave_bends_a_surface_by_its_amplitude_and_wavelength(length, extruded):
    expected = 0.05 * (2 * np.pi / length) ** 2 / 2**0.5
    assert rough(wave(length, extruded=extruded)) == pytest.approx(expected, rel=0.05)


def test_long_waves_are_shape():
    one, four = (rough(wave(share * WAVELENGTH)).mean() * (share * WAVELENGTH) ** 2 for share in (1.0, 4.0))
    assert four < 0.1 * one
    assert rough(wave(48.0), 60.0).mean() > 5 * rough(wave(48.0)).mean()


def test_a_ball_has_none():
    ball = shapes.document(BRepPrimAPI_MakeSphere(10.0).Shape())
    drawn = render(ball, Picture(show="roughness:5mm", size="120x90"))
    assert (drawn.lowest, drawn.highest, drawn.unit, drawn.title) == (0.0, 0.0, "1/mm", "roughness below 5 mm")


def test_the_wavelength_is_a_length():
    assert show_of("roughness:2%") == Show("roughness", "2%")
    for text in ("roughness:", "roughness:fine", "roughness:-1mm"):
        with pytest.raises(UsageError):
            show_of(text)
