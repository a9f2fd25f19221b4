"""A document on its way through the steps of a recipe: viewed, edited, checked in memory; and the report of it."""

from __future__ import annotations

import importlib
import time
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING

from mracad import note
from mracad.brief import named_line
from mracad.edit.result import Edit, Reason
from mracad.edit.tolerances import Tolerances, tolerances
from mracad.edit.torn import gaps, torn
from mracad.errors import EditError, MracadError
from mracad.inspect.deviation import Deviation, deviations
from mracad.inspect.mended import Mending, unmended
from mracad.inspect.seams import SeamMeasure, key, remeasured, seams
from mracad.job.judge import Judged, Original
from mracad.job.left import Excluded, Left
from mracad.job.words import numbers
from mracad.model.brep import Model
from mracad.spec.steps import Fitting, Selection

if TYPE_CHECKING:
    from mracad.model.facts import Validity
    from mracad.occ.document import Document
    from mracad.spec.recipe import Step

Progress = Callable[[str, int, int], None]
"""Called with the name of a stage, the steps done and the steps in all."""


@dataclass(frozen=True)
class Report:
    """What one edit of one file did.

    Attributes
    ----------
    model : Model
        The snapshot before the edit.
    edit : Edit
    deviations : list of Deviation
    before, after : list of SeamMeasure
        Seams before and after, in the same order.
    valid_before, valid_after : Validity
    tolerances : Tolerances
        How much worse the edit may make seams.
    unmended : tuple of Mending
        Defects that were to be mended and were not.
    """

    model: Model
    edit: Edit
    deviations: list[Deviation]
    before: list[SeamMeasure]
    after: list[SeamMeasure]
    valid_before: Validity
    valid_after: Validity
    tolerances: Tolerances
    unmended: tuple[Mending, ...]
    seconds: float

    def __repr__(self) -> str:
        return named_line("Report", self.model.name, self.told)

    def _repr_html_(self) -> str:
        from mracad.report.notebook import cell

        heads = "Face", "Status", "Reason", "Moved, mm"
        rows = [
            (f"#{each.face + 1}", each.status, each.words, f"{each.moved:.3g}" if each.moved else "")
            for each in sorted(self.edit.outcomes, key=lambda each: each.status != "edited")
        ]
        return cell([("Model", self.model.name), ("Result", self.told)], heads, rows)

    @property
    def told(self) -> str:
        """What it did, in a few words."""
        edited, largest = len(self.edit.faces("edited")), max((each.largest for each in self.deviations), default=0.0)
        return f"{edited} of {len(self.edit.outcomes)} faces edited, deviation up to {largest:.3g} mm"

    @property
    def control_points(self) -> tuple[int, int]:
        """Control points of all NURBS faces before and after."""
        before = after = 0
        for surface in self.model.surfaces:
            net, offset = surface.net, self.edit.displacement.offsets.get(surface.index)
            before += net.u.count * net.v.count
            after += net.u.count * net.v.count if offset is None else offset.poles.shape[0] * offset.poles.shape[1]
        return before, after

    def gaps(self) -> dict[tuple[int, ...], float]:
        """Largest gap (mm) allowed, by pair of faces, at seams whose faces moved separately or to a tolerance."""
        return gaps(self.model, self.before, self.edit, self.tolerances)

    def smooth_seams(self) -> frozenset[tuple[int, tuple[int, int]]]:
        """Keys of the seams that were smooth before."""
        return frozenset(key(m) for m in self.before if m.smooth)


def play(
    document: Document,
    steps: Sequence[Step],
    *,
    original: Original | None = None,
    progress: Progress | None = None,
    apply: bool = True,
    excluded: Mapping[int, Excluded] = MappingProxyType({}),
    firm: Collection[int] = (),
) -> list[Report | Judged]:
    """Take a document through steps, in memory, up to the first check that fails.

    Parameters
    ----------
    document : Document
        Changed in place.
    steps : sequence of Step
    original : callable, optional
        Reads the document again as it was before any step, for comparisons.
    apply : bool
        False for a dry run, after which the document must not be written: the last step is not put into it.
    excluded : mapping
        Faces that no edit may change, and why.
    firm : collection of int
        Edges that must not slide.

    Returns
    -------
    list of Report and Judged
        One for each step that was done.

    Raises
    ------
    EditError
        As :func:`run`.
    """
    results: list[Report | Judged] = []
    for step in steps:
        module, _, name = step.options.function.partition(":")
        function = getattr(importlib.import_module(module), name)
        result: Report | Judged
        with _telling(step.id if len(steps) > 1 else ""):
            if isinstance(step.options, Selection):
                put = apply or step is not steps[-1]
                result = run(
                    document, function, step.options, progress=progress, apply=put, excluded=excluded, firm=firm
                )
            else:
                tell(progress, step.use)
                result = function(document, step.options, original)
        results.append(result)
        if isinstance(result, Judged) and not result.passed:
            break
    return results


@contextmanager
def _telling(step: str) -> Iterator[None]:
    """Errors of the block name a step."""
    try:
        yield
    except MracadError as error:
        if step:
            error.message = f"{step}: {error.message}"
            error.args = (str(error),)
        raise


def run(
    document: Document,
    edit: Callable[..., Edit],
    options: Selection,
    *,
    progress: Progress | None = None,
    apply: bool = True,
    excluded: Mapping[int, Excluded] = MappingProxyType({}),
    firm: Collection[int] = (),
) -> Report:
    """Edit a document in memory.

    Parameters
    ----------
    document : Document
        Changed in place unless ``apply`` is false.
    edit : callable
        ``edit(model, options, *models, scope=…, progress=…) -> Edit``; the options name the ``models``.
    options : Selection
        Options of the edit, including its selectors.
    apply : bool
        False for a dry run.
    excluded : mapping
        Faces that the edit may not change, and why.
    firm : collection of int
        Edges that must not slide.

    Raises
    ------
    EditError
        When faces were named one by one and none can move, or the result would be less valid than the input whichever
        faces stay unchanged.  The document must then not be written.
    """
    from mracad.job.look import looked_at
    from mracad.occ.check import check
    from mracad.occ.files import read
    from mracad.occ.view import view

    stage = partial(tell, progress)
    start = time.perf_counter()
    stage("looking at faces")
    model, scope = looked_at(document, options)
    others = [view(read(file)) for file in options.models()]
    before: list[SeamMeasure] = []
    valid_before: Validity | None = None
    left, allowed = Left(model.name, dict(excluded), set(firm)), tolerances(model, options)
    while True:
        stage("editing")
        try:
            narrowed = scope.holding(left.faces, left.firm)
            result = edit(model, options, *others, scope=narrowed, progress=partial(stage, "editing"))
        except EditError as error:
            raise left.explained(error) from error
        result = _named(result, {face: left.faces[face] for face in left.faces.keys() & scope.chosen})
        _refuse_if_asked(model, result, scope.named)
        stage("measuring seams")
        if valid_before is None:
            before = seams(model)
            stage("checking the input")
            valid_before = check(document)
            stage("measuring seams")
        valid_after = valid_before
        offsets = result.displacement.offsets
        after = remeasured(model, result.displacement.applied(model), before, offsets) if offsets else before
        found = torn(model, before, after, result, allowed, options.keep)
        if found and left.stopped(result.displacement.slid_at(model, found)):
            continue
        found = {i for i in found if model.faces[i].surface is not None} - left.faces.keys()
        if found:
            left.leave(found, Excluded.SEAMS, before, result)
            continue
        if not (apply and offsets):
            break
        worse, valid_after = _put(document, (model, result, allowed), left, valid_before, stage)
        if not worse:
            break
        if not left.stopped(result.displacement.slid_at(model, worse)):
            left.leave(worse, Excluded.INVALID, before, result)
    mended: tuple[Mending, ...] = ()
    if isinstance(options, Fitting):
        mended = unmended(options, model.diagonal, scope.chosen - left.faces.keys(), before, after)
    stage("measuring the deviation")
    off = deviations(model, result.displacement)
    return Report(
        model, result, off, before, after, valid_before, valid_after, allowed, mended, time.perf_counter() - start
    )


def tell(progress: Progress | None, name: str, done: int = 0, total: int = 1) -> None:
    """Report the stage that is running."""
    note.doing(name)
    if progress:
        progress(name, done, total)


def _put(
    document: Document,
    seen: tuple[Model, Edit, Tolerances],
    left: Left,
    before: Validity,
    stage: Callable[[str], None],
) -> tuple[set[int], Validity]:
    """Apply an edit to a document; return the faces that would be less valid and the verdict.

    If there are such faces, the edit is taken out again.  ``seen`` are the model, the edit and its tolerances.
    """
    from mracad.occ.apply import apply, restore
    from mracad.occ.check import check

    model, edit, allowed = seen
    stage("changing the model")
    sliding = apply(document, model, edit.displacement)
    stage("checking the result")
    touched = {f for i in edit.displacement.offsets for f in model.surfaces[i].faces}
    touched |= edit.displacement.around(model)
    moved = check(document, faces=touched)
    worse = _worse(before, moved)
    for edge in sliding.loose(allowed.gap) if sliding else ():
        worse |= {side.face for side in model.edges[edge].sides}
    if worse:
        restore(document, model, edit.displacement, sliding)
    if not worse <= touched - left.faces.keys() and not edit.displacement.slid_at(model, worse):
        raise EditError(
            f"{model.name}: the result would be less valid", "leave faces out with --faces '!#N', or use --amount 0.5"
        )
    return worse, _verdict(before, moved, touched)


def _refuse_if_asked(model: Model, result: Edit, named: Collection[int]) -> None:
    """Raise EditError where faces were named one by one and none of them can be edited."""
    asked = [outcome for outcome in result.outcomes if outcome.face in named]
    left = [outcome for outcome in asked if outcome.status == "left"]
    if left and not any(outcome.status == "edited" for outcome in asked):
        names = numbers([outcome.face for outcome in left])
        raise EditError(
            f"{model.name}: {names}: {left[0].words}",
            "leave these faces out, or give no --faces to edit what can be edited",
        )


def _named(result: Edit, excluded: Mapping[int, Excluded]) -> Edit:
    """The edit, with the reasons why ``excluded`` faces stay unchanged."""
    if not excluded:
        return result
    return replace(
        result,
        outcomes=tuple(
            replace(o, status="left", reason=Reason.WORSE, said=excluded[o.face].value) if o.face in excluded else o
            for o in result.outcomes
        ),
    )


def _worse(before: Validity, after: Validity) -> set[int]:
    """Faces with a failure that they did not have before (-1 for a failure that belongs to no face)."""
    fresh = Counter(after.failures) - Counter(before.failures)
    lost = {-1} if after.free_edges > before.free_edges else set()
    return lost | {-1 if failure.face is None else failure.face for failure in fresh}


def _verdict(before: Validity, moved: Validity, touched: set[int]) -> Validity:
    """The verdict on the whole model after an edit, from the check before it and the check of the faces that moved."""
    failures = tuple(f for f in before.failures if f.face not in touched) + moved.failures
    return replace(
        before,
        valid=not failures,
        failures=failures,
        edge_tolerance=max(before.edge_tolerance, moved.edge_tolerance),
        vertex_tolerance=max(before.vertex_tolerance, moved.vertex_tolerance),
    )
