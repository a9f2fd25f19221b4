"""Processes that compute results ahead: the same results, from wherever they come."""

import os
import threading

import pytest

from mracad import processes
from mracad.errors import UsageError
from mracad.job import guard
from mracad.processes import Ahead, workers

CAN_FORK = processes._can_fork


@pytest.fixture
def forking(monkeypatch):
    """Processes from the first result on, whatever runs beside the tests; yields the number of those started."""
    started, start = [], Ahead._start

    def counted(self, count):
        started.append(count)
        start(self, count)

    monkeypatch.setattr(processes, "PATIENCE", -1.0)
    monkeypatch.setattr(processes, "_can_fork", lambda: True)
    monkeypatch.setattr(Ahead, "_start", counted)
    monkeypatch.setenv("MRACAD_WORKERS", "3")
    return started


def alive(process):
    return process.exitcode is None


def test_results_come_from_other_processes_which_end(forking):
    with Ahead(lambda key: (key * key, os.getpid())) as found:
        found.expect(range(6))
        results = [found(key) for key in (3, 0, 1, 2, 5, 4, 9)]
        staff = [each.process for each in found._staff]
        assert forking == [3] and all(map(alive, staff))
    assert [square for square, _ in results] == [9, 0, 1, 4, 25, 16, 81]
    assert os.getpid() not in {process for _, process in results[:6]} and not any(map(alive, staff))


def test_results_that_a_process_fails_to_send_are_computed_here(forking):
    here = os.getpid()

    def work(key):
        if key == 1 and os.getpid() != here:
            os._exit(1)
        if key == 2:
            raise ValueError("two")
        return lambda: key  # no pickle

    with Ahead(work) as found:
        found.expect(range(4))
        assert [found(key)() for key in (0, 1, 3)] == [0, 1, 3]
        with pytest.raises(ValueError, match="two"):
            found(2)


@pytest.mark.parametrize("reason", ["one worker", "threads", "short"])
def test_no_processes(forking, monkeypatch, reason):
    if reason == "one worker":
        monkeypatch.setenv("MRACAD_WORKERS", "1")
    if reason == "short":
        monkeypatch.setattr(processes, "PATIENCE", 60.0)
    if reason == "threads":
        monkeypatch.setattr(processes, "_can_fork", CAN_FORK)
    end = threading.Event()
    thread = threading.Thread(target=end.wait)
    thread.start()
    try:
        with Ahead(lambda key: os.getpid()) as found:
            found.expect(range(3))
            assert {found(key) for key in range(3)} == {os.getpid()}
    finally:
        end.set()
        thread.join()


def test_the_number_of_workers(monkeypatch):
    monkeypatch.setenv("MRACAD_WORKERS", "7")
    assert workers() == 7
    monkeypatch.delenv("MRACAD_WORKERS")
    assert workers() >= 1
    for wrong in ("0", "two", "-1"):
        monkeypatch.setenv("MRACAD_WORKERS", wrong)
        with pytest.raises(UsageError, match="MRACAD_WORKERS"):
            workers()


def test_a_process_with_limited_memory_has_no_copies():
    def both():
        return [processes._can_fork(), guard.run(processes._can_fork, bool, memory=4 * 10**9)]

    assert guard.run(both, list) == [True, False]


def test_a_wrong_number_is_told_before_any_work(mracad, samples, tmp_path, monkeypatch):
    monkeypatch.setenv("MRACAD_WORKERS", "many")
    found = mracad("smooth", samples / "panel.step", "--scale", "5mm", "-o", tmp_path / "out.step")
    assert found.code == 2 and "MRACAD_WORKERS is 'many'" in found.err and not list(tmp_path.iterdir())
