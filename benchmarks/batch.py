"""Batches: speed-up by two workers, overhead per file, memory, kills and lost workers.

Usage: python benchmarks/batch.py [FILES [NAME…]]     (default: 200, and every measurement below)

Both sides of every ratio are measured in the same run.  The files are the samples, each made different by a comment;
the recipe smooths and checks them.  On a busy machine compare processor times as well.
"""

from __future__ import annotations

import contextlib
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import psutil

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from mracad.job.batch.find import find  # noqa: E402
from mracad.job.batch.manifest import Manifest  # noqa: E402
from mracad.job.batch.pool import Pool  # noqa: E402
from mracad.job.batch.run import run  # noqa: E402
from mracad.job.batch.settings import Limits, Settings  # noqa: E402
from mracad.job.batch.work import warm  # noqa: E402
from mracad.spec.recipe import load  # noqa: E402
from tests.job.batch.runs import batch, environment, kills, outputs, recipe, shams  # noqa: E402
from tests.job.batch.tasks import work  # noqa: E402
from tests.job.batch.test_cluster import cluster  # noqa: E402

RECIPE = '[[step]]\nuse = "smooth"\nscale = "5%"\n\n[[step]]\nuse = "check"\n'
SAMPLES = ("blade", "bottle", "panel", "trimmed")


def models(folder: Path, count: int) -> Path:
    """Files derived from the samples."""
    folder.mkdir()
    texts = [(ROOT / "samples" / f"{name}.step").read_text() for name in SAMPLES]
    for number in range(count):
        text = texts[number % len(texts)].replace("HEADER;", f"HEADER; /* {number} */", 1)
        (folder / f"{SAMPLES[number % len(texts)]}{number:03}.step").write_text(text)
    return folder


def timed(*words: object) -> float:
    """Seconds of a batch."""
    start = time.perf_counter()
    code, _, err = batch(*words)
    assert code == 0, err
    return time.perf_counter() - start


def cpu() -> float:
    """Processor seconds of all children so far."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def workers(folder: Path, files: int) -> None:
    """Two workers against one, whole commands."""
    words = (recipe(folder, RECIPE), models(folder / "in", files), "-O")
    marks = [cpu()]
    one = timed(*words, folder / "one", "-j", 1)
    marks.append(cpu())
    two = timed(*words, folder / "two", "-j", 2)
    marks.append(cpu())
    same = outputs(folder / "one") == outputs(folder / "two")
    print(f"{files} files: -j 1 {one:.1f} s, -j 2 {two:.1f} s: {one / two:.2f} times as fast; same bytes: {same}")
    print(f"  processor time: -j 1 {marks[1] - marks[0]:.1f} s, -j 2 {marks[2] - marks[1]:.1f} s")


def overhead(folder: Path, files: int) -> None:
    """Wall time besides the work itself, with one warm worker."""
    items = find([str(models(folder / "in", files + 1))], folder / "out")
    with Manifest(folder / "out") as manifest, Pool(1, Limits(), warm) as pool:
        list(run(load(recipe(folder, RECIPE)), items[:1], manifest, pool, Settings()))
        start, used = time.perf_counter(), time.process_time()
        outcomes = list(run(load(recipe(folder, RECIPE)), items[1:], manifest, pool, Settings()))
        wall, used = time.perf_counter() - start, time.process_time() - used
    beside = (wall - sum(outcome.seconds for outcome in outcomes)) / files
    print(
        f"overhead: {beside * 1e3:.1f} ms per file, of {wall / files * 1e3:.0f} ms; "
        f"processor time of the client {used / files * 1e3:.1f} ms per file"
    )


def memory(folder: Path) -> None:
    """Peak memory of the client for few and for many files of 1 MB."""
    peaks = []
    for count in (50, 1000):
        source = shams(folder / f"in{count}", count)
        for path in source.iterdir():
            path.write_text(f"{path}" + "x" * 1_000_000)
        command = [sys.executable, "-m", "mracad_cli", "batch", recipe(folder, RECIPE), source, "-j", "2", "-O"]
        process = subprocess.Popen(
            [*map(str, command), str(folder / f"out{count}")], env=environment(0.0), stdout=subprocess.DEVNULL
        )
        client, peak = psutil.Process(process.pid), 0
        while process.poll() is None:
            with contextlib.suppress(psutil.Error):
                peak = max(peak, client.memory_info().rss)
            time.sleep(0.01)
        peaks.append(peak / 1e6)
    print(f"client's memory: {peaks[0]:.0f} MB for 50 files, {peaks[1]:.0f} MB for 1000")


def flight() -> None:
    """Tiny tasks in flight."""
    with Pool(2) as pool:
        rates = []
        for count in (500, 10_000):
            start = time.perf_counter()
            for future in [pool.submit(work, "good") for _ in range(count)]:
                future.result()
            rates.append((time.perf_counter() - start) / count * 1e3)
    print(f"tiny tasks: {rates[0]:.2f} ms each of 500, {rates[1]:.2f} ms each of 10000")


def killed(folder: Path, files: int, count: int) -> None:
    """The batch killed again and again, then resumed."""
    words = (recipe(folder, RECIPE), models(folder / "in", files), "-j", 2, "-O")
    timed(*words, folder / "whole")
    done = kills(words, folder / "out", count, files)
    timed(*words, folder / "out")
    same = outputs(folder / "out") == outputs(folder / "whole")
    print(f"{count} kills, outputs at each {done} of {files}; resumed: same bytes as undisturbed: {same}")


def lost(folder: Path, files: int) -> None:
    """A cluster of two workers, one killed midway."""
    words = (recipe(folder, RECIPE), models(folder / "in", files), "-O")
    local = timed(*words, folder / "local", "-j", 2)
    with cluster(2) as (address, processes):
        killer = subprocess.Popen(
            [
                sys.executable,
                "-c",
                "import glob, os, sys, time\n"
                "while len(glob.glob(sys.argv[1])) < int(sys.argv[2]): time.sleep(0.01)\n"
                "os.kill(int(sys.argv[3]), 9)",
                str(folder / "out" / "*.step"),
                str(files // 3),
                str(processes[0].pid),
            ]
        )
        remote = timed(*words, folder / "out", "--cluster", address)
        killer.wait()
    same = outputs(folder / "out") == outputs(folder / "local")
    print(f"cluster of 2, one killed at a third: {files} files in {remote:.1f} s (local {local:.1f} s), same: {same}")


def scaled(folder: Path, files: int) -> None:
    """A cluster of two workers beside one, both warm; on a busy machine, the share of time that they work counts."""
    words = (recipe(folder, RECIPE), "--json", "-O")
    few, many = models(folder / "few", 2 * len(SAMPLES)), models(folder / "many", files)
    walls, busy = dict[int, float](), dict[int, float]()
    for count in (1, 2):
        with cluster(count) as (address, processes):
            timed(*words, folder / f"warm{count}", few, "--cluster", address)
            before = sum(map(spent, processes))
            start = time.perf_counter()
            code, out, err = batch(*words, folder / f"out{count}", many, "--cluster", address)
            walls[count] = time.perf_counter() - start
            used = sum(map(spent, processes)) - before
        assert code == 0, err
        lines = [json.loads(line) for line in out.splitlines()]
        work = sum(line["seconds"] for line in lines[:-1])
        busy[count] = work / lines[-1]["summary"]["seconds"] / count
        print(
            f"cluster of {count}: {files} files in {walls[count]:.1f} s; processor time {used:.1f} s; each worker "
            f"works {busy[count]:.1%} of the time between first and last file"
        )
    same = outputs(folder / "out1") == outputs(folder / "out2")
    print(
        f"  two workers are {walls[1] / walls[2]:.2f} times as fast as one, {2 * busy[2] / busy[1]:.2f} times by the "
        f"time that they work; same bytes: {same}"
    )


def waits(folder: Path, files: int) -> None:
    """What a cluster costs beside the work, on a machine of any load: files of 1 MB whose work is to wait for 0.5 s."""
    few, many = shams(folder / "few", 4), shams(folder / "many", files)
    for path in many.iterdir():
        path.write_text(f"{path}" + "x" * 1_000_000)
    words, times = (recipe(folder), "--json", "-O"), []
    for count in (1, 2):
        with cluster(count, sham=0.5) as (address, _):
            batch(*words, folder / f"warm{count}", few, "--cluster", address, sham=0.5)
            code, out, err = batch(*words, folder / f"out{count}", many, "--cluster", address, sham=0.5)
        assert code == 0, err
        times.append(json.loads(out.splitlines()[-1])["summary"]["seconds"])
    beside = (2 * times[1] - 0.5 * files) / files
    print(
        f"cluster, {files} files of 0.5 s each: two workers are {times[0] / times[1]:.2f} times as fast as one; "
        f"{beside * 1e3:.0f} ms per file beside the work"
    )


def spent(process: subprocess.Popen[bytes]) -> float:
    """Processor seconds of a process and its children."""
    top = psutil.Process(process.pid)
    return sum(sum(each.cpu_times()[:2]) for each in (top, *top.children(recursive=True)))


def main() -> None:
    files = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    tasks: dict[str, Callable[[Path], None]] = {
        "workers": lambda folder: workers(folder, files),
        "overhead": lambda folder: overhead(folder, files),
        "memory": memory,
        "flight": lambda folder: flight(),
        "killed": lambda folder: killed(folder, min(files, 100), 20),
        "waits": lambda folder: waits(folder, 40),
        "scaled": lambda folder: scaled(folder, min(files, 100)),
        "lost": lambda folder: lost(folder, min(files, 40)),
    }
    for name in sys.argv[2:] or tasks:
        with tempfile.TemporaryDirectory() as folder:
            tasks[name](Path(folder))
        sys.stdout.flush()


if __name__ == "__main__":
    main()
