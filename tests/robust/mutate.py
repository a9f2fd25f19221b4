"""Models with faults: ``python -m tests.robust.mutate COUNT [SEED]`` checks as many (see ``make fuzz``).

Each is read, viewed, checked and written again in a child process with a time limit.  Either that works, or it ends in
one line of error; the process neither crashes unseen nor leaves a partial file.
"""

from __future__ import annotations

import io
import os
import random
import re
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from functools import cache, partial
from multiprocessing import get_context
from pathlib import Path

from mracad_cli import __main__ as cli

from mracad.errors import MracadError
from mracad.job import guard
from mracad.occ.files import read, write
from mracad.occ.view import view

SAMPLES = Path(__file__).parents[2] / "samples"
LIMIT = 20.0
"""Seconds for one file."""
NUMBERS = (b"1.E308", b"NaN", b"-0.", b"-1.E308", b"1.E-308", b"0.", b"Inf", b"99999999999999999999")
_NUMBER = re.compile(rb"(?<=[(,])-?\d+\.\d*(?:E[-+]?\d+)?(?=[,)])")
_REFERENCE = re.compile(rb"#\d+(?=[,)])")
_COUNT = re.compile(rb"(?<=[(,])\d+(?=[,)])")


def _spots(pattern: re.Pattern[bytes], text: bytes, rng: random.Random) -> list[re.Match[bytes]]:
    found = list(pattern.finditer(text))
    return rng.sample(found, min(len(found), rng.choice((1, 1, 2, 5, 40))))


def _replaced(pattern: re.Pattern[bytes], word: Callable[[re.Match[bytes]], bytes], text: bytes, rng) -> bytes:
    for match in sorted(_spots(pattern, text, rng), key=lambda m: -m.start()):
        text = text[: match.start()] + word(match) + text[match.end() :]
    return text


def flip_bytes(text: bytes, rng: random.Random) -> bytes:
    data = bytearray(text)
    for _ in range(rng.choice((1, 3, 30))):
        data[rng.randrange(len(data))] = rng.randrange(256)
    return bytes(data)


def drop_lines(text: bytes, rng: random.Random) -> bytes:
    lines = text.splitlines(keepends=True)
    for _ in range(rng.choice((1, 1, 5, 50))):
        del lines[rng.randrange(7, len(lines) - 2)]
    return b"".join(lines)


def swap_lines(text: bytes, rng: random.Random) -> bytes:
    lines = text.splitlines(keepends=True)
    for _ in range(rng.choice((1, 5, 50))):
        a, b = rng.randrange(7, len(lines) - 2), rng.randrange(7, len(lines) - 2)
        lines[a], lines[b] = lines[b], lines[a]
    return b"".join(lines)


def wild_numbers(text: bytes, rng: random.Random) -> bytes:
    return _replaced(_NUMBER, lambda m: rng.choice(NUMBERS), text, rng)


def wild_counts(text: bytes, rng: random.Random) -> bytes:
    words = (b"-1", b"0", b"1", b"1000000", b"2147483648", b"99999999999999999999")
    return _replaced(_COUNT, lambda m: rng.choice(words), text, rng)


def references_to_nowhere(text: bytes, rng: random.Random) -> bytes:
    return _replaced(_REFERENCE, lambda m: b"#999999999", text, rng)


def references_elsewhere(text: bytes, rng: random.Random) -> bytes:
    known = _REFERENCE.findall(text)
    return _replaced(_REFERENCE, lambda m: rng.choice(known), text, rng)


def references_to_themselves(text: bytes, rng: random.Random) -> bytes:
    def itself(match: re.Match[bytes]) -> bytes:
        start = text.rfind(b"\n#", 0, match.start()) + 1
        return text[start : text.find(b" ", start)] or b"#1"

    return _replaced(_REFERENCE, itself, text, rng)


def truncate(text: bytes, rng: random.Random) -> bytes:
    cut = text[: rng.randrange(len(text))]
    return cut + rng.choice((b"", b"\nENDSEC;\nEND-ISO-10303-21;\n", b"';\nENDSEC;\nEND-ISO-10303-21;\n"))


def many_faces(text: bytes, rng: random.Random) -> bytes:
    def claimed(match: re.Match[bytes]) -> bytes:
        faces = match[2].split(b",")
        return match[1] + b",".join(rng.choice(faces) for _ in range(10**5)) + b")"

    return re.sub(rb"(_SHELL\('',\()([^)]*)\)", claimed, text, count=1)


FAULTS = (
    flip_bytes, drop_lines, swap_lines, wild_numbers, wild_numbers, wild_counts, references_to_nowhere,
    references_elsewhere, references_elsewhere, references_to_themselves, truncate,
)  # fmt: skip
OTHERS = {  # faults of the other formats that are read
    "iges": (flip_bytes, drop_lines, swap_lines, wild_numbers, wild_counts, truncate),
    "brep": (flip_bytes, drop_lines, swap_lines, truncate),
    "binbrep": (flip_bytes, truncate),
}
SOURCES = ("assembly", "trimmed", "blade", "bottle")


@cache
def _source(name: str, format: str) -> bytes:
    """A sample in a format."""
    if format == "step":
        return (SAMPLES / f"{name}.step").read_bytes()
    stream = io.BytesIO()
    write(read(SAMPLES / f"{name}.step"), stream, format)
    return stream.getvalue()


def mutant(number: int, seed: int = 0) -> tuple[str, bytes]:
    """The fault and the text of one file."""
    rng = random.Random(f"{seed}/{number}")
    format = ("step", "step", "step", "step", *OTHERS)[number % 7]
    fault = rng.choice(OTHERS.get(format, FAULTS))
    if number % 500 == 499:
        format, fault = "step", many_faces
    return f"{format}, {fault.__name__}", fault(_source(rng.choice(SOURCES), format), rng)


def verdict(number: int, seed: int = 0, limit: float = LIMIT) -> tuple[str, int, str]:
    """The fault, the exit code, and what is wrong with how the command took it, or ``""``."""
    fault, text = mutant(number, seed)
    with tempfile.TemporaryDirectory() as folder:
        source, out = Path(folder, "in.dat"), Path(folder, "work", "out.step")
        out.parent.mkdir()
        source.write_bytes(text)
        words = ["smooth", source, "--scale", "5%", "-o", out, "--time-limit", limit]

        def work() -> int:
            sys.stdout, sys.stderr = (open(Path(folder, name), "w") for name in ("out", "err"))  # noqa: SIM115
            os.dup2(sys.stdout.fileno(), 1)
            os.dup2(sys.stderr.fileno(), 2)
            return cli.main([str(word) for word in words])

        try:
            code = guard.run(work, int, limit + 10)
        except MracadError as error:
            return fault, int(error.code), f"the command itself ended: {error}"
        left = {path.name for path in out.parent.iterdir()}
        return fault, code, _wrong(code, Path(folder, "err").read_text(errors="replace"), left)


def _wrong(code: int, errors: str, left: set[str]) -> str:
    if "Traceback" in errors or "internal error" in errors:
        return errors[-300:]
    if code not in (0, 2, 3, 4, 5, 70):
        return f"exit code {code}"
    if left != ({"out.step"} if code == 0 else set()):
        return f"left {left} with exit code {code}"
    if code and (errors.count("\n") != 1 or not errors.startswith("mracad: ")):
        return f"not one line: {errors[-300:]}"
    return ""


def main(count: int, seed: int) -> int:
    """Check many, print what happened, and return 1 if anything is wrong."""
    codes: Counter[int] = Counter()
    bad = 0
    view(read(SAMPLES / "assembly.step"))  # the children find the kernel loaded
    for format in OTHERS:
        for name in SOURCES:
            _source(name, format)
    with ProcessPoolExecutor(2, get_context("fork")) as pool:
        for number, (fault, code, wrong) in enumerate(pool.map(partial(verdict, seed=seed), range(count))):
            codes[code] += 1
            if wrong:
                bad += 1
                print(f"{number} ({fault}): {wrong}", flush=True)
    print(f"{count} files: " + ", ".join(f"{n} with exit code {code}" for code, n in sorted(codes.items())))
    print(f"{bad} taken wrongly" if bad else "all taken well")
    return 1 if bad else 0


if __name__ == "__main__":
    raise SystemExit(main(int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 0))
