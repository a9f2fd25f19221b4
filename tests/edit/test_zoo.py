"""Bodies as they are drawn every day: files of them, edited or not, are as good read back as they were in memory."""

import io

import pytest

from mracad.edit.feature.edits import move, repeat
from mracad.edit.smooth import smooth
from mracad.errors import EditError
from mracad.inspect.seams import seams
from mracad.job.document import run
from mracad.occ.check import check
from mracad.occ.files import read, write
from mracad.occ.load import Text
from mracad.occ.sizes import mass
from mracad.occ.view import view
from mracad.spec.steps import Move, Repeat, Smooth
from tests import zoo
from tests.occ import shapes

FORMATS = ["step", "iges"]
QUICK = ["pipe", "twisted", "square_to_round"]
SCALES = ["1%", "5%", "20%"]


@pytest.fixture
def quick(pytestconfig):
    """Skip what takes long, unless --long asks for it."""

    def only(wanted):
        if not (wanted or pytestconfig.getoption("--long")):
            pytest.skip("pytest --long does all of them")

    return only


def body(name):
    return zoo.SOLIDS[name]().val().wrapped


def assert_kept(document, format):
    """The file of a document, read back, is no worse than the document."""
    stream = io.BytesIO()
    cut = write(document, stream, format).cut
    found = read(Text(stream.getvalue(), "again"))
    before, after = check(document, distances=True), check(found, distances=True)
    assert after.valid or not before.valid, after.failures[:3]
    assert (after.solids, after.free_edges) == (before.solids, before.free_edges)
    assert after.faces == before.faces + sum(each.parts - 1 for each in cut)
    old, new = mass(document), mass(found)
    assert (new.volume, new.area) == pytest.approx((old.volume, old.area), rel=5e-5)
    for size in ("edge_tolerance", "vertex_tolerance", "curve_distance"):
        assert getattr(after, size) <= 1.5 * getattr(before, size) + 1e-5, size
    ours, theirs = (seams(view(each)) for each in (document, found))
    assert max((m.gap for m in theirs), default=0) <= 1.5 * max((m.gap for m in ours), default=0) + 1e-5
    assert sum(m.smooth for m in theirs) >= sum(m.smooth for m in ours)
    turned = [max((m.angle for m in each if m.smooth), default=0) for each in (ours, theirs)]
    assert turned[1] <= turned[0] + 0.01


@pytest.mark.parametrize("name", zoo.SOLIDS)
@pytest.mark.parametrize("format", FORMATS)
def test_bodies_as_drawn(name, format):
    assert_kept(shapes.document(body(name)), format)


@pytest.mark.parametrize("name", zoo.SOLIDS)
@pytest.mark.parametrize("format", FORMATS)
def test_bodies_as_nurbs(name, format, quick):
    quick(name in QUICK)
    assert_kept(shapes.document(zoo.nurbs(body(name))), format)


@pytest.mark.parametrize("name", zoo.SOLIDS)
@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("refine", ["auto", "never"])
def test_bodies_smoothed(name, scale, refine, quick):
    quick(name in QUICK and scale == "20%" and refine == "auto")
    document = zoo.noisy(body(name))
    try:
        report = run(document, smooth, Smooth(scale=scale, refine=refine))
    except EditError as error:
        pytest.skip(str(error))
    assert report.valid_after.valid
    assert_kept(document, "step")


@pytest.mark.parametrize(
    ("edit", "options"),
    [
        (move, Move(feature="near:-8,0,10,radius:6", to="8,0,10")),
        (repeat, Repeat(feature="near:-8,0,10,radius:6", at=("8,0,10", "0,1,10"))),
    ],
    ids=["moved", "repeated"],
)
def test_a_bump_elsewhere(edit, options):
    document = zoo.bumped()
    report = run(document, edit, options)
    assert report.edit.faces("edited") and report.valid_after.valid
    assert_kept(document, "step")
