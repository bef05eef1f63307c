"""Worker and its parent: shared file, process state, memory and decoding errors."""

import os
import random
import shlex
import subprocess
import sys
import tempfile

import numpy as np
import pytest

from tests.bench.engine.conftest import TRACKMARK
from trackmark.bench.engine import heartbeat, worker
from trackmark.bench.engine.heartbeat import (
    ELSEWHERE,
    HEAD,
    NOBODY,
    READING,
    Heartbeat,
    read_message,
    read_rows,
    read_state,
)
from trackmark.bench.engine.process_state import (
    ProcessState,
    machine_memory,
)
from trackmark.bench.engine.work_unit import Request, Unit
from trackmark.bench.experiments.experiment import SequenceSource
from trackmark.bench.machine_errors import MachineError
from trackmark.datasets.decoding import decoding

UNIT = Unit(SequenceSource("samples/face"), (), "accuracy", 120)


@pytest.fixture
def shared():
    """Provide the descriptor of a shared file that holds a message of the parent."""
    with tempfile.TemporaryFile() as file:
        heartbeat.reset(file.fileno(), ELSEWHERE, b"request")
        yield file.fileno()


def test_heartbeat_shows_what_is_called(shared):
    beats = Heartbeat(shared)
    assert beats.read_message() == b"request"
    assert not beats.has_called
    beats.on_frame_read(4)
    first = read_state(shared)
    assert (first.frame, first.entry) == (4, READING)
    beats.on_tracker_call(2, 4)
    second = read_state(shared)
    assert (second.frame, second.entry) == (4, 2)
    assert second.sign_of_life != first.sign_of_life
    beats.compiling()
    assert read_state(shared).sign_of_life != second.sign_of_life
    beats.on_tracker_return()
    beats.on_frames_done(5)
    assert (read_state(shared).entry, read_state(shared).frames_done) == (NOBODY, 5)
    beats.on_loop_end()
    assert read_state(shared).entry == ELSEWHERE
    assert beats.has_called


def test_rows_and_message_are_read_unchanged(shared):
    beats = Heartbeat(shared)
    rows = beats.rows((5, 6))
    assert np.isnan(rows).all()
    rows[2] = range(6)
    arrays = {
        "boxes": np.array([[0.1, np.nan], [-0.0, 1e308]]),
        "none": np.zeros((0, 4), np.float32),
        "fields": np.array([(1, 2.5)], [("a", "i2"), ("b", ">f8")]),
        "flags": np.array(True),
    }
    beats.write_message({"text": "\udcff", "number": np.float32(0.5), "arrays": arrays})
    assert read_rows(shared, read_state(shared)) == rows.tobytes()
    message = read_message(shared, read_state(shared))
    assert (message["text"], message["number"]) == ("\udcff", 0.5)
    for name, array in arrays.items():
        read = message["arrays"][name]
        assert (read.dtype, read.shape) == (array.dtype, array.shape)
        assert read.tobytes() == array.tobytes()
    with pytest.raises(ValueError, match="Python objects"):
        beats.write_message([np.array([None])])


@pytest.mark.parametrize(
    "damage",
    [
        lambda file: os.ftruncate(file, 0),
        lambda file: os.ftruncate(file, HEAD + 20),
        lambda file: os.pwrite(file, b"\xff" * HEAD, 0),
        lambda file: os.pwrite(file, b"x", HEAD + 60),
        lambda file: os.pwrite(file, bytes(8 * 7), 0),
    ],
    ids=["empty", "truncated", "overwritten head", "overwritten message", "zeros"],
)
def test_damaged_message_is_recognised(shared, damage):
    beats = Heartbeat(shared)
    beats.write_message({"worn": False, "result": None})
    assert read_message(shared, read_state(shared)) == {"worn": False, "result": None}
    damage(shared)
    with pytest.raises(ValueError, match="message"):
        read_message(shared, read_state(shared))
    assert read_rows(shared, read_state(shared)) == b""


@pytest.mark.slow
def test_full_disk_of_temporary_files_is_one_line(tmp_path):
    code = f"import tempfile; tempfile.tempdir = {str(tmp_path)!r}; {TRACKMARK[2]}"
    command = [*TRACKMARK[:2], code, "run", "--trackers", "static"]
    command += ["--sequences", "plain/target", "--output", str(tmp_path.parent / "results")]
    room = ["mount", "-t", "tmpfs", "-o", "size=4k", "none", str(tmp_path)]
    fill = f"{shlex.join(room)} && head -c 4096 /dev/zero > {tmp_path}/full"
    if subprocess.run(["unshare", "-rm", "sh", "-c", fill], check=False).returncode:
        pytest.skip("this user may not mount a file system")
    inside = ["unshare", "-rm", "sh", "-c", f"{fill} && exec {shlex.join(command)}"]
    done = subprocess.run(inside, capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr
    assert "no space for temporary files" in done.stderr
    assert "TMPDIR" in done.stderr
    assert "Traceback" not in done.stderr


def test_worker_without_disk_space_is_reported(shared):
    Heartbeat(shared).write_no_room()
    with pytest.raises(MachineError, match="no space for temporary files"):
        read_message(shared, read_state(shared))


@pytest.mark.parametrize(
    ("called", "used", "kind"),
    [(False, False, "error"), (True, False, "harm"), (False, True, "harm")],
)
def test_decoding_without_memory_is_harm_after_a_tracker_call(
    shared, monkeypatch, called, used, kind
):
    def perform(unit, run_seconds, observer):
        if called:
            observer.on_tracker_call(0, 0)
            observer.on_tracker_return()
        with decoding("clip/1.png: frame 0 can't be read"):
            raise MemoryError

    monkeypatch.setattr(worker, "perform", perform)
    answer = worker._answer(Request(UNIT, 1.0), Heartbeat(shared), used)
    assert list(answer) == [kind]
    assert ("clip/1.png" in answer[kind]) == (kind == "error")


@pytest.mark.parametrize(("owner", "kind"), [("", "defect"), ("mine.py:Mine", "harm")])
def test_defect_of_trackmark_is_not_harm_by_a_tracker(shared, monkeypatch, owner, kind):
    monkeypatch.setattr(worker, "perform", lambda *_: 1 / 0)
    request = Request(Unit(UNIT.source, (), "accuracy", 120, owner), 1.0)
    answer = worker._answer(request, Heartbeat(shared), used=False)
    assert list(answer) == [kind]
    assert "ZeroDivisionError" in answer[kind]


def test_process_state_shows_changes_and_is_restored(tmp_path):
    before = ProcessState.current()
    assert ProcessState.current() == before
    for change in (
        random.random,
        np.random.random,
        lambda: np.seterr(all="raise"),
        lambda: os.chdir(tmp_path),
        lambda: os.environ.update(TRACKMARK_CACHE="elsewhere"),
        lambda: os.environ.pop("PATH"),
        lambda: os.umask(0o777),
    ):
        change()
        assert ProcessState.current() != before
        before.restore()
        assert ProcessState.current() == before


def test_memory_of_a_container_counts(tmp_path, monkeypatch):
    group = tmp_path / "memory.max"
    monkeypatch.setattr("trackmark.bench.engine.process_state._CONTROL_GROUP", group)
    whole = machine_memory()
    group.write_text("max\n")
    assert machine_memory() == whole
    group.write_text("1048576\n")
    assert machine_memory() == 1 << 20


def test_memory_beyond_the_limit_is_an_error():
    code = (
        "from trackmark.bench.engine.process_state import limit_memory; limit_memory(1 << 30)\n"
        "try: bytearray(2 << 30)\n"
        "except MemoryError: print('refused')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "refused\n"
