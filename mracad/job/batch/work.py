"""What a worker does with one file: bytes in, bytes out."""

from __future__ import annotations

import importlib
import os
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mracad import memo, note
from mracad.errors import Code, MracadError
from mracad.inspect.faults import ReadBack
from mracad.job.batch.settings import Settings
from mracad.spec.recipe import Step, title, versions
from mracad.spec.steps import STEPS

if TYPE_CHECKING:
    from mracad.job.document import Report
    from mracad.job.judge import Judged
    from mracad.occ.document import Document


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
        Contents of the files that the steps name.
    epoch : str or None
        ``SOURCE_DATE_EPOCH``.
    versions : mapping
        Versions at the client of the packages that affect the result.
    """

    name: str
    data: bytes = field(repr=False)
    steps: tuple[Step, ...]
    settings: Settings = field(default_factory=Settings)
    format: str = "step"
    files: Mapping[str, bytes] = field(default_factory=dict, repr=False)
    epoch: str | None = None
    versions: Mapping[str, str] = field(default_factory=versions)


@dataclass(frozen=True)
class Product:
    """The output, a summary of each step, warnings, the seconds taken, and the output as read back (None where it was
    not)."""

    data: bytes = field(repr=False)
    steps: tuple[dict[str, Any], ...]
    warnings: tuple[str, ...]
    seconds: float
    read_back: ReadBack | None = None


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
        When a step cannot be done or a check fails.
    """
    from mracad.job.judge import Judged
    from mracad.job.produce import Target, produce

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
    target = Target(work.name, work.format, work.settings.schema or "")
    with tempfile.TemporaryDirectory() as folder:
        steps = _here(work, Path(folder))
        note.doing("reading", work.name)
        document = _read(work)
        done = produce(
            document, lambda: _read(work), steps, [target], title=title(work.steps), verify=work.settings.verify
        )
    last = done.results[-1]
    if isinstance(last, Judged) and not last.passed:
        more = f" (and {len(last.failures) - 1} more)" if len(last.failures) > 1 else ""
        raise MracadError(f"{work.steps[len(done.results) - 1].id}: {last.failures[0]}{more}", code=Code.FAILED_CHECK)
    made = done.made[0]
    short = ({"step": step.id, **_short(result)} for step, result in zip(work.steps, done.results, strict=True))
    lost = (f"the output lacks {what}" for what in made.written.lost)
    warnings = (*document.warnings, *lost, *(f"the output has {cut}" for cut in made.written.cut))
    return Product(made.data, tuple(short), warnings, time.perf_counter() - start, made.read_back)


def _read(work: Work) -> Document:
    from mracad.occ.files import read
    from mracad.occ.load import Text

    return read(Text(work.data, work.name), work.settings.input_unit, work.settings.encoding)


def _here(work: Work, folder: Path) -> list[Step]:
    """The steps, with the files that they name copied into a folder of this machine."""
    places: dict[str, str] = {}
    for number, (name, data) in enumerate(work.files.items()):
        place = folder / str(number) / Path(name).name
        place.parent.mkdir()
        place.write_bytes(data)
        places[name] = str(place)
    return [replace(step, options=step.options.relocated(places)) for step in work.steps]


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
