"""What edits did, in the words of their reports."""

from collections import Counter

from mracad.edit.smooth import smooth
from mracad.job.document import run
from mracad.job.treated import rings, told
from mracad.occ.files import read
from mracad.spec.steps import Smooth


def test_faces_and_edges_are_counted_as_in_the_report(samples):
    options = Smooth(scale="25mm", faces=("#1", "#2"), hold=("#4",))
    report = run(read(samples / "panel.step"), smooth, options)
    found = told(report, options)
    assert found.faces == {0: "edited", 1: "edited", 3: "held"} | dict.fromkeys((2, 4, 5), "unselected")
    assert found.words["edited"] == "2 faces smoothed at 25mm" and found.words["held"] == "1 face held by --hold"
    assert found.words["coupled"] == "1 edge moved with both faces"
    stay = [edge for edge in report.edit.edges if edge.reason]
    why = Counter(found.edges[edge.edge] for edge in stay)
    for how, count in why.items():
        assert found.words[how].startswith(f"{count} edge") and how.partition(" ")[0] in ("idle", "stayed")
    reasons = {str(edge.reason) for edge in stay}
    assert {found.words[how].partition("stayed: ")[2] for how in why if how != "idle"} <= reasons
    moved = {edge.edge: edge.how for edge in report.edit.edges if not edge.reason}
    assert found.edges.items() >= moved.items() and len(found.edges) == len(report.edit.edges) and rings(report) is None
