"""Functions of the edits, made of their structs of options, which declare names, types, defaults and descriptions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from inspect import Parameter, Signature, cleandoc
from typing import Any

from mracad.api.examples import EXAMPLES
from mracad.api.past import remember
from mracad.api.progress import shown
from mracad.api.speech import explained, speaking
from mracad.api.things import opened
from mracad.api.threads import one_thread
from mracad.api.values import bound, chosen, described, parameters
from mracad.job.document import Report, play
from mracad.output import put
from mracad.spec.recipe import Step
from mracad.spec.steps import STEPS, Options, Selection

PROGRESS = Parameter("progress", Parameter.KEYWORD_ONLY, default=None, annotation="Progress")
DETAILS = Parameter("details", Parameter.KEYWORD_ONLY, default=None, annotation="Path | None")


def edits(steps: Mapping[str, type[Options]] = STEPS) -> dict[str, type[Selection]]:
    """The options of each edit, by the name of its function."""
    return {use: struct for use, struct in steps.items() if issubclass(struct, Selection)}


def signature(use: str) -> Signature:
    """The signature of an edit."""
    thing = Parameter("thing", Parameter.POSITIONAL_ONLY, annotation="Thing")
    own = parameters(STEPS[use])
    return Signature([thing, *own, *([DETAILS] if use == "level" else []), PROGRESS], return_annotation="Thing")


def edit(use: str) -> Callable[..., Any]:
    """The function of an edit."""
    taken = signature(use)

    def function(thing: Any, /, **given: Any) -> Any:
        bound(use, taken, given, thing)
        details, progress = (given.pop(name, None) for name in (DETAILS.name if use == "level" else "", PROGRESS.name))
        with speaking(), shown(progress) as tell:
            tell("reading", 0, 1)
            whole = opened(thing, change=True)
            step = Step(use, use, chosen(STEPS[use], given, whole))
            with one_thread():
                (report,) = play(whole.document, [step], progress=tell)
            assert isinstance(report, Report)
            if details is not None:
                _save(report, step, details)
            whole.document.steps += (step,)
            whole.document.reports += (report,)
            result = whole.back()
            remember(result, report)
        return result

    function.__name__ = function.__qualname__ = use
    function.__module__ = "mracad"
    function.__doc__ = docstring(use)
    vars(function)["__signature__"] = taken
    return function


def _save(report: Report, step: Step, path: Any) -> None:
    """Write what :func:`level` took away to a file."""
    from mracad.edit.details import Details
    from mracad.edit.mra import save

    put(save(Details.of(report.model, report.edit.displacement, step.options.done)), path)  # type: ignore[attr-defined]


def docstring(use: str) -> str:
    """The docstring of an edit, in the form of numpydoc."""
    lines = described(STEPS[use], parameters(STEPS[use]))
    if use == "level":
        lines += "\ndetails : Path, optional\n    File (.mra) to save the details to, for :func:`mracad.compose`."
    summary = explained(cleandoc(STEPS[use].__doc__ or ""))
    return _DOCSTRING.format(summary=summary, options=lines, example=EXAMPLES.get(use, ""))


_DOCSTRING = """{summary}

Parameters
----------
thing : path, binary stream, Document or shape
    Shapes are a ``Workplane``, ``Shape`` or ``Assembly`` of CadQuery, a ``Shape`` of build123d, or a ``TopoDS_Shape``.
    A workplane on whose stack are faces of a solid stands for the solid, with these faces to be edited.
{options}
progress : callable or bool, optional
    Called with the stage, the steps done and the steps in all; True shows a bar where that is possible.

Returns
-------
Document or shape
    A Document for a file, else a new object of the same type; ``thing`` itself does not change.
    :func:`mracad.report_of` tells what was done.

Raises
------
UsageError
    For options that do not make sense, and faces that do not exist.
FileError
    For a file that cannot be read.
EditError
    For an edit that cannot be done as asked, or that would make the model worse.

Notes
-----
Lengths are numbers in millimetres, or texts with a unit (``"5mm"``, ``"0.2in"``, ``"2%"`` of the model's diagonal).
Points and vectors are texts or three numbers, in millimetres.  Faces are texts (``"#3"``, a name, ``"cq:>Z"``, ...),
indices from 0, or faces of the shape itself.

Examples
--------
{example}
"""
