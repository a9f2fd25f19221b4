"""Workers on other machines: Dask's ``distributed`` behind the interface of the local pool.

A task goes to a Dask worker and there into a pool of its own (:mod:`mracad.job.batch.pool`).  So limits and crashes
are reported as they are locally, and a bad file never takes a Dask worker down.  When a Dask worker is lost, its
tasks are repeated elsewhere.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from concurrent.futures import CancelledError, Executor, Future
from typing import Any

from mracad.errors import CrashError, FileError
from mracad.job.batch.pool import Pool
from mracad.job.batch.settings import Limits
from mracad.job.batch.work import warm

_pools: dict[Limits, Pool] = {}
_lock = threading.Lock()


class Cluster(Executor):
    """Tasks done by the workers of a Dask cluster.

    Parameters
    ----------
    address : str
        Address of the scheduler, ``"tcp://host:8786"``, or ``"local"`` to start a cluster on this machine.
    limits : Limits
        Limits of each task; by default the memory is that of each worker machine.
    workers : int
        Number of tasks that a local cluster does at a time.
    patience : float
        Seconds to wait for the scheduler and its first worker.

    Raises
    ------
    FileError
        When the cluster cannot be reached or has no workers.
    """

    def __init__(self, address: str, limits: Limits, workers: int = 1, patience: float = 30) -> None:
        import dask
        import distributed

        dask.config.set({"distributed.admin.large-graph-warning-threshold": "1TB"})  # the models travel with the tasks
        self._limits = limits
        self._own = None
        if address == "local":
            self._own = distributed.LocalCluster(
                n_workers=1,
                threads_per_worker=workers,
                processes=False,
                dashboard_address=None,
                memory_limit=0,
                silence_logs=logging.ERROR,
            )
        try:
            self._client = distributed.Client(self._own or address, timeout=patience, set_as_default=False)
            self._client.wait_for_workers(1, timeout=patience)
        except (OSError, TimeoutError, ValueError) as error:
            hint = "start it with 'dask scheduler', and workers with 'dask worker ADDRESS'"
            raise FileError(f"no cluster with workers at {address}", hint) from error
        self._executor = self._client.get_executor(pure=False)

    @property
    def workers(self) -> int:
        """Number of tasks that the cluster can do at a time, at present."""
        return max(1, sum(self._client.nthreads().values()))

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = self._executor.submit(isolated, self._limits, fn, *args, **kwargs)
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        self._executor.shutdown(wait=wait and not cancel_futures)
        self._client.close()
        if self._own:
            while _pools:
                _pools.popitem()[1].shutdown(wait, cancel_futures=cancel_futures)
            self._own.close()


def isolated(limits: Limits, fn: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
    """Call in a process of its own on the machine of this Dask worker."""
    from distributed import get_worker

    with _lock:
        if limits not in _pools:
            _pools[limits] = Pool(get_worker().state.nthreads, limits, warm)
        pool = _pools[limits]
    return pool.submit(fn, *args, **kwargs).result()


def lost(error: Exception) -> Exception:
    """The error of a task; a :class:`CrashError`, as from the local pool, where the cluster lost it."""
    if isinstance(error, CancelledError) or type(error).__module__.startswith("distributed"):
        return CrashError(f"the cluster lost the task ({type(error).__name__})", "see the logs of its workers")
    return error
