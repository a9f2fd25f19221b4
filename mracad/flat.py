"""Machine code in one piece that runs wherever it lies, so that it takes no library to load.

Of an object file (ELF) for x86-64, whose sections refer to each other by their distance alone.
"""

from __future__ import annotations

import ctypes
import mmap
import platform
import struct
import sys
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from itertools import takewhile
from pathlib import Path

ALIGNED = 64
"""Bytes; no section needs more."""

_HEAD = b"in one piece"

_HERE = sys.platform == "linux" and platform.machine() == "x86_64"
_MACHINE = 62  # EM_X86_64
_DISTANCE = {2, 4}  # R_X86_64_PC32, R_X86_64_PLT32
_SYMBOLS, _ADDENDS, _NO_BITS, _LOADED = 2, 4, 8, 2  # SHT_SYMTAB, SHT_RELA, SHT_NOBITS, SHF_ALLOC


@dataclass
class _Section:
    """A section of an object file, and where it lies in the piece, if it is loaded."""

    kind: int
    flags: int
    data: memoryview
    link: int
    info: int
    place: int = -1


@cache
def processor() -> str:
    """What code for this processor alone depends on; ``""`` where code in one piece is not supported."""
    if not _HERE:
        return ""
    with suppress(OSError), Path("/proc/cpuinfo").open() as file:
        about = (line.partition(":") for line in takewhile(str.strip, file))
        return "|".join(value.strip() for name, _, value in about if name.strip() in ("model name", "flags"))
    return ""


def flat(data: bytes, name: str) -> bytes:
    """The code of an object file in one piece, with where a function starts; the file as it is if that cannot be."""
    if not _HERE or data[:5] != b"\x7fELF\x02" or struct.unpack_from("<H", data, 18) != (_MACHINE,):
        return data
    sections = _sections(data)
    piece = bytearray(ALIGNED)
    for each in sections:
        if each.flags & _LOADED and len(each.data):
            if each.kind == _NO_BITS:
                return data
            piece += bytes(-len(piece) % ALIGNED)
            each.place = len(piece)
            piece += each.data
    symbols = next(each for each in sections if each.kind == _SYMBOLS)
    names = bytes(sections[symbols.link].data)
    known = list(struct.iter_unpack("<IBBHQQ", symbols.data))
    for each in sections:
        if each.kind == _ADDENDS and sections[each.info].place >= 0:
            for at, what, addend in struct.iter_unpack("<QQq", each.data):
                of, value = known[what >> 32][3:5]
                if what & 0xFFFFFFFF not in _DISTANCE or not 0 < of < len(sections) or sections[of].place < 0:
                    return data
                at += sections[each.info].place
                struct.pack_into("<i", piece, at, sections[of].place + value + addend - at)
    word = name.encode() + b"\0"
    begin = next(value + sections[of].place for at, _, _, of, value, _ in known if names.startswith(word, at))
    struct.pack_into(f"<{len(_HEAD)}sI", piece, 0, _HEAD, begin)
    return bytes(piece)


def is_flat(code: bytes) -> bool:
    """Whether code is in one piece."""
    return code.startswith(_HEAD)


def _sections(data: bytes) -> list[_Section]:
    (start,), (size, count) = struct.unpack_from("<Q", data, 40), struct.unpack_from("<HH", data, 58)
    found = []
    for at in range(start, start + count * size, size):
        _, kind, flags, _, begin, length, link, info = struct.unpack_from("<IIQQQQII", data, at)
        found.append(_Section(kind, flags, memoryview(data)[begin : begin + length], link, info))
    return found


def placed(piece: bytes) -> tuple[mmap.mmap, int]:
    """Memory with such code, which nobody may write any more, and the address where the function starts.

    Raises
    ------
    OSError
        When the system allows no new code.
    """
    memory = mmap.mmap(-1, len(piece), mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    memory.write(piece)
    start = ctypes.addressof(ctypes.c_char.from_buffer(memory))
    system = ctypes.CDLL(None, use_errno=True)
    if system.mprotect(ctypes.c_void_p(start), ctypes.c_size_t(len(piece)), mmap.PROT_READ | mmap.PROT_EXEC):
        raise OSError(ctypes.get_errno(), "cannot run new code")
    return memory, start + struct.unpack_from("<I", piece, len(_HEAD))[0]
