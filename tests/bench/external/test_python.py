"""Trackers of Python files in another interpreter."""

import ast
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from tests.bench.external.conftest import DRIFT, HOME, living
from trackmark import bench
from trackmark.bench.experiments.tracker_files import describe_tracker, resolve_trackers
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.external.python import WORKER
from trackmark.trackers import Randomness, TrackerError, static
from trackmark.trackers.base import plain_class

NAME = "plain_tracker.py"
pytestmark = pytest.mark.usefixtures("folder")


def content(run):
    segmentation = run.segmentation and run.segmentation.region_similarity.tobytes()
    revised = None if run.revised is None else run.revised.tobytes()
    details = {name: values.tobytes() for name, values in run.details.items()}
    rows = run.boxes.tobytes(), run.visible.tobytes(), run.confidence.tobytes()
    return run.failure, rows, details, revised, segmentation


@pytest.mark.parametrize(
    ("mode", "protocol"), [("calm", "tre:starts=3"), ("rich", "one-pass"), ("flood", "one-pass")]
)
def test_boxes_equal_those_in_process(environment, mode, protocol):
    """Each segment of a protocol has a new tracker in the same process."""
    in_process, external = (
        bench.evaluate_run(f"{NAME}{python}:mode={mode}", "Noise", repetition=3, protocol=protocol)
        for python in ("", f":python={environment}")
    )
    assert not in_process.failure
    assert content(external) == content(in_process)
    assert external.identity.tracker == in_process.identity.tracker
    assert len(living(str(WORKER))) == 1


@pytest.mark.slow
def test_other_version_of_python_gives_equal_boxes(other_environment):
    for mode in ("calm", "rich"):
        external = bench.evaluate_run(f"{NAME}:python={other_environment}:mode={mode}", "Noise")
        assert content(external) == content(bench.evaluate_run(f"{NAME}:mode={mode}", "Noise"))


def test_plugin_runs_where_trackmark_is_installed():
    external = bench.evaluate_run(f"{static.__file__}:python={sys.executable}:as=still", "Noise")
    assert content(external) == content(bench.evaluate_run("static", "Noise"))


FAILURES = {
    "raise": r"the process raised ValueError: broken\. .*last words.*, in misbehave",
    "sys.exit": r"the process ended with status 3\.",
    "signal": r"the process ended by signal 11 .*last words.*in misbehave",
    "nan": r"the box \[nan, 1\.0, 2\.0, 3\.0\] is invalid",
    "garbage": r"the box .*nonsense.* Expected: four numbers",
    "key": r"the process raised ValueError: update returned a dict with the keys 'box', 'score'",
    "hang": r"the process did not answer in 60 s\..*last words.*waiting.* in hang",
    "slow start": r"the process did not answer in 300 s\..*waiting.* in __init__",
}


@pytest.mark.parametrize("mode", FAILURES)
def test_failure_names_command_and_last_output(environment, mode):
    run = bench.evaluate_run(f"{NAME}:python={environment}:mode={mode}", "Noise")
    reason, _, trace = run.failure.partition("\n")
    text = " ".join(trace.split())
    assert np.isfinite(run.boxes[:, 0]).sum() == (1 if mode == "slow start" else 3), reason
    assert re.search(FAILURES[mode], text), text
    assert mode in ("nan", "garbage") or f"{environment}/bin/python" in reason


def test_hung_worker_ends_with_its_harness(environment, hangs, folder):
    """A killed harness cannot end its workers."""
    text, sequence = f"{DRIFT}:python={environment}:mode=hang", str(folder / "Noise")
    code = f"from trackmark import bench; bench.evaluate_run({text!r}, {sequence!r})"
    harness = subprocess.Popen([sys.executable, "-c", code], cwd=HOME)
    wait_until(hangs.exists)
    assert len(living(str(WORKER))) == 1
    harness.kill()
    harness.wait()
    wait_until(lambda: not living(str(WORKER)))


def wait_until(condition):
    until = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.05)


DRAWING = """
import random, time
import numpy as np
class Drawing:
    def __init__(self, rng): self.rng = rng
    def init(self, image, box): pass
    def update(self, image):
        until = time.process_time() + 0.02
        while time.process_time() < until: pass
        return [self.rng.random(), np.random.rand(), random.random(), 1]
"""


def test_seeds_and_times_are_those_of_the_worker(environment, folder):
    (folder / "drawing.py").write_text(DRAWING)
    text = f"drawing.py:python={environment}"
    assert parse_tracker(text).randomness is Randomness.GENERATOR
    first, again, other = (bench.evaluate_run(text, "Noise", repetition=n) for n in (0, 0, 1))
    assert content(first) == content(again)
    assert (first.boxes[1:, :3] != other.boxes[1:, :3]).all()
    # The CPU time of another process; all of its threads count, so the wall time can be shorter.
    assert first.circumstances["update_seconds"] >= 0.02
    assert "clock" not in first.circumstances


def test_version_depends_on_source_and_libraries(environment, folder):
    file = folder / NAME
    text = f"{NAME}:python={environment}"
    version = parse_tracker(text).version
    assert version["libraries"].keys() == {"python", "numpy"}
    file.write_text("# comment\n" + DRIFT.read_text())
    assert parse_tracker(text).version == version
    file.write_text(DRIFT.read_text().replace("/ 1000", "/ 2000"))
    assert parse_tracker(text).version["source"] != version["source"]
    assert parse_tracker(text).version["libraries"] == version["libraries"]


def test_description_lists_parameters(environment):
    description = describe_tracker(f"{NAME}:python={environment}")
    assert description["name"] == "plain_tracker.py:Drift"
    assert [entry["name"] for entry in description["parameters"]] == ["step", "mode"]
    assert description["randomness"] == "generator"


def test_invalid_interpreter_or_import_is_an_early_error(environment, folder):
    (folder / "needy.py").write_text("import no_such_library\n")
    for python, error in {
        "no/such/python": r"no/such/python .*worker.py .*cannot be started: .*No such file",
        environment: r"python -X.*needy.py: .*No module named 'no_such_lib",
    }.items():
        with pytest.raises(TrackerError, match=error):
            resolve_trackers([f"needy.py:python={python}"])


@pytest.mark.parametrize("file", [WORKER, plain_class.__file__])
def test_worker_has_syntax_of_python_3_6(file):
    ast.parse(Path(file).read_text("utf-8"), feature_version=(3, 6))
