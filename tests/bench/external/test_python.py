"""Trackers of Python files in another interpreter."""

import ast
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from tests.bench.external.conftest import FILE, living
from trackmark import bench, datasets
from trackmark.bench.experiments.tracker_files import describe_tracker, resolve_trackers
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.external.python import WORKER
from trackmark.trackers import Randomness, TrackerError, static

FAILURES = {
    "raise": r"the process raised ValueError: broken\. .*last words.*, in misbehave",
    "sys.exit": r"the process ended with status 3\.",
    "signal": r"the process ended by signal 11 .*last words.*in misbehave",
    "nan": r"the box \[nan, 1\.0, 2\.0, 3\.0\] is invalid",
    "garbage": r"the box .*nonsense.* Expected: four numbers",
    "hang": r"the process did not answer in 60 s\..*last words.*waiting.* in hang",
    "slow start": r"the process did not answer in 300 s\..*waiting.* in __init__",
}


pytestmark = pytest.mark.usefixtures("clock_of_hangs")


@pytest.fixture
def noise(tmp_path, otb):
    """Return a sequence of 8 frames."""
    return datasets.load(str(otb(tmp_path / "Noise", 8)))


def content(run):
    segmentation = run.segmentation and run.segmentation.region_similarity.tobytes()
    revised = None if run.revised is None else run.revised.tobytes()
    details = {name: values.tobytes() for name, values in run.details.items()}
    rows = run.boxes.tobytes(), run.visible.tobytes(), run.confidence.tobytes()
    return run.failure, rows, details, revised, segmentation


@pytest.mark.parametrize(
    ("mode", "protocol"), [("calm", "tre:starts=3"), ("rich", "one-pass"), ("flood", "one-pass")]
)
def test_boxes_equal_those_in_process(environment, noise, mode, protocol):
    """Each segment of a protocol has a new tracker in the same process."""
    texts = [f"{FILE}:mode={mode}", f"{FILE}:python={environment}:mode={mode}"]
    in_process, external = (
        bench.evaluate_run(text, noise, repetition=3, protocol=protocol) for text in texts
    )
    assert not in_process.failure
    assert content(external) == content(in_process)
    assert external.identity.tracker == in_process.identity.tracker
    assert len(living(str(WORKER))) == 1


def test_other_version_gives_equal_boxes(other_python, noise):
    external = bench.evaluate_run(f"{FILE}:python={other_python}", noise)
    assert content(external) == content(bench.evaluate_run(str(FILE), noise))


@pytest.mark.slow
def test_environment_of_another_version_gives_equal_boxes(other_environment, noise):
    external = bench.evaluate_run(f"{FILE}:python={other_environment}", noise)
    assert content(external) == content(bench.evaluate_run(str(FILE), noise))


@pytest.mark.parametrize("mode", FAILURES)
def test_failure_names_command_and_last_output(environment, noise, mode):
    run = bench.evaluate_run(f"{FILE}:python={environment}:mode={mode}", noise)
    reason, _, trace = run.failure.partition("\n")
    text = " ".join(trace.split())
    assert np.isfinite(run.boxes[:, 0]).sum() == (1 if mode == "slow start" else 3), reason
    assert re.search(FAILURES[mode], text), text
    assert mode in ("nan", "garbage") or f"{environment}/bin/python" in reason


def test_hung_worker_ends_with_its_harness(environment, clock_of_hangs, tmp_path, otb):
    """A killed harness cannot end its workers."""
    otb(tmp_path / "Noise", 8)
    text = f"{FILE}:python={environment}:mode=hang"
    code = f"from trackmark import bench; bench.evaluate_run({text!r}, {str(tmp_path / 'Noise')!r})"
    harness = subprocess.Popen([sys.executable, "-c", code])
    wait_until((tmp_path / "hangs").exists)
    assert len(living(str(WORKER))) == 1
    harness.kill()
    harness.wait()
    wait_until(lambda: not living(str(WORKER)))


def wait_until(condition):
    until = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.05)


def test_times_are_those_of_the_worker(environment, tmp_path, noise):
    file = tmp_path / "sleeper.py"
    file.write_text(
        "import time\n"
        "class Sleeper:\n"
        "    def init(self, image, box): self.box = box\n"
        "    def update(self, image):\n"
        "        until = time.process_time() + 0.02\n"
        "        while time.process_time() < until: pass\n"
        "        return self.box\n"
    )
    run = bench.evaluate_run(f"{file}:python={environment}", noise)
    # The CPU time of another process; all of its threads count, so the wall time can be shorter.
    assert run.circumstances["update_seconds"] >= 0.02
    assert run.circumstances["seconds"] >= 0.02
    assert "clock" not in run.circumstances


def test_seed_reaches_arguments_and_global_generators(environment, tmp_path, noise):
    file = tmp_path / "drawing.py"
    file.write_text(
        "import random\nimport numpy as np\n"
        "class Drawing:\n"
        "    def __init__(self, rng): self.rng = rng\n"
        "    def init(self, image, box): pass\n"
        "    def update(self, image):\n"
        "        return [self.rng.random(), np.random.rand(), random.random(), 1]\n"
    )
    text = f"{file}:python={environment}"
    assert parse_tracker(text).randomness is Randomness.GENERATOR
    first, again, other = (bench.evaluate_run(text, noise, repetition=n) for n in (0, 0, 1))
    assert content(first) == content(again)
    assert (first.boxes[1:, :3] != other.boxes[1:, :3]).all()


def test_version_depends_on_source_and_libraries(environment, tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(FILE.read_text())
    text = f"{file}:python={environment}"
    version = parse_tracker(text).version
    assert version["libraries"].keys() == {"python", "numpy"}
    file.write_text("# comment\n" + FILE.read_text())
    assert parse_tracker(text).version == version
    file.write_text(FILE.read_text().replace("/ 1000", "/ 2000"))
    assert parse_tracker(text).version["source"] != version["source"]
    assert parse_tracker(text).version["libraries"] == version["libraries"]


def test_description_lists_parameters(environment):
    description = describe_tracker(f"{FILE}:python={environment}")
    assert description["name"] == "plain_tracker.py:Drift"
    assert [entry["name"] for entry in description["parameters"]] == ["step", "mode"]
    assert description["randomness"] == "generator"
    with pytest.raises(TrackerError, match=r"parameter of plain_tracker.py:Drift 'stop'"):
        parse_tracker(f"{FILE}:python={environment}:stop=1")


def test_plugin_runs_where_trackmark_is_installed(noise):
    external = bench.evaluate_run(f"{static.__file__}:python={sys.executable}:as=still", noise)
    assert content(external) == content(bench.evaluate_run("static", noise))


def test_invalid_interpreter_or_import_is_an_early_error(environment, tmp_path):
    file = tmp_path / "needy.py"
    file.write_text("import no_such_library\n")
    for python, error in {
        "no/such/python": r"no/such/python .*worker.py .*cannot be started: .*No such file",
        environment: r"python -X.*needy.py: .*No module named 'no_such_lib",
    }.items():
        with pytest.raises(TrackerError, match=error):
            resolve_trackers([f"{file}:python={python}"])


TABLE = """
[mine]
file = "plain_tracker.py:Drift"
python = "env"
parameters = { step = 2.0 }
environment = { OMP_NUM_THREADS = "3" }
frame_timeout = 7
version = "1.2"
"""


def test_table_of_a_file_defines_a_tracker(environment, tmp_path, noise, monkeypatch):
    """Relative paths refer to the folder of the file; the table's name is the tracker's."""
    file = tmp_path / "trackers.toml"
    file.write_text(TABLE)
    (tmp_path / "plain_tracker.py").write_text(FILE.read_text())
    (tmp_path / "env").symlink_to(environment)
    spec = parse_tracker(f"{file}:mine")
    assert (spec.label, spec.parameters["step"]) == ("mine:step=2", 2.0)
    assert spec.version["source"] == "1.2"
    assert parse_tracker(f"{file}:mine:step=3").label == "mine:step=3"
    monkeypatch.chdir(tmp_path)
    assert not bench.evaluate_run("trackers.toml:mine", noise).failure


TABLE_ERRORS = {
    "[other]": r"unknown tracker of .*trackers.toml 'mine'\. .*Known: other",
    "[mine]\nfiles = 'a.py'": r"unknown parameter of .*toml:mine 'files'\. Did you mean 'file'",
    "[mine]\npython = 'p'": r"trackers.toml:mine: give either the key 'file'",
    "[mine]\nfile = 'a.py'\nframe_timeout = 'x'": r"mine: parameter frame_timeout=x: .* number",
    "[mine]\nfile = 'a.py'\ntrax = 'b'": r"trackers.toml:mine: give either the key 'file'",
    "mine = 1": r"mine is a value\. Expected: a table \[mine\]",
    "[mine": r"trackers.toml: Expected",
}


@pytest.mark.parametrize("content", TABLE_ERRORS)
def test_invalid_table_names_file_and_key(tmp_path, content):
    file = tmp_path / "trackers.toml"
    file.write_text(content)
    with pytest.raises(TrackerError, match=TABLE_ERRORS[content]):
        parse_tracker(f"{file}:mine")


def test_examples_of_the_page_work(environment, tmp_path, noise):
    page = (Path(__file__).parents[3] / "docs" / "external.md").read_text()
    code, table = (re.search(rf"```{name}\n(.*?)```", page, re.S)[1] for name in ("python", "toml"))
    (tmp_path / "matcher.py").write_text(code)
    (tmp_path / "trackers.toml").write_text(table)
    (tmp_path / "envs").mkdir()
    (tmp_path / "envs" / "torch").symlink_to(environment)
    assert not bench.evaluate_run(f"{tmp_path}/trackers.toml:mine:size=3", noise).failure


def test_worker_has_syntax_of_python_3_6():
    ast.parse(WORKER.read_text("utf-8"), feature_version=(3, 6))
