"""What commands tell while they run: --quiet, --verbose, --log and --junit."""

import json
from xml.etree import ElementTree as Xml

import pytest

MADE = ("feature", "make", "formula:0.2*cos(x)*cos(y),radius:3mm", "-o", "a.feature")


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_quiet_prints_nothing_but_what_json_asks_for(mracad, here):
    result = mracad(*MADE, "-q")
    assert (result.code, result.out, result.err) == (0, "", "") and (here / "a.feature").exists()
    assert json.loads(mracad(*MADE, "-q", "--json", "--overwrite").out)["written"] == "a.feature"
    assert mracad("info", "none.step", "-q").err.startswith("mracad: cannot read 'none.step'")


def test_quiet_keeps_warnings(mracad, here, monkeypatch):
    from mracad_cli.say import warn

    monkeypatch.setattr("mracad_cli.commands.check.load", lambda file: warn("it looks odd") or 1 / 0)
    result = mracad("check", "part.step", "-q", "--log", "run.log")
    assert result.err.startswith("warning: it looks odd\nmracad: ") and result.out == ""
    assert [event["text"] for event in events(here / "run.log") if event["event"] == "warning"] == ["it looks odd"]


def test_verbose_tells_phases_and_the_end(mracad):
    result = mracad(*MADE, "-v")
    assert result.err.splitlines()[-1].startswith("mracad feature make took ")
    assert result.err.endswith(" s, exit code 0\n") and result.out == mracad(*MADE, "--overwrite").out
    assert "reading: " in mracad("info", "none.step", "-v").err


def events(path):
    return [json.loads(line) for line in path.read_text().splitlines()]


def test_the_log_tells_what_was_asked_done_and_said(mracad, here):
    (here / "mracad.toml").write_text('[feature.make]\ntaper = "1mm"\n')
    said = mracad(*MADE, "--log", "run.log").out
    began, ended = events(here / "run.log")
    assert began["event"] == "began" and began["arguments"] == [*MADE, "--log", "run.log"]
    assert began["defaults"] == [{"option": "feature make taper", "value": "1mm", "from": "mracad.toml:2"}]
    assert began["versions"].keys() >= {"mracad", "numpy", "cadquery-ocp"} and began["time"].endswith("Z")
    assert ended["event"] == "ended" and ended["code"] == 0 and ended["said"] == said.splitlines()
    assert ended["seconds"] >= 0 and ended["process"] == began["process"]


def test_the_log_keeps_earlier_runs_and_tells_phases_and_errors(mracad, here):
    assert mracad(*MADE, "--log", "run.log").code == 0
    assert mracad("info", "none.step", "--log", "run.log").code == 3
    every = events(here / "run.log")
    assert [event["event"] for event in every] == ["began", "ended", "began", "phase", "ended"]
    assert every[3]["phase"] == "reading" and every[3]["seconds"] >= 0
    assert every[4]["code"] == 3 and "none.step" in every[4]["message"] and every[4]["hint"]


def test_the_log_of_a_child_process_is_whole(here):
    import subprocess
    import sys

    def run(*words):
        command = [sys.executable, "-m", "mracad_cli", *words, "--log", "run.log", "--junit", "a.xml", "--overwrite"]
        return subprocess.run(command, capture_output=True, text=True)

    result = run(*MADE)
    *_, ended = events(here / "run.log")
    assert result.returncode == 0 and ended["said"] == result.stdout.splitlines()
    assert Xml.parse("a.xml").findtext(".//system-out") == result.stdout.rstrip("\n")
    assert run("render", "none.step", "-o", "a.png").returncode == 3
    _, phase, ended = events(here / "run.log")[2:]
    assert phase["phase"] == "reading" and ended["code"] == 3 and "none.step" in ended["message"]


def test_a_log_that_cannot_be_written(mracad):
    result = mracad(*MADE, "--log", "no/run.log")
    assert result.code == 3 and "no/run.log" in result.err


def case(path):
    root = Xml.parse(path).getroot()
    (only,) = root.findall("testcase")
    return root, only


def test_junit_of_a_command_that_succeeds(mracad, here):
    said = mracad(*MADE, "--junit", "a.xml").out
    root, only = case(here / "a.xml")
    assert root.get("name") == only.get("classname") == "mracad feature make" and only.get("name") == MADE[2]
    assert [root.get(key) for key in ("tests", "failures", "errors")] == ["1", "0", "0"]
    assert only.findtext("system-out") == said.rstrip("\n") and float(only.get("time")) >= 0


@pytest.mark.parametrize("command", ["info", "check"])
def test_an_error_in_junit(mracad, here, command):
    assert mracad(command, "none.step", "--junit", "a.xml").code == 3
    root, only = case(here / "a.xml")
    assert root.get("errors") == "1" and only.find("error").get("type") == "3"
    assert "none.step" in only.find("error").get("message")


def test_a_failed_check_in_a_recipe_is_a_failure_in_junit(mracad, here, samples):
    words = ("check --max-gap 1e-15mm --fail-on free-edges", samples / "panel_clean.step", "-o", "a.step")
    assert mracad("pipeline", *words, "--junit", "a.xml").code == 1
    root, only = case(here / "a.xml")
    assert root.get("failures") == "1" and root.get("errors") == "0" and only.find("failure").get("type") == "1"


def test_what_is_about_the_model_is_a_failure_and_all_else_an_error():
    from mracad_cli.render import junit

    from mracad.errors import Code

    assert {code for code in Code if junit.became(code) == "failure"} == {Code.FAILED_CHECK, Code.CANNOT_EDIT}


def test_junit_replaces_no_model_and_no_file_that_was_there(mracad, here):
    (here / "a.xml").write_text("precious")
    for name in ("a.step", "a.xml"):
        assert mracad(*MADE, "--junit", name).code == 2
    assert (here / "a.xml").read_text() == "precious"
