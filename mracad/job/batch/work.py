"""What a worker does with one file: bytes in, bytes out."""

from __future__ import annotations

import importlib
import json
import os
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from msgspec import structs

from mracad import memo, note
from mracad.errors import MracadError
from mracad.formats import FORMATS
from mracad.inspect.faults import ReadBack
from mracad.job.batch.manifest import digest
from mracad.job.batch.settings import Settings
from mracad.spec.recipe import Step, versions
from mracad.spec.steps import STEPS
from mracad.store import Location, location

if TYPE_CHECKING:
    from mracad.job.document import Report
    from mracad.job.judge import Judged
    from mracad.job.produce import Production
    from mracad.occ.document import Document


class Pages(Protocol):
    """What makes a page about each file; sent to the workers, which draw."""

    def place(self, output: str) -> Location:
        """The file for the page about an output."""

    def made(self, output: str, key: str) -> bool:
        """Whether there is a page of the work with this key."""

    def draw(self, before: Document, steps: Sequence[Step], done: Production, key: str) -> bytes:
        """The page about a file that was taken through steps."""


@dataclass(frozen=True)
class Work:
    """One file and its steps: everything that the result depends on, so that any machine can do it.

    Attributes
    ----------
    name : str
        Name of the file, without its folder.
    data : bytes
        Its content.
    steps : tuple of Step
    settings : Settings
    format : str
        Format of the output.
    files : mapping
        Contents of the files that the steps and the settings name.
    epoch : str or None
        ``SOURCE_DATE_EPOCH``.
    versions : mapping
        Versions at the client of the packages that affect the result.
    pages : Pages or None
        What makes a page about the file, if one is wanted.
    """

    name: str
    data: bytes = field(repr=False)
    steps: tuple[Step, ...]
    settings: Settings = field(default_factory=Settings)
    format: str = "step"
    files: Mapping[str, bytes] = field(default_factory=dict, repr=False)
    epoch: str | None = None
    versions: Mapping[str, str] = field(default_factory=versions)
    pages: Pages | None = field(default=None, repr=False)

    @cached_property
    def key(self) -> str:
        """A hash of everything that the output depends on."""
        files = {location(name).name: digest(data) for name, data in self.files.items()}
        steps = [[step.use, step.id, structs.asdict(step.options)] for step in self.steps]
        how = self.settings
        parts: list[Any] = [self.name, digest(self.data), steps, dict(self.versions), files]
        if FORMATS[self.format].kind == "mesh":
            parts.append([how.chord, how.angle, how.ascii_stl, how.scalars.scalar])
        return digest(
            json.dumps(
                [*parts, how.input_unit, how.encoding, self.format, how.schema or "", how.verify, self.epoch],
                sort_keys=True,
            ).encode()
        )


@dataclass(frozen=True)
class Product:
    """What became of a file.

    Attributes
    ----------
    data : bytes
        The output; empty where a check failed.
    steps : tuple of dict
        A summary of each step.
    warnings : tuple of str
    seconds : float
    read_back : ReadBack or None
        The output as read back; None where it was not.
    page : bytes
        The page about it, if one was wanted.
    failed : str
        The check that failed, and why; empty where all passed.
    """

    data: bytes = field(repr=False)
    steps: tuple[dict[str, Any], ...]
    warnings: tuple[str, ...]
    seconds: float
    read_back: ReadBack | None = None
    page: bytes = field(default=b"", repr=False)
    failed: str = ""


def warm() -> None:
    """Load what the steps need."""
    kernel = (f"mracad.occ.{name}" for name in ("files", "view", "apply", "check"))
    for module in (*kernel, *(struct.function.partition(":")[0] for struct in STEPS.values())):
        importlib.import_module(module)


def do(work: Work) -> Product:
    """Take one file through its steps.

    Raises
    ------
    MracadError
        When a step cannot be done, or the page cannot be made.
    """
    from mracad.job.output import Target
    from mracad.job.produce import produce

    start = time.perf_counter()
    for name, version in versions().items():
        if version != work.versions.get(name):
            text = f"the worker has {name} {version}, not {work.versions.get(name)}"
            raise MracadError(text, "install the same versions there")
    if work.epoch is None:
        os.environ.pop("SOURCE_DATE_EPOCH", None)
    else:
        os.environ["SOURCE_DATE_EPOCH"] = work.epoch
    memo.clear()
    how = work.settings
    mesh = how.chord, how.angle, how.ascii_stl
    with tempfile.TemporaryDirectory() as folder:
        places = _here(work, Path(folder))
        steps = [replace(step, options=step.options.relocated(places)) for step in work.steps]
        scalars = how.scalars.relocated(places)
        target = Target(work.name, work.format, how.schema or "", *mesh, scalars=scalars)
        note.doing("reading", work.name)
        document = _read(work)
        done = produce(document, lambda: _read(work), steps, [target], verify=how.verify)
    page = b""
    if work.pages:
        note.doing("drawing the page")
        page = work.pages.draw(_read(work), work.steps, done, work.key)
    short = tuple({"step": step.id, **_short(result)} for step, result in zip(work.steps, done.results, strict=False))
    seconds = time.perf_counter() - start
    if not done.made:
        return Product(b"", short, tuple(document.warnings), seconds, page=page, failed=_failure(work, done))
    made = done.made[0]
    lost = (f"the output lacks {what}" for what in made.written.lost)
    warnings = (*document.warnings, *lost, *(f"the output has {cut}" for cut in made.written.cut))
    return Product(made.data, short, warnings, seconds, made.read_back, page)


def _failure(work: Work, done: Production) -> str:
    """The check that failed, and why."""
    from mracad.job.judge import Judged

    last = done.results[-1]
    assert isinstance(last, Judged)
    more = f" (and {len(last.failures) - 1} more)" if len(last.failures) > 1 else ""
    return f"{work.steps[len(done.results) - 1].id}: {last.failures[0]}{more}"


def _read(work: Work) -> Document:
    from mracad.occ.files import read
    from mracad.occ.load import Text

    return read(Text(work.data, work.name), work.settings.input_unit, work.settings.encoding)


def _here(work: Work, folder: Path) -> dict[str, str]:
    """The places of the files that the steps and the settings name, copied into a folder of this machine."""
    places: dict[str, str] = {}
    for number, (name, data) in enumerate(work.files.items()):
        place = folder / str(number) / location(name).name
        place.parent.mkdir()
        place.write_bytes(data)
        places[name] = str(place)
    return places


def _short(result: Report | Judged) -> dict[str, Any]:
    """A summary of what a step did, without the long lists."""
    from mracad.job.judge import Judged

    if isinstance(result, Judged):
        return {"passed": result.passed}
    return {
        "edited": len(result.edit.faces("edited")),
        "faces": len(result.edit.outcomes),
        "deviation": max((d.largest for d in result.deviations), default=0.0),
        "valid": result.valid_after.valid,
    }
