"""Edits as methods of CadQuery and operations of build123d, tested against the released libraries."""

import ast
import inspect

import cadquery as cq
import pytest

import mracad
import mracad.cadquery
from mracad.api.verbs import verbs
from tests.api.nets import moved

NAMES = verbs(camel=True)


def test_every_edit_is_a_method_and_none_of_cadquery_is_replaced():
    (work,) = (
        node
        for node in ast.parse(inspect.getsource(inspect.getmodule(cq.Workplane))).body
        if isinstance(node, ast.ClassDef) and node.name == "Workplane"
    )
    own = {node.name for node in work.body if isinstance(node, ast.FunctionDef)}
    assert len(own) > 100 and not own.intersection(NAMES.values())
    assert {"smooth", "denoise", "repeatFeature", "moveFeature"} <= set(NAMES.values())
    assert all(callable(getattr(cq.Workplane, name)) for name in NAMES.values())
    with pytest.raises(AttributeError, match="no attribute 'polish'"):
        mracad.cadquery.polish  # noqa: B018


def test_a_method_goes_on_with_the_chain(slab):
    fair = cq.Workplane(slab).faces(">Z").smooth(level=1)
    assert sum(moved(slab, fair.val())) == 1 and mracad.report_of(fair).deviations
    assert fair.faces("<X").size() == 1 and fair.end().size() == 1

    bumpy = cq.Workplane(slab).repeatFeature(feature="formula:0.1*cos(x),radius:1mm", at=(5, 5, 5.1), faces="cq:>Z")
    assert len(mracad.report_of(bumpy).edit.copies) == 1
    assert type(mracad.cadquery.smooth(slab, level=1)) is type(slab)


def test_operations_of_build123d(slab):
    b3d = pytest.importorskip("build123d")
    from mracad import build123d as operations

    part = b3d.Solid(slab.wrapped)
    fair = operations.fair(part, level=1)
    assert type(fair) is b3d.Solid and fair.is_valid and any(moved(part, fair))
    with b3d.BuildPart() as builder:
        b3d.insert(part)
        operations.fair(level=1)
    assert builder.part.volume == pytest.approx(fair.volume, rel=1e-12)
    with pytest.raises(ValueError, match="fair needs a shape"):
        operations.fair(level=1)
