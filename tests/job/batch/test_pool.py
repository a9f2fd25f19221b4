"""A task that ends its worker, oversteps a limit or fails costs itself alone."""

from __future__ import annotations

import os
import pickle
import time

import pytest

from mracad.errors import CrashError, LimitError, UsageError
from mracad.job.batch.pool import Pool
from mracad.job.batch.settings import Limits
from mracad.job.batch.work import Product
from tests.job.batch.tasks import MB, made, work


def test_bad_tasks_cost_themselves_alone():
    bad = {
        "crash": (CrashError, "SIGSEGV"),
        "kill": (LimitError, "killed, most likely for lack of memory; use fewer workers"),
        "exit": (CrashError, "exit code 3"),
        "hang": (LimitError, "time limit of 2 s"),
        "hang at a stage": (LimitError, "time limit of 2 s while looking 'part.step'"),
        "crash at a stage": (CrashError, "(SIGSEGV) while looking 'part.step'"),
        "eat": (LimitError, "memory limit of 400 MB"),
        "wrong": (UsageError, "no"),
        "bug": (CrashError, "EOFError: of a file"),
        "trap": (CrashError, "internal error"),
    }
    with Pool(2, Limits(2.0, 400 * MB)) as pool:
        futures = {f"{what} {i}": pool.submit(work, what) for i, what in enumerate([*bad, "print"])}
        good = [pool.submit(work, "good") for _ in range(20)]
        assert all(future.result() == "good" for future in good)
        for name, future in futures.items():
            what = name.rpartition(" ")[0]
            if what in bad:
                kind, text = bad[what]
                error = future.exception()
                assert isinstance(error, kind) and text in str(error), what
            else:
                assert future.result() == what


def test_what_one_task_was_at_is_not_said_of_the_next():
    with Pool(1, Limits(1.0)) as pool:
        assert pool.submit(work, "note").result() == "note"
        error = pool.submit(work, "hang").exception()
    assert str(error).startswith("exceeded the time limit of 1 s;")


def test_what_a_child_of_a_worker_holds_counts():
    with Pool(1, Limits(30.0, 400 * MB)) as pool:
        error = pool.submit(work, "eat in a child").exception()
    assert isinstance(error, LimitError) and "memory limit of 400 MB" in str(error)


def test_a_worker_does_one_task_after_another():
    with Pool(1) as pool:
        assert len({pool.submit(os.getpid).result() for _ in range(10)}) == 1


def test_what_a_worker_sends_back_is_data(monkeypatch: pytest.MonkeyPatch):
    """Of the type that the function says it returns; nothing in the client unpickles anything."""
    for name in ("load", "loads", "Unpickler"):
        monkeypatch.setattr(pickle, name, None)
    with Pool(1) as pool:
        product = pool.submit(made, 3).result()
        assert product == Product(b"\xff\x00data", ({"edited": 3, "valid": True},), ("lost",), 0.5)
        assert isinstance(pool.submit(work, "wrong").exception(), UsageError)


def test_cancelling_ends_what_is_under_way():
    pool = Pool(1)
    futures = [pool.submit(work, "hang"), pool.submit(work, "good")]
    time.sleep(0.5)
    start = time.monotonic()
    pool.shutdown(cancel_futures=True)
    assert time.monotonic() - start < 5
    assert futures[0].exception() and futures[1].cancelled()
    with pytest.raises(RuntimeError):
        pool.submit(work, "good")


def test_ten_thousand_tasks_in_flight_do_not_slow_the_client():
    with Pool(2) as pool:
        for warm in [pool.submit(work, "good") for _ in range(20)]:
            warm.result()

        def each(count: int) -> float:
            start = time.perf_counter()
            for future in [pool.submit(work, "good") for _ in range(count)]:
                future.result()
            return (time.perf_counter() - start) / count

        few, many = min(each(500) for _ in range(3)), each(10_000)
    print(f"each of 500: {few * 1e3:.2f} ms, each of 10000: {many * 1e3:.2f} ms")
    assert many < 3 * few
