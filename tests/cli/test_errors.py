"""Bad input: one line that says what is wrong and what to do, the exit code, and no file written or touched."""

import json
import os
import subprocess
import sys

import pytest

BAD_FILES = {
    "empty": b"",
    "not STEP": b"solid stl\nendsolid\n",
    "truncated": b"ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\n",
    "no geometry": b"ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n"
    b"FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\nENDSEC;\nDATA;\n#1=CARTESIAN_POINT('',(0.,0.,0.));\nENDSEC;\nEND-ISO-10303-21;\n",
    "garbage after the header": b"ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n#1=FOO(((;\nENDSEC;\nEND-ISO-10303-21;\n",
}


def one_line(result, code):
    assert result.code == code, result
    assert result.out == ""
    assert result.err.startswith("mracad: ") and result.err.count("\n") == 1
    assert "Traceback" not in result.err


@pytest.mark.parametrize("kind", BAD_FILES)
@pytest.mark.parametrize("command", ["smooth", "info", "convert"])
def test_a_bad_file(mracad, tmp_path, kind, command):
    source, out = tmp_path / "in.step", tmp_path / "out.step"
    source.write_bytes(BAD_FILES[kind])
    out.write_text("precious")
    words = {"smooth": ["--scale", "5mm"], "info": [], "convert": []}[command]
    words += [] if command == "info" else ["-o", out, "--overwrite"]
    one_line(mracad(command, source, *words), 3)
    assert out.read_text() == "precious"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["in.step", "out.step"]


def test_a_missing_file_and_a_directory(mracad, tmp_path):
    one_line(mracad("smooth", tmp_path / "none.step", "--scale", "5mm", "-o", tmp_path / "out.step"), 3)
    one_line(mracad("info", tmp_path), 3)
    assert not (tmp_path / "out.step").exists()


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (["--scale", "0"], 2, "greater than zero"),
        (["--scale", "nan"], 2, "not a length"),
        (["--scale", "1e999"], 2, "not a length"),
        (["--scale", "5 bananas"], 2, "not a length"),
        (["--level", "nan"], 2, "level"),
        ([], 2, "scale, a level or a limit"),
        (["--scale", "5mm", "--level", "2"], 2, "scale or a level"),
        (["--scale", "5mm", "--amount", "nan"], 2, "amount"),
        (["--scale", "5mm", "--amount", "2"], 2, "amount"),
        (["--scale", "5mm", "--max-deviation", "-1"], 2, "max-deviation"),
        (["--scale", "5mm", "--faces", "#99"], 2, "#1 to #6"),
        (["--scale", "5mm", "--faces", "#x"], 2, "face number"),
        (["--scale", "5mm", "--faces", "nobody"], 2, "no face matches"),
        (["--scale", "5mm", "--faces", "near:1,2"], 2, "not a point"),
        (["--scale", "5mm", "--faces", "near:nan,0,0"], 2, "not a point"),
        (["--scale", "5mm", "--hold", "edge#999"], 2, "edges"),
        (["--scale", "5mm", "--keep", "g7"], 2, "g7"),
        (["--scale", "5mm", "--input-unit", "parsec"], 2, "unit"),
        (["--scale", "5mm", "--frobnicate"], 2, "--frobnicate"),
    ],
)
def test_a_bad_option(mracad, samples, tmp_path, words, code, says):
    out = tmp_path / "out.step"
    result = mracad("smooth", samples / "panel.step", *words, "-o", out)
    one_line(result, code)
    assert says in result.err
    assert not list(tmp_path.iterdir())


def test_bad_outputs(mracad, samples, tmp_path):
    panel, taken = samples / "panel.step", tmp_path / "taken.step"
    taken.write_text("precious")
    one_line(mracad("smooth", panel, "--scale", "5mm", "-o", taken), 2)
    one_line(mracad("smooth", panel, "--scale", "5mm", "-o", tmp_path / "no" / "out.step"), 3)
    one_line(mracad("smooth", panel, "--scale", "5mm", "-o", tmp_path / "out.docx"), 3)
    one_line(mracad("smooth", panel, "--scale", "5mm", "--overwrite", "-o", tmp_path), 3)
    one_line(mracad("convert", panel, "-o", tmp_path / "a.stl", "-o", tmp_path / "a.stl"), 2)
    assert taken.read_text() == "precious" and [p.name for p in tmp_path.iterdir()] == ["taken.step"]


def test_errors_as_json(mracad, tmp_path):
    result = mracad("info", tmp_path / "none.step", "--json")
    assert result.code == 3
    error = json.loads(result.out)["error"]
    assert error["code"] == 3 and "none.step" in error["message"] and error["hint"]


def test_an_unknown_command_names_the_nearest(mracad):
    result = mracad("smoth")
    one_line(result, 2)
    assert "'smooth'" in result.err


def test_a_model_that_is_fair_goes_through_and_says_so(mracad, samples, tmp_path):
    out = tmp_path / "out.step"
    for words in ((), ("--faces", "#1")):
        result = mracad("smooth", samples / "panel_clean.step", "--scale", "0.1%", "-o", out, "--overwrite", *words)
        assert result.code == 0 and out.exists() and "already fair at 0.1%" in result.out
        assert "nothing changed" in result.out.splitlines()[0]


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--scale", "5mm"], "no output is named"),
        (["--scal", "5mm", "-o", "x.step"], "--scal"),
        (["--amount", "2", "--scale", "5mm", "-o", "x.step"], "amount"),
    ],
)
def test_bad_usage_in_a_process_of_its_own(samples, tmp_path, words, says):
    command = [sys.executable, "-m", "mracad_cli", "smooth", str(samples / "panel.step"), *words]
    result = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert result.returncode == 2 and result.stdout == "" and not list(tmp_path.iterdir())
    assert result.stderr.startswith("mracad: ") and result.stderr.count("\n") == 1 and says in result.stderr


def test_a_dry_run_needs_no_output(mracad, small):
    result = mracad("smooth", small[0], "--scale", "4mm", "--dry-run")
    assert result.code == 0 and "dry run, nothing written" in result.out


def test_nothing_is_written_when_a_report_cannot_be_made(mracad, small, tmp_path, monkeypatch):
    from mracad_cli.render import json as render

    monkeypatch.setattr(render, "report", lambda _: {"figure": object()})
    for words in (["--json"], ["--report", tmp_path / "report.json"]):
        words += ["--dry-run"] if "--report" in words else ["-o", tmp_path / "out.step", "--depfile", tmp_path / "d"]
        assert mracad("smooth", small[0], "--scale", "4mm", *words).code == 70
        assert not list(tmp_path.iterdir())


def test_nothing_is_written_when_nobody_reads_the_result(small, tmp_path):
    words = ["smooth", str(small[0]), "--scale", "4mm", "-o", "out.step", "--report", "report.json"]
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "mracad_cli", *words]
    result = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, text=True, cwd=tmp_path)
    os.close(writer)
    assert result.returncode == 3 and "standard output was closed" in result.stderr and not list(tmp_path.iterdir())


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full")
@pytest.mark.parametrize("words", [["-o", "out.brep"], ["-o", "out.brep", "--json"], ["-o", "-"]])
def test_nothing_is_written_when_the_result_cannot_be(small, tmp_path, words):
    words = ["convert", str(small[0]), *words, "-o", "out.stl"]
    command = [sys.executable, "-m", "mracad_cli", *words]
    with open("/dev/full", "w") as full:
        result = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, cwd=tmp_path)
    assert result.returncode == 3 and not list(tmp_path.iterdir())
    assert result.stderr.splitlines()[-1].startswith("mracad: cannot write to standard output: No space left")
    assert "Traceback" not in result.stderr


def test_two_files_of_one_name(mracad, samples, tmp_path):
    blade, one = samples / "blade.step", tmp_path / "one.step"
    for words in (["-o", one, "-o", one], ["-o", one, "--report", one], ["-o", one, "--report", "r", "--depfile", "r"]):
        one_line(mracad("smooth", blade, "--scale", "5%", *words), 2)
    one_line(mracad("check", blade, "--junit", one, "--sarif", tmp_path / "." / "one.step"), 2)
    assert not list(tmp_path.iterdir())


def test_debug_shows_the_traceback_of_an_error_and_nothing_else_changes(mracad, tmp_path):
    plain, debug = (mracad("info", tmp_path / "none.step", *words) for words in ((), ("--debug",)))
    assert debug.code == plain.code == 3 and "Traceback" not in plain.err
    assert debug.err.startswith("Traceback") and debug.err.endswith(plain.err)


@pytest.mark.parametrize(
    "words",
    [
        ["smooth", "none.step", "--scale", "9mm", "-o", "out.step"],
        ["render", "in.step", "--before", "none.step", "-o", "out.png"],
        ["convert", "in.step", "--scalar", "deviation:none.step", "-o", "out.vtp"],
        ["compose", "in.step", "none.mra", "-o", "out.step"],
        ["repeat", "in.step", "--feature", "none.png,width:3mm,height:1mm", "--at", "1,2,3", "-o", "out.step"],
        ["compare", "none.step", "in.step", "--report-html", "out.html"],
    ],
)
def test_inputs_that_are_missing_come_before_outputs_that_exist(mracad, tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    for name in ("in.step", words[-1]):
        (tmp_path / name).write_text("precious")
    result = mracad(*words)
    one_line(result, 3)
    assert "cannot read 'none." in result.err and (tmp_path / words[-1]).read_text() == "precious"
