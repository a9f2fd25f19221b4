"""Work in a child process that is asked to end."""

import os
import signal
import threading
import time

import pytest

from mracad.job import guard


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
