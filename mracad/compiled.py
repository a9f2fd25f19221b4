"""Functions on flat arrays as machine code, which is kept on disk and loaded without a compiler.

It is kept beside the bytecode of the function's module, or in the cache of the user where that cannot be written, for
one kind of processor, and used until the modules of its parts or the compiler change.  Code in one piece takes
nothing but memory to load (:mod:`mracad.flat`); any other takes the library of the compiler, 45 MB.
"""

from __future__ import annotations

import contextlib
import ctypes
import hashlib
import os
from collections.abc import Callable, Iterator, Sequence
from functools import cache, cached_property, partial
from importlib.util import cache_from_source
from pathlib import Path
from types import FunctionType
from typing import TYPE_CHECKING, Any

from mracad.cache import SEAL, find, keep, sealed
from mracad.errors import MracadError
from mracad.flat import flat, is_flat, placed, processor
from mracad.note import COMPILING, doing
from mracad.output import put

_NUMBERS = {"float64": ctypes.c_double, "int64": ctypes.c_int64}

if TYPE_CHECKING:
    import numpy as np

Function = Any
_owners: list[Any] = []  # machine code lives as long as they do


class Compiled:
    """A function whose arguments are groups of numbers and pointers to flat arrays, and that returns nothing.

    Parameters
    ----------
    function : callable
        It must neither allocate nor raise.
    arguments : sequence of sequence of str
        Types of the members of each argument, a tuple, or of its only one: ``float64``, ``int64``, or ``float64*`` for
        a pointer.  It is called with all members one after another, and with pointers as integers.
    helpers, inlined : sequence of callable
        Functions that it calls; those of the latter become part of their callers.
    work : (int, int)
        Amounts of work above which it pays to load it, and to compile it.
    """

    def __init__(
        self,
        function: Function,
        arguments: Sequence[Sequence[str]],
        helpers: Sequence[Function] = (),
        inlined: Sequence[Function] = (),
        work: tuple[int, int] = (0, 0),
    ) -> None:
        self._function, self._arguments, self._helpers, self._inlined = function, arguments, helpers, inlined
        self._loaded: Callable[..., None] | None = None
        self._work, self._done, self._used = work, 0, False

    def pays(self, work: int) -> bool:
        """Whether so much more work in this process is a case for it, and it can be had."""
        if not self._used:
            few, many = self._work
            self._done += work
            self._used = (self._done >= many or (self._done >= few and self.ready)) and self.allowed
        return self._used

    @property
    def ready(self) -> bool:
        """Whether it can be had without a compiler."""
        return self._loaded is not None or self._found is not None

    def prepare(self) -> Callable[..., None]:
        """The function as it is called; it is compiled if need be."""
        if self._loaded is None:
            self._loaded = self._load(self._found or self._made())
        return self._loaded

    @cached_property
    def allowed(self) -> bool:
        """Whether the system lets new code run; it is compiled if need be."""
        with contextlib.suppress(OSError):
            return self.prepare() is not None
        return False

    def __call__(self, *arguments: float) -> None:
        """Call it."""
        self.prepare()(*arguments)

    @cached_property
    def _key(self) -> bytes:
        parts = (self._function, *self._helpers, *self._inlined)
        sources = b"".join(Path(each).read_bytes() for each in sorted({part.__code__.co_filename for part in parts}))
        about = "|".join([_version(), processor() or _processor(), repr(self._arguments)])
        return hashlib.sha256(sources + about.encode()).digest()

    @cached_property
    def _name(self) -> str:
        return f"{Path(self._function.__code__.co_filename).stem}.{self._function.__name__}-{self._key.hex()[:16]}.o"

    @property
    def _beside(self) -> Path:
        return Path(cache_from_source(self._function.__code__.co_filename)).with_name(self._name)

    @cached_property
    def _found(self) -> bytes | None:
        return self._on_disk()

    def _on_disk(self) -> bytes | None:
        """The machine code on disk, if it is whole."""
        for place in (self._beside, find(self._name)):
            with contextlib.suppress(OSError):
                data = place.read_bytes() if place else b""
                if data.startswith(self._key) and sealed(data[:-SEAL]) == data:
                    return data[len(self._key) : -SEAL]
        return None

    def _made(self) -> bytes:
        """The machine code, which is stored; by another process, if that was compiling it already."""
        with _alone(Path(self._function.__code__.co_filename).parent):
            found = self._on_disk()
            if found is not None:
                return found
            doing(COMPILING)
            code = self._compiled()
            try:
                self._beside.parent.mkdir(parents=True, exist_ok=True)
                put(sealed(self._key + code), self._beside)
            except (OSError, MracadError):
                keep(self._name, sealed(self._key + code))
            return code

    def _compiled(self) -> bytes:
        from llvmlite import binding
        from numba import njit, types

        def kind(name: str) -> Any:
            return types.CPointer(getattr(types, name[:-1])) if name.endswith("*") else getattr(types, name)

        each = [[kind(name) for name in group] for group in self._arguments]
        signature = types.void(*(group[0] if len(group) == 1 else types.Tuple(group) for group in each))
        made = njit(signature, error_model="numpy")(self._linked(njit))
        (wanted,) = (found.fndesc.llvm_func_name for found in made.overloads.values())
        machine = _machine(binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten())
        module = binding.parse_assembly(made.inspect_llvm(made.signatures[0]))
        for part in [*module.functions, *module.global_variables]:
            if not part.is_declaration:
                part.linkage = "external" if part.name == wanted else "internal"
        module.get_function(wanted).name = _NAME
        passes = binding.create_new_module_pass_manager()
        passes.add_global_dead_code_eliminate_pass()
        passes.run(module, binding.create_pass_builder(machine, binding.create_pipeline_tuning_options()))
        return flat(machine.emit_object(module), _NAME)

    def _linked(self, compiler: Callable[..., Any]) -> Function:
        """The function, with helpers that are compiled when it is."""
        names: dict[str, Any] = {}
        for functions, inline in ((self._inlined, "always"), (self._helpers, "never")):
            for each in functions:
                own = FunctionType(each.__code__, each.__globals__ | names, each.__name__)
                names[each.__name__] = compiler(error_model="numpy", inline=inline)(own)
        for each in self._helpers:
            names[each.__name__].py_func.__globals__.update(names)
        return FunctionType(self._function.__code__, self._function.__globals__ | names, self._function.__name__)

    def _load(self, code: bytes) -> Callable[..., None]:
        owner, start = placed(code) if is_flat(code) else _linked_by_compiler(code)
        _owners.append(owner)
        names = [name for group in self._arguments for name in group]
        kinds: Any = [ctypes.c_void_p if name.endswith("*") else _NUMBERS[name] for name in names]
        native = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, *kinds)
        unused = (ctypes.c_int64 * 2)()  # for a result and an exception, of which there are none
        return partial(native(start), unused, unused)


_NAME = "function"


def pointer(array: np.ndarray) -> int:
    """Where an array is in memory, whose numbers lie there one after another."""
    try:
        return ctypes.addressof(ctypes.c_char.from_buffer(array))  # type: ignore[arg-type]
    except (TypeError, ValueError):  # read-only, or empty: that takes five times as long
        assert array.flags.c_contiguous
        return int(array.__array_interface__["data"][0])


@contextlib.contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Have other processes wait that compile code of the same folder, where the system can do that."""
    try:
        from fcntl import LOCK_EX, flock

        lock = os.open(folder, os.O_RDONLY)
    except (ImportError, OSError):
        yield
        return
    try:
        with contextlib.suppress(OSError):
            flock(lock, LOCK_EX)
        yield
    finally:
        os.close(lock)


@cache
def _version() -> str:
    """The version of the compiler."""
    from importlib.metadata import version  # 10 ms, which small models need not wait for

    return version("llvmlite")


def _processor() -> str:
    from llvmlite import binding

    return str(binding.get_host_cpu_name() + binding.get_host_cpu_features().flatten())


def _linked_by_compiler(code: bytes) -> tuple[Any, int]:
    """The owner of the code of an object file in memory, and its address."""
    from llvmlite import binding

    engine = binding.create_mcjit_compiler(binding.parse_assembly(""), _machine())
    engine.add_object_file(binding.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return engine, engine.get_function_address(_NAME)


def _machine(processor: str = "", features: str = "") -> Any:
    from llvmlite import binding

    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    target = binding.Target.from_default_triple()
    return target.create_target_machine(cpu=processor, features=features, opt=3, reloc="pic", codemodel="small")
