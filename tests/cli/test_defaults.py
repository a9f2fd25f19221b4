"""Defaults from files and the environment: what goes before what, and what is refused, with its place."""

import json

import pytest

FEATURE = ("feature", "make", "formula:0.2*cos(x)*cos(y),radius:3mm", "-o", "a.feature", "--json", "--overwrite")


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder in a project."""
    folder = tmp_path / "project" / "parts"
    folder.mkdir(parents=True)
    monkeypatch.chdir(folder)
    return folder


@pytest.fixture
def taken(mracad):
    """The defaults that a command takes, by their options, as (value, place); it ends for want of its file."""

    def run(*words):
        result = mracad(*words, "--verbose")
        assert result.code == 3, result
        found = {}
        for line in result.err.splitlines():
            if line.startswith("default: "):
                key, _, rest = line.removeprefix("default: ").partition(" = ")
                value, _, place = rest.rpartition(" from ")
                found[key] = json.loads(value), place
        return found

    return run


SMOOTH = ("smooth", "part.step", "-o", "out.step")
FINE = (*SMOOTH, "--scale", "5mm")


def test_a_default_has_the_effect_of_the_option(here, mracad, monkeypatch):
    def made(*words):
        result = mracad(*FEATURE, *words)
        assert result.code == 0, result
        return json.loads(result.out), (here / "a.feature").read_bytes()

    without, given = made(), made("--taper", "1.5mm")
    assert without != given
    (here / "mracad.toml").write_text('[feature.make]\ntaper = "1.5mm"\n')
    assert made() == given
    (here / "mracad.toml").unlink()
    (here.parent / "pyproject.toml").write_text('[tool.mracad."feature make"]\ntaper = 1.5\n')
    assert made() == given
    monkeypatch.setenv("MRACAD_FEATURE_MAKE_TAPER", "1.5mm")
    (here.parent / "pyproject.toml").unlink()
    assert made() == given
    assert made("--taper", "0.7mm") != given


def test_the_environment_goes_before_the_nearest_file_and_that_before_the_project(here, taken, monkeypatch):
    (here.parent / "pyproject.toml").write_text('[tool.mracad]\nkeep = "g0"\nedges = "frozen"\n')
    (here.parent / "mracad.toml").write_text('keep = "g1"\n')
    assert taken(*FINE) == {
        "keep": ("g1", "../mracad.toml:1"),
        "edges": ("frozen", "../pyproject.toml:3"),
    }
    (here / "pyproject.toml").write_text("[project]\nname = 'mracad'\n")  # says nothing: the next one counts
    (here / "mracad.toml").write_text("[smooth]\n\nkeep = 'g2'\n")
    assert taken(*FINE)["smooth keep"] == ("g2", "mracad.toml:3")
    monkeypatch.setenv("MRACAD_KEEP", "as-is")
    assert taken(*FINE)["keep"] == ("as-is", "MRACAD_KEEP")
    monkeypatch.setenv("MRACAD_SMOOTH_KEEP", "g1")
    assert taken(*FINE)["smooth keep"] == ("g1", "MRACAD_SMOOTH_KEEP")
    assert taken(*FINE, "--keep", "g2").keys() == {"edges"}
    monkeypatch.setenv("MRACAD_SMOOTH_KEEP", "")  # takes the default away
    assert taken(*FINE).keys() == {"edges"}


def test_a_command_takes_only_options_that_it_has(here, taken):
    (here / "mracad.toml").write_text('scale = "5mm"\njobs = 2\n[check]\nmax-gap = "1um"\n')
    assert taken(*SMOOTH).keys() == {"scale"}
    assert taken("check", "part.step").keys() == {"check max-gap"}
    assert taken("convert", "part.step", "-o", "a.stl") == {}


def test_several_values_and_flags(here, taken, monkeypatch):
    (here / "mracad.toml").write_text(
        "faces = ['#1', 'the lid']\noverwrite = true\n[smooth]\nlimit-by-curvature = false\n"
    )
    assert taken(*FINE) == {
        "faces": (["#1", "the lid"], "mracad.toml:1"),
        "overwrite": (True, "mracad.toml:2"),
        "smooth limit-by-curvature": (False, "mracad.toml:4"),
    }
    monkeypatch.setenv("MRACAD_FACES", "#2 'the lid'")
    assert taken(*FINE)["faces"] == ("#2 'the lid'", "MRACAD_FACES")


def test_a_flag_of_the_environment_can_be_off(here, mracad, monkeypatch):
    (here / "mracad.toml").write_text("overwrite = true\n")
    assert mracad(*FEATURE[:-1]).code == 0 and mracad(*FEATURE[:-1]).code == 0
    monkeypatch.setenv("MRACAD_OVERWRITE", "0")
    result = mracad(*FEATURE[:-1])
    assert result.code == 2 and "a.feature exists" in result.err


def test_paths_in_a_file_are_relative_to_it(here, mracad):
    (here.parent / "mracad.toml").write_text('log = "run.log"\n')
    assert mracad(*FEATURE).code == 0
    assert (here.parent / "run.log").exists() and not (here / "run.log").exists()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('\nsclae = "5mm"\n', "mracad.toml:2: no command has an option 'sclae'; did you mean 'scale'?"),
        ('[smooth]\nsclae = "5mm"\n', "mracad.toml:2: smooth has no option 'sclae'; did you mean 'scale'?"),
        ('[smoth]\nscale = "5mm"\n', "mracad.toml:2: there is no command 'smoth'; did you mean 'smooth'?"),
        ('[smooth]\nscale = "5 apples"\n', "mracad.toml:2: scale: '5 apples' is not a length; "),
        ("[smooth]\namount = 2\n", "mracad.toml:2: amount: 2 is not between 0 and 1; "),
        ("keep = 'g7'\n", "mracad.toml:1: keep: "),
        ("keep = ['g1', 'g2']\n", "mracad.toml:1: keep: it takes one value, "),
        ("overwrite = 'perhaps'\n", "mracad.toml:1: overwrite: 'perhaps' is neither true nor false; "),
        ("[run]\nset = ['smooth.scale=3mm']\n", "there is no"),
        ("keep = \n", "mracad.toml:1: Invalid value"),
    ],
)
def test_what_is_wrong_is_refused_with_its_place(here, mracad, text, says):
    (here / "mracad.toml").write_text(text)
    result = mracad(*(("run", "fair.toml", "part.step") if "[run]" in text else SMOOTH))
    if "[run]" in text:
        says = "mracad.toml:2: set has no default; give it on the command line"
    assert result.code == 2 and result.out == "" and result.err.count("\n") == 1, result
    assert result.err.startswith(f"mracad: {says}"), result.err
    assert mracad("smooth", "--help").code == 0


def test_what_is_wrong_in_the_environment_is_refused_too(here, mracad, monkeypatch):
    monkeypatch.setenv("MRACAD_CORPUS", "elsewhere")  # not an option
    monkeypatch.setenv("MRACAD_CACHE", "elsewhere")
    assert mracad(*FEATURE).code == 0
    for name, value, says in (
        ("MRACAD_SCLAE", "5mm", "MRACAD_SCLAE: no command has an option 'sclae'; did you mean 'scale'?"),
        ("MRACAD_SMOOTH_SCALE", "5 apples", "MRACAD_SMOOTH_SCALE: scale: '5 apples' is not a length"),
        ("MRACAD_FACES", "'#1", "MRACAD_FACES: faces: No closing quotation"),
    ):
        with monkeypatch.context() as own:
            own.setenv(name, value)
            result = mracad(*SMOOTH)
            assert result.code == 2 and result.err.startswith(f"mracad: {says}"), result.err


def test_an_error_tells_where_the_option_was_set(here, mracad):
    (here / "mracad.toml").write_text('[level]\nscale = "5mm"\n')
    result = mracad("level", "part.step", "--level", "2", "-o", "out.step")
    assert result.code == 2
    assert "a level or a scale, not both" in result.err and "scale is set in mracad.toml:2" in result.err


def test_the_help_tells_defaults_and_their_places(here, mracad):
    (here / "mracad.toml").write_text('keep = "g1"\n[smooth]\nscale = "5mm"\n')
    said = " ".join(mracad("smooth", "--help").out.split())
    assert '[mracad.toml:3: "5mm"]' in said and '[default: g1] [mracad.toml:1: "g1"]' in said
    assert "mracad.toml" not in mracad("convert", "--help").out


def test_steps_of_recipes_take_no_defaults(here, mracad):
    (here / "fair.toml").write_text('[[step]]\nuse = "smooth"\nscale = "5mm"\n')
    before = mracad("recipe", "check", "fair.toml", "--json")
    (here / "mracad.toml").write_text('amount = 0.5\n[smooth]\nkeep = "g2"\nscale = "9mm"\n')
    assert mracad("recipe", "check", "fair.toml", "--json") == before and before.code == 0


def test_names_for_other_commands_are_no_matter_and_what_is_overridden_is_not_read(here, mracad, monkeypatch):
    """The part is missing: exit code 3 once the options are read."""
    (here / "mracad.toml").write_text('[smooth]\nsclae = "5mm"\n[feature]\nx = 1\n')
    monkeypatch.setenv("MRACAD_SMOOTH_SCLAE", "5mm")
    assert mracad("render", "part.step", "-o", "a.png").code == 3
    assert mracad(*FINE).code == 2 and mracad("env").code == 1
    monkeypatch.delenv("MRACAD_SMOOTH_SCLAE")
    (here / "mracad.toml").write_text('[smooth]\nscale = "banana"\n')
    assert mracad(*FINE).code == 3
    assert mracad(*SMOOTH).err.startswith("mracad: mracad.toml:2: scale: 'banana' is not a length")
