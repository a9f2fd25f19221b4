"""``--encoding`` on every command that reads, and what is said where texts are guessed or lost."""

import json

import pytest

from tests.job.batch.runs import recipe

RIGHT, WRONG = "Geh\u00e4use", "Geh\u0434use"  # in cp1252 and in cp1251


@pytest.fixture
def model(small, tmp_path):
    """A model whose product has a name that is not UTF-8."""
    text = small[0].read_bytes()
    assert b"PRODUCT('part','part'" in text
    path = tmp_path / "model.step"
    path.write_bytes(text.replace(b"PRODUCT('part','part'", b"PRODUCT('part','Geh\xe4use'"))
    return path


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("encoding, name", [(None, RIGHT), ("cp1251", WRONG)])
def test_the_name_reaches_info_and_every_output(mracad, model, tmp_path, encoding, name):
    said = ["--encoding", encoding] if encoding else []
    result = mracad("info", model, "--json", *said)
    assert json.loads(result.out)["products"] == [name]
    assert ("neither ASCII nor UTF-8, read as cp1252" in result.err) == (encoding is None)
    escaped = f"\\X2\\{ord(name[3]):04X}\\X0\\"
    plan = recipe(tmp_path)
    for words in (
        ("convert", model),
        ("smooth", model, "--scale", "5%"),
        ("run", plan, model),
        ("pipeline", "smooth --scale 5%", model),
    ):
        out = tmp_path / f"{words[0]}.step"
        result = mracad(*words, *said, "-o", out, "--json")
        assert result.code == 0, result.err
        assert f"PRODUCT('part','Geh{escaped}use'" in out.read_text()
        warnings = json.loads(result.out)["warnings"]
        assert len(warnings) == (encoding is None) and all(f"warning: {text}" in result.err for text in warnings)
    folder = tmp_path / "out"
    result = mracad("batch", plan, model, "-O", folder, "-j", 1, *said, "--json")
    assert result.code == 0, result.err
    assert f"Geh{escaped}use" in (folder / "model.step").read_text()
    assert len(json.loads(result.out.splitlines()[0])["warnings"]) == (encoding is None)
    for words in (("check", model), ("compare", tmp_path / "convert.step", model), ("feature", "list", model)):
        assert mracad(*words, *said).code == 0


def test_a_name_that_a_format_does_not_take_is_said_to_be_lost(mracad, model, tmp_path):
    result = mracad("convert", model, "-o", tmp_path / "out.igs", "--json")
    assert f"lacks 1 of 1 names ({RIGHT})" in result.err
    assert json.loads(result.out)["lost"]["out.igs"][0]["what"] == "names"


def test_an_unknown_character_set_is_a_usage_error(mracad, model, tmp_path):
    result = mracad("convert", model, "--encoding", "klingon", "-o", tmp_path / "out.step")
    assert result.code == 2 and "klingon" in result.err
