"""The types of the public names, as the file ``mracad/__init__.pyi`` (``make docs``).

Type checkers and editors read it; the functions themselves are made when they are first used.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterable
from inspect import Parameter, Signature

from mracad.api import looks
from mracad.api.edits import edits, signature
from mracad.api.write import write
from mracad.spec.steps import OWN

HEAD = '''"""Types of the public names of mracad; made by ``make docs`` from the structs of options."""

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
'''


def stub() -> str:
    """The content of the file."""
    lines = [HEAD]
    for use in edits(OWN):
        for given, returned in (("File", "Document"), ("Thing", "Thing")):
            first, *rest = signature(use).parameters.values()
            taken = Signature([first.replace(annotation=given), *rest], return_annotation=returned)
            lines += ["@overload", *_function(use, taken)]
    for look in (looks.check, looks.compare, looks.info, looks.render, looks.snapshot, looks.spectrum, write):
        lines += _function(look.__name__, inspect.signature(look))
    return "\n".join(lines) + "\n"


def _function(name: str, taken: Signature) -> Iterable[str]:
    """A function without a body, its parameters one a line."""
    yield f"def {name}("
    kinds = [parameter.kind for parameter in taken.parameters.values()]
    for place, parameter in enumerate(taken.parameters.values()):
        if parameter.kind == Parameter.KEYWORD_ONLY and kinds[place - 1] != Parameter.KEYWORD_ONLY:
            yield "    *,"
        default = "" if parameter.default is Parameter.empty else f" = {_value(parameter.default)}"
        yield f"    {parameter.name}: {parameter.annotation}{default},"
        if parameter.kind == Parameter.POSITIONAL_ONLY and kinds[place + 1 :][:1] != [Parameter.POSITIONAL_ONLY]:
            yield "    /,"
    yield f") -> {taken.return_annotation}: ..."


def _value(default: object) -> str:
    return f'"{default}"' if isinstance(default, str) else repr(default)
