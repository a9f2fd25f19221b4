"""From a file to files: read, taken through steps, written, read back and judged before anything is put in place."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from mracad.errors import EditError, FileError
from mracad.inspect import accept
from mracad.inspect.accept import Slack
from mracad.inspect.faults import Fault, FaultKind, ReadBack, blamed
from mracad.job.document import Progress, Report, play, tell
from mracad.job.judge import Judged, Original
from mracad.job.left import Excluded
from mracad.job.output import Made, Target, pictured, written
from mracad.job.words import of_fault
from mracad.model.facts import Facts
from mracad.spec.recipe import title

if TYPE_CHECKING:
    from mracad.occ.document import Document
    from mracad.occ.files import Written
    from mracad.spec.recipe import Step

_SAME_PLACE = 1e-9  # of the largest coordinate

ROUNDS = 8
"""How often the steps are repeated, each time without the faces that would make the file worse."""


@dataclass(frozen=True)
class Production:
    """The result of each step, the outputs (none where a check failed, or on a dry run), and the document after the
    steps; the last one is not in it on a dry run."""

    document: Document = field(repr=False)
    results: tuple[Report | Judged, ...] = ()
    made: tuple[Made, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether every check held."""
        last = self.results[-1] if self.results else None
        return not isinstance(last, Judged) or last.passed


def produce(
    document: Document,
    original: Original,
    steps: Sequence[Step] = (),
    targets: Sequence[Target] = (),
    *,
    verify: bool = True,
    progress: Progress | None = None,
    done: Sequence[Report | Judged] = (),
) -> Production:
    """Take a document through steps, and make output files from it.

    Every file is read back and compared with the document.  If it is worse, and also worse than the kernel's own read
    and write of the input, the steps are repeated without the faces that cause it.

    Parameters
    ----------
    document : Document
        Changed in place.
    original : callable
        Reads the document again as it was before any step.
    steps : sequence of Step
    targets : sequence of Target
        None for a dry run.
    verify : bool
        False to skip reading back.
    done : sequence of Report and Judged
        Their results, if the document has gone through the steps already.

    Raises
    ------
    EditError
        When a step cannot be done, or a file would be worse whichever faces stay unchanged.
    """
    excluded: dict[int, Excluded] = {}
    firm: set[int] = set()
    faults: tuple[tuple[Target, Fault], ...] = ()
    copies, header = _Copies(original), title(steps) or "convert"
    for number in range(ROUNDS):
        if number:
            document = original()
        try:
            put = bool(targets)
            results = (
                play(document, steps, original=original, progress=progress, apply=put, excluded=excluded, firm=firm)
                if number or not done
                else list(done)
            )
        except EditError as error:
            if faults:
                raise _refused(document.name, faults) from error
            raise
        found = Production(document, tuple(results))
        if not (targets and found.passed):
            return found
        tell(progress, "writing")
        made = tuple(
            pictured(document, target, original, list(zip(steps, results, strict=False)))
            if target.kind == "picture"
            else written(document, target, header, original)
            for target in targets
        )
        if verify:
            tell(progress, "reading back")
            memory = _Memory(document, results)
            made = tuple(each if each.target.kind == "picture" else _judged(each, memory, copies) for each in made)
        faults = tuple((each.target, fault) for each in made if each.read_back for fault in each.read_back.faults)
        if not faults:
            return replace(found, made=made)
        slid = memory.slid({face for _, fault in faults for face in fault.faces})
        if slid:
            firm |= slid
            continue
        edited = memory.edited - excluded.keys()
        if not edited:
            break
        left = blamed((fault for _, fault in faults), edited, memory.facts)
        excluded |= dict.fromkeys(left, Excluded.FILE)
    raise _refused(document.name, faults)


class _Memory:
    """The document that was written."""

    def __init__(self, document: Document, results: Sequence[Report | Judged]) -> None:
        self.document = document
        self.reports = [result for result in results if isinstance(result, Report)]
        self.edited = {o.face for report in self.reports for o in report.edit.faces("edited")}

    @cached_property
    def facts(self) -> Facts:
        from mracad.occ.facts import facts

        return facts(self.document)

    def slid(self, faces: Collection[int]) -> set[int]:
        """The edges that slid beside some faces; all for no faces."""
        return {e for report in self.reports for e in report.edit.displacement.slid_at(report.model, faces)}

    @property
    def slack(self) -> Slack:
        edges = [edge for report in self.reports for edge in report.edit.edges if len(edge.faces) == 2]
        moved = {tuple(sorted(edge.faces)) for edge in edges if edge.how != "frozen"}
        gaps: dict[tuple[int, ...], float] = {}
        for pair, gap in (each for report in self.reports for each in report.gaps().items()):
            gaps[pair] = max(gap, gaps.get(pair, 0.0))
        return Slack(moved, gaps)


class _Copies:
    """The kernel's own copy of the input: read, written in the same format and read back, only when asked for."""

    def __init__(self, original: Original) -> None:
        self.original = original
        self._data: dict[tuple[str, str], bytes] = {}
        self._made: dict[tuple[str, str], Facts] = {}

    @cached_property
    def document(self) -> Document:
        return self.original()

    @cached_property
    def input(self) -> Facts:
        from mracad.occ.facts import facts

        return facts(self.document)

    def mesh(self, target: Target) -> Written:
        """A mesh of the input."""
        return written(self.document, target).written

    def data(self, target: Target) -> bytes:
        """The copy as it is written."""
        key = target.format, target.schema
        if key not in self._data:
            self._data[key] = written(self.document, target).data
        return self._data[key]

    def states(self, made: Made, document: Document, faces: Collection[int]) -> bool:
        """Whether the copy states some faces of a document as its file does, entity by entity."""
        if made.target.format != "step":
            return False
        from mracad.occ.check import centres
        from mracad.occ.entities import alike

        places = np.array(centres(document)) / document.units.mm
        size = float(np.abs(places[np.isfinite(places)]).max(initial=0.0))
        return alike(made.data, self.data(made.target), places[sorted(faces)], _SAME_PLACE * size)

    def of(self, target: Target) -> tuple[Facts, Facts]:
        """Facts of the input and of its copy; of the input twice if there is no copy: nothing is forgiven."""
        key = target.format, target.schema
        if key not in self._made:
            try:
                self._made[key] = _read_back(self.data(target), target)
            except Exception as error:
                if not _unreadable(error):
                    raise
                self._made[key] = self.input
        return self.input, self._made[key]


def _read_back(data: bytes, target: Target) -> Facts:
    """The facts of a file, from its bytes alone."""
    from mracad.occ.facts import facts
    from mracad.occ.files import read
    from mracad.occ.load import Text

    return facts(read(Text(data, target.name)))


def _unreadable(error: Exception) -> bool:
    """Whether an error means that a file cannot be read: file errors, and those of the kernel."""
    return isinstance(error, FileError) or type(error).__module__.startswith("OCP")


def _judged(made: Made, memory: _Memory, copies: _Copies) -> Made:
    """An output, read back and judged."""
    if made.target.kind == "mesh":
        torn = made.written.open
        before = copies.mesh(made.target).open if torn and memory.edited else torn
        return replace(made, read_back=accept.meshed(torn, before))
    slack = replace(memory.slack, parts={cut.face: cut.parts for cut in made.written.cut})
    copy = partial(copies.of, made.target) if memory.edited else None
    known = memory.facts
    try:
        file = _read_back(made.data, made.target)
        found = accept.read_back(
            file, *accept.judge(known, file, slack, copy, partial(copies.states, made, memory.document))
        )
    except Exception as error:
        if not _unreadable(error):
            raise
        only = (0,) if known.count == 1 else ()
        found = ReadBack(False, (Fault(FaultKind.UNREAD, only, status=getattr(error, "message", str(error))),))
    return replace(made, read_back=found)


def _refused(name: str, faults: Sequence[tuple[Target, Fault]]) -> EditError:
    """The error for outputs that would be worse; it names the worst fault."""
    target, fault = min(faults, key=lambda each: list(FaultKind).index(each[1].reason))
    more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    return EditError(
        f"{name}: the {target.format.upper()} file would be worse: {of_fault(fault)}{more}",
        "write BREP, which holds faces as they are"
        if target.format in ("step", "iges")
        else "leave these faces out of the selection",
    )
