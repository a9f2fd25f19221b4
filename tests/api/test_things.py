"""What comes in comes out: files, documents, and shapes of other libraries, with everything equal but edited faces."""

import gc
import io
import sys
from types import ModuleType, SimpleNamespace

import cadquery as cq
import numpy as np
import pytest
from OCP.TopoDS import TopoDS_Solid

import mracad
from mracad.errors import EditError, UsageError
from mracad.inspect.faults import Fault, FaultKind, ReadBack
from mracad.occ.shapes import copied
from tests.api.nets import moved, nets
from tests.occ import shapes


def test_a_shape_of_cadquery_stays_one_and_is_not_changed_itself(slab):
    slab.label = "slab"
    before = nets(slab)
    fair = mracad.smooth(slab, level=1)
    assert type(fair) is type(slab) and fair.label == "slab" and fair.isValid() and moved(slab, fair) == [True, True]
    assert all(np.array_equal(a, b) for a, b in zip(before, nets(slab), strict=True))
    placed = slab.moved(cq.Location((5, 6, 7), (0, 0, 1), 30))
    again = mracad.smooth(placed, level=1)
    assert again.location().toTuple() == placed.location().toTuple()
    assert all(np.array_equal(a, b) for a, b in zip(nets(again), nets(fair), strict=True))


def test_a_shape_of_the_kernel_stays_one(slab):
    fair = mracad.denoise(slab.wrapped, noise=0.02)
    assert type(fair) is TopoDS_Solid and any(moved(slab.wrapped, fair))
    assert mracad.report_of(fair).edit.faces("edited")


def test_a_workplane_keeps_its_chain(slab):
    work = cq.Workplane("XZ").add(slab).tag("whole")
    fair = mracad.smooth(work, level=1)
    assert type(fair) is cq.Workplane and fair.parent is work and fair.plane.zDir == work.plane.zDir
    assert fair.size() == 1 and fair.faces(">Y").size() == 1 and work._getTagged("whole").val() is slab


def test_faces_on_the_stack_are_those_to_edit(slab):
    fair = mracad.smooth(cq.Workplane(slab).faces(">Z"), level=1)
    assert fair.val().ShapeType() == "Solid" and moved(slab, fair.val()) == moved(
        slab, mracad.smooth(slab, level=1, faces="cq:>Z")
    )
    assert sum(moved(slab, fair.val())) == 1


@pytest.mark.parametrize("given", ["own", "kernel", "index", "text", "workplane"])
def test_faces_are_selectors_indices_or_faces_of_the_host(slab, given):
    index = next(i for i, face in enumerate(slab.Faces()) if face.geomType() == "BSPLINE")
    face = slab.Faces()[index]
    chosen = {
        "own": face,
        "kernel": face.wrapped,
        "index": index,
        "text": f"#{index + 1}",
        "workplane": cq.Workplane(slab).newObject([face]),
    }[given]
    report = mracad.report_of(mracad.smooth(slab, level=1, faces=chosen))
    assert [each.face for each in report.edit.faces("edited")] == [index]
    report = mracad.report_of(mracad.smooth(slab, level=1, hold=[chosen, slab.Edges()[0]]))
    assert [each.face for each in report.edit.faces("held")] == [index]


def test_an_assembly_keeps_everything_but_the_edited_faces(slab):
    box = cq.Workplane().box(2, 2, 2)
    top = cq.Assembly(name="top", loc=cq.Location((1, 2, 3)), metadata={"order": 7})
    inner = cq.Assembly(name="inner", loc=cq.Location((20, 0, 0), (0, 0, 1), 30), color=cq.Color("red"))
    inner.add(slab, name="left", color=cq.Color(0, 0, 1, 0.5), loc=cq.Location((0, 0, 5)))
    inner.add(slab, name="right", loc=cq.Location((0, 30, 5), (1, 0, 0), 90), metadata={"side": "right"})
    inner.add(box, name="box", material="steel")
    top.add(inner)
    left = top.objects["inner"].objects["left"]
    left.addSubshape(slab.Faces()[0], name="marked", color=cq.Color("green"), layer="paint")

    fair = mracad.smooth(top, level=1)
    old, new = dict(top.traverse()), dict(fair.traverse())
    assert list(old) == list(new) and type(fair) is cq.Assembly and fair.parent is None
    for name, node in old.items():
        twin = new[name]
        assert twin is not node and list(twin.objects) == list(node.objects) and twin.metadata == node.metadata
        assert twin.loc.toTuple() == node.loc.toTuple() and twin.material == node.material
        assert twin.color is node.color and [child.parent is twin for child in twin.children] == [True] * len(
            node.children
        )
    assert new["box"].obj.val().wrapped.IsSame(box.val().wrapped) and fair.objects["inner/box"] is new["box"]
    assert new["left"].obj.wrapped.IsPartner(new["right"].obj.wrapped) and not slab.wrapped.IsPartner(
        new["left"].obj.wrapped
    )
    assert new["left"]["marked"].isSame(new["left"].obj.Faces()[0])
    assert list(new["left"]._subshape_layers.values()) == ["paint"]
    assert len(new["left"]._subshape_colors) == 1

    was, now = mracad.snapshot(top), mracad.snapshot(fair)
    assert [face.name for face in was.faces] == [face.name for face in now.faces] and "marked" in {
        f.name for f in was.faces
    }
    assert [face.colour for face in was.faces] == [face.colour for face in now.faces] and was.products == now.products
    assert all(np.array_equal(a, b) for a, b in zip(sum(was.places, ()), sum(now.places, ()), strict=True))
    differs = moved(top, fair)
    assert differs == [True, True] and fair.toCompound().isValid()

    one = mracad.smooth(top, level=1, instance="inner/left")
    shaped = {name: node.obj for name, node in one.traverse() if node.obj}
    assert not shaped["left"].wrapped.IsPartner(slab.wrapped) and shaped["right"].wrapped.IsPartner(slab.wrapped)


class Shape:
    """A shape of build123d, as far as mracad looks at one."""

    def __init__(self, wrapped, label="", color=None, children=()):
        self.wrapped, self.label, self.color, self.joints, self._NodeMixin__children = (
            wrapped,
            label,
            color,
            {},
            children,
        )

    @property
    def children(self):
        return getattr(self, "_NodeMixin__children", ())

    @children.setter
    def children(self, found):
        self._NodeMixin__children = tuple(found)
        self.wrapped = shapes.compound(*(each.wrapped for each in found))


@pytest.fixture(params=["released", "stand-in"])
def build123d(request, monkeypatch):
    """build123d, which needs another build of the kernel than CadQuery, where it is installed; or a stand-in."""
    if request.param == "released":
        found = pytest.importorskip("build123d")
        yield SimpleNamespace(
            shape=found.Solid, compound=lambda children: found.Compound(label="all", children=children)
        )
        return
    module = ModuleType("build123d")
    module.Shape = Shape
    monkeypatch.setitem(sys.modules, "build123d", module)

    def compound(children):
        whole = Shape(None, "all")
        whole.children = children
        return whole

    yield SimpleNamespace(shape=Shape, compound=compound)


def test_shapes_of_build123d_keep_labels_and_children(slab, build123d):
    part = build123d.shape(slab.wrapped)
    part.label = "part"
    fair = mracad.smooth(part, level=1)
    assert type(fair) is type(part) and fair.label == "part" and any(moved(part, fair))
    both = build123d.compound([part, build123d.shape(cq.Workplane().box(1, 1, 1).val().wrapped)])
    fair = mracad.smooth(both, level=1)
    assert type(fair) is type(both) and [child.label for child in fair.children] == ["part", ""]
    assert fair.children[1].wrapped.IsSame(both.children[1].wrapped) and any(moved(both, fair))


def test_a_document_is_not_changed_and_its_copy_has_the_same_bits(samples):
    document = mracad.read(samples / "assembly.step")
    fair = mracad.smooth(document, scale=5)
    assert not document.reports and len(fair.reports) == 1 and moved(document, fair) == [True]
    assert moved(samples / "assembly.step", document) == [False]
    again = mracad.level(fair, level=1)
    assert [step.use for step in again.steps] == ["smooth", "level"] and len(fair.reports) == 1
    one, two = io.BytesIO(), io.BytesIO()
    mracad.write(document, one)
    mracad.write(copied(document), two)
    assert one.getvalue() == two.getvalue()


def test_pictures_and_meshes_of_a_result_know_what_was_done(samples, tmp_path):
    fair = mracad.smooth(samples / "assembly.step", scale=10)
    off = mracad.report_of(fair).deviations[0].largest
    drawn = mracad.render(fair, show="deviation", view="top", size="150x100")
    assert max(drawn.highest, -drawn.lowest) > 0.5 * off and mracad.render(fair, show="treatment", size="60x40").data
    for show in ("deviation", "treatment"):
        with pytest.raises(UsageError, match=f"show: {show}"):
            mracad.render(samples / "assembly.step", show=show)
    mracad.write(fair, tmp_path / "fair.vtp", scalar="deviation", chord="1mm")
    assert b"deviation" in (tmp_path / "fair.vtp").read_bytes()
    with pytest.raises(UsageError, match="scalar: STL holds no numbers"):
        mracad.write(fair, tmp_path / "fair.stl", scalar="deviation")


def test_the_file_is_judged_as_by_the_command(samples, monkeypatch):
    fair = mracad.smooth(samples / "assembly.step", scale=5)

    def worse(*given):
        return ReadBack(False, (Fault(FaultKind.AREA, (6,), 2.0, 1.0),))

    monkeypatch.setattr("mracad.inspect.accept.read_back", worse)
    with pytest.raises(EditError, match="the STEP file would be worse: the area of #7"):
        fair.write(io.BytesIO())


def test_faces_that_make_a_file_worse_stay_as_they_were(samples, monkeypatch):
    fair = mracad.smooth(samples / "assembly.step", scale=5)
    found = iter([ReadBack(False, (Fault(FaultKind.AREA, (6,), 2.0, 1.0),)), ReadBack(True)])
    monkeypatch.setattr("mracad.inspect.accept.read_back", lambda *given: next(found))
    fair.write(io.BytesIO())
    assert mracad.report_of(fair).edit.outcomes[6].said == "the file would be worse there"
    assert moved(samples / "assembly.step", fair) == [False]


def test_reports_live_as_long_as_what_was_made(slab):
    from mracad.api import past

    fair = mracad.smooth(slab, level=1)
    assert mracad.report_of(fair).deviations
    key = id(fair)
    del fair
    gc.collect()
    assert key not in past._REPORTS
    with pytest.raises(UsageError, match="no edit of mracad made it"):
        mracad.report_of(slab)


def test_progress_is_told(slab):
    told = []
    mracad.smooth(slab, level=1, progress=lambda *each: told.append(each))
    assert [each[0] for each in told][:2] == ["reading", "looking at faces"] and len(told) > 5


@pytest.mark.parametrize(
    "thing, said",
    [
        (5, "int: this is no model"),
        (cq.Workplane(), "no shape on its stack"),
        (cq.Workplane().box(1, 1, 1).edges(), "edges on its stack"),
        (cq.Edge.makeLine(cq.Vector(), cq.Vector(1, 0, 0)), "holds no faces"),
        ("nowhere.step", "there is no such file"),
    ],
)
def test_other_things_are_refused(thing, said):
    with pytest.raises(mracad.MracadError, match=said):
        mracad.smooth(thing, level=1)
