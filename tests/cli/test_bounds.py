"""Values that nothing could come of are refused before the work starts, and in time."""

import pytest

FEATURE = ("--feature", "near:5,5,0,radius:1.5")
DETAIL = ("--from", "#1", "--to", "#1", "--band", "0mm:8mm")
COPIES = [
    (("--at", "@flat.csv"), 3, "flat.csv:1: height 0 makes no copy"),
    (("--at", "@far.csv"), 3, "far.csv:1"),
    (("--at", "@many.csv"), 3, "more than 10000 places"),
    (("--at", "5,7,0", "--size", "1e-9"), 4, "closer than"),
    (("--at", "@tiny.csv"), 4, "closer than"),
    (("--at", "5,7,0", "--spin", "inf"), 2, "spin"),
    (("--at", "1e999,0,0"), 2, "not a place"),
    (("--polar", "3000000,z"), 2, "more than 10000 places"),
    (("--polar", "²,z"), 2, "not a number of places"),
    (("--polar", "9" * 5000 + ",z"), 2, "not a number of places"),
    (("--grid", "200x200,1,1"), 2, "more than 10000 places"),
    (("--along", "edge#1,3000000"), 2, "more than 10000 places"),
    (("--along", "edge#²,2"), 2, "not a row"),
]
OTHERS = [
    (("smooth", "IN", "--scale", "4mm", "--faces", "#²", "--dry-run"), 2, "not a face number"),
    (("smooth", "IN", "--scale", "4mm", "--faces", "#" + "9" * 5000, "--dry-run"), 2, "#1 to #2"),
    (("smooth", "IN", "--scale", "4mm", "--hold", "edge#²", "--dry-run"), 2, "edges #1 to"),
    (("transfer", "IN", "IN", *DETAIL, "--size", "1e-9", "--dry-run"), 4, "closer than"),
    (("convert", "IN", "-o", "out.stl", "--chord", "1e-9mm"), 2, "chord"),
    (("convert", "IN", "-o", "out.stl", "--angle", "0.001"), 2, "angle"),
    (("convert", "IN", "-o", "out.stl", "--angle", "nan"), 2, "angle"),
    (("info", "IN", "--time-limit", "1e300"), 2, "too large for a time"),
    (("smooth", "IN", "--scale", "1e100", "--dry-run"), 2, "too large for a length"),
    (("info", "IN", "--memory-limit", "9" * 400), 2, "not an amount of memory"),
]


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [*((("repeat", "IN", *FEATURE, *words, "--dry-run"), code, says) for words, code, says in COPIES), *OTHERS],
)
def test_a_value_that_nothing_could_come_of(mracad, small, tmp_path, monkeypatch, words, code, says):
    monkeypatch.chdir(tmp_path)
    tables = {"flat": "5,7,0,0,1,0", "far": "5,7,1e999", "tiny": "5,7,0,0,1e-9", "many": "5,7,0\n" * 10_001}
    for name, text in tables.items():
        (tmp_path / f"{name}.csv").write_text(text)
    result = mracad(*(str(small[0]) if word == "IN" else word for word in words))
    assert result.code == code and says in result.err and result.err.count("\n") == 1, result
    assert not (tmp_path / "out.stl").exists()
