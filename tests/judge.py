"""What the kernel says of a STEP file that it reads back: the yardstick for every output."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from mracad.inspect.seams import SeamMeasure, seams
from mracad.model.brep import Model
from mracad.model.facts import Validity
from mracad.occ.check import check
from mracad.occ.settings import exchange, quiet
from mracad.occ.step import read_step
from mracad.occ.view import view


@dataclass(frozen=True)
class Verdict:
    """Validity, the snapshot and the seams of a file."""

    validity: Validity
    model: Model
    seams: list[SeamMeasure]

    @property
    def tolerance(self) -> float:
        return max(self.validity.edge_tolerance, self.validity.vertex_tolerance)


@lru_cache(maxsize=4)
def judge(path: Path) -> Verdict:
    """Read a file and judge it."""
    document = read_step(path)
    model = view(document)
    return Verdict(check(document), model, seams(model))


def kernel_copy(source: Path, target: Path) -> Path:
    """What the kernel alone makes of a file: read it, write it, nothing else.

    It is told to write all digits: with its usual twelve, the healing of the reader settles gaps of some files up to
    1.5e-7 mm differently, which says nothing of an edit.
    """
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.STEPCAFControl import STEPCAFControl_Reader, STEPCAFControl_Writer
    from OCP.STEPControl import STEPControl_AsIs
    from OCP.StepData import StepData_StepWriter
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDocStd import TDocStd_Document

    with quiet(), exchange({"write.step.schema": "AP214IS"}):
        document = TDocStd_Document(TCollection_ExtendedString("copy"))
        reader = STEPCAFControl_Reader()
        assert reader.ReadFile(str(source)) == IFSelect_RetDone
        assert reader.Transfer(document)
        writer = STEPCAFControl_Writer()
        assert writer.Transfer(document, STEPControl_AsIs)
        printer = StepData_StepWriter(writer.Writer().Model())
        printer.FloatWriter().SetFormat("%.17G")
        printer.SendModel(writer.Writer().WS().Protocol())
        with target.open("wb") as stream:
            printer.Print(stream)
    return target


GAP, LEAST, MORE = 1e-4, 1e-5, 0.02
"""``--gap-tolerance``, mm; gap of any edge that counts for none, mm; share by which one may be wider that is as wide as
may be."""

STEEPER = 0.01
"""How much the angle of a smooth seam may grow beside faces that moved, degrees."""


def allowed(source: Verdict, loose: Collection[tuple], held: Collection[tuple]) -> dict[tuple[int, int], float]:
    """How wide seams may be, mm: of those that move to the tolerance, and of those that are held beside a face that
    moves, which keep to the tolerances of their edges."""
    found: dict[tuple[int, int], float] = defaultdict(float)
    for measure in source.seams:
        faces = min(measure.faces), max(measure.faces)
        if faces in held:
            tolerance = source.model.edges[measure.edge].tolerance
            found[faces] = max(found[faces], min(max(tolerance, LEAST), GAP), (1 + MORE) * measure.gap)
        if faces in loose:
            found[faces] = max(found[faces], measure.gap + GAP)
    return found


def assert_as_good(
    result: Verdict,
    yardstick: Verdict,
    refined: Collection[int] = (),
    coupled: Collection[tuple] = (),
    widest: Mapping[tuple[int, int], float] | None = None,
) -> None:
    """The output is as good as the kernel's own copy of the input.

    ``coupled`` are pairs of faces whose seams moved exactly, ``widest`` says how wide others may be (:func:`allowed`).
    On ``refined`` faces the reader lays new curves (within the old tolerance), and where the normal turns quickly it
    turns a few thousandths of a degree at those.
    """
    widest = widest or {}
    new, old = result.validity, yardstick.validity
    assert new.valid or not old.valid, new.failures[:5]
    assert (new.solids, new.shells, new.faces) == (old.solids, old.shells, old.faces)
    assert new.free_edges <= old.free_edges
    assert result.tolerance <= max([yardstick.tolerance, *widest.values()]) + 1e-7
    ours, theirs = _by_faces(result.seams), _by_faces(yardstick.seams)
    assert ours.keys() == theirs.keys()
    for faces, found in ours.items():
        before = theirs[faces]
        assert len(found) == len(before)
        for new_gap, old_gap in zip(*(sorted(m.gap for m in each) for each in (found, before)), strict=True):
            limit = max(old_gap + (1e-6 if faces in coupled else 1e-7), widest.get(faces, 0.0))
            assert new_gap <= limit, (faces, old_gap)
        steeper = STEEPER if faces in widest or not set(faces).isdisjoint(refined) else 1e-4
        smooth = [sorted(m.angle for m in each if m.smooth) for each in (found, before)]
        for new_angle, old_angle in zip(*smooth, strict=True):
            assert new_angle <= old_angle + steeper, faces


def _by_faces(measures: list[SeamMeasure]) -> dict[tuple[int, int], list[SeamMeasure]]:
    """Seams by the pair of faces that they join (the two files may list their edges in another order)."""
    found: dict[tuple[int, int], list[SeamMeasure]] = defaultdict(list)
    for measure in measures:
        found[min(measure.faces), max(measure.faces)].append(measure)
    return found
