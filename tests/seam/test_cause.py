"""Why edges stay: an enum with what belongs to it; its words are made in one place."""

import json

import pytest
from mracad_cli.render.json import treatment
from mracad_cli.render.text import edge_words

from mracad.seam.cause import Cause, Still
from mracad.seam.natural import Treatment


@pytest.mark.parametrize("still", Still)
def test_every_cause_has_words_of_its_own(still):
    assert str(Cause(still, "plane")) == still.value.replace("{}", "plane")
    assert sum(each.value == still.value for each in Still) == 1


def test_reports_say_them_as_text():
    edges = (
        Treatment(0, (0, 1), "frozen", Cause(Still.ANALYTIC, "plane")),
        Treatment(1, (0, 2), "frozen", Cause(Still.ANALYTIC, "plane")),
        Treatment(2, (0,), "frozen", Cause(Still.FREE)),
        Treatment(3, (0, 3), "coupled"),
    )
    found = json.loads(json.dumps([treatment(edge) for edge in edges]))
    assert found[0] == {"edge": 1, "faces": [1, 2], "how": "frozen", "reason": "plane neighbour"}
    assert [each["reason"] for each in found[1:]] == ["plane neighbour", "free edge", ""]
    assert edge_words(edges).endswith("(stayed: 2 × plane neighbour, 1 × free edge)")
