"""Sections and their combs against closed forms."""

import io

import numpy as np
import pytest
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakeSphere,
    BRepPrimAPI_MakeTorus,
)
from OCP.gp import gp_Ax1, gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
from PIL import Image

from mracad.errors import UsageError
from mracad.occ.facets import facets
from mracad.spec.pictures import Picture
from mracad.view.picture import render
from mracad.view.section import combed, curves, lines
from tests.occ import shapes


def cut(shape, axis, place, spacing=0.5):
    """Points of a section and the sizes of its curvature, where the faces bend."""
    found = curves(facets(shapes.document(shape), 1e-3, 30.0), axis, place, spacing)
    points, bends = (np.concatenate([getattr(each, name) for each in found]) for name in ("points", "bends"))
    size = np.linalg.norm(bends, axis=1)
    bent = size > 1e-9
    return points[bent], bends[bent], size[bent]


@pytest.mark.parametrize("tilt", [0.0, 0.5, 1.1])
def test_a_cylinder_cut_obliquely_is_an_ellipse(tilt):
    radius = 10.0
    axis = gp_Ax2(gp_Pnt(-40 * np.sin(tilt), 0, -40 * np.cos(tilt)), gp_Dir(np.sin(tilt), 0, np.cos(tilt)))
    points, bends, size = cut(BRepPrimAPI_MakeCylinder(axis, radius, 80.0).Shape(), 2, 0.0)
    long, short = radius / np.cos(tilt), radius
    x, y, _ = points.T
    np.testing.assert_allclose((x / long) ** 2 + (y / short) ** 2, 1.0, rtol=1e-9)
    expected = long * short / ((y * long / short) ** 2 + (x * short / long) ** 2) ** 1.5
    np.testing.assert_allclose(size, expected, rtol=1e-8)
    inward = -np.stack([x / long**2, y / short**2, 0 * x], axis=1)
    inward /= np.linalg.norm(inward, axis=1, keepdims=True)
    np.testing.assert_allclose(bends, expected[:, None] * inward, rtol=1e-7, atol=1e-10)


def test_splines_that_are_turned_and_placed_are_cut_as_they_are():
    """z = x²/100, turned about z and cut by y = 0."""
    nodes = np.linspace(-20, 20, 4)
    bernstein = np.stack(
        [(1 - t) ** (3 - k) * t**k * (1, 3, 3, 1)[k] for k in range(4) for t in [(nodes + 20) / 40]], 1
    )
    poles = np.linalg.solve(bernstein, np.stack([nodes, 0 * nodes, 0.01 * nodes**2], axis=1))
    net = np.stack([poles + np.array([0, shift, 0]) for shift in np.linspace(-10, 10, 4)], axis=1)
    turn = gp_Trsf()
    turn.SetRotation(gp_Ax1(gp_Pnt(), gp_Dir(0, 0, 1)), 0.7)
    shift = gp_Trsf()
    shift.SetTranslation(gp_Vec(100, 0, 0))
    shape = BRepBuilderAPI_Transform(shapes.face_on(shapes.bezier(net)), shift * turn, False).Shape()
    points, _, size = cut(shape, 1, 0.0)
    along = (points[:, 0] - 100) * np.cos(0.7)
    np.testing.assert_allclose(points[:, 2], 0.01 * along**2, atol=1e-9)
    slope = 0.02 * along * np.cos(0.7)
    np.testing.assert_allclose(size, 0.02 * np.cos(0.7) ** 2 / (1 + slope**2) ** 1.5, rtol=1e-7)


def test_a_torus_cut_beside_its_axis():
    """Of the curve F(x, z) = 0 the curvature is |F_xx F_z² − 2 F_xz F_x F_z + F_zz F_x²| / |∇F|³."""
    points, _, size = cut(BRepPrimAPI_MakeTorus(20.0, 6.0).Shape(), 1, 3.0)
    x, y, z = points.T
    rho = np.hypot(x, y)
    np.testing.assert_allclose((rho - 20) ** 2 + z**2, 36, rtol=1e-8)
    fx, fz = 2 * (rho - 20) * x / rho, 2 * z
    fxx, fzz = 2 - 40 * y**2 / rho**3, 2
    np.testing.assert_allclose(size, np.abs(fxx * fz**2 + fzz * fx**2) / np.hypot(fx, fz) ** 3, rtol=1e-6)


def test_a_plane_that_touches_gives_nothing():
    body = facets(shapes.document(BRepPrimAPI_MakeCylinder(5.0, 10.0).Shape()), 1e-3, 30.0)
    assert not curves(body, 2, 10.0, 0.5) and not curves(body, 0, 7.0, 0.5)


def test_a_point_in_which_a_plane_cuts_is_no_curve():
    cone = facets(shapes.document(BRepPrimAPI_MakeCone(0.0, 10.0, 10.0).Shape()), 1e-3, 30.0)
    assert not curves(cone, 2, 1e-8, 0.1) and curves(cone, 2, 5.0, 0.1)


def test_where_a_surface_is_degenerate_there_is_no_tooth():
    """A plane through the apex of a cone, and one beside it by less than can be told: two straight lines."""
    cone = facets(shapes.document(BRepPrimAPI_MakeCone(0.0, 10.0, 10.0).Shape()), 1e-3, 30.0)
    for place in (0.0, 1e-9):
        comb = combed(curves(cone, 0, place, 0.5), 3.0)
        assert comb.unit < 1.0


def test_combs_are_to_their_scale_and_straight_lines_have_none():
    body = facets(shapes.document(BRepPrimAPI_MakeCylinder(5.0, 10.0).Shape()), 1e-3, 30.0)
    circle, box = curves(body, 2, 5.0, 0.1), curves(body, 0, 0.0, 0.1)
    assert combed(box, 3.0).unit == 0.0
    comb = combed(circle, 3.0)
    teeth, curve = lines(circle, comb)
    np.testing.assert_allclose(np.hypot(*curve.starts.T[:2]), 5.0, rtol=1e-9)
    np.testing.assert_allclose(np.hypot(*teeth.ends.T[:2]), 8.0, rtol=1e-9)
    assert comb.length * 0.2 == pytest.approx(3.0) and comb.unit == 0.1 and comb.most == np.inf


def test_teeth_that_are_too_long_are_cut_and_that_is_said():
    ball = facets(shapes.document(BRepPrimAPI_MakeSphere(0.5).Shape()), 1e-3, 30.0)
    large = facets(shapes.document(BRepPrimAPI_MakeSphere(50.0).Shape()), 1e-3, 30.0)
    found = [*curves(large, 2, 0.0, 0.5), *curves(ball, 2, 0.0, 0.5)]
    comb = combed(found, 4.0)
    assert comb.length / 50 == pytest.approx(4.0) and comb.most < 0.1
    teeth = lines(found, comb)[0]
    small = np.hypot(*teeth.starts.T[:2]) < 0.6
    assert np.linalg.norm(teeth.ends - teeth.starts, axis=1)[small].max() < 5.1


def drawn(document, **options):
    found = render(document, Picture(**options)).data
    return np.asarray(Image.open(io.BytesIO(found)).convert("RGB")).astype(int)


def test_a_comb_in_a_picture_is_as_long_as_the_scale_says():
    rod = shapes.document(BRepPrimAPI_MakeCylinder(10.0, 4.0).Shape())
    picture = drawn(rod, view=("top",), section=("z=2mm",), comb=True, size="400x400")
    red = (picture[..., 0] > 150) & (picture[..., 1] < 130)
    blue = (picture[..., 2] - picture[..., 0] > 60) & ~red
    y, x = np.nonzero(blue)
    pixel = 20.0 / (0.7 * 400)
    away = np.hypot(x + 0.5 - 200, y + 0.5 - 200)
    assert away.max() == pytest.approx(10 / pixel + 0.15 * 400, abs=1.5)
    row = picture[400 - 9 - round(2.2 * 9), :100].sum(axis=1) < 450
    assert np.flatnonzero(row)[[0, -1]] == pytest.approx([9, 9 + 0.05 * 10 * 0.15 * 400], abs=1.0), "0.05 1/mm"


def test_a_section_behind_faces_is_paler():
    rod = shapes.document(BRepPrimAPI_MakeCylinder(10.0, 40.0).Shape())
    picture = drawn(rod, view=("0,-1,1",), section=("z=20mm",), size="300x300")
    red = picture[:, 150, 0] - picture[:, 150, 1]
    peaks = [y for y in range(1, 299) if red[y] > 25 and red[y] >= red[y - 1] and red[y] > red[y + 1]]
    assert len(peaks) == 2 and red[peaks[1]] > 1.8 * red[peaks[0]]


def test_a_section_beside_the_model_is_refused():
    rod = shapes.document(BRepPrimAPI_MakeCylinder(10.0, 40.0).Shape())
    with pytest.raises(UsageError, match="section: z=50mm does not cut the model"):
        drawn(rod, section=("z=50mm",))
