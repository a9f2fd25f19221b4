"""Reading and writing STEP: exact numbers, units, names, colours, errors, reproducible bytes."""

import io
import os
import re
import subprocess
import sys

import numpy as np
import pytest
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
from OCP.gp import gp_Trsf, gp_Vec
from OCP.TopLoc import TopLoc_Location

from mracad.errors import FileError, UsageError
from mracad.occ.check import check
from mracad.occ.files import write
from mracad.occ.part21 import tidy
from mracad.occ.step import read_step, write_step
from mracad.occ.view import view
from tests.occ import shapes

POINT = re.compile(rb"CARTESIAN_POINT\s*\(\s*'[^']*'\s*,\s*\(([^)]*)\)")


def points(path):
    """All Cartesian points of a STEP file, as the numbers that its text says."""
    return {tuple(map(float, match[1].split(b","))) for match in POINT.finditer(path.read_bytes())}


def far(x=0.0, y=0.0, z=0.0):
    move = gp_Trsf()
    move.SetTranslation(gp_Vec(x, y, z))
    return TopLoc_Location(move)


@pytest.fixture
def wavy(tmp_path):
    return shapes.save(shapes.face_on(shapes.bspline(shapes.wavy_poles(9, 7))), tmp_path / "wavy.step")


@pytest.mark.parametrize("unit", ["MM", "CM", "M", "KM", "UM", "INCH", "FT", "MI", "MIL", "UIN"])
def test_numbers_return_bit_identical_in_every_unit(tmp_path, unit):
    surface = shapes.bspline(shapes.wavy_poles(9, 7))
    source = shapes.save(shapes.face_on(surface), tmp_path / "in.step", unit)
    document = read_step(source)
    write_step(document, tmp_path / "out.step")
    if unit == "MM":
        assert points(source) <= points(tmp_path / "out.step")
    again = read_step(tmp_path / "out.step")
    assert again.unit == document.unit
    poles = view(again).surfaces[0].net.poles
    assert np.array_equal(poles, view(document).surfaces[0].net.poles)
    assert poles == pytest.approx(shapes.wavy_poles(9, 7), abs=1e-8)


def test_input_unit_corrects_a_wrong_unit(wavy, tmp_path):
    right, wrong = read_step(wavy), read_step(wavy, "in")
    assert wrong.unit == "in"
    a, b = view(right), view(wrong)
    assert b.surfaces[0].net.poles == pytest.approx(25.4 * a.surfaces[0].net.poles, rel=1e-15)
    assert b.diagonal == pytest.approx(25.4 * a.diagonal)
    write_step(wrong, tmp_path / "out.step")
    again = view(read_step(tmp_path / "out.step"))
    assert np.array_equal(again.surfaces[0].net.poles, b.surfaces[0].net.poles)
    assert again.diagonal == pytest.approx(b.diagonal)


def test_dimensions_keep_a_file_in_plain_millimetres(tmp_path):
    source = shapes.save(shapes.face_on(shapes.bspline(shapes.wavy_poles(9, 7))), tmp_path / "in.step", "INCH")
    source.write_bytes(source.read_bytes().replace(b"DATA;", b"DATA; /* DIMENSIONAL_SIZE */"))
    for override, factor in ((None, 1.0), ("in", 1.0), ("mm", 1 / 25.4)):
        document = read_step(source, override)
        assert document.unit == "mm"
        poles = view(document).surfaces[0].net.poles
        assert poles == pytest.approx(factor * shapes.wavy_poles(9, 7), abs=1e-9)
        write_step(document, tmp_path / "out.step")
        assert view(read_step(tmp_path / "out.step")).surfaces[0].net.poles == pytest.approx(poles, abs=1e-12)


def test_files_that_mix_units_are_held_in_millimetres(wavy):
    text = wavy.read_bytes()
    other = (
        b"#9001=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.METRE.));#9002=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()"
        b"SI_UNIT($,.RADIAN.));#9003=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#9001,#9002))"
        b"REPRESENTATION_CONTEXT('',''));"
    )
    mixed = text.replace(b"ENDSEC;\nEND-ISO", other + b"ENDSEC;\nEND-ISO")
    assert read_step(io.BytesIO(mixed)).unit == "mm"
    with pytest.raises(UsageError, match="mixes"):
        read_step(io.BytesIO(mixed), "in")


def test_unknown_unit_is_a_usage_error(wavy):
    with pytest.raises(UsageError, match="parsec"):
        read_step(wavy, "parsec")


def test_reads_a_stream_and_a_file_with_an_odd_name(wavy, tmp_path):
    odd = tmp_path / "naïve 部品 #1 (copy)'s.step"
    odd.write_bytes(wavy.read_bytes())
    assert read_step(odd).name == odd.name
    assert len(read_step(io.BytesIO(wavy.read_bytes())).faces) == 1
    stream = io.BytesIO()
    write_step(read_step(odd), stream)
    assert stream.getvalue().startswith(b"ISO-10303-21;")
    write_step(read_step(odd), odd, options_text="C:\\temp 'ø'")
    assert len(read_step(odd).faces) == 1
    head = odd.read_bytes().split(b"DATA;")[0]
    assert b"na\\X2\\00EF\\X0\\ve" in head and b"(copy)''s.step" in head and b"C:\\\\temp ''\\X2\\00F8\\X0\\''" in head


def test_bad_inputs_say_what_is_wrong(wavy, tmp_path):
    text = wavy.read_bytes()
    lines = shapes.compound()
    cases = {
        "missing.step": (None, "no such file"),
        "empty.step": (b"", "empty"),
        "cut.step": (text[: len(text) // 2], "truncated"),
        "notes.step": (b"dear diary", "not a STEP"),
        "nothing.step": (shapes.save(lines, tmp_path / "x.step").read_bytes(), "no faces"),
        "garbled.step": (text.replace(b"B_SPLINE_SURFACE_WITH_KNOTS", b"B_SPLINE_SURFACE_WITH_NOTHING"), "no faces"),
    }
    for name, (content, reason) in cases.items():
        if content is not None:
            (tmp_path / name).write_bytes(content)
        with pytest.raises(FileError, match=reason) as error:
            read_step(tmp_path / name)
        assert name in error.value.message and error.value.hint and "\n" not in str(error.value)
    with pytest.raises(FileError, match="folder"):
        read_step(tmp_path)


def test_unwritable_targets_leave_nothing_behind(wavy, tmp_path):
    document = read_step(wavy)
    (tmp_path / "taken").mkdir()
    for target in (tmp_path / "nowhere" / "out.step", tmp_path / "taken"):
        with pytest.raises(FileError, match="cannot write"):
            write_step(document, target)
    with pytest.raises(UsageError, match="AP999"):
        write_step(document, tmp_path / "out.step", schema="AP999")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["taken", "wavy.step"]


def test_nothing_is_printed(wavy, tmp_path, capfd):
    document = read_step(wavy)
    check(document, distances=True)
    write_step(document, tmp_path / "out.step")
    write(document, tmp_path / "out.stl")
    with pytest.raises(FileError):
        read_step(shapes.save(shapes.compound(), tmp_path / "none.step"))
    captured = capfd.readouterr()
    assert captured.out == "" and captured.err == ""


def test_same_bytes_every_time_and_in_every_process(tmp_path):
    box, bar = BRepPrimAPI_MakeBox(1, 2, 3).Shape(), BRepPrimAPI_MakeCylinder(1, 5).Shape()
    source = tmp_path / "in.step"
    write_step(shapes.assembly(shapes.compound(box, bar.Moved(far(9))), far(), far(0, 30), far(0, 0, 40)), source)
    script = (
        "import sys; from mracad.occ.step import read_step, write_step\n"
        "for target in sys.argv[2:]:\n"
        "    write_step(read_step(sys.argv[1]), target, options_text='smooth --scale 5')\n"
    )
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
    targets = [str(tmp_path / folder / "out.step") for folder in ("one", "two")]
    subprocess.run([sys.executable, "-c", script, str(source), *targets], check=True)
    first, second = ((tmp_path / folder / "out.step").read_bytes() for folder in ("one", "two"))
    assert first == second
    for _ in range(30):  # the kernel's own counts grow by digits
        write_step(read_step(source), tmp_path / "out.step", options_text="smooth --scale 5")
        assert (tmp_path / "out.step").read_bytes() == first
    assert b"smooth --scale 5" in first and b"1970-01-01T00:00:00" in first
    assert str(tmp_path).encode() not in first and b"Open CASCADE STEP translator" not in first


def test_coloured_parts_come_in_one_order_in_any_process(samples):
    script = (
        "import sys; from mracad.occ.step import read_step, write_step\n"
        "write_step(read_step(sys.argv[1]), sys.stdout.buffer)"
    )
    command = [sys.executable, "-c", script, str(samples / "assembly.step")]
    running = [
        subprocess.Popen(command, stdout=subprocess.PIPE, env={**os.environ, "PYTHONHASHSEED": seed}) for seed in "0123"
    ]
    outputs = {process.communicate()[0] for process in running}
    assert len(outputs) == 1
    assert outputs.pop().count(b"MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION") == 3


def test_the_order_of_styles_does_not_depend_on_the_order_they_were_written_in():
    head = b"DATA;\n#1 = BODY();\n#2 = BODY();\n#3 = CONTEXT();\n"
    first = b"#%d = MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',(#%d),#3);\n#%d = ITEM('#4',#1,#%d);\n"
    second = b"#%d = MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',(#%d),#3);\n#%d = ITEM('',#2,#%d);\n"
    colour, rest, end = b"#%d = COLOUR();\n", b"#%d = NOTE('it''s (#5;',#%d);\n", b"ENDSEC;\n"
    one = head + first % (4, 5, 5, 6) + colour % 6 + second % (7, 8, 8, 6) + rest % (9, 7) + end
    two = head + second % (4, 5, 5, 6) + colour % 6 + first % (7, 8, 8, 6) + rest % (9, 4) + end
    assert one != two and tidy(one) == tidy(two) == one


def test_header_time_follows_source_date_epoch(wavy, tmp_path, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1000000000")
    write_step(read_step(wavy), tmp_path / "out.step")
    assert b"2001-09-09T01:46:40" in (tmp_path / "out.step").read_bytes()
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "yesterday")
    with pytest.raises(UsageError, match="yesterday"):
        write_step(read_step(wavy), tmp_path / "other.step")
    assert not (tmp_path / "other.step").exists()


@pytest.mark.parametrize("schema, default", [("AP203", "AP214"), ("AP214", "AP214"), ("AP242", "AP242")])
def test_schema_is_what_was_asked_or_fits_the_file(wavy, tmp_path, schema, default):
    write_step(read_step(wavy), tmp_path / "out.step", schema=schema)
    again = read_step(tmp_path / "out.step")
    assert again.schema == schema
    write_step(again, tmp_path / "again.step")
    assert read_step(tmp_path / "again.step").schema == default


def test_reals_are_valid_step_reals(tmp_path):
    poles = shapes.wavy_poles(4, 4)
    poles[0, 0] = [0.0, -3.0, 1e-7]
    poles[0, 1] = [1e22, -1.5e-120, 1e-5]
    document = shapes.document(shapes.face_on(shapes.bspline(poles)))
    write_step(document, tmp_path / "out.step")
    for match in POINT.finditer((tmp_path / "out.step").read_bytes()):
        for number in match[1].replace(b"\n", b"").replace(b" ", b"").split(b","):
            assert re.fullmatch(rb"-?\d+\.\d*(E[-+]?\d+)?", number), number
    kept = points(tmp_path / "out.step")
    assert (0.0, -3.0, 1e-7) in kept and (1e22, -1.5e-120, 1e-5) in kept


def test_names_and_colours_survive_and_are_seen(tmp_path):
    box, bar = BRepPrimAPI_MakeBox(1, 2, 3).Shape(), BRepPrimAPI_MakeCylinder(1, 5).Shape()
    made = shapes.document(box, bar, names={0: "Bügel 1.50", 1: "bar"}, colours={0: "#ff8000"})
    write_step(made, tmp_path / "one.step")
    write_step(read_step(tmp_path / "one.step"), tmp_path / "two.step")
    model = view(read_step(tmp_path / "two.step"))
    assert model.products == ("Bügel 1.50", "bar")
    assert {face.colour for face in model.faces if face.product == "bar"} == {""}
    assert {face.colour for face in model.faces if face.product != "bar"} == {"#ff8000"}


def test_face_names_survive(wavy, tmp_path):
    named = tmp_path / "named.step"
    named.write_bytes(re.sub(rb"ADVANCED_FACE\(''", b"ADVANCED_FACE('top 2.50'", wavy.read_bytes()))
    write_step(read_step(named), tmp_path / "out.step")
    assert view(read_step(tmp_path / "out.step")).faces[0].name == "top 2.50"


def test_importing_mracad_loads_no_kernel():
    script = "import sys, mracad, mracad.model; assert not [m for m in sys.modules if m.startswith('OCP')]"
    subprocess.run([sys.executable, "-c", script], check=True, env=os.environ)
