"""A Dask cluster on the loopback: a killed worker's files are done elsewhere, with the same bytes."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.job.batch.runs import batch, environment, outputs, recipe, shams, start

pytest.importorskip("distributed")


@contextlib.contextmanager
def cluster(workers: int, sham: float | None = None) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A scheduler and workers as a user starts them: its address, and the workers."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"

    def dask(*words: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "dask", *words, "--no-dashboard"]
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        return subprocess.Popen(command, env=environment(sham), **quiet)

    scheduler = dask("scheduler", "--host", "127.0.0.1", "--port", str(port))
    found = [dask("worker", address, "--nthreads", "1", "--no-nanny", "--host", "127.0.0.1") for _ in range(workers)]
    try:
        yield address, found
    finally:
        for process in [*found, scheduler]:
            process.kill()
            process.wait()


def test_a_lost_worker_costs_nothing(tmp_path: Path):
    folder = shams(tmp_path / "in", 40)
    (folder / "part007.step").write_text("/* crash */")
    words = (recipe(tmp_path), folder, "-O")
    assert batch(*words, tmp_path / "local", "-j", 2, sham=0.0)[0] == 1
    with cluster(2, sham=0.1) as (address, workers):
        process = start(*words, tmp_path / "out", "--cluster", address, sham=0.1)
        limit = time.monotonic() + 60
        while len(outputs(tmp_path / "out")) < 10 and time.monotonic() < limit:
            time.sleep(0.05)
        os.kill(workers[0].pid, signal.SIGKILL)
        out, err = process.communicate(timeout=60)
        assert process.returncode == 1, err
    assert "40 files: 39 done, 1 failed" in out and "crashed (SIGSEGV)" in out
    assert outputs(tmp_path / "out") == outputs(tmp_path / "local")
    code, out, err = batch(*words, tmp_path / "here", "--cluster", "local", "-j", 2, sham=0.0)
    assert code == 1 and "39 done, 1 failed" in out, err
    assert outputs(tmp_path / "here") == outputs(tmp_path / "local")


def test_a_cluster_that_is_not_there_is_named():
    from mracad.errors import FileError
    from mracad.job.batch.cluster import Cluster
    from mracad.job.batch.settings import Limits

    with pytest.raises(FileError, match=r"no cluster with workers at tcp://127\.0\.0\.1:9"):
        Cluster("tcp://127.0.0.1:9", Limits(), patience=1)
