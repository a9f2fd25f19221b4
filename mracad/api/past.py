"""The report of the edit that made a thing, kept beside the thing for as long as that lives."""

from __future__ import annotations

import weakref
from typing import Any

from mracad.api.document import Document
from mracad.errors import UsageError
from mracad.job.document import Report

_REPORTS: dict[int, Report] = {}


def remember(thing: Any, report: Report) -> None:
    """Keep the report of the edit that made a thing."""
    if id(thing) not in _REPORTS:
        weakref.finalize(thing, _REPORTS.pop, id(thing), None)
    _REPORTS[id(thing)] = report


def report_of(thing: Any) -> Report:
    """The report of the edit that made a document or shape.

    Parameters
    ----------
    thing : Document or shape
        What an edit of mracad returned.

    Returns
    -------
    Report
        What was done to each face (``edit.outcomes``, indices count from 0), ``deviations`` (mm), seams ``before`` and
        ``after`` (gaps in mm, angles in degrees), validity, and the ``model`` as it was.

    Raises
    ------
    UsageError
        For a thing that no edit has made.

    Examples
    --------
    >>> report = mracad.report_of(mracad.smooth("assembly.step", scale="5mm"))
    >>> [outcome.face for outcome in report.edit.faces("edited")]
    [6]
    """
    found = thing.reports[-1] if isinstance(thing, Document) and thing.reports else _REPORTS.get(id(thing))
    if found is None:
        raise UsageError(f"{type(thing).__name__}: no edit of mracad made it", "give what an edit returned")
    return found
