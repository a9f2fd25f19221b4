"""Batches: bad files, kills and resumption, order, reports, what make wants."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from xml.etree import ElementTree

import psutil
import pytest

from mracad.errors import FileError, UsageError
from mracad.job.batch.find import find
from mracad.job.batch.manifest import NAME, Manifest
from mracad.spec.recipe import load
from tests.job.batch.runs import RECIPE, batch, environment, kills, models, outputs, recipe, shams, start
from tests.report.test_page import Read


def test_five_bad_files_of_forty_cost_five(tmp_path):
    folder = models(tmp_path / "in", 40)
    paths = [folder / f"part{number:03}.step" for number in (4, 12, 20, 28, 36)]
    text = paths[0].read_bytes()
    paths[0].write_bytes(text[: len(text) // 2])
    for path, fault in zip(paths[1:4], ("crash", "hang", "eat"), strict=True):
        path.write_bytes(text.replace(b"DATA;", b"/* %s */ DATA;" % fault.encode(), 1))
    paths[4].chmod(0)
    reasons = (
        "is truncated",
        "crashed (SIGSEGV)",
        "5 s while reading 'part020.step'",
        "memory limit of 1000 MB",
        "Permission denied",
    )
    words = (recipe(tmp_path), folder, "-O", tmp_path / "out", "-j", 2, "--time-limit", "5", "--memory-limit", "1GB")
    code, out, _ = batch(*words, "--junit", tmp_path / "j.xml")
    first, *failed = out.splitlines()
    assert code == 1
    assert first.startswith("40 files: 35 done, 5 failed")
    for path, reason, line in zip(paths, reasons, failed, strict=True):
        assert line.startswith(f"failed: {path}: ") and reason in line
    assert len(list((tmp_path / "out").glob("*.step"))) == 35
    suite = ElementTree.parse(tmp_path / "j.xml").getroot()
    assert (suite.get("tests"), suite.get("errors"), suite.get("failures")) == ("40", "5", "0")
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "out").glob("*.step")}
    code, out, _ = batch(*words, "--json")
    lines = [json.loads(line) for line in out.splitlines()]
    tried = [line["file"] for line in lines[:-1] if line["attempts"] or line["status"] == "failed"]
    assert code == 1 and sorted(tried) == [str(path) for path in paths]
    assert lines[-1]["summary"] | {"seconds": 0} == {
        "recipe": "recipe.toml", "files": 40, "unchanged": 35, "failed": 5, "seconds": 0,
    }  # fmt: skip
    assert before == {path: path.stat().st_mtime_ns for path in before}


def test_the_outputs_do_not_depend_on_the_number_of_workers(tmp_path):
    folder = models(tmp_path / "in", 6)
    if sys.platform == "linux":
        (folder / "part005.step").rename(folder / os.fsdecode(b"-p\xe4rt [5].step"))
    words = (recipe(tmp_path), folder)
    for jobs in (1, 2):
        assert batch(*words, "-O", tmp_path / f"out{jobs}", "-j", jobs)[0] == 0
    assert outputs(tmp_path / "out1") == outputs(tmp_path / "out2")
    one = [sys.executable, "-m", "mracad_cli", "run", tmp_path / "recipe.toml", folder / "part003.step", "-o"]
    subprocess.run([*one, tmp_path / "part003.step"], env=environment(), check=True, capture_output=True)
    assert (tmp_path / "part003.step").read_bytes() == (tmp_path / "out1" / "part003.step").read_bytes()


def test_kills_at_random_moments_leave_nothing_but_less_to_do(tmp_path):
    folder = shams(tmp_path / "in", 60)
    words = (recipe(tmp_path), folder, "-j", 2, "-O")
    assert batch(*words, tmp_path / "whole", sham=0.01)[0] == 0
    done = kills(words, tmp_path / "out", 4, 60, sham=0.01)
    code, out, _ = batch(*words, tmp_path / "out", sham=0.01)
    print(f"done at each kill: {done} of 60; then {out.strip()}")
    assert code == 0 and done == sorted(done) and done[0]
    assert outputs(tmp_path / "out") == outputs(tmp_path / "whole")


def test_a_changed_input_or_recipe_is_done_again_and_nothing_else(tmp_path):
    folder = shams(tmp_path / "in", 3)
    words = (recipe(tmp_path), folder, "-O", tmp_path / "out", "--json")

    def statuses(*more: str) -> list[str]:
        lines = [json.loads(line) for line in batch(*words, *more, sham=0.0)[1].splitlines()]
        return [line["status"] for line in sorted(lines[:-1], key=lambda line: line["file"])]

    assert statuses() == ["done"] * 3
    assert statuses() == ["unchanged"] * 3
    (folder / "part001.step").write_text("other")
    assert statuses() == ["unchanged", "done", "unchanged"]
    (tmp_path / "out" / "part002.step").unlink()
    (tmp_path / "out" / "part000.step").write_text("spoiled")
    assert statuses() == ["done", "unchanged", "done"]
    stamp = (tmp_path / "out" / "part000.step").stat().st_mtime_ns
    assert statuses("--set", "smooth.scale=3mm", "--if-changed") == ["done"] * 3
    assert (tmp_path / "out" / "part000.step").stat().st_mtime_ns == stamp


def test_a_torn_manifest_costs_one_line(tmp_path):
    with Manifest(tmp_path) as manifest:
        manifest.write("a.step", "key", b"a")
        manifest.write("b.step", "key", b"b")
    path = tmp_path / NAME
    path.write_bytes(path.read_bytes()[:-20])
    with Manifest(tmp_path) as manifest:
        assert manifest.done("a.step", "key") and not manifest.done("a.step", "other")
        assert not manifest.done("b.step", "key")
        manifest.write("b.step", "key", b"b")
        with pytest.raises(FileError, match="another batch"):
            Manifest(tmp_path)
    with Manifest(tmp_path) as manifest:
        assert manifest.done("b.step", "key")


def test_what_others_made_is_not_replaced(tmp_path):
    folder = shams(tmp_path / "in", 2)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "part001.step").write_text("precious")
    code, out, _ = batch(recipe(tmp_path), folder, "-O", tmp_path / "out", sham=0.0)
    assert code == 1 and "--overwrite" in out
    assert (tmp_path / "out" / "part001.step").read_text() == "precious"
    assert batch(recipe(tmp_path), folder, "-O", tmp_path / "out", "--overwrite", sham=0.0)[0] == 0


def test_fail_fast_stops_and_retry_tries_again(tmp_path):
    folder = shams(tmp_path / "in", 30)
    (folder / "part000.step").write_text("/* crash */")
    words = (recipe(tmp_path), folder, "-O", tmp_path / "out", "-j", 1, "--json")
    code, out, _ = batch(*words, "--fail-fast", "--retry", 2, sham=0.01)
    lines = [json.loads(line) for line in out.splitlines()]
    failed = next(line for line in lines if line.get("status") == "failed")
    assert code == 1 and failed["attempts"] == 3 and failed["code"] == 70
    assert lines[-1]["summary"]["not tried"] > 20


def test_a_failed_check_is_a_failure_and_writes_nothing(tmp_path):
    folder = models(tmp_path / "in", 1)
    path = recipe(tmp_path, '[[step]]\nuse = "check"\nfail-on = ["free-edges"]\n')
    code, out, _ = batch(path, folder, "-O", tmp_path / "out", "--junit", tmp_path / "j.xml")
    assert code == 1 and "check: edge#1 of #1 is a free edge (and 3 more)" in out
    assert outputs(tmp_path / "out") == {}
    assert ElementTree.parse(tmp_path / "j.xml").find(".//failure") is not None


def test_inputs_are_files_folders_patterns_and_lists(tmp_path):
    folder = shams(tmp_path / "in", 3)
    (folder / "sub").mkdir()
    (folder / "sub" / "deep.STP").write_text("deep")
    (folder / "readme.txt").write_text("no model")
    out = tmp_path / "out"
    assert [item.output for item in find([str(folder)], out)] == [
        "part000.step", "part001.step", "part002.step", os.path.join("sub", "deep.STP"),
    ]  # fmt: skip
    assert len(find([f"{folder}/part*.step", str(folder / "part000.step")], out)) == 3
    (folder / ".hidden.step").write_text("hidden")
    assert find([str(folder)], folder / "sub")[-1].output == "part002.step"
    assert [item.output for item in find([f"{tmp_path}/*/**/*.STP"], out)] == [os.path.join("in", "sub", "deep.STP")]
    with pytest.raises(UsageError, match="replaced by its own output"):
        find([str(folder / "part000.step")], folder)
    with pytest.raises(FileError, match="no models in"):
        find([f"{folder}/*.stp"], out)
    (tmp_path / "part000.step").write_text("other")
    with pytest.raises(UsageError, match="would both be written"):
        find([str(folder), str(tmp_path / "part000.step")], out)


def test_a_list_from_standard_input_a_plan_and_a_depfile(tmp_path):
    folder = shams(tmp_path / "in", 2)
    names = "\n".join(str(path) for path in sorted(folder.iterdir()))
    command = [sys.executable, "-m", "mracad_cli", "batch", str(recipe(tmp_path)), "-", "-O", str(tmp_path / "out")]
    settings = {"input": names, "env": environment(0.0), "text": True, "capture_output": True}
    shown = subprocess.run([*command, "--dry-run"], **settings)
    assert shown.returncode == 0 and not (tmp_path / "out").exists()
    assert "1. smooth: smooth --scale 20%" in shown.stdout and "part001.step -> " in shown.stdout
    assert subprocess.run([*command, "--depfile", str(tmp_path / "d")], **settings).returncode == 0
    rule = f"{tmp_path / 'out' / 'part000.step'}: {folder / 'part000.step'} {tmp_path / 'recipe.toml'}\n"
    assert rule in (tmp_path / "d").read_text()


@pytest.mark.parametrize(
    ("text", "place", "hint"),
    [('use = "smoth"', "recipe.toml:2", "'smooth'"), ('use = "smooth"\nscale = "2 mn"', "recipe.toml:3", "5mm")],
)
def test_a_wrong_recipe_is_refused_before_anything_is_read(tmp_path, text, place, hint):
    code, out, err = batch(recipe(tmp_path, f"[[step]]\n{text}\n"), tmp_path / "*.step", "-O", tmp_path / "out")
    assert (code, out) == (2, "") and place in err and hint in err
    assert not (tmp_path / "out").exists()


def test_records_are_there_whenever_asked_for(tmp_path):
    words = (recipe(tmp_path), shams(tmp_path / "in", 2), "-O", tmp_path / "out")
    assert batch(*words, sham=0.0)[0] == 0
    code, out, _ = batch(*words, "--record", sham=0.0)
    assert code == 0 and "2 unchanged" in out
    assert load(tmp_path / "out" / "part000.step.toml").steps("-") == load(words[0]).steps("-")


def test_pages_come_from_the_workers_and_a_missing_one_is_made_again(tmp_path):
    folder = shams(tmp_path / "in", 3)
    (folder / "part002.step").write_text("/* crash */")
    words = (recipe(tmp_path), folder, "-O", tmp_path / "out", "--report-html", tmp_path / "all.html", "--json")

    def done() -> tuple[list[str], list[list[str]]]:
        lines = [json.loads(line) for line in batch(*words, sham=0.0)[1].splitlines()]
        table = Read((tmp_path / "all.html").read_text(encoding="utf-8")).tables["files"]
        statuses = [line["status"] for line in sorted(lines[:-1], key=lambda line: line["file"])]
        return statuses, [[text for _, text in row] for row in table["rows"] if row]

    statuses, rows = done()
    assert statuses == ["done", "done", "failed"]
    assert ["crashed (SIGSEGV)" in row[-1] for row in rows] == [True, False, False]
    assert [("0.5" in row) for row in rows] == [False, True, True]
    (tmp_path / "all_files" / "part001.step.html").unlink()
    stamp = (tmp_path / "out" / "part001.step").stat().st_mtime_ns
    assert done()[0] == ["unchanged", "done", "failed"]
    assert (tmp_path / "out" / "part001.step").stat().st_mtime_ns == stamp, "the output is not touched"
    (folder / "part000.step").write_text("other")
    assert batch(*words[:-3], sham=0.0)[0] == 1
    assert done()[0] == ["done", "unchanged", "failed"], "a page that is older than its output is made again"


@pytest.mark.skipif(sys.platform != "linux", reason="names are Unicode elsewhere")
def test_names_that_are_not_unicode(tmp_path):
    folder = shams(tmp_path / "in", 1)
    name = os.fsdecode(b"b\xe4r 'x'.step")
    (folder / "part000.step").rename(folder / name)
    words = (recipe(tmp_path), folder, "-O", tmp_path / "out", "--json", "--junit", tmp_path / "j.xml")
    for status in ("done", "unchanged"):
        code, out, err = batch(*words, sham=0.0)
        assert code == 0, err
        assert [json.loads(line).get("status") for line in out.splitlines()] == [status, None]
    assert list(outputs(tmp_path / "out")) == [name]


@pytest.mark.skipif(sys.platform != "linux", reason="names are Unicode elsewhere")
def test_files_that_options_name_need_not_be_unicode_either(tmp_path):
    """The line in the header of the output holds their names."""
    folder = models(tmp_path / "in", 1)
    name = os.fsdecode(b"b\xe4r.step")
    (folder / "part000.step").rename(folder / name)
    compare = '\n[[step]]\nuse = "compare"\nreference = "{folder}/{name}.step"\nmax-deviation = "1mm"\n'
    path = recipe(tmp_path, RECIPE + compare)
    code, _, err = batch(path, folder, "-O", tmp_path / "out")
    assert code == 0 and list(outputs(tmp_path / "out")) == [name], err
    code, out, _ = batch(path, folder, "-O", tmp_path / "other", "--record")
    assert code == 1 and "not Unicode" in out and "internal" not in out and not outputs(tmp_path / "other")


@pytest.mark.skipif(sys.platform != "linux", reason="asks the system to end children")
def test_workers_end_with_a_killed_batch_and_an_interrupted_one_says_so(tmp_path):
    folder = shams(tmp_path / "in", 4)
    for number in (signal.SIGKILL, signal.SIGINT):
        process = start(recipe(tmp_path), folder, "-O", tmp_path / "out", "-j", 2, sham=60.0)
        client, limit = psutil.Process(process.pid), time.monotonic() + 30
        while len(workers := client.children()) < 2 and time.monotonic() < limit:
            time.sleep(0.05)
        time.sleep(0.5)
        process.send_signal(number)
        _, err = process.communicate(timeout=40)
        assert len(workers) == 2 and not psutil.wait_procs(workers, timeout=20)[1]
    assert process.returncode == 130 and "interrupted after 0 of 4 files; run it again" in err


def test_outputs_keep_the_format_of_their_inputs_or_get_another(tmp_path):
    folder = tmp_path / "in"
    folder.mkdir()
    for name in ("a.igs", "b.BREP", "c.stp"):
        (folder / name).write_text("sham")
    out = tmp_path / "out"
    kept = {item.output: item.format for item in find([str(folder)], out)}
    assert kept == {"a.igs": "iges", "b.BREP": "brep", "c.stp": "step"}
    assert [(i.output, i.format) for i in find([str(folder)], out, "glb")] == [
        ("a.glb", "glb"), ("b.glb", "glb"), ("c.glb", "glb"),
    ]  # fmt: skip
    (folder / "a.stp").write_text("sham")
    with pytest.raises(UsageError, match="both"):
        find([str(folder)], out, "glb")
