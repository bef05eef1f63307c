"""Nobody is blamed for what another tracker did, in the same pass or before it."""

import os
import signal
import threading
from dataclasses import replace
from pathlib import Path

import pytest

from tests.bench.conftest import KNOB_TRACKER
from tests.bench.engine.conftest import command_line, send
from trackmark import bench
from trackmark.bench.engine.supervisor import ClosedError, Supervisor
from trackmark.bench.engine.unit import Limits
from trackmark.bench.execution.plan import make_plan
from trackmark.bench.execution.scheduling import left_of
from trackmark.bench.experiments.experiment import Experiment, SequenceSource
from trackmark.bench.experiments.tracker_files import settled
from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.index import read_index
from trackmark.bench.store.log import log_files, read_log
from trackmark.bench.store.results import Results
from trackmark.bench.store.truth import write_truth
from trackmark.bench.store.upkeep import merge_results

LEFT, ABANDONED = (f"{seconds}.{os.getpid()}" for seconds in (86413, 86415))  # nobody else's
NAMELESS = "subprocess.Popen(['sleep', '{}'], env={{}}, start_new_session=True)"
NO_ROOM = b'{"result": null, "raised": "ResultsError", "said": "there is no room"}\n'
ACTS = {
    "Alarms": "signal.alarm(1)",
    "Dawdles": "time.sleep(0.3)",
    "LimitsRecursion": "sys.setrecursionlimit(150)",
    "Recurses": "self.depth(120)",
    "Patches": "np.mean = lambda *a, **k: 1 / 0",
    "Averages": "np.mean([1.0])",
    "SignalsItself": "os.kill(os.getpid(), 40)",
    "BreaksTheHarness": "recorder.checked_box.__code__ = (lambda box: 1 / 0).__code__",
    "MissesFile": "raise OSError('no \\udcff.png')",
    "Forks": "os.fork()",
    "ForksToo": "os.fork()",
    "Raises": "raise ValueError('no wish')",
    "Reads": "self.box = self.box + [np.mean([1.0]), 0, 0, 0]",
    "Spoils": "np.mean = sys.modules['trackmark.bench.metrics.native']._mean = lambda *a: 0.5;"
    " truth.as_columns = lambda columns: pa.table({name: [0.0] * 12 for name in columns});"
    " os.umask(0o777)",
    "LeavesThread": "_thread.start_new_thread(time.sleep, (1e6,))",  # `threading` knows of none
    "DelaysReading": "waits, read = [3.0], cv2.imdecode;"
    " cv2.imdecode = lambda *a: (time.sleep(waits.pop() if waits else 0), read(*a))[1]",
    "SaysThereIsNoRoom": "[os.write(int(one), NO_ROOM) for one in os.listdir('/proc/self/fd')"
    " if 'socket:' in os.path.realpath(f'/proc/self/fd/{one}')]; time.sleep(1e6)",
    "LeavesNameless": NAMELESS.format(LEFT),
    "AbandonsNameless": f"{NAMELESS.format(ABANDONED)}; os._exit(3)",
}


@pytest.fixture(scope="module")
def ground(tmp_path_factory, otb):
    folder = tmp_path_factory.mktemp("ground")
    for name in "AB":
        otb(folder / "data" / name, 12)
    source = KNOB_TRACKER.replace("class Knob(", "class Base(")
    source += "    depth = lambda self, n: self.depth(n - 1) if n else 0\n\n"
    for name, act in ACTS.items():
        source += f"""
class {name}(Base):
    def init(self, image, box, mask=None):
        super().init(image, box)
        self.frame = 0

    def update(self, image):
        self.frame += 1
        if self.frame == 3 or {name!r} == "Dawdles":
            {act}
        return super().update(image)
"""
    head = "import _thread, os, signal, subprocess, sys, time\n"
    head += f"import cv2, pyarrow as pa, numpy as np\nNO_ROOM = {NO_ROOM}\n"
    head += (
        "from trackmark.bench.evaluation import recorder\nfrom trackmark.bench.store import truth\n"
    )
    (folder / "acts.py").write_text(source.replace("from pydantic", head + "from pydantic", 1))
    return folder


def perform(ground, *names, sequences="A", timing=False, seeds=1, limits=None):
    chosen = Experiment(
        "-".join(names),
        tuple(f"{ground}/acts.py:{name}" if name[0].isupper() else name for name in names),
        tuple(SequenceSource(str(ground / "data" / name)) for name in sequences),
        repetitions=seeds,
        timing=timing,
    )
    folder = bench.run(chosen, ground / "results", jobs=1, limits=limits or Limits())
    return folder, read_index(Results(folder))


def failures(ground, *names, sequences="A", seeds=1, **options):
    _, rows = perform(ground, *names, sequences=sequences, seeds=seeds, **options)
    assert len(rows) == len(names) * len(sequences) * seeds
    return {
        (row["tracker"].partition(":")[2], row["sequence"], row["repetition"]): row["failure"]
        for row in rows
        if row["failure"]
    }


def running(command):
    numbers = [int(place.name) for place in Path("/proc").glob("[0-9]*")]
    return [number for number in numbers if command in command_line(number)]


@pytest.mark.slow
def test_an_alarm_that_an_earlier_tracker_set_is_not_its_successors_failure(ground):
    found = failures(ground, "Alarms", "Dawdles", timing=True)
    assert ("Dawdles", "A", 0) not in found


@pytest.fixture(scope="module")
def together(ground):
    """Failures of those that ran in one command, by name."""
    names = ("LimitsRecursion", "Recurses", "SignalsItself", "MissesFile")
    found = failures(ground, *names, "LeavesNameless", "AbandonsNameless")
    return {name: failure for (name, _, _), failure in found.items()}


def test_a_limit_that_a_neighbour_set_is_not_its_own_failure(together):
    assert together.keys() == {"SignalsItself", "MissesFile", "AbandonsNameless"}


@pytest.mark.slow
def test_a_function_that_a_neighbour_broke_is_not_its_own_failure(ground):
    assert set(failures(ground, "Patches", "Averages")) <= {("Patches", "A", 0)}


@pytest.mark.slow
def test_who_breaks_the_harness_costs_his_own_runs_alone(ground):
    found = failures(ground, "BreaksTheHarness", "Dawdles", sequences="AB")
    assert set(found) == {("BreaksTheHarness", name, 0) for name in "AB"}


def test_signals_without_names_and_text_that_no_file_can_hold_are_told(together):
    assert "killed by signal 40" in together["SignalsItself"]
    assert r"no \udcff.png" in together["MissesFile"]


@pytest.mark.slow
def test_all_who_fork_are_found(ground):
    found = failures(ground, "Forks", "Dawdles", "ForksToo", seeds=2)
    assert set(found) == {(name, "A", seed) for name in ("Forks", "ForksToo") for seed in (0, 1)}
    assert all("it forked" in failure for failure in found.values())


@pytest.mark.slow
def test_repetitions_that_fail_for_one_reason_are_confirmed_once(ground, monkeypatch):
    asked = []
    plain = Supervisor._ask
    monkeypatch.setattr(
        Supervisor,
        "_ask",
        lambda self, request, *rest: asked.append(request) or plain(self, request, *rest),
    )
    found = failures(ground, "Raises", "Dawdles", seeds=5)
    assert set(found) == {("Raises", "A", seed) for seed in range(5)}
    assert [len(request.unit.entries) for request in asked] == [5, 1, 5]


def test_what_a_tracker_spoils_in_its_process_shows_nowhere_else(
    ground, contents, without_processes
):
    """Not in boxes, truth and scores, nor in who may read them: before it, after it, beside it."""
    names = ("Reads", "static")
    with without_processes():
        plain, rows = perform(ground, *names, sequences="AB")
    spoilt, found = perform(ground, "Spoils", *names, sequences="AB")
    boxes = contents(spoilt)
    assert {key: boxes[key] for key in contents(plain)} == contents(plain)
    for row in rows:
        assert row["status"] == "finished"
        (same,) = (other for other in found if other["path"] == row["path"])
        assert repr(same["scores"]) == repr(row["scores"])
    modes = {file.stat().st_mode & 0o777 for file in spoilt.rglob("*") if file.is_file()}
    assert modes == {(plain / "plan.json").stat().st_mode & 0o777}


def test_each_tracker_is_timed_in_a_process_of_its_own(ground):
    folder, rows = perform(ground, "LeavesThread", "static", "Reads", sequences="AB", timing=True)
    assert {row["status"] for row in rows} == {"finished"}
    processes = {}
    for entry in read_log(log_files(folder)[0]):
        if entry["event"] == "unit":
            (tracker,) = entry["runs"]
            processes.setdefault(tracker, set()).add(entry["process"])
    assert [len(of) for of in processes.values()] == [1, 1, 1]
    assert len(set.union(*processes.values())) == 3


@pytest.mark.slow
def test_how_long_a_frame_takes_to_read_is_not_the_trackers_time(ground):
    assert failures(ground, "DelaysReading", limits=Limits(frame_seconds=2.0)) == {}


def test_what_a_tracker_has_started_ends_unless_its_process_did(together, wait_until):
    """With no mark in its environment and no living ancestor nobody knows whose it is."""
    assert "status 3" in together["AbandonsNameless"]
    wait_until(lambda: not running(f"sleep {LEFT}"))
    (abandoned,) = running(f"sleep {ABANDONED}")
    send(abandoned, signal.SIGKILL)


def test_so_does_what_the_import_of_its_file_has_started(ground, wait_until):
    command = f"sleep 86414.{os.getpid()}"
    start = f"import subprocess\nsubprocess.Popen({command.split()}, start_new_session=True)\n"
    (ground / "starts.py").write_text(start + KNOB_TRACKER)
    settled([f"{ground}/starts.py"])
    wait_until(lambda: not running(command))


def test_a_tracker_that_says_that_nothing_can_be_written_ends_the_command(ground):
    """A limit: it is believed, since it may well be so."""
    with pytest.raises(ResultsError, match="there is no room"):
        perform(ground, "SaysThereIsNoRoom")


def test_a_worker_that_is_killed_while_it_begins_is_begun_again(ground, monkeypatch):
    from trackmark.bench.engine import child_process

    killed = []
    plain = child_process.ChildProcess._hear

    def hear(self, look, limit):
        if not killed:
            killed.append(self._process.pid)
            os.kill(self._process.pid, signal.SIGKILL)
        return plain(self, look, limit)

    monkeypatch.setattr(child_process.ChildProcess, "_hear", hear)
    assert failures(ground, "Reads") == {}
    assert killed


@pytest.mark.parametrize("delay", [0.0, 0.3])
def test_a_supervisor_that_is_closed_while_a_child_begins_does_not_begin_the_unit(
    ground, wait_until, delay
):
    chosen = Experiment(
        "slow",
        tuple(f"{ground}/acts.py:{name}" for name in ("Dawdles",)),
        (SequenceSource(str(ground / "data" / "A")),),
    )
    (unit,) = left_of(make_plan(chosen, Results(ground / "none")))
    supervisor = Supervisor(Limits())
    threading.Timer(delay, supervisor.close).start()
    with pytest.raises(ClosedError):
        supervisor.perform(unit, ground / "none" / "slow")
    wait_until(lambda: supervisor._child is None)  # the other thread is at it
    assert Results(ground / "none" / "slow").files() == []  # none was waited for


def test_what_finished_replaces_what_failed_whoever_was_first(make_sequence, tmp_path):
    sequence = make_sequence()
    finished = bench.evaluate("static", sequence)
    failed = replace(finished, failure="frame 3: killed by somebody")
    for name, run in (("a", failed), ("b", finished)):
        results = Results(tmp_path / name)
        results.prepare(results.asked())
        write_truth(results.folder, sequence)
        assert results.write(run)
    merge_results([tmp_path / "a", tmp_path / "b"], tmp_path / "whole")
    (row,) = read_index(Results(tmp_path / "whole"))
    assert row["status"] == "finished"
    results = Results(tmp_path / "a")
    assert results.write(finished)
    assert not results.write(failed)
    assert results.read(results.path(finished.identity)).status == "finished"
