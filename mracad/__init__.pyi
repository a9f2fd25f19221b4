"""Types of the public names of mracad; made by ``make docs`` from the structs of options."""

import os
from collections.abc import Callable, Iterable, Sequence
from typing import Any, BinaryIO, Literal, Protocol, TypeAlias, TypeVar, overload

from mracad.api.document import Document as Document
from mracad.api.document import read as read
from mracad.api.past import report_of as report_of
from mracad.errors import CrashError as CrashError
from mracad.errors import EditError as EditError
from mracad.errors import FileError as FileError
from mracad.errors import LimitError as LimitError
from mracad.errors import MracadError as MracadError
from mracad.errors import UsageError as UsageError
from mracad.inspect.spectrum import Spectrum
from mracad.job.info import Info
from mracad.job.judge import Judged
from mracad.model.brep import Model
from mracad.occ.files import Written
from mracad.view.picture import Rendered

class _Wrapped(Protocol):
    """A shape of CadQuery or build123d."""

    @property
    def wrapped(self) -> Any: ...

class _Kernel(Protocol):
    """A shape of the kernel."""

    def IsSame(self, other: Any, /) -> bool: ...

class _Workplane(Protocol):
    """A workplane of CadQuery."""

    def newObject(self, objlist: Any, /) -> Any: ...

class _Assembly(Protocol):
    """An assembly of CadQuery."""

    def toCompound(self) -> Any: ...

Shape: TypeAlias = Document | _Wrapped | _Kernel | _Workplane | _Assembly
File: TypeAlias = str | os.PathLike[str] | BinaryIO
Source: TypeAlias = File | Shape
Path: TypeAlias = str | os.PathLike[str]
Quantity: TypeAlias = str | float
Faces: TypeAlias = str | int | _Wrapped | _Kernel | _Workplane | Iterable[str | int | _Wrapped | _Kernel]
Progress: TypeAlias = Callable[[str, int, int], Any] | bool | None
Thing = TypeVar("Thing", bound=Shape)

__version__: str

@overload
def smooth(
    thing: File,
    /,
    *,
    scale: Quantity | None = None,
    across: Quantity | None = None,
    along: str | None = None,
    limit_by_curvature: bool = True,
    level: float | None = None,
    faces: Faces = (),
    instance: str | None = None,
    hold: Faces = (),
    keep: Literal['as-is', 'g0', 'g1', 'g2'] = "as-is",
    edges: Literal['coupled', 'slide', 'frozen'] = "coupled",
    fit_g1: Quantity | None = None,
    close_gaps: bool = False,
    gap_tolerance: Quantity = "1e-4mm",
    refine: Literal['auto', 'never'] = "auto",
    amount: float = 1.0,
    max_deviation: Quantity | None = None,
    free_edges: Literal['hold', 'smooth'] = "hold",
    corners: Literal['hold', 'move'] = "hold",
    progress: Progress = None,
) -> Document: ...
@overload
def smooth(
    thing: Thing,
    /,
    *,
    scale: Quantity | None = None,
    across: Quantity | None = None,
    along: str | None = None,
    limit_by_curvature: bool = True,
    level: float | None = None,
    faces: Faces = (),
    instance: str | None = None,
    hold: Faces = (),
    keep: Literal['as-is', 'g0', 'g1', 'g2'] = "as-is",
    edges: Literal['coupled', 'slide', 'frozen'] = "coupled",
    fit_g1: Quantity | None = None,
    close_gaps: bool = False,
    gap_tolerance: Quantity = "1e-4mm",
    refine: Literal['auto', 'never'] = "auto",
    amount: float = 1.0,
    max_deviation: Quantity | None = None,
    free_edges: Literal['hold', 'smooth'] = "hold",
    corners: Literal['hold', 'move'] = "hold",
    progress: Progress = None,
) -> Thing: ...
@overload
def denoise(
    thing: File,
    /,
    *,
    noise: Quantity | None = None,
    method: Literal['wiener', 'spline'] = "wiener",
    strength: float = 1.0,
    outliers: Quantity = 0.0,
    faces: Faces = (),
    instance: str | None = None,
    hold: Faces = (),
    keep: Literal['as-is', 'g0', 'g1', 'g2'] = "as-is",
    edges: Literal['coupled', 'slide', 'frozen'] = "slide",
    fit_g1: Quantity | None = None,
    close_gaps: bool = False,
    gap_tolerance: Quantity = "1e-4mm",
    refine: Literal['auto', 'never'] = "auto",
    amount: float = 1.0,
    max_deviation: Quantity | None = None,
    free_edges: Literal['hold', 'smooth'] = "hold",
    corners: Literal['hold', 'move'] = "hold",
    progress: Progress = None,
) -> Document: ...
@overload
def denoise(
    thing: Thing,
    /,
    *,
    noise: Quantity | None = None,
    method: Literal['wiener', 'spline'] = "wiener",
    strength: float = 1.0,
    outliers: Quantity = 0.0,
    faces: Faces = (),
    instance: str | None = None,
    hold: Faces = (),
    keep: Literal['as-is', 'g0', 'g1', 'g2'] = "as-is",
    edges: Literal['coupled', 'slide', 'frozen'] = "slide",
    fit_g1: Quantity | None = None,
    close_gaps: bool = False,
    gap_tolerance: Quantity = "1e-4mm",
    refine: Literal['auto', 'never'] = "auto",
    amount: float = 1.0,
    max_deviation: Quantity | None = None,
    free_edges: Literal['hold', 'smooth'] = "hold",
    corners: Literal['hold', 'move'] = "hold",
    progress: Progress = None,
) -> Thing: ...
@overload
def offset(
    thing: File,
    /,
    *,
    distance: Quantity,
    inward: bool = False,
    faces: Faces = (),
    instance: str | None = None,
    hold: Faces = (),
    keep: Literal['as-is', 'g0', 'g1', 'g2'] = "as-is",
    edges: Literal['coupled', 'frozen'] = "coupled",
    fit_g1: Quantity | None = None,
    close_gaps: bool = False,
    gap_tolerance: Quantity = "1e-4mm",
    refine: Literal['auto', 'never'] = "auto",
    amount: float = 1.0,
    max_deviation: Quantity | None = None,
    progress: Progress = None,
) -> Document: ...
@overload
def offset(
    thing: Thing,
    /,
    *,
    distance: Quantity,
    inward: bool = False,
    faces: Faces = (),
    instance: str | None = None,
    hold: Faces = (),
    keep: Literal['as-is', 'g0', 'g1', 'g2'] = "as-is",
    edges: Literal['coupled', 'frozen'] = "coupled",
    fit_g1: Quantity | None = None,
    close_gaps: bool = False,
    gap_tolerance: Quantity = "1e-4mm",
    refine: Literal['auto', 'never'] = "auto",
    amount: float = 1.0,
    max_deviation: Quantity | None = None,
    progress: Progress = None,
) -> Thing: ...
@overload
def equalize(
    thing: File,
    /,
    *,
    band: str | Sequence[str] = (),
    faces: Faces = (),
    instance: str | None = None,
    hold: Faces = (),
    keep: Literal['as-is', 'g0', 'g1', 'g2'] = "as-is",
    edges: Literal['coupled', 'slide', 'frozen'] = "coupled",
    fit_g1: Quantity | None = None,
    close_gaps: bool = False,
    gap_tolerance: Quantity = "1e-4mm",
    refine: Literal['auto', 'never'] = "auto",
    amount: float = 1.0,
    max_deviation: Quantity | None = None,
    free_edges: Literal['hold', 'smooth'] = "hold",
    corners: Literal['hold', 'move'] = "hold",
    progress: Progress = None,
) -> Document: ...
@overload
def equalize(
    thing: Thing,
    /,
    *,
    band: str | Sequence[str] = (),
    faces: Faces = (),
    instance: str | None = None,
    hold: Faces = (),
    keep: Literal['as-is', 'g0', 'g1', 'g2'] = "as-is",
    edges: Literal['coupled', 'slide', 'frozen'] = "coupled",
    fit_g1: Quantity | None = None,
    close_gaps: bool = False,
    gap_tolerance: Quantity = "1e-4mm",
    refine: Literal['auto', 'never'] = "auto",
    amount: float = 1.0,
    max_deviation: Quantity | None = None,
    free_edges: Literal['hold', 'smooth'] = "hold",
    corners: Literal['hold', 'move'] = "hold",
    progress: Progress = None,
) -> Thing: ...
@overload
def sweep(
    thing: File,
    /,
    *,
    scale: Quantity,
    at: str | Sequence[float] | Sequence[str | Sequence[float]] = (),
    by: str | Sequence[float] | Sequence[str | Sequence[float]] = (),
    to: str | Sequence[float] | Sequence[str | Sequence[float]] = (),
    radius: Quantity | None = None,
    rotate: str | None = None,
    stretch: str | None = None,
    faces: Faces = (),
    instance: str | None = None,
    hold: Faces = (),
    keep: Literal['as-is', 'g0', 'g1', 'g2'] = "as-is",
    edges: Literal['coupled', 'frozen'] = "coupled",
    fit_g1: Quantity | None = None,
    close_gaps: bool = False,
    gap_tolerance: Quantity = "1e-4mm",
    refine: Literal['auto', 'never'] = "auto",
    amount: float = 1.0,
    max_deviation: Quantity | None = None,
    progress: Progress = None,
) -> Document: ...
@overload
def sweep(
    thing: Thing,
    /,
    *,
    scale: Quantity,
    at: str | Sequence[float] | Sequence[str | Sequence[float]] = (),
    by: str | Sequence[float] | Sequence[str | Sequence[float]] = (),
    to: str | Sequence[float] | Sequence[str | Sequence[float]] = (),
    radius: Quantity | None = None,
    rotate: str | None = None,
    stretch: str | None = None,
    faces: Faces = (),
    instance: str | None = None,
    hold: Faces = (),
    keep: Literal['as-is', 'g0', 'g1', 'g2'] = "as-is",
    edges: Literal['coupled', 'frozen'] = "coupled",
    fit_g1: Quantity | None = None,
    close_gaps: bool = False,
    gap_tolerance: Quantity = "1e-4mm",
    refine: Literal['auto', 'never'] = "auto",
    amount: float = 1.0,
    max_deviation: Quantity | None = None,
    progress: Progress = None,
) -> Thing: ...
@overload
def level(
    thing: File,
    /,
    *,
    level: float | None = None,
    scale: Quantity | None = None,
    faces: Faces = (),
    instance: str | None = None,
    hold: Faces = (),
    keep: Literal['as-is', 'g0', 'g1', 'g2'] = "as-is",
    edges: Literal['coupled', 'frozen'] = "coupled",
    fit_g1: Quantity | None = None,
    close_gaps: bool = False,
    gap_tolerance: Quantity = "1e-4mm",
    refine: Literal['auto', 'never'] = "auto",
    amount: float = 1.0,
    max_deviation: Quantity | None = None,
    details: Path | None = None,
    progress: Progress = None,
) -> Document: ...
@overload
def level(
    thing: Thing,
    /,
    *,
    level: float | None = None,
    scale: Quantity | None = None,
    faces: Faces = (),
    instance: str | None = None,
    hold: Faces = (),
    keep: Literal['as-is', 'g0', 'g1', 'g2'] = "as-is",
    edges: Literal['coupled', 'frozen'] = "coupled",
    fit_g1: Quantity | None = None,
    close_gaps: bool = False,
    gap_tolerance: Quantity = "1e-4mm",
    refine: Literal['auto', 'never'] = "auto",
    amount: float = 1.0,
    max_deviation: Quantity | None = None,
    details: Path | None = None,
    progress: Progress = None,
) -> Thing: ...
@overload
def compose(
    thing: File,
    /,
    *,
    details: Path,
    faces: Faces = (),
    instance: str | None = None,
    hold: Faces = (),
    keep: Literal['as-is', 'g0', 'g1', 'g2'] = "as-is",
    edges: Literal['coupled', 'frozen'] = "coupled",
    fit_g1: Quantity | None = None,
    close_gaps: bool = False,
    gap_tolerance: Quantity = "1e-4mm",
    refine: Literal['auto', 'never'] = "auto",
    amount: float = 1.0,
    max_deviation: Quantity | None = None,
    progress: Progress = None,
) -> Document: ...
@overload
def compose(
    thing: Thing,
    /,
    *,
    details: Path,
    faces: Faces = (),
    instance: str | None = None,
    hold: Faces = (),
    keep: Literal['as-is', 'g0', 'g1', 'g2'] = "as-is",
    edges: Literal['coupled', 'frozen'] = "coupled",
    fit_g1: Quantity | None = None,
    close_gaps: bool = False,
    gap_tolerance: Quantity = "1e-4mm",
    refine: Literal['auto', 'never'] = "auto",
    amount: float = 1.0,
    max_deviation: Quantity | None = None,
    progress: Progress = None,
) -> Thing: ...
@overload
def move(
    thing: File,
    /,
    *,
    to: str | Sequence[float],
    feature: str,
    faces: Faces = (),
    instance: str | None = None,
    hold: Faces = (),
    keep: Literal['as-is', 'g0', 'g1', 'g2'] = "as-is",
    edges: Literal['frozen', 'coupled'] = "coupled",
    taper: Quantity | None = None,
    base: Literal['surroundings', 'level'] = "surroundings",
    band: str | None = None,
    rotate: Quantity = 0.0,
    size: float = 1.0,
    height: float = 1.0,
    mirror: bool = False,
    clip: bool = False,
    progress: Progress = None,
) -> Document: ...
@overload
def move(
    thing: Thing,
    /,
    *,
    to: str | Sequence[float],
    feature: str,
    faces: Faces = (),
    instance: str | None = None,
    hold: Faces = (),
    keep: Literal['as-is', 'g0', 'g1', 'g2'] = "as-is",
    edges: Literal['frozen', 'coupled'] = "coupled",
    taper: Quantity | None = None,
    base: Literal['surroundings', 'level'] = "surroundings",
    band: str | None = None,
    rotate: Quantity = 0.0,
    size: float = 1.0,
    height: float = 1.0,
    mirror: bool = False,
    clip: bool = False,
    progress: Progress = None,
) -> Thing: ...
@overload
def repeat(
    thing: File,
    /,
    *,
    feature: str,
    at: str | Sequence[float] | Sequence[str | Sequence[float]] = (),
    grid: str | None = None,
    polar: str | None = None,
    along: str | None = None,
    fill: str | None = None,
    margin: Quantity | None = None,
    align: str | Sequence[float] | None = None,
    size_by: str | None = None,
    height_by: str | None = None,
    skip_off: bool = False,
    overlap: Literal['add', 'max', 'replace'] = "add",
    jitter: Quantity | None = None,
    spin: Quantity = 0.0,
    seed: int = 0,
    faces: Faces = (),
    instance: str | None = None,
    hold: Faces = (),
    keep: Literal['as-is', 'g0', 'g1', 'g2'] = "as-is",
    edges: Literal['frozen', 'coupled'] = "coupled",
    taper: Quantity | None = None,
    base: Literal['surroundings', 'level'] = "surroundings",
    band: str | None = None,
    rotate: Quantity = 0.0,
    size: float = 1.0,
    height: float = 1.0,
    mirror: bool = False,
    clip: bool = False,
    progress: Progress = None,
) -> Document: ...
@overload
def repeat(
    thing: Thing,
    /,
    *,
    feature: str,
    at: str | Sequence[float] | Sequence[str | Sequence[float]] = (),
    grid: str | None = None,
    polar: str | None = None,
    along: str | None = None,
    fill: str | None = None,
    margin: Quantity | None = None,
    align: str | Sequence[float] | None = None,
    size_by: str | None = None,
    height_by: str | None = None,
    skip_off: bool = False,
    overlap: Literal['add', 'max', 'replace'] = "add",
    jitter: Quantity | None = None,
    spin: Quantity = 0.0,
    seed: int = 0,
    faces: Faces = (),
    instance: str | None = None,
    hold: Faces = (),
    keep: Literal['as-is', 'g0', 'g1', 'g2'] = "as-is",
    edges: Literal['frozen', 'coupled'] = "coupled",
    taper: Quantity | None = None,
    base: Literal['surroundings', 'level'] = "surroundings",
    band: str | None = None,
    rotate: Quantity = 0.0,
    size: float = 1.0,
    height: float = 1.0,
    mirror: bool = False,
    clip: bool = False,
    progress: Progress = None,
) -> Thing: ...
@overload
def transfer(
    thing: File,
    /,
    *,
    source: Path,
    from_: Path | None = None,
    to: str | None = None,
    map: str | Sequence[str] = (),
    mode: Literal['add', 'replace'] = "add",
    blend: str | Sequence[str] = (),
    grow: bool = False,
    seed: int = 0,
    band: str | None = None,
    taper: Quantity | None = None,
    base: Literal['surroundings', 'level'] = "surroundings",
    rotate: Quantity = 0.0,
    size: float = 1.0,
    height: float = 1.0,
    mirror: bool = False,
    clip: bool = False,
    faces: Faces = (),
    instance: str | None = None,
    hold: Faces = (),
    keep: Literal['as-is', 'g0', 'g1', 'g2'] = "as-is",
    edges: Literal['coupled', 'frozen'] = "coupled",
    fit_g1: Quantity | None = None,
    close_gaps: bool = False,
    gap_tolerance: Quantity = "1e-4mm",
    refine: Literal['auto', 'never'] = "auto",
    amount: float = 1.0,
    max_deviation: Quantity | None = None,
    free_edges: Literal['hold', 'smooth'] = "hold",
    corners: Literal['hold', 'move'] = "hold",
    progress: Progress = None,
) -> Document: ...
@overload
def transfer(
    thing: Thing,
    /,
    *,
    source: Path,
    from_: Path | None = None,
    to: str | None = None,
    map: str | Sequence[str] = (),
    mode: Literal['add', 'replace'] = "add",
    blend: str | Sequence[str] = (),
    grow: bool = False,
    seed: int = 0,
    band: str | None = None,
    taper: Quantity | None = None,
    base: Literal['surroundings', 'level'] = "surroundings",
    rotate: Quantity = 0.0,
    size: float = 1.0,
    height: float = 1.0,
    mirror: bool = False,
    clip: bool = False,
    faces: Faces = (),
    instance: str | None = None,
    hold: Faces = (),
    keep: Literal['as-is', 'g0', 'g1', 'g2'] = "as-is",
    edges: Literal['coupled', 'frozen'] = "coupled",
    fit_g1: Quantity | None = None,
    close_gaps: bool = False,
    gap_tolerance: Quantity = "1e-4mm",
    refine: Literal['auto', 'never'] = "auto",
    amount: float = 1.0,
    max_deviation: Quantity | None = None,
    free_edges: Literal['hold', 'smooth'] = "hold",
    corners: Literal['hold', 'move'] = "hold",
    progress: Progress = None,
) -> Thing: ...
def check(
    thing: Source,
    /,
    *,
    max_gap: Quantity | None = None,
    max_angle: Quantity | None = None,
    kink: Quantity = 1.0,
    expect: Path | None = None,
    max_tolerance: Quantity | None = None,
    min_wall: Quantity | None = None,
    layer_limit: Quantity | None = None,
    fail_on: Literal['invalid', 'unknown', 'free-edges', 'unsewn', 'file', 'self-intersection', 'mesh', 'nothing'] | Sequence[Literal['invalid', 'unknown', 'free-edges', 'unsewn', 'file', 'self-intersection', 'mesh', 'nothing']] = ('invalid',),
    progress: Progress = None,
) -> Judged: ...
def compare(
    thing: Source,
    reference: Source,
    /,
    *,
    max_deviation: Quantity = "1e-6mm",
    max_gap_growth: Quantity | None = None,
    max_angle_growth: Quantity | None = None,
    max_volume_change: Quantity | None = None,
    ignore: Literal['faces', 'deviation', 'seams', 'topology', 'validity', 'size', 'assembly', 'names', 'colours', 'layers', 'materials', 'annotations'] | Sequence[Literal['faces', 'deviation', 'seams', 'topology', 'validity', 'size', 'assembly', 'names', 'colours', 'layers', 'materials', 'annotations']] = (),
    progress: Progress = None,
) -> Judged: ...
def info(
    thing: Source,
    /,
    *,
    scale: str | float = "2%",
    keep: Literal['g0', 'g1', 'g2'] = "g1",
    all: bool = False,
    at: str | Sequence[Any] = (),
    progress: Progress = None,
) -> Info: ...
def render(
    thing: Source,
    /,
    *,
    show: str = "shaded",
    view: str | Sequence[float] | Sequence[str | Sequence[float]] = ('iso',),
    fit: Faces = (),
    size: str | tuple[int, int] = "1200x800",
    stripes: int = 36,
    before: Path | None = None,
    wipe: bool = False,
    section: str | Sequence[str] = (),
    comb: bool = False,
    progress: Progress = None,
) -> Rendered: ...
def snapshot(
    thing: Source,
    /,
) -> Model: ...
def spectrum(
    thing: Source,
    /,
    *,
    faces: Faces = (),
    progress: Progress = None,
) -> list[Spectrum]: ...
def write(
    thing: Source,
    target: str | os.PathLike[str] | BinaryIO,
    *,
    format: str = "",
    schema: str = "",
    chord: str | float = "0.02%",
    angle: float | None = None,
    ascii: bool = False,
    scalar: str | Sequence[str] = (),
) -> Written: ...
