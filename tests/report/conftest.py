"""A report of a model with a hostile name, made once."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder

import mracad as package
from tests.occ import shapes

HOSTILE = "<script>alert(1)</script>"


@dataclass(frozen=True)
class Made:
    """A report: the model, the page, and the same as JSON."""

    model: Path
    page: Path
    body: dict


@pytest.fixture(scope="module", autouse=True)
def small_pictures():
    """Pages with pictures that are quickly drawn."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("mracad.report.figures.SIZE", "240x160")
        patch.setattr("mracad.report.figures.PAIR", "360x150")
        yield


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    from mracad_cli.__main__ import main

    folder = tmp_path_factory.mktemp("report")
    x, y = np.meshgrid(np.linspace(0, 10, 12), np.linspace(0, 10, 12), indexing="ij")
    nets = [np.stack([x + dx, y, np.sin(x + dx) * np.cos(0.7 * y)], axis=-1) for dx in (0, 10)]
    sheet = shapes.sewn(*(shapes.face_on(shapes.bspline(net)) for net in nets))
    rod = BRepPrimAPI_MakeCylinder(2.0, 8.0).Shape()
    names = {0: HOSTILE, 1: "rod --> </script><!-- & \" ' \x07"}
    document = shapes.document(sheet, rod, names=names, colours={1: "#3366cc"})
    package.write(document, folder / "model.step")
    out, told = folder / "report.html", folder / "report.json"
    import contextlib

    with told.open("w") as file, contextlib.redirect_stdout(file):
        assert main(["report", str(folder / "model.step"), "-o", str(out), "--json"]) == 0
    return Made(folder / "model.step", out, json.loads(told.read_text()))
