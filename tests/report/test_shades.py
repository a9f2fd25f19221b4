"""Deviation on the triangles of reports, against closed forms."""

import zlib

import numpy as np
import pytest
from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere

from mracad.occ.facets import facets
from mracad.report.shades import COUNT, SAMPLES, shades
from tests.occ import shapes


def coded(model, reference):
    """The shades of a document, the parts of the sides of its triangles, and the colours of all places."""
    body, other = (facets(each, 4e-4, 18.0) for each in (model, reference))
    found = shades(body, sorted(body.facets), other)
    data = np.frombuffer(zlib.decompress(found.data), np.uint8)
    triangles = sum(len(each.corners) for each in body.facets.values())
    points = sum(len(each.points) for each in body.facets.values())
    parts = data[:triangles].astype(int)
    assert len(data) == triangles + points + ((parts + 1) * (parts + 2) // 2)[parts > 1].sum()
    return found, parts, data[triangles:].astype(int)


def test_a_larger_sphere_is_one_colour():
    found, _, colours = coded(*(shapes.document(BRepPrimAPI_MakeSphere(r).Shape()) for r in (10.09, 10.0)))
    assert (found.lowest, found.highest) == pytest.approx((0.09, 0.09), abs=1e-5) and found.bar.high == 0.1
    assert (colours == round(1.9 * (COUNT // 2))).all(), "also at the poles"
    assert found.marks == ["−0.1", "−0.05", "0", "0.05", "0.1"]


def test_waves_lower_than_triangles_are_exact_are_seen(monkeypatch):
    x, y = np.meshgrid(np.linspace(0, 10, 16), np.linspace(0, 10, 16), indexing="ij")
    z = 0.002 * (-1.0) ** np.arange(16)[:, None] * (np.abs(x - 5) < 4) * (np.abs(y - 5) < 4)
    nets = np.stack([x, y, z], -1), np.stack([x, y, 0.0 * x], -1)[::5, ::5]
    wave, flat = (shapes.document(shapes.face_on(shapes.bspline(net))) for net in nets)
    u, v = np.meshgrid(np.linspace(0, 1, 300), np.linspace(0, 1, 100))
    heights = facets(wave, 4e-4, 18.0).facets[0].ground.jets(np.stack([u.ravel(), v.ravel()], 1), 1)[0][:, 2]
    found, parts, colours = coded(flat, wave)
    assert (-found.highest, -found.lowest) == pytest.approx((heights.min(), heights.max()), abs=2e-5)
    assert parts.max() > 1 and len(colours) < 2 * SAMPLES
    monkeypatch.setattr("mracad.report.shades.SAMPLES", 0)
    assert coded(flat, wave)[0].highest < 0.8 * found.highest, "corners alone miss them"
