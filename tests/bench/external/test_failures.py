"""Failures of external trackers: each costs its own run, and leaves no process behind."""

import os
import re
import signal
import subprocess
import sys
import time
from contextlib import closing
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from tests.bench.external.conftest import DRIFT, HOME, TRAX, living
from trackmark import datasets
from trackmark.bench import operating_system
from trackmark.bench.evaluation.loop import evaluate_run
from trackmark.bench.execution.pool import Pool
from trackmark.bench.execution.task import Limits, PlannedRun, Task, UnusableTrackerError
from trackmark.bench.experiments.experiment import SequenceSpec
from trackmark.bench.experiments.tracker_spec import resolve_specs, run_identity
from trackmark.bench.external import close_idle_processes, trax
from trackmark.bench.external.definition import open_external
from trackmark.bench.external.process import ExternalTrackerError
from trackmark.bench.external.worker_process import START, WORKER

pytestmark = pytest.mark.usefixtures("folder")

PYTHON = {
    "raise": r"the process raised ValueError: broken\. .*last words.*, in misbehave",
    "signal": r"the process ended by signal 11 .*last words.*in misbehave",
    "nan": r"an invalid estimate: the box \[nan, 1\.0, 2\.0, 3\.0\] is invalid.*last words",
    "hang": r"did not answer in 60 s\. Its last call: .*plain_tracker\.py.* in hang.*last words",
    "slow start": r"the process did not answer in 300 s\..*waiting.* in __init__",
}
COMMAND = {
    "raise": r"the process ended with status 1\. Its last line: ValueError: broken.*in main",
    "hang": r"the process did not answer in 60 s\..*a log line",
    "flood": r"the process ended with status 7\. Its last line: yyy",
    "garbage": r"the process answered with the region 'nonsense,1'\. Expected:",
    "confidence": r"the confidence 7\. Expected: a number from 0 to 1\. Add confidence=false",
    "spaces": r"the process answered with 4 regions, '1, 2, 3, 4'\. Expected: one region without",
    "quit": r"the process ended the session: out of \"memory\"",
    "hello": r"the process sent '@@TRAX:hello'\. Expected: the message 'state'",
}


@pytest.mark.slow
@pytest.mark.parametrize("mode", PYTHON)
def test_failure_of_a_class_names_command_end_and_last_output(environment, mode):
    run = evaluate_run(f"{DRIFT}:python={environment}:mode={mode}", "Noise")
    frames = 1 if mode == "slow start" else 3
    assert_failed(run, frames, f"{environment}/bin/python", PYTHON[mode])


@pytest.mark.parametrize("is_external", [True, False])
def test_idle_process_that_was_killed_costs_no_run(environment, is_external):
    spec = f"plain_tracker.py:python={environment}" if is_external else "plain_tracker.py"
    first = evaluate_run(spec, "Noise")
    (process,) = living(str(WORKER))
    os.kill(process, signal.SIGKILL)
    # Its threads can end after it; the end is left for the harness to notice (WNOWAIT).
    os.waitid(os.P_PID, process, os.WEXITED | os.WNOWAIT)
    second = evaluate_run(spec, "Noise")
    assert (second.failure, second.boxes.tobytes()) == ("", first.boxes.tobytes())


ENDS = """
import os

class Ends:
    def init(self, image, box):
        self.box = box

    def update(self, image):
        return self.box

    def __del__(self):
        os._exit(3)
"""


@pytest.mark.parametrize("options", ["", f":python={sys.executable}"])
def test_destructor_that_ends_its_process_costs_no_run(folder, options):
    (folder / "ends.py").write_text(ENDS)
    assert [evaluate_run(f"ends.py{options}", "Noise").failure for _ in range(2)] == ["", ""]


@pytest.mark.parametrize("mode", COMMAND)
def test_failure_of_a_command_names_command_end_and_last_output(mode):
    command = f"{sys.executable} plain.py 4 {mode}"
    run = evaluate_run(f"trax:command={command}:as=mine", "Noise")
    assert_failed(run, 1 if mode == "confidence" else 3, command, COMMAND[mode])
    assert not living("plain.py")


@pytest.mark.parametrize(("mode", "frame"), [("twice", 4), ("later", 5), ("last", 7)])
def test_answer_too_many_of_a_command_is_a_failure(mode, frame):
    """An answer that is taken for that of the next frame would shift all later boxes."""
    run = evaluate_run(f"trax:command={sys.executable} plain.py 4 {mode}:as=mine", "Noise")
    assert run.failure.startswith(f"000{frame + 1}.png: "), run.failure
    assert "sent '@@TRAX:state" in run.failure
    assert "without a request. Expected: one answer per frame" in run.failure


LAST_LINES = {
    "ignored": """
class Noisy:
    def __del__(self): raise TypeError("in a destructor")
noisy = Noisy()
raise ValueError("broken")
""",
    "several lines": 'raise ValueError("broken\\nsecond line\\nthird line")',
    "at exit": """
import atexit, warnings
atexit.register(lambda: 1 / 0)
atexit.register(lambda: warnings.warn("leaked"))
raise ValueError("broken")
""",
}


@pytest.mark.parametrize("code", LAST_LINES.values(), ids=LAST_LINES)
def test_last_line_of_a_command_is_its_exception(folder, code):
    (folder / "broken.py").write_text(code)
    with pytest.raises(ExternalTrackerError) as raised:
        open_external("trax", {"command": f"{sys.executable} broken.py", "as": "mine"})
    first = str(raised.value).partition("\n")[0]
    assert first.endswith("(no TraX hello). Its last line: ValueError: broken")


def test_old_version_of_python_is_named(folder):
    """A process with the version number of Python 2 runs the same file."""
    (folder / "python2").write_text(
        f"#!/bin/sh\nshift; exec {sys.executable} -c 'import sys; sys.version_info = (2, 7, 18); "
        'exec(compile(open(sys.argv[1]).read(), sys.argv[1], "exec"))\' "$@"\n'
    )
    (folder / "python2").chmod(0o755)
    with pytest.raises(ExternalTrackerError, match=r"is Python 2\.7\. Expected: Python 3\.6"):
        open_external("plain_tracker.py", {"python": "./python2"})
    source = START.read_text()  # which Python 2 must be able to parse
    assert 'f"' not in source
    assert "->" not in source


WRITING = """
import os
class Writing:
    def init(self, image, box): self.box = box
    def update(self, image):
        for number in range(3, 20):
            try: os.write(number, TEXT)
            except OSError: pass
        return self.box
"""


def test_output_on_the_channel_of_answers_is_a_failure(folder):
    text = b'@@TRACKMARK:[1, {"wall": 0}]\n'
    (folder / "writing.py").write_text(f"TEXT = {text!r}{WRITING}")
    run = evaluate_run(f"writing.py:python={sys.executable}", "Noise")
    assert "which is not the answer to request 4. Write to stdout or stderr only" in run.failure


FORKING = """
import os
class Forking:
    def __init__(self, place="update"):
        self.place, self.shift = place, 0
        self.fork("constructor")
    def init(self, image, box):
        self.box = box
        self.fork("init")
    def update(self, image):
        self.fork("update")
        return [self.box[0] + self.shift, *self.box[1:]]
    def fork(self, place):
        if self.place == place and not os.fork():
            self.shift = 100
            if os.environ.get("CHILD_RAISES"):
                raise RuntimeError
"""
PLACES = ["constructor", "init", "update"]


@pytest.mark.parametrize(
    ("place", "raises"),
    [("update", "")]
    + [pytest.param(*case, marks=pytest.mark.slow) for case in product(PLACES, ["", "1"])],
)
def test_forked_process_that_returns_gives_no_boxes(folder, monkeypatch, place, raises):
    monkeypatch.setenv("CHILD_RAISES", raises)
    (folder / "forking.py").write_text(FORKING)
    for python in ("", f":python={sys.executable}"):
        run = evaluate_run(f"forking.py:place={place}{python}", "Noise")
        assert "the process forked a copy of itself, which returned" in run.failure
        reached = np.isfinite(run.boxes[:, 0])
        assert (run.boxes[reached] == run.boxes[0]).all()


def assert_failed(run, frames, program, error):
    reason, _, trace = run.failure.partition("\n")
    assert np.isfinite(run.boxes[:, 0]).sum() == frames, reason
    assert re.search(error, " ".join(trace.split())), trace
    assert program in reason


def wait_until(condition):
    until = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.05)


def test_hung_worker_ends_with_its_harness(environment, hangs, folder):
    """A killed harness cannot end its workers."""
    text, sequence = f"{DRIFT}:python={environment}:mode=hang", str(folder / "Noise")
    code = (
        "from trackmark.bench.evaluation.loop import evaluate_run; "
        f"evaluate_run({text!r}, {sequence!r})"
    )
    harness = subprocess.Popen([sys.executable, "-c", code], cwd=HOME)
    wait_until(hangs.exists)
    assert len(living(str(WORKER))) == 1
    harness.kill()
    harness.wait()
    wait_until(lambda: not living(str(WORKER)))


def test_frame_file_of_a_killed_harness_is_removed_later(hangs, folder, monkeypatch):
    monkeypatch.setattr(trax, "FRAME_FOLDER", str(folder / "frames"))
    (folder / "frames").mkdir()
    command = f"trax:command={sys.executable} plain.py 4 hang:as=mine"
    code = (
        "from trackmark.bench.evaluation.loop import evaluate_run; "
        "from trackmark.bench.external import trax; "
        f"trax.FRAME_FOLDER = {str(folder / 'frames')!r}; "
        f"evaluate_run({command!r}, {str(folder / 'Noise')!r})"
    )
    harness = subprocess.Popen(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(HOME)!r}); {code}"]
    )
    wait_until(hangs.exists)
    harness.kill()
    harness.wait()
    hangs.unlink()
    assert len([*Path("frames").iterdir()]) == 1
    evaluate_run(command.replace(" hang", ""), "Noise")
    close_idle_processes()
    assert not [*Path("frames").iterdir()]
    for number in living("plain.py"):  # it hangs, so that it does not notice the end of its input
        os.kill(number, signal.SIGKILL)


def perform(texts, options=""):
    """Return the outcomes of runs in worker processes by specification; add options to these."""
    specs, tasks = resolve_specs(texts), []
    assert not living("plain")
    for text, spec in specs.items():
        identity = run_identity(spec, datasets.load("Noise"), 0)
        tasks.append(Task(SequenceSpec("Noise"), (PlannedRun(text + options, identity),), 8))
    with closing(Pool(1, Limits())) as pool:
        outcomes = {
            task.runs[0].tracker.removesuffix(options): outcome
            for task, outcome in pool.run_tasks(tasks)
        }
    wait_until(lambda: not living("plain"))  # killed processes end after their worker
    return outcomes


def test_worker_process_contains_failures(environment):
    """Neither a process nor a file with frames of an ended process remains."""
    command = f"trax:command={sys.executable} plain.py 4"
    texts = {
        f"{command}:as=calm": "",
        f"{command} exit:as=exit": "plain.py 4 exit: the process ended with status 7",
        f"plain_tracker.py:python={environment}:mode=raise": "raised ValueError: broken",
        f"plain_tracker.py:python={environment}": "",
    }
    hang = f"{command} hang:as=hang"
    outcomes = perform(texts) | perform([hang], ":frame_limit=3")
    texts[hang] = "plain.py 4 hang: the process did not answer in 3 s"
    for text, failure in texts.items():
        (run,) = outcomes[text]
        reason = run.failure
        assert bool(reason) == bool(failure)
        assert failure in reason
    files = [*Path("/dev/shm").glob("trackmark-frames-*")]  # of other processes
    assert all(operating_system._lock(file) is None for file in files)


def test_failed_start_in_a_worker_is_no_error_of_the_sequence(folder):
    """The process starts once for the plan and once for the run, which gets no licence here."""
    (folder / "used").mkdir()
    code = "import os, sys\nif os.listdir('used'): sys.exit('no licence')\n"
    file = folder / "licensed.py"
    file.write_text(f"{code}open('used/1', 'w').close()\n{TRAX.read_text()}")
    (outcome,) = perform([f"trax:command={sys.executable} licensed.py 4:as=mine"]).values()
    assert isinstance(outcome, UnusableTrackerError)  # equal for all sequences: reported once
    assert "ended with status 1 (no TraX hello). Its last line: no licence" in str(outcome)
