"""Outputs are read back and judged before they take their place."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from OCP.BRep import BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.Geom import Geom_OffsetSurface, Geom_SphericalSurface
from OCP.GeomConvert import GeomConvert
from OCP.gp import gp_Ax3, gp_Vec
from OCP.TopLoc import TopLoc_Location

import mracad as library
from mracad.job.left import Excluded
from mracad.occ import step as writer
from tests import zoo
from tests.job.batch.runs import recipe
from tests.occ import shapes

SMOOTH = "--scale", "16mm"


@pytest.fixture
def lossy(monkeypatch: pytest.MonkeyPatch) -> None:
    """A writer that leaves the last face out of every STEP file."""
    whole = writer.step

    def step(document, *options, **settings):
        data, cut = whole(document, *options, **settings)
        head, _, tail = data.rpartition(b"OPEN_SHELL('',(")
        faces, _, rest = tail.partition(b")")
        return head + b"OPEN_SHELL('',(" + faces.rpartition(b",")[0] + b")" + rest, cut

    monkeypatch.setattr(writer, "step", step)


@pytest.mark.parametrize(
    "words", [("smooth", "--scale", "4mm"), ("convert",), ("pipeline", "smooth --scale 4mm ! check")]
)
def test_a_file_that_lacks_a_face_is_not_written(mracad, small: list[Path], tmp_path: Path, lossy, words) -> None:
    source, target = small[0], tmp_path / "out.step"
    target.write_text("as it was")
    command, *rest = words
    given = (command, *rest, source) if command == "pipeline" else (command, source, *rest)
    result = mracad(*given, "-o", target, "--overwrite")
    assert result.code == 4 and result.out == ""
    assert result.err.count("\n") == 1 and "#2 is lost" in result.err
    assert target.read_text() == "as it was" and [p.name for p in tmp_path.iterdir()] == ["out.step"]
    result = mracad(*given, "-o", target, "--overwrite", "--verify", "off")
    assert result.code == 0 and "as read back" not in result.out
    assert b"OPEN_SHELL" in target.read_bytes()


@pytest.mark.usefixtures("quick")
def test_a_batch_does_not_write_it_either(mracad, small: list[Path], tmp_path: Path) -> None:
    """A batch says for each file what it is as read back; verification can be switched off there, too."""
    steps = recipe(tmp_path, '[[step]]\nuse = "smooth"\nscale = "4mm"\n')
    for verify in ("on", "off"):
        result = mracad("batch", steps, small[0], "-O", tmp_path / verify, "--json", "--verify", verify)
        assert result.code == 0, result.err
        outcome = json.loads(result.out.splitlines()[0])
        assert (outcome["read_back"] is None) == (verify == "off")
        assert verify == "off" or outcome["read_back"]["valid"]


def test_the_report_says_what_each_file_is(mracad, samples: Path, tmp_path: Path) -> None:
    names, report = [f"out.{ending}" for ending in ("step", "igs", "brep", "bbrep")], tmp_path / "report.json"
    targets = [word for name in names for word in ("-o", tmp_path / name)]
    result = mracad("smooth", samples / "panel.step", *SMOOTH, *targets, "--report", report)
    assert result.code == 0 and result.out.splitlines()[-1].startswith("valid: yes, as read back (was yes); wrote out")
    told = json.loads(report.read_text())["read_back"]
    assert list(told) == names
    for found in told.values():
        assert found["valid"] and found["faults"] == [] and found["counts"]["faces"] == 6
        assert found["counts"]["free_edges"] == 10 and found["tolerance"] < 1e-4
        low, high = found["box"]
        assert all(a < b for a, b in zip(low, high, strict=True))


@pytest.mark.parametrize("ending", ["step", "igs"])
def test_an_output_that_reads_back_without_faces_is_refused(mracad, tmp_path: Path, ending: str) -> None:
    """A face on an offset of a surface with poles: readers of STEP and IGES drop it.  That is not the input's fault."""
    ball = GeomConvert.SurfaceToBSplineSurface_s(Geom_SphericalSurface(gp_Ax3(), 10.0))
    face = BRepBuilderAPI_MakeFace(Geom_OffsetSurface(ball, 2.0), 1e-6).Face()
    library.write(shapes.document(face), tmp_path / "in.brep")
    result = mracad("convert", tmp_path / "in.brep", "-o", tmp_path / f"out.{ending}")
    assert result.code == 4 and result.out == "" and result.err.count("\n") == 1
    assert f"#1 cannot be read back: 'out.{ending}' holds no faces; write BREP" in result.err
    assert [path.name for path in tmp_path.iterdir()] == ["in.brep"]
    assert mracad("convert", tmp_path / "in.brep", "-o", tmp_path / "out.brep").code == 0


def test_a_failure_of_the_kernels_writer_is_not_the_inputs_fault(mracad, tmp_path: Path) -> None:
    """A ring of revolution with two holes: the kernel's IGES writer throws."""
    library.write(shapes.document(dict(zoo.closed())["ring-holes"]()), tmp_path / "in.brep")
    result = mracad("convert", tmp_path / "in.brep", "-o", tmp_path / "out.igs")
    assert result.code == 4 and result.out == "" and result.err.count("\n") == 1
    assert "cannot express 'in.brep' as IGES" in result.err and "write BREP" in result.err
    assert [path.name for path in tmp_path.iterdir()] == ["in.brep"]
    assert mracad("convert", tmp_path / "in.brep", "-o", tmp_path / "out.brep").code == 0


def test_an_output_that_cannot_be_read_back_is_refused(mracad, small: list[Path], tmp_path: Path, monkeypatch) -> None:
    """A writer whose files end in the middle."""
    whole = writer.step

    def step(document, *options, **settings):
        data, cut = whole(document, *options, **settings)
        return data[: len(data) // 2], cut

    monkeypatch.setattr(writer, "step", step)
    for words in (("smooth", "--scale", "4mm"), ("convert",)):
        command, *rest = words
        result = mracad(command, small[0], *rest, "-o", tmp_path / "out.step")
        assert result.code == 4 and result.out == "" and result.err.count("\n") == 1
        assert "it cannot be read back: 'out.step' is truncated" in result.err
        assert list(tmp_path.iterdir()) == []


def test_a_dry_run_speaks_of_memory(mracad, small: list[Path]) -> None:
    result = mracad("smooth", small[0], "--scale", "4mm", "--dry-run")
    assert (
        result.code == 0 and result.out.splitlines()[-1] == "valid: yes, in memory (was yes); dry run, nothing written"
    )


def test_a_mesh_is_judged_by_its_triangles(mracad, samples: Path, tmp_path: Path) -> None:
    result = mracad("convert", samples / "bottle.step", "-o", tmp_path / "out.stl")
    assert result.code == 0 and "valid: yes, as meshed; wrote out.stl" in result.out


def test_faces_of_which_the_file_would_be_worse_are_left(mracad, samples: Path, tmp_path: Path, monkeypatch) -> None:
    """A writer that tears the corners off face #1 as soon as that has moved: it and its neighbours there are left."""
    whole = writer.step
    first = library.snapshot(library.read(samples / "panel.step")).surfaces[0].net.poles

    def step(document, *options, **settings):
        surface = BRep_Tool.Surface_s(document.faces[0], TopLoc_Location())
        moved = not np.array_equal(library.snapshot(document).surfaces[0].net.poles, first)
        rows, columns = surface.NbUPoles(), surface.NbVPoles()
        was = [(i, j, surface.Pole(i, j)) for i in (1, rows) for j in (1, columns)]
        for i, j, pole in was if moved else ():
            surface.SetPole(i, j, pole.Translated(gp_Vec(0, 0, 0.5)))
        try:
            return whole(document, *options, **settings)
        finally:
            for i, j, pole in was:
                surface.SetPole(i, j, pole)

    monkeypatch.setattr(writer, "step", step)
    target, report = tmp_path / "out.step", tmp_path / "report.json"
    result = mracad("smooth", samples / "panel.step", *SMOOTH, "-o", target, "--report", report)
    assert result.code == 0, result.err
    found = json.loads(report.read_text())
    left = {face["face"] for face in found["faces"] if face["said"] == Excluded.FILE.value}
    assert {(f["status"], f["reason"]) for f in found["faces"] if f["face"] in left} == {
        ("left", "would come out worse")
    }
    assert 1 in left and 1 <= found["counts"]["edited"] == 6 - len(left)
    assert found["read_back"]["out.step"]["valid"] and Excluded.FILE.value in result.out.splitlines()[0]
