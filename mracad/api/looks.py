"""Functions that look at models and change nothing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import wraps
from inspect import Parameter, Signature, cleandoc
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from mracad.api.progress import Progress, shown
from mracad.api.speech import speaking
from mracad.api.things import Source, opened
from mracad.api.threads import one_thread
from mracad.api.values import bound, chosen, described, parameters
from mracad.errors import UsageError
from mracad.spec.pictures import Picture
from mracad.spec.places import spot
from mracad.spec.steps import Check, Compare, Options, Selection

if TYPE_CHECKING:
    from mracad.inspect.spectrum import Spectrum
    from mracad.job.info import Info
    from mracad.job.judge import Judged
    from mracad.model.brep import Model
    from mracad.view.picture import Rendered

Function = Callable[..., Any]


def _declared(
    struct: type[Options], *leading: Parameter, without: Sequence[str] = ()
) -> Callable[[Function], Function]:
    """Give a function the keywords of a struct: its signature, and their description in place of ``{options}``."""

    def decorate(function: Function) -> Function:
        own = parameters(struct, without)
        progress = Parameter("progress", Parameter.KEYWORD_ONLY, default=None, annotation="Progress")
        taken = Signature([*leading, *own, progress], return_annotation=function.__annotations__["return"])

        @wraps(function)
        def call(*things: Any, **given: Any) -> Any:
            bound(function.__name__, taken, given, *things)
            with speaking(), one_thread(), shown(given.pop("progress", None)) as tell:
                return function(*things, given, tell)

        call.__doc__ = cleandoc(function.__doc__ or "").replace("{options}", described(struct, own))
        vars(call)["__signature__"] = taken
        return call

    return decorate


THING, REFERENCE = (Parameter(name, Parameter.POSITIONAL_ONLY, annotation="Source") for name in ("thing", "reference"))


@_declared(Check, THING)
def check(thing: Any, given: dict[str, Any], tell: Function) -> Judged:
    """Check a model layer by layer: the file, its shapes, closed shells, seams, faces that cross, tolerances, walls.

    Parameters
    ----------
    thing : path, binary stream, Document or shape
        Only for a path or stream the file itself is judged, and slow layers are checked without being asked for.
    {options}
    progress : callable or bool, optional
        As for edits.

    Returns
    -------
    Judged
        ``passed``, ``failures`` (texts), and the ``verdict`` with its layers.

    Raises
    ------
    FileError
        For a file that cannot be read.
    UsageError
        For options that do not make sense.

    Examples
    --------
    >>> found = mracad.check("assembly.step", max_gap="0.001mm")
    >>> found.passed, found.failures
    (True, [])
    """
    from mracad.job.check import check

    whole = opened(thing, change=False)
    tell("checking", 0, 1)
    return check(
        whole.document, chosen(Check, given, whole), text=None if whole.text is None else whole.text.getvalue()
    )


@_declared(Compare, THING, REFERENCE, without=("reference", "reference_unit"))
def compare(thing: Any, reference: Any, given: dict[str, Any], tell: Function) -> Judged:
    """Compare a model with a reference; faces are matched by shape.

    Parameters
    ----------
    thing, reference : path, binary stream, Document or shape
    {options}
    progress : callable or bool, optional
        As for edits.

    Returns
    -------
    Judged
        ``passed``, ``failures`` (texts), and the ``verdict`` with its layers.

    Raises
    ------
    FileError
        For a file that cannot be read.
    UsageError
        For options that do not make sense.

    Examples
    --------
    >>> document = mracad.read("assembly.step")
    >>> mracad.compare(document, "assembly.step", max_deviation="0.01mm").passed
    True
    """
    from mracad.job.compare import compare

    old, new = (opened(each, change=False) for each in (reference, thing))
    tell("comparing", 0, 1)
    return compare(new.document, chosen(Compare, given, new), lambda: old.document)


@_declared(Picture, THING)
def render(thing: Any, given: dict[str, Any], tell: Function) -> Rendered:
    """Draw a model: shaded, or with zebra stripes, isophotes, curvature, deviation or the numbers of its faces.

    Parameters
    ----------
    thing : path, binary stream, Document or shape
        Of a Document that edits have made, ``deviation`` alone is from the input, and ``treatment`` shows what became
        of its faces.
    {options}
    progress : callable or bool, optional
        As for edits.

    Returns
    -------
    Rendered
        ``data`` is the PNG; ``lowest`` and ``highest`` are the extreme numbers of a map, in its ``unit``.

    Raises
    ------
    FileError
        For a file that cannot be read, or a model that cannot be drawn.
    UsageError
        For options that do not make sense.

    Examples
    --------
    >>> picture = mracad.render("assembly.step", show="curvature:gauss", size="300x200")
    >>> picture.unit, picture.data[1:4]
    ('1/mm²', b'PNG')
    """
    from mracad.job.output import drawn
    from mracad.spec.pictures import show_of, unedited

    whole = opened(thing, change=False)
    document, wanted = whole.document, chosen(Picture, given, whole)
    show = show_of(wanted.show)
    if not document.reports:
        unedited(show, hint="give a Document that an edit returned")
        if wanted.wipe and not wanted.before:
            raise UsageError("wipe: there is no other model", "add --before REF.step")
    tell("drawing", 0, 1)
    return drawn(document, wanted, document.original, list(zip(document.steps, document.reports, strict=True)))


@_declared(Selection, THING, without=("instance", "hold", "keep", "edges"))
def spectrum(thing: Any, given: dict[str, Any], tell: Function) -> list[Spectrum]:
    """Measure how high the waves on NURBS faces are, by wavelength and direction, and where the shape begins.

    Parameters
    ----------
    thing : path, binary stream, Document or shape
    {options}
    progress : callable or bool, optional
        As for edits.

    Returns
    -------
    list of Spectrum
        One for each NURBS face: the bands along u and along v, heights in mm.

    Raises
    ------
    FileError
        For a file that cannot be read.
    UsageError
        For faces that do not exist.

    Examples
    --------
    >>> found = mracad.spectrum("assembly.step", faces=6)
    >>> len(found), found[0].faces
    (1, (6,))
    """
    from mracad.inspect.spectrum import spectra
    from mracad.job.look import looked_at
    from mracad.spec.select import NURBS

    whole = opened(thing, change=False)
    model, scope = looked_at(whole.document, chosen(Selection, given, whole))
    every = [i for i in sorted(scope.chosen) if model.faces[i].kind in NURBS]
    found = []
    for done, face in enumerate(every):
        tell("measuring waves", done, len(every))
        found += spectra(model, [face])
    return found


def info(
    thing: Source,
    /,
    *,
    scale: str | float = "2%",
    keep: Literal["g0", "g1", "g2"] = "g1",
    all: bool = False,
    at: str | Sequence[Any] = (),
    progress: Progress = None,
) -> Info:
    """Look at a model: units, faces, the scales of their detail, seams, validity.

    Parameters
    ----------
    thing : path, binary stream, Document or shape
    scale : str or float
        Scale at which to look for detail, a length.
    keep : {"g0", "g1", "g2"}
        Continuity that edges keep; it determines which control points are free.
    all : bool
        Also measure the area and centre of each face.
    at : str or numbers, or sequence of these
        Also tell the face nearest to X,Y,Z (mm), or #3@u,v, with its parameters, frame and curvature there.
    progress : callable or bool, optional
        As for edits.

    Returns
    -------
    Info

    Raises
    ------
    FileError
        For a file that cannot be read.
    UsageError
        For a malformed scale or point.

    Examples
    --------
    >>> info = mracad.info("assembly.step", all=True)
    >>> len(info.model.faces), info.valid.valid, round(info.sizes[6][0].area)  # mm²
    (15, True, 1377)
    """
    from mracad.job.info import info

    with speaking(), shown(progress) as tell:
        points = [spot(p if isinstance(p, str) else ",".join(map(str, p)), "at") for p in _rows(at)]
        whole = opened(thing, change=False)
        return info(whole.document, str(scale), keep, sized=all, places=points, progress=tell)


def snapshot(thing: Source, /) -> Model:
    """The geometry of a model as plain arrays.

    Parameters
    ----------
    thing : path, binary stream, Document or shape

    Returns
    -------
    Model
        Surfaces with their nets (control points ``(nu, nv, 3)``, mm), faces, edges with samples.

    Raises
    ------
    FileError
        For a file that cannot be read.

    Examples
    --------
    >>> model = mracad.snapshot("assembly.step")
    >>> model.surfaces[0].net.poles.shape
    (29, 17, 3)
    """
    from mracad.job.look import snapshot

    with speaking():
        return snapshot(opened(thing, change=False).document)


def _rows(at: Any) -> Sequence[Any]:
    """Points, of which a single one may be given."""
    return [at] if isinstance(at, str) or (np.ndim(at) == 1 and len(at)) else at
