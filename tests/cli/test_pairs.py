"""All pairs of options of every command: exit codes of the contract, valid JSON, nothing written on an error."""

import json
from collections import Counter
from pathlib import Path

import pytest

from tests.cli import declared

LEAST = 0.3
"""Share of the rows that must come to an end: where nearly all are refused, nothing is tried."""

ROWS = 8
"""Rows of a command without --long, evenly from all of them."""


TOLD = {"junit.xml", "run.log"}
"""Files that tell of errors, too."""


def contents(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in Path(folder).rglob("*") if p.is_file()}


def rows(command, small, every):
    """Words to call a command with: a pairwise cover of its options and the models."""
    ways = [[(str(path),) for path in small], *declared.choices(command)]
    found = list(declared.pairwise(ways))
    step = max(1, len(found) // ROWS)
    for (source,), *given in found if every else found[::step]:
        named = {"IN": source, "REF": str(small[0]), "MRA": str(small[0].with_suffix(".mra"))}
        arguments = declared.ARGUMENTS.get(command, ("IN",))
        yield [*command.split(), *(named.get(a, a) for a in arguments), *(word for words in given for word in words)]


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("command", declared.commands())
def test_pairs_of_options(command, mracad, small, tmp_path, monkeypatch, pytestconfig):
    codes = Counter()
    for number, words in enumerate(rows(command, small, pytestconfig.getoption("--long"))):
        folder = tmp_path / str(number)
        folder.mkdir()
        (folder / "recipe.toml").write_text(declared.RECIPE)
        (folder / "places.csv").write_text("x,y,z\n7,5,0\n")
        monkeypatch.chdir(folder)
        before = contents(folder)
        result = mracad(*words)
        codes[result.code] += 1
        said = f"mracad {' '.join(words)}\n{result.err}"
        assert result.code in (0, 1, 2, 3, 4, 5), said
        assert "Traceback" not in result.err, said
        after = contents(folder)
        if result.code > 1 and command != "batch":
            assert {name: data for name, data in after.items() if name not in TOLD} == before, said
            assert result.err.count("mracad: ") == 1, said
        for name, data in after.items():
            if name.endswith((".json", ".sarif")):
                json.loads(data, parse_constant=pytest.fail)
        if "--json" in words:
            text = result.err if "-" in words and result.code < 2 else result.out
            lines = [line for line in text.splitlines() if line.startswith("{")]
            assert lines, said
            for line in lines:
                json.loads(line, parse_constant=pytest.fail)
    print(command, dict(codes))
    assert codes[0] + codes[1] >= LEAST * codes.total(), codes


def test_a_pairwise_cover_has_every_pair():
    ways = [range(3), range(10, 12), range(20, 24), range(30, 31), range(40, 42)]
    found = list(declared.pairwise(ways))
    for i, one in enumerate(ways):
        for other in ways[:i]:
            assert {(a, b) for a in one for b in other} <= {(a, b) for row in found for a in row for b in row}
    assert len(found) < 20
