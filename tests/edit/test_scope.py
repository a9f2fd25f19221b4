"""What an edit may move: faces and edges that options name, on a model alone as on a document."""

import io

import msgspec
import numpy as np
import pytest

from mracad.edit.feature.edits import repeat
from mracad.edit.smooth import smooth
from mracad.errors import UsageError
from mracad.job.document import run
from mracad.job.look import snapshot
from mracad.occ.step import read_step, write_step
from mracad.occ.view import view
from mracad.seam.cause import Cause, Still
from mracad.spec.steps import Repeat, Smooth
from tests.edit import panels
from tests.occ import shapes


def panel(**how):
    """Two patches of one noisy surface."""
    _, noisy = panels.whole(8, 0.3, patches=(1, 2))
    return panels.document(panels.cut(noisy, (1, 2)), **how)


def seam_of(model):
    """The edge, or one of the two edges, that both faces meet at."""
    sewn = [edge.index for edge in model.edges if len({side.face for side in edge.sides}) == 2]
    return sewn[0] if sewn else next(e.index for e in model.edges if np.ptp(e.points[:, 1]) < 1 < e.points[0, 1] < 199)


def written(document):
    stream = io.BytesIO()
    write_step(document, stream)
    return view(read_step(io.BytesIO(stream.getvalue())))


@pytest.mark.parametrize("sewn", [True, False])
def test_a_held_edge_stays_and_the_rest_moves(sewn):
    place = seam_of(view(panel(sewn=sewn)))
    found = {}
    for hold in ((), (f"edge#{place + 1}",)):
        document = panel(sewn=sewn)
        before = view(document).edges[place].points
        report = run(document, smooth, Smooth(level=2, hold=hold))
        (treatment,) = (t for t in report.edit.edges if t.edge == place)
        moved = np.abs(view(document).edges[place].points - before).max()
        found[hold] = treatment.how, treatment.reason, moved
        assert {o.status for o in report.edit.outcomes} == {"edited"}
    (how, _, free), (held, reason, still) = found.values()
    assert how == "coupled" and free > 0.01
    assert held == "frozen" and reason == Cause(Still.HELD) and still == 0.0


def test_a_held_edge_stays_under_a_copy_of_a_feature():
    found = []
    for hold in ((), ("edge#1",)):
        document = panel()
        model = view(document)
        place = seam_of(model)
        hold = tuple(f"edge#{place + 1}" for _ in hold)
        x, y, z = model.edges[place].points[12]
        options = Repeat(feature="near:50,50,0,radius:15", at=(f"{x},{y},{z}",), hold=hold, clip=True)
        run(document, repeat, options)
        found.append(np.abs(view(document).edges[place].points - model.edges[place].points).max())
    assert found[0] > 1e-3 and found[1] == 0.0


@pytest.mark.parametrize(
    ("options", "edited"),
    [({}, {0, 1}), ({"faces": ("#1",)}, {0}), ({"faces": ("!#1",)}, {1}), ({"hold": ("#2",)}, {0})],
)
def test_the_options_say_which_faces_of_a_model_are_edited(options, edited):
    model = snapshot(panel())
    edit = smooth(model, Smooth(level=2, **options))
    assert {o.face for o in edit.faces("edited")} == edited
    assert {model.surfaces[i].faces[0] for i in edit.displacement.offsets} == edited


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"faces": ("edge#3",)}, "edge#3 is not a face"),
        ({"faces": ("#1", "edge#3")}, "edge#3 is not a face"),
        ({"hold": ("!edge#3",)}, "cannot be left out"),
        ({"faces": ("#9",)}, "#1 to #2"),
        ({"faces": ("cq:>Z",)}, "needs the document"),
        ({"instance": "part"}, "needs the document"),
    ],
)
def test_what_a_model_cannot_be_asked(options, says):
    with pytest.raises(UsageError, match=says):
        smooth(snapshot(panel()), Smooth(level=2, **options))


def test_an_edge_of_one_instance_is_held_by_the_number_of_the_part(tmp_path):
    from OCP.gp import gp_Trsf, gp_Vec
    from OCP.TopLoc import TopLoc_Location

    turn = gp_Trsf()
    turn.SetTranslation(gp_Vec(0, 0, 300))
    part = panel().parts[0].shape
    for hold in ((), (f"edge#{seam_of(view(panel())) + 1}",)):
        document = shapes.assembly(part, TopLoc_Location(), TopLoc_Location(turn))
        from mracad.occ.instance import instances

        path = list(instances(document))[-1]
        report = run(document, smooth, Smooth(level=2, instance=path, hold=hold))
        hows = {t.how for t in report.edit.edges if len(t.faces) == 2}
        assert hows == {"frozen" if hold else "coupled"}


@pytest.mark.parametrize("options", [{"level": 2, "edges": "frozen"}, {"level": 1.5, "faces": ("#1",)}, {"level": 2}])
def test_outcomes_are_plain_numbers(options):
    """Not numpy's, which no encoder of reports takes."""
    edit = smooth(snapshot(panel()), Smooth(**options))
    records = (edit.outcomes, edit.edges)
    assert msgspec.json.encode(records)


def _refused(value):
    raise AssertionError(f"{type(value)} is not plain")
