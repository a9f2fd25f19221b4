"""What type checkers know of the public names; mypy reads this file, nothing runs it."""

from pathlib import Path
from typing import Any, Literal, assert_type

import mracad
from mracad.job.judge import Judged


class Shape:
    wrapped: Any = None


def files(path: Path) -> None:
    assert_type(mracad.smooth(path, scale=5), mracad.Document)
    assert_type(mracad.smooth("panel.step", scale="5mm", hold=["#3", 4]), mracad.Document)
    assert_type(mracad.check(path, max_gap=0.01), Judged)


def things(document: mracad.Document, shape: Shape, keep: Literal["g1", "g2"]) -> None:
    assert_type(mracad.denoise(document), mracad.Document)
    assert_type(mracad.level(shape, level=2, faces=shape, keep=keep, details="a.mra"), Shape)
    assert_type(mracad.repeat(shape, feature="a.feature", at=[(1, 2, 3)], progress=print), Shape)
    mracad.smooth(5, scale=5)  # type: ignore[call-overload]
    mracad.smooth(shape, scal=5)  # type: ignore[call-overload]
    mracad.smooth(shape, keep="g7")  # type: ignore[call-overload]
