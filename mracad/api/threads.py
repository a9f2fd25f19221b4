"""Linear algebra in one thread, as on the command line."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def one_thread() -> Iterator[None]:
    """Keep linear algebra in the block to one thread: the same bytes on every machine, and no time lost in waiting."""
    import scipy.linalg  # noqa: F401  # its threads can only be limited once it is loaded
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1, "blas"):
        yield
