"""Results do not depend on the number of threads of linear algebra."""

import io
import os
import subprocess
import sys

from threadpoolctl import threadpool_info, threadpool_limits

import mracad
from mracad.job.batch.pool import Pool
from mracad.occ.files import write
from tests.job.batch.tasks import threads
from tests.occ.shapes import bspline, face_on, save, wavy_poles


def test_smooth_gives_the_same_bytes_with_one_and_two_threads(tmp_path):
    """On a net of this size two threads would change the last bits."""
    path = save(face_on(bspline(wavy_poles(60, 47))), tmp_path / "a.step")
    made = []
    for count in (1, 2):
        with threadpool_limits(count, "blas"):
            stream = io.BytesIO()
            write(mracad.smooth(path, scale="10%"), stream, "brep")
            assert {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"} == {count}
        made.append(stream.getvalue())
    assert made[0] == made[1]


def test_commands_and_workers_take_one_thread_whatever_is_set(monkeypatch):
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "2")
    with Pool(1) as pool:
        assert pool.submit(threads).result() == "1"
    said = "import os, mracad_cli; print(os.environ['OPENBLAS_NUM_THREADS'])"
    assert subprocess.run([sys.executable, "-c", said], capture_output=True, text=True, env=os.environ).stdout == "1\n"
