"""Batches in object stores, on servers of this machine: S3 by moto, Google's by gcp-storage-emulator."""

from __future__ import annotations

import json
import logging
import socket
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from mracad.errors import FileError
from mracad.job.batch.find import find
from mracad.job.batch.manifest import TOGETHER, Manifest
from mracad.store import Url, read
from tests.job.batch.runs import FAULTS, batch, recipe

pytest.importorskip("moto")
fsspec = pytest.importorskip("fsspec")
KEYS = ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY")


@pytest.fixture(scope="module")
def server() -> Iterator[str]:
    """The address of a server for S3 with one bucket."""
    from moto.server import ThreadedMotoServer

    logging.getLogger("werkzeug").setLevel(logging.ERROR)
    running = ThreadedMotoServer("127.0.0.1", 0, verbose=False)
    running.start()
    yield f"http://127.0.0.1:{running.get_host_and_port()[1]}"
    running.stop()


@pytest.fixture
def s3(server: str, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """A bucket, whose address and keys are in the environment."""
    for name, value in (("AWS_ENDPOINT_URL", server), ("AWS_DEFAULT_REGION", "us-east-1"), *((k, "k") for k in KEYS)):
        monkeypatch.setenv(name, value)
    _forget()
    system = fsspec.filesystem("s3")
    if not system.exists("bucket"):
        system.mkdir("bucket")
    yield "s3://bucket"
    system.rm("bucket/", recursive=True)
    _forget()


@pytest.fixture
def gs(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """The same of Google's kind."""
    emulator = pytest.importorskip("gcp_storage_emulator.server")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    running = emulator.create_server("127.0.0.1", port, in_memory=True, default_bucket="bucket")
    running.start()
    monkeypatch.setenv("GCSFS_EXPERIMENTAL_ZB_HNS_SUPPORT", "false")  # the emulator does not know it
    monkeypatch.setenv("STORAGE_EMULATOR_HOST", f"http://127.0.0.1:{port}")
    _forget()
    yield "gs://bucket"
    running.stop()
    _forget()


@pytest.fixture
def sham(monkeypatch: pytest.MonkeyPatch) -> None:
    """Workers whose work is a sham."""
    monkeypatch.setenv("SHAM", "0")
    monkeypatch.syspath_prepend(str(FAULTS))


def _forget() -> None:
    """Forget connections, which know the addresses and keys that were."""
    for name in ("s3", "gs"):
        fsspec.get_filesystem_class(name).clear_instance_cache()


def _put(folder: str, *names: str) -> None:
    for name in names:
        Url(f"{folder}/{name}").write_bytes(name.encode())


def _statuses(mracad: Callable[..., Any], *words: object) -> dict[str, str]:
    """What became of each output, of a batch that prints JSON."""
    result = mracad("batch", *words, "-j", 1, "--json")
    assert result.err == ""
    lines = [json.loads(line) for line in result.out.splitlines()[:-1]]
    return {line["output"]: line["status"] for line in lines}


def test_a_batch_in_s3_goes_on_where_it_was(mracad, s3, sham, tmp_path):
    _put(f"{s3}/in", "a.step", "deep/b.stp", "deep/c.iges", "notes.txt", ".hidden.step")
    words = (recipe(tmp_path), f"{s3}/in", "-O", f"{s3}/in/out", "--record", "--report-html", f"{s3}/all.html")
    each = {"a.step": "done", "deep/b.stp": "done", "deep/c.iges": "done"}
    assert _statuses(mracad, *words) == each
    Url(f"{s3}/in/deep/b.stp").write_bytes(b"other")
    Url(f"{s3}/in/out/deep/c.iges").write_bytes(b"spoiled")
    assert _statuses(mracad, *words) == {**each, "a.step": "unchanged"}
    index = read(f"{s3}/all.html").decode()
    assert "all_files/deep/b.stp.html" in index and "0.5" in index
    assert {"a.step", "a.step.toml", "deep/b.stp", "deep/b.stp.toml"} <= set(Url(f"{s3}/in/out").files())

    (tmp_path / "in" / "deep").mkdir(parents=True)
    for name in each:
        (tmp_path / "in" / name).write_bytes(read(f"{s3}/in/{name}"))
    pattern = ("batch", words[0], tmp_path / "in", "-O", f"{s3}/new", "-j", 1, "--junit", f"{s3}/j.xml")
    assert mracad(*pattern).code == 0 and b'tests="3"' in read(f"{s3}/j.xml")
    assert _statuses(mracad, words[0], f"{s3}/in/deep/*.st*p", "-O", tmp_path / "out" / "deep") == {"b.stp": "done"}
    made = read(f"{s3}/in/out/deep/b.stp")
    assert made == read(f"{s3}/new/deep/b.stp") == (tmp_path / "out" / "deep" / "b.stp").read_bytes()


def test_a_dask_cluster_takes_its_models_from_s3(s3, tmp_path):
    pytest.importorskip("distributed")
    _put(f"{s3}/in", "a.step")
    words = (recipe(tmp_path), f"{s3}/in/*.step", "-O", f"{s3}/out", "--cluster", "local", "-j", 1)
    code, out, err = batch(*words, sham=0.0)
    assert code == 0 and out.startswith("1 file: 1 done"), out + err
    assert len(read(f"{s3}/out/a.step")) == 64 * 2000


def test_what_others_made_in_gs_stays(mracad, gs, sham, tmp_path):
    _put(f"{gs}/in", "a.step", "b.step")
    _put(f"{gs}/out", "b.step")
    words = ("batch", recipe(tmp_path), f"{gs}/in/*.step", "-O", f"{gs}/out", "-j", 1)
    result = mracad(*words)
    assert result.code == 1 and "2 files: 1 done, 1 failed" in result.out, result
    assert f"'{gs}/out/b.step' exists and was not made by a batch; give --overwrite" in result.out
    assert read(f"{gs}/out/b.step") == b"b.step" and len(read(f"{gs}/out/a.step")) == 64 * 2000


def test_faults_of_stores_are_one_line_and_exit_code_3(mracad, s3, tmp_path, monkeypatch):
    monkeypatch.setenv("AWS_MAX_ATTEMPTS", "1")
    path, there = recipe(tmp_path), tmp_path / "a.step"
    there.write_text("x")

    def said(*words: object) -> str:
        _forget()
        result = mracad(*words)
        assert result.code == 3 and result.out == "" and result.err.count("\n") == 1, result.err
        return result.err

    assert "'s3://none/*.step': Not Found; check its name" in said(
        "batch", path, "s3://none/*.step", "-O", tmp_path / "out"
    )
    assert "'s3://none/out': there is no such bucket" in said("batch", path, there, "-O", "s3://none/out")
    assert "no models in 's3://bucket/*.step'" in said("batch", path, f"{s3}/*.step", "-O", tmp_path / "out")
    assert "'s3://none/b.step': there is no such bucket" in said("convert", there, "-o", "s3://none/b.step")
    with monkeypatch.context() as without:
        for key in KEYS:
            without.delenv(key)
        for name in ("AWS_CONFIG_FILE", "AWS_SHARED_CREDENTIALS_FILE"):
            without.setenv(name, str(tmp_path / "none"))
        without.setenv("AWS_EC2_METADATA_DISABLED", "true")
        assert "Unable to locate credentials; give credentials where" in said("info", f"{s3}/a.step")
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:9")
    assert "Could not connect to the endpoint" in said("info", f"{s3}/a.step")
    _forget()


def test_a_manifest_in_a_store_survives_kills_and_does_not_rewrite_what_is_long(tmp_path):
    from fsspec.implementations.memory import MemoryFileSystem

    MemoryFileSystem.store.clear()
    folder = Url("memory://out")
    written: list[int] = []
    with pytest.MonkeyPatch.context() as patch:
        whole = Url.write_bytes
        patch.setattr(Url, "write_bytes", lambda url, data: (written.append(len(data)), whole(url, data))[1])
        with Manifest(folder) as manifest:
            for number in range(TOGETHER + 5):
                manifest.write(f"{number}.step", "key", b"made")
    assert max(written) < 200 * TOGETHER and len(Url("memory://out/manifest.*.jsonl").files()) == 2
    killed = Manifest(folder)
    killed._lines.add(json.dumps({"output": "late.step", "key": "key", "sha256": "of what is not there"}).encode())
    with Manifest(folder) as manifest:
        assert all(manifest.done(f"{number}.step", "key") for number in range(TOGETHER + 5))
        assert manifest.made("late.step") and not manifest.done("late.step", "key")
        manifest.write("0.step", "other", b"new")
    with Manifest(folder) as manifest:
        assert manifest.done("0.step", "other") and not manifest.done("0.step", "key")


def test_outputs_in_a_store_do_not_become_inputs(tmp_path: Path):
    from fsspec.implementations.memory import MemoryFileSystem

    MemoryFileSystem.store.clear()
    _put("memory://in", "a.step", "out/a.step", "outer/b.step")
    found = find(["memory://in"], Url("memory://in/out"))
    assert [(item.source, item.output) for item in found] == [
        ("memory://in/a.step", "a.step"), ("memory://in/outer/b.step", "outer/b.step"),
    ]  # fmt: skip
    assert find(["memory://in/a.step"], tmp_path)[0].output == "a.step"
    with pytest.raises(FileError, match="no models in 'memory://in/none/"):
        find(["memory://in/none/*.step"], tmp_path)
