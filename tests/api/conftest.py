"""A small solid with freeform faces."""

import cadquery as cq
import numpy as np
import pytest
from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
from OCP.gp import gp_Vec

from tests.occ import shapes


@pytest.fixture(scope="session")
def slab():
    """A solid between two bumpy NURBS faces and four flat ones."""
    x, y = np.meshgrid(np.linspace(0, 10, 12), np.linspace(0, 10, 12), indexing="ij")
    rough = np.random.default_rng(1).normal(0, 0.02, x.shape)
    rough[[0, 1, -2, -1]] = rough[:, [0, 1, -2, -1]] = 0
    top = shapes.face_on(shapes.bspline(np.stack([x, y, 2 + 0.1 * np.sin(x) + rough], axis=-1)))
    return cq.Shape.cast(BRepPrimAPI_MakePrism(top, gp_Vec(0, 0, 3)).Shape())
