"""Files with faults, kills, limits and crashes: an error message, and never a partial file."""

import ctypes
import faulthandler
import fcntl
import os
import subprocess
import sys
import time

import pytest

from mracad import note, output
from mracad.errors import Code, EditError, FileError, MracadError
from mracad.inspect.verdict import Finding, Layer
from mracad.job import guard
from mracad.job.batch.manifest import Manifest
from mracad.occ.check import check
from mracad.occ.files import read
from tests.robust import kill, mutate

NUMBERS = (*range(10), 499)


@pytest.mark.parametrize("number", NUMBERS)
def test_a_file_with_faults(number):
    fault, code, wrong = mutate.verdict(number, limit=4)
    assert not wrong, (fault, code, wrong)


def test_kills_leave_the_old_file_or_the_new_one():
    assert not kill.kills(10)


def test_what_killed_writers_left_is_removed(tmp_path):
    with output.beside(tmp_path / "out.step") as made:
        name = made.name
    left, held, young = (tmp_path / name.replace(name[8:16], digits * 8) for digits in "abc")
    for path in (left, held, young):
        path.write_bytes(b"part of a file")
    for path in (left, held):
        os.utime(path, (0, 0))
    with held.open() as writer:
        fcntl.flock(writer, fcntl.LOCK_EX)
        output.put(b"whole", tmp_path / "out.step")
    assert {path.name for path in tmp_path.iterdir()} == {held.name, young.name, "out.step"}


def test_files_of_the_user_are_not_taken_for_those_of_killed_writers(tmp_path):
    own = [tmp_path / name for name in (".mracad-notes", ".mracad-batch-list.txt", f".mracad-{'ab' * 15}.part")]
    for path in own:
        path.write_text("of the user")
        os.utime(path, (0, 0))
    output.put(b"whole", tmp_path / "out.step")
    with Manifest(tmp_path) as manifest:
        manifest.write("two.step", "key", b"whole")
    assert all(path.read_text() == "of the user" for path in own)


def test_files_are_written_all_or_none(tmp_path):
    """One that cannot be written, or a reader that went away before, leaves the others as they were."""
    one, two = tmp_path / "one", tmp_path / "two"
    one.write_text("old")
    with pytest.raises(FileError, match="no/two"):
        output.put_all({one: b"new", tmp_path / "no" / "two": b"new"})
    with pytest.raises(BrokenPipeError):
        output.put_all({one: b"new", two: b"new"}, last=lambda: os.write(closed(), b"lines"))
    assert one.read_text() == "old" and [path.name for path in tmp_path.iterdir()] == ["one"]
    output.put_all({one: b"new", two: b"new"})
    assert one.read_text() == two.read_text() == "new"


def closed():
    """A pipe without a reader."""
    reader, writer = os.pipe()
    os.close(reader)
    return writer


def test_a_file_that_is_being_written_is_not_taken_for_one_that_was_left(tmp_path):
    with output.beside(tmp_path / "slow.step") as slow:
        os.utime(slow, (0, 0))
        output.put(b"whole", tmp_path / "out.step")
        assert slow.exists()
        slow.write_bytes(b"late")
    assert (tmp_path / "slow.step").read_bytes() == b"late"


def test_a_child_checks_models_after_its_parent_has(samples):
    """The threads that the kernel started in the parent are not in the child, which must not wait for them."""
    document = read(samples / "blade.step")
    assert check(document).valid
    assert guard.run(lambda: check(document).valid, bool, 60)


def crash():
    faulthandler.disable()
    ctypes.string_at(0)


def abort():
    faulthandler.disable()
    os.abort()


def hang():
    while True:
        pass


def hungry():
    return len(bytes(10**8))


@pytest.mark.parametrize(
    ("work", "code", "says"),
    [
        (crash, Code.INTERNAL, "SIGSEGV"),
        (abort, Code.INTERNAL, "SIGABRT"),
        (hang, Code.LIMIT, "time limit of 0.3 s"),
    ],
)
def test_a_crash_or_an_endless_loop_is_an_error(work, code, says):
    start = time.monotonic()
    with pytest.raises(MracadError, match=says) as error:
        guard.run(work, object, 0.3)
    assert error.value.code == code and error.value.hint and time.monotonic() - start < 3


def test_a_crash_says_what_it_was_at():
    def work():
        note.doing("reading", "bad.step")
        note.doing("editing")
        crash()

    with pytest.raises(MracadError, match=r"crashed \(SIGSEGV\) while editing 'bad.step'"):
        guard.run(work, object)


def test_outputs_that_take_their_places_are_not_cut_off(tmp_path):
    def work():
        output.put(b"whole", tmp_path / "out.step")
        time.sleep(0.6)
        return "done"

    assert guard.run(work, str, 0.3) == "done"


def test_too_much_memory_is_an_error():
    with pytest.raises(MracadError, match="memory limit of 1 MB") as error:
        guard.run(hungry, int, memory=10**6)
    assert error.value.code == Code.LIMIT
    assert guard.run(hungry, int, memory=3 * 10**9) == 10**8


def test_libraries_have_words_for_memory_that_ran_out():
    def work():
        raise ImportError("libz.so: failed to map segment from shared object")

    with pytest.raises(MracadError, match="out of memory") as error:
        guard.run(work, object)
    assert error.value.code == Code.LIMIT


def unloadable():
    raise ImportError("initialization failed")  # all that pybind11 says when a module runs out of memory


def test_a_library_that_does_not_load_under_a_limit_has_too_little_memory():
    with pytest.raises(MracadError, match="memory limit of 3000 MB"):
        guard.run(unloadable, int, memory=3 * 10**9)
    with pytest.raises(MracadError, match="internal error: ImportError"):
        guard.run(unloadable, int)


def test_results_and_errors_come_back():
    assert guard.run(lambda: {"a": [1, 2]}, dict, 60) == {"a": [1, 2]}
    for kind in (EditError, FileError):

        def work(kind=kind):
            raise kind("what", "why")

        with pytest.raises(kind) as error:
            guard.run(work, object)
        assert (error.value.message, error.value.hint) == ("what", "why")


class Trap:
    """What would do harm were it unpickled."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return os.mkdir, (str(self.path),)


def test_what_a_child_sends_is_data(tmp_path):
    def raising():
        raise OSError(Trap(tmp_path / "trap"))

    for work in (lambda: Trap(tmp_path / "trap"), raising):
        with pytest.raises(MracadError, match="internal error") as error:
            guard.run(work, object)
        assert error.value.code == Code.INTERNAL and not list(tmp_path.iterdir())
    layer = Layer("mesh", "fail", "text", (Finding("rule", (1, 2), None, (1.0, 2.0, 3.0)),), {"a": {"b": 1}})
    assert guard.run(lambda: layer, Layer) == layer


def test_an_error_may_name_a_file_that_is_not_unicode():
    def work():
        raise FileError("cannot read 'caf\udce9.step'", "rename it")

    with pytest.raises(FileError, match=r"caf\\udce9.step"):
        guard.run(work, object)


def test_work_that_ends_before_its_limit_is_not_waited_for(monkeypatch):
    monkeypatch.setattr(guard, "_TICK", 60.0)
    start = time.perf_counter()
    assert guard.run(lambda: "done", str, 120, 4 * 10**9) == "done"
    assert time.perf_counter() - start < 30


def command(*words):
    return subprocess.run(
        [sys.executable, "-m", "mracad_cli", *map(str, words)], capture_output=True, text=True, timeout=60
    )


def test_limits_on_the_command_line(mracad, samples, tmp_path):
    out = tmp_path / "out.step"
    words = ["smooth", samples / "panel.step", "--scale", "16mm", "-o", out]
    late = command(*words, "--time-limit", "0.005min")
    assert late.returncode == 5 and late.stderr.count("\n") == 1 and "0.3 s" in late.stderr and late.stdout == ""
    assert not list(tmp_path.iterdir())
    for little in ("60 MB", "120 MB", "300 MB"):  # while loading, reading and solving
        full = command(*words, "--memory-limit", little.replace(" ", ""))
        assert full.returncode == 5 and little in full.stderr and not list(tmp_path.iterdir())
    assert command(*words, "--time-limit", "1min", "--memory-limit", "4GB").returncode == 0 and out.exists()
    for wrong in (
        ["--time-limit", "0"],
        ["--time-limit", "soon"],
        ["--time-limit", "5mm"],
        ["--time-limit", "1e300"],
        ["--memory-limit", "9" * 400],
        ["--memory-limit", "much"],
    ):
        assert mracad("info", samples / "panel.step", *wrong).code == 2
