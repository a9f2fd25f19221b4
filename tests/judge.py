"""What the kernel says of a STEP file that it reads back: the yardstick for every output."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from mracad.audit.continuity import SeamMeasure, seams
from mracad.model import Model
from mracad.occ.check import Validity, check
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


LOOSE = 1e-4, 0.01
"""Gap, mm, that a seam that moved to the tolerance may have, and how much its angle may have grown, degrees."""

SAMPLED = 1.05
"""The gap of such a seam is not wider anywhere than it was at its widest; at the places of the measure it may be."""


def assert_as_good(
    result: Verdict,
    yardstick: Verdict,
    refined: Collection[int] = (),
    coupled: Collection[tuple] = (),
    loose: Collection[tuple] = (),
    source: Verdict | None = None,
) -> None:
    """The output is as good as the kernel's own copy of the input.

    ``coupled`` are pairs of faces whose seams moved exactly, ``loose`` those whose seams moved to the tolerance: these
    are as good as those of the ``source`` (the reader heals some seams of its own copy).  On ``refined`` faces the
    reader lays new curves (within the old tolerance), and where the normal turns quickly it turns a few thousandths of
    a degree at those.
    """
    new, old = result.validity, yardstick.validity
    assert new.valid or not old.valid, new.failures[:5]
    assert (new.solids, new.shells, new.faces) == (old.solids, old.shells, old.faces)
    assert new.free_edges <= old.free_edges
    assert result.tolerance <= max([yardstick.tolerance, *([LOOSE[0], source.tolerance] if loose else [])]) + 1e-7
    ours, theirs = _by_faces(result.seams), _by_faces(yardstick.seams)
    widest = {faces: max(m.gap for m in found) for faces, found in _by_faces(source.seams).items()} if loose else {}
    assert ours.keys() == theirs.keys()
    for faces, found in ours.items():
        before = theirs[faces]
        assert len(found) == len(before)
        for new_gap, old_gap in zip(*(sorted(m.gap for m in each) for each in (found, before)), strict=True):
            limit = old_gap + (1e-6 if faces in coupled else 1e-7)
            if faces in loose:
                limit = max(limit, SAMPLED * widest[faces], LOOSE[0])
            assert new_gap <= limit, (faces, old_gap)
        steeper = LOOSE[1] if faces in loose or not set(faces).isdisjoint(refined) else 1e-4
        smooth = [sorted(m.angle for m in each if m.smooth) for each in (found, before)]
        for new_angle, old_angle in zip(*smooth, strict=True):
            assert new_angle <= old_angle + steeper, faces


def _by_faces(measures: list[SeamMeasure]) -> dict[tuple[int, int], list[SeamMeasure]]:
    """Seams by the pair of faces that they join (the two files may list their edges in another order)."""
    found: dict[tuple[int, int], list[SeamMeasure]] = defaultdict(list)
    for measure in measures:
        found[min(measure.faces), max(measure.faces)].append(measure)
    return found
