"""A batch: an executor processes its files, and each result is written as it comes."""

from __future__ import annotations

import os
import time
from collections.abc import Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from typing import Any, Literal, Protocol

from mracad.errors import Code, MracadError, UsageError
from mracad.inspect.faults import ReadBack
from mracad.job.batch.cluster import lost
from mracad.job.batch.find import Item
from mracad.job.batch.manifest import Manifest
from mracad.job.batch.settings import Settings
from mracad.job.batch.work import Pages, Product, Work, do
from mracad.spec.recipe import Recipe, record_of
from mracad.store import location, read

AHEAD = 2
"""Files given to the executor per worker: enough that none waits, few enough to hold in memory."""

RETRIED = frozenset({Code.LIMIT, Code.INTERNAL})
"""Errors after which a file may be tried again: limits and crashes."""

Status = Literal["done", "unchanged", "failed", "not tried"]


@dataclass(frozen=True)
class Outcome:
    """What became of one file.

    Attributes
    ----------
    file, output : str
    status : Status
        ``done``; ``unchanged``: an earlier batch did it; ``failed``; ``not tried``: the batch stopped first.
    code : int
        The exit code that a command would have.
    message, hint : str
        Why it failed, and what to do.
    seconds : float
        Time of the work itself; for a file that failed, time since it was given to the executor.
    attempts : int
    steps : tuple of dict
        What each step did, in short.
    warnings : tuple of str
        What had to be guessed or was lost.
    read_back : ReadBack or None
        The output as read back; None where it was not read back.
    page : str
        The file with the page about it, if there is one.
    """

    file: str
    output: str
    status: Status
    code: int = 0
    message: str = ""
    hint: str = ""
    seconds: float = 0.0
    attempts: int = 0
    steps: tuple[dict[str, Any], ...] = ()
    warnings: tuple[str, ...] = ()
    read_back: ReadBack | None = None
    page: str = ""


class Workers(Protocol):
    """An executor that says how many tasks it does at a time."""

    @property
    def workers(self) -> int: ...

    def submit(self, fn: Any, /, *args: Any) -> Future[Any]: ...

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None: ...


def run(
    recipe: Recipe,
    items: Iterable[Item],
    manifest: Manifest,
    executor: Workers,
    settings: Settings,
    pages: Pages | None = None,
) -> Generator[Outcome, None, None]:
    """Take files through a recipe; yields outcomes as they come.

    Parameters
    ----------
    recipe : Recipe
    items : iterable of Item
        Consumed only as fast as they are processed.
    manifest : Manifest
        Manifest of the output folder.
    executor : Workers
        It is shut down when the batch stops early.
    settings : Settings
    pages : Pages, optional
        Makes a page about each file.
    """
    batch = _Batch(recipe, manifest, executor, settings, pages)
    waiting = iter(items)
    stopped = False
    try:
        while True:
            while not stopped and len(batch.pending) < AHEAD * executor.workers:
                item = next(waiting, None)
                if item is None:
                    break
                if outcome := batch.start(item):
                    yield outcome
                    stopped = not settings.keep_going and outcome.status == "failed"
            if stopped or not batch.pending:
                break
            for outcome in batch.finished():
                yield outcome
                stopped = stopped or (not settings.keep_going and outcome.status == "failed")
        left = [task.item for task in batch.pending.values()] + (list(waiting) if stopped else [])
        yield from (Outcome(item.source, item.output, "not tried") for item in left)
    finally:
        if batch.pending:
            executor.shutdown(wait=True, cancel_futures=True)


@dataclass
class _Task:
    """A file that was given to the executor."""

    item: Item
    work: Work
    attempts: int
    start: float


class _Batch:
    """The tasks that are under way."""

    def __init__(
        self, recipe: Recipe, manifest: Manifest, executor: Workers, settings: Settings, pages: Pages | None
    ) -> None:
        self.recipe, self.manifest, self.executor, self.settings = recipe, manifest, executor, settings
        self.pages = pages
        self.pending: dict[Future[Any], _Task] = {}
        self._epoch = os.environ.get("SOURCE_DATE_EPOCH")

    def start(self, item: Item) -> Outcome | None:
        """Give a file to the executor; the outcome instead if it is already done or cannot be done."""
        try:
            steps = self.recipe.steps(item.source)
            named = (*(file for step in steps for file in step.options.files()), *self.settings.scalars.files())
            files = {file: read(file) for file in named}
            data = read(item.source)
            self._check_target(item)
        except MracadError as error:
            return _failed(item, error)
        work = Work(
            location(item.source).name, data, steps, self.settings, item.format, files, self._epoch, pages=self.pages
        )
        try:
            beside = self._record(item, work)
            paged = self.pages is None or self.pages.made(item.output, work.key)
            if paged and self.manifest.done(item.output, work.key):
                self.manifest.put(beside, if_changed=True)
                return Outcome(item.source, item.output, "unchanged", page=self._page(item))
        except MracadError as error:
            return _failed(item, error)
        self._submit(_Task(item, work, 0, 0.0))
        return None

    def finished(self) -> Iterator[Outcome]:
        """Wait for tasks, and write their products."""
        for future in wait(self.pending, return_when=FIRST_COMPLETED).done:
            task = self.pending.pop(future)
            try:
                outcome = self._written(task, future.result())
            except Exception as failure:
                error = lost(failure)
                if not isinstance(error, MracadError):
                    raise
                if error.code in RETRIED and task.attempts <= self.settings.retry:
                    self._submit(task)
                    continue
                outcome = _failed(task.item, error, task)
            yield outcome

    def _submit(self, task: _Task) -> None:
        task.attempts += 1
        task.start = time.perf_counter()
        self.pending[self.executor.submit(do, task.work)] = task

    def _record(self, item: Item, work: Work) -> dict[str, bytes]:
        """The resolved recipe to write beside the output, if asked for."""
        name = f"{item.output}.toml"
        return {name: record_of(work.steps, self.manifest.folder / name).encode()} if self.settings.record else {}

    def _check_target(self, item: Item) -> None:
        target = self.manifest.folder / item.output
        if not (self.settings.overwrite or self.manifest.made(item.output)) and target.exists():
            raise UsageError(f"'{target}' exists and was not made by a batch", "give --overwrite to replace it")

    def _page(self, item: Item) -> str:
        return str(self.pages.place(item.output)) if self.pages else ""

    def _written(self, task: _Task, product: Product) -> Outcome:
        """The outcome of a task, once what it made is in place."""
        output, key = task.item.output, task.work.key
        page = self._page(task.item)
        beside = {str(location(page).resolve()): product.page} if page else {}
        if product.failed:
            self.manifest.put(beside)
        else:
            beside |= self._record(task.item, task.work)
            same = self.settings.if_changed or self.manifest.done(output, key)
            self.manifest.write(output, key, product.data, beside, if_changed=same)
        return Outcome(
            task.item.source,
            output,
            "failed" if product.failed else "done",
            code=int(Code.FAILED_CHECK) if product.failed else 0,
            message=product.failed,
            seconds=product.seconds,
            attempts=task.attempts,
            steps=product.steps,
            warnings=product.warnings,
            read_back=product.read_back,
            page=page,
        )


def _failed(item: Item, error: MracadError, task: _Task | None = None) -> Outcome:
    return Outcome(
        item.source,
        item.output,
        "failed",
        code=int(error.code),
        message=error.message,
        hint=error.hint,
        seconds=time.perf_counter() - task.start if task else 0.0,
        attempts=task.attempts if task else 0,
    )
