"""Work in a child process that is asked to end."""

import os
import resource
import signal
import threading
import time

import pytest

from mracad.errors import LimitError
from mracad.job import guard, loss


def deaf():
    """Go on for a minute whatever is asked, as while a library works."""
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    time.sleep(60)


def test_a_child_that_does_not_end_when_asked_is_ended(monkeypatch):
    monkeypatch.setattr(guard, "_SOON", 0.2)
    monkeypatch.setattr(guard, "_GRACE", 0.1)
    monkeypatch.setattr(guard, "_TICK", 0.05)
    timer = threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGTERM))
    timer.start()
    start = time.monotonic()
    with pytest.raises(SystemExit) as caught:
        guard.run(deaf, object)
    assert caught.value.code == 128 + signal.SIGTERM and time.monotonic() - start < 10


def test_a_child_that_the_system_kills_did_not_crash(monkeypatch, tmp_path):
    """The system's count of processes that it ended for lack of memory tells why, where there is one."""
    counts = tmp_path / "vmstat"
    monkeypatch.setattr(loss, "_COUNTS", counts)
    for before, after, says in (
        ("nr_free_pages 9\noom_kill 4\n", "nr_free_pages 9\noom_kill 5\n", "memory ran out"),
        ("oom_kill 4\n", "oom_kill 4\n", "most likely for lack of memory"),
        ("", "", "most likely for lack of memory"),
    ):
        counts.write_text(before)

        def work(after=after):
            counts.write_text(after)
            os.kill(os.getpid(), signal.SIGKILL)

        with pytest.raises(LimitError, match=says) as caught:
            guard.run(work, object)
        assert "machine with more" in caught.value.hint


def test_a_limit_of_cpu_time_is_named(monkeypatch):
    monkeypatch.setattr(resource, "getrlimit", lambda _: (7, resource.RLIM_INFINITY))
    for number in (signal.SIGKILL, signal.SIGXCPU):
        with pytest.raises(LimitError, match="7 s of CPU time") as caught:
            guard.run(lambda number=number: os.kill(os.getpid(), number), object)
        assert "ulimit -t" in caught.value.hint
