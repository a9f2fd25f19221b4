"""Progress of work, for a callback or as a bar."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeAlias

Call = Callable[[str, int, int], Any]

Progress: TypeAlias = Call | bool | None


@contextmanager
def shown(progress: Progress) -> Iterator[Call]:
    """What to call with the stage, the steps done and the steps in all; True is a bar by tqdm, if that is installed."""
    if callable(progress):
        yield progress
        return
    try:
        from tqdm.auto import tqdm
    except ImportError:
        progress = False
    if not progress:
        yield lambda stage, done, total: None
        return
    with tqdm(leave=False) as bar:

        def tell(stage: str, done: int, total: int) -> None:
            bar.set_description(stage, refresh=False)
            bar.total, bar.n = total, done
            bar.refresh()

        yield tell
