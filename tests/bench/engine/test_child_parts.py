"""What a child and its supervisor share: board, output, limits, surroundings, memory."""

import io
import os
import random
import shlex
import subprocess
import sys
import tempfile
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackmark import bench
from trackmark.bench.engine import child, engine, probe
from trackmark.bench.engine.board import ELSEWHERE, NOBODY, READING, Board, BoardObserver
from trackmark.bench.engine.output import LONGEST, Printed, Tail
from trackmark.bench.engine.performing import Outcome, scored
from trackmark.bench.engine.process import Surroundings, machine_memory, peak_memory, reset_peak
from trackmark.bench.engine.supervisor import _suspects
from trackmark.bench.engine.unit import Entry, Limits, Unit
from trackmark.bench.experiments.experiment import ExperimentError, SequenceSource
from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.results import Results
from trackmark.bench.store.truth import write_truth
from trackmark.bench.store.unfinished import map_rows, read_rows
from trackmark.datasets.decoding import decoding


@pytest.fixture
def board():
    with tempfile.TemporaryFile() as file:
        file.truncate(Board.SIZE)
        yield Board(file.fileno())


def observer_on(board):
    return BoardObserver(board, lambda: True, Printed(lambda: board.look().entry, io.StringIO()))


def test_the_board_shows_who_is_called_and_for_the_second_look_that_it_went_on(board):
    board.clear()
    observer = observer_on(board)
    observer.reading(4)
    first = board.look()
    assert (first.frame, first.entry) == (4, READING)
    observer.calling(2, 4)
    second = board.look()
    assert (second.frame, second.entry) == (4, 2)
    assert second.sign_of_life != first.sign_of_life
    observer.compiling()
    assert board.look().sign_of_life != second.sign_of_life
    observer.called(2)
    observer.shown(5)
    assert (board.look().entry, board.look().shown) == (NOBODY, 5)
    board.clear()
    assert board.look() == (0, 0, ELSEWHERE, 0, 0, 0, 0)


def test_a_board_that_finds_no_room_is_a_line_and_no_death(tmp_path):
    """In a temporary folder that has become full: its memory is a file there."""
    code = f"""
import tempfile
tempfile.tempdir = {str(tmp_path)!r}  # chosen before it was full
from trackmark.bench.cli import main
main()
"""
    command = [sys.executable, "-c", code, "run", "--trackers", "static"]
    command += ["--sequences", "plain/target", "--output", str(tmp_path.parent / "results")]
    room = ["mount", "-t", "tmpfs", "-o", "size=4k", "none", str(tmp_path)]
    fill = f"{shlex.join(room)} && head -c 4096 /dev/zero > {tmp_path}/full"
    if subprocess.run(["unshare", "-rm", "sh", "-c", fill], check=False).returncode:
        pytest.skip("nobody may mount a file system here")
    inside = ["unshare", "-rm", "sh", "-c", f"{fill} && exec {shlex.join(command)}"]
    done = subprocess.run(inside, capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr
    assert "no room for temporary files" in done.stderr
    assert "TMPDIR" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_copy_that_comes_back_from_a_call_ends_there_and_is_told_on(board):
    board.clear()
    observer = observer_on(board)
    observer.calling(1, 3)
    copy = os.fork()
    observer.called(1)
    if copy == 0:
        os._exit(99)  # the copy must not get here
    assert os.waitstatus_to_exitcode(os.waitpid(copy, 0)[1]) == 0
    assert list(observer.misdeeds()) == [1]


def test_a_fork_whose_copy_does_not_come_back_is_no_misdeed(board, monkeypatch):
    monkeypatch.setattr("trackmark.bench.engine.board._COPY_SECONDS", 0.1)
    board.clear()
    observer = observer_on(board)
    copy = os.fork()
    if copy == 0:
        os._exit(0)
    os.waitpid(copy, 0)
    assert observer.misdeeds() == {}


@given(st.lists(st.text(max_size=3 * LONGEST // 2), max_size=8))
def test_a_tail_is_the_end_of_all_that_was_said(pieces):
    tail = Tail()
    for piece in pieces:
        tail.add(piece)
    assert tail.text() == "".join(pieces)[-LONGEST:]


def test_a_tail_holds_little_however_much_is_said():
    tail = Tail()
    for _ in range(1000):
        tail.add("x" * 1000)
    assert sum(map(len, tail._pieces)) <= 2 * LONGEST


def test_what_is_printed_is_sorted_by_whose_turn_it_is_and_passed_on(board):
    board.clear()
    through = io.StringIO()
    printed = Printed(lambda: board.look().entry, through)
    observer = BoardObserver(board, lambda: True, printed)
    for entry in (0, 1, 0):
        observer.calling(entry, 1)
        print("word", entry, file=printed)
        observer.called(entry)
    assert observer.printed() == {0: "word 0\nword 0\n", 1: "word 1\n"}
    assert observer.printed() == {}
    assert through.getvalue() == "word 0\nword 1\nword 0\n"


@pytest.mark.parametrize("name", ["frame_seconds", "run_seconds", "memory_bytes"])
@pytest.mark.parametrize("value", [0, -1, float("nan")])
def test_a_limit_that_nothing_can_keep_is_refused(name, value):
    with pytest.raises(ExperimentError, match=name):
        Limits(**{name: value})


def test_the_memory_of_a_container_counts_rather_than_its_machine(tmp_path, monkeypatch):
    group = tmp_path / "memory.max"
    monkeypatch.setattr("trackmark.bench.engine.process._CONTROL_GROUP", group)
    whole = machine_memory()
    group.write_text("max\n")
    assert machine_memory() == whole
    group.write_text("1048576\n")
    assert machine_memory() == 1 << 20


def test_the_peak_of_memory_is_that_since_it_was_forgotten():
    def peak_with(megabytes):
        reset_peak()
        data = np.ones(megabytes << 17)
        return peak_memory() + 0 * len(data)

    many, few = peak_with(300), peak_with(10)
    assert many - few > 200 << 20


def test_more_memory_than_allowed_is_an_error_and_no_death():
    code = (
        "from trackmark.bench.engine.process import limit_memory; limit_memory(1 << 30)\n"
        "try: bytearray(2 << 30)\n"
        "except MemoryError: print('refused')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "refused\n"


def test_surroundings_tell_what_was_changed_and_are_put_back(tmp_path):
    before = Surroundings.now()
    assert Surroundings.now() == before
    for change in (
        random.random,
        np.random.random,
        lambda: np.seterr(all="raise"),
        lambda: os.chdir(tmp_path),
        lambda: os.environ.update(TRACKMARK_CACHE="elsewhere"),
        lambda: os.environ.pop("PATH"),
    ):
        change()
        assert Surroundings.now() != before
        before.restore()
        assert Surroundings.now() == before


@given(st.integers(2, 40), st.integers(-2, 39))
def test_suspects_are_all_runs_of_a_unit_once_and_fewer_at_a_time(n, suspect):
    entries = tuple(Entry("static", i, "v") for i in range(n))
    unit = Unit(SequenceSource("samples/face"), entries, "accuracy", 10)
    parts = [part.unit for part in _suspects(unit, min(suspect, n - 1))]
    assert sorted(entry for part in parts for entry in part.entries) == list(entries)
    assert all(len(part.entries) < n for part in parts)
    if suspect >= 0:
        assert parts[0].entries == (entries[min(suspect, n - 1)],)


def test_rows_of_an_unfinished_run_are_on_disk_without_being_written(tmp_path):
    rows = map_rows(tmp_path / "0.unfinished.npy", 5, 6)
    assert np.isnan(rows).all()
    rows[2] = range(6)
    np.testing.assert_array_equal(read_rows(tmp_path / "0.unfinished.npy"), rows)
    assert read_rows(tmp_path / "1.unfinished.npy") is None


def test_a_probe_measures_every_tracker_and_keeps_nothing(here):
    entries = tuple(Entry(text, 0, "") for text in ("static", f"{here}/knob.py:Knob"))
    unit = Unit(SequenceSource(str(here / "data" / "Small")), entries, "accuracy", 5)
    before = sorted(here.rglob("*"))
    probed = probe(unit, 4, Limits())
    assert len(probed.seconds) == 2
    assert np.isfinite([*probed.seconds, probed.frame_seconds]).all()
    assert [p for p in sorted(here.rglob("*")) if "__pycache__" not in p.parts] == before


def test_an_answer_on_other_runs_or_more_than_were_asked_for_is_refused(make_sequence, tmp_path):
    sequence = make_sequence()
    run = bench.evaluate("static", sequence)
    elsewhere = Results(tmp_path / "elsewhere")
    elsewhere.prepare(elsewhere.asked())
    write_truth(elsewhere.folder, sequence)
    elsewhere.write(run)
    entry = Entry("static", 0, run.identity.version)
    unit = Unit(SequenceSource(sequence.name), (entry,), "accuracy", len(sequence))
    rows = [{"path": str(elsewhere.path(run.identity))}]
    outcome = Outcome(rows, [entry], 0.0, 0.0, 0.0, 0, "", 0)
    with pytest.raises(ResultsError, match="nobody asked for"):
        scored(outcome, unit, tmp_path / "here")
    assert scored(outcome, unit, elsewhere.folder).rows[0]["tracker"] == "static"
    for more in ({"errors": ["why"]}, {"rows": [], "entries": [], "errors": ["why"] * 9}):
        with pytest.raises(ResultsError, match="nobody asked for"):
            scored(replace(outcome, **more), unit, elsewhere.folder)


def test_an_unknown_engine_is_named_with_the_closest():
    with pytest.raises(ExperimentError, match=r"unknown engine 'lokal'\. Did you mean 'local'"):
        engine("lokal")
    with pytest.raises(ExperimentError, match="--address"):
        engine("local", address="tcp://somewhere")


@pytest.mark.parametrize(
    ("called", "fresh", "raised"),
    [(False, True, "SequenceError"), (True, True, "harm"), (False, False, "harm")],
)
def test_memory_that_decoding_lacks_is_a_trackers_doing_where_one_may_have_taken_it(
    board, monkeypatch, called, fresh, raised
):
    """What was called in this process may hold memory; in a fresh one the image is too large."""

    def performed(observer):
        if called:
            observer.calling(0, 0)
            observer.called(0)
        with decoding("clip/1.png: frame 0 can't be read"):
            raise MemoryError

    board.clear()
    answer = child._answer(performed, observer_on(board), fresh)
    assert answer.raised == raised
    assert ("clip/1.png" in answer.said) == (raised == "SequenceError")
