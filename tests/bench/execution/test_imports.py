"""Tracker files whose import, or whose defaults, differ between processes."""

import shutil
import sys

import pytest

from trackmark.bench.execution.executor import Execution
from trackmark.bench.experiments.experiment import Experiment, SequenceSpec
from trackmark.bench.experiments.tracker_spec import resolve_specs
from trackmark.trackers import TrackerError

TRACKER = """
class Tracker:
    {arguments}

    def init(self, image, box):
        self.box = box

    def update(self, image):
        return self.box
"""
EXCLUSIVE = """
import os
try:
    os.mkdir("used")
except FileExistsError:
    raise RuntimeError("the device is in use by another process") from None
"""


@pytest.fixture
def errors(tmp_path, monkeypatch):
    """Return the errors of runs on two sequences, or the states of the runs."""
    monkeypatch.chdir(tmp_path)

    def run(text, option=""):
        (tmp_path / "mine.py").write_text(text)
        shutil.rmtree("used", ignore_errors=True)
        sources = tuple(map(SequenceSpec, ("samples/face", "samples/bow-tie")))
        execution = Execution(
            Experiment("e", (f"mine.py{option}",), sources), tmp_path / "results", 2
        )
        finished = [row["status"] for row in execution.rows()]
        return execution.tracker_errors or finished

    return run


def test_import_that_fails_in_the_worker_is_shown_once(errors):
    assert errors(EXCLUSIVE + TRACKER.format(arguments="")) == [
        "mine.py: the file cannot be imported: RuntimeError: the device is in use by another "
        "process (line 6). This happens in a worker process, which imports the file again."
    ]


def test_start_that_fails_in_the_worker_is_shown_once(errors):
    (error,) = errors(EXCLUSIVE + TRACKER.format(arguments=""), f":python={sys.executable}")
    assert error.endswith(
        "mine.py: the process raised RuntimeError: the device is in use by another process. This "
        "happens in a worker process, which imports the file again."
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (
            "def __init__(self, a=1, process=os.getpid()): pass",
            "the default of the argument 'process'",
        ),
        ("name = f'tracker-{os.getpid()}'", "its name"),
    ],
)
def test_value_that_differs_in_each_process_is_named(errors, arguments, problem):
    (error,) = errors("import os\n" + TRACKER.format(arguments=arguments))
    assert error.startswith(f"mine.py: {problem} differs in each process, for example ")
    assert error.endswith("not depend on the process, the time or a random number.")


def test_random_default_is_equal_in_each_process(errors):
    text = "import random\n" + TRACKER.format(arguments="def __init__(self, a=random.random()): 0")
    assert errors(text) == ["finished"] * 2


@pytest.mark.parametrize("option", ["", f":python={sys.executable}"])
def test_arguments_of_the_process_are_not_those_of_the_file(tmp_path, option):
    file = tmp_path / "mine.py"
    parser = "import argparse\nparser = argparse.ArgumentParser()\n"
    lines = "parser.add_argument('video')\nparser.parse_args()\n"
    file.write_text(parser + lines + TRACKER.format(arguments=""))
    before = list(sys.argv)
    message = "arguments are required: video" if option else r"SystemExit: 2 \(line 4\).*__main__"
    with pytest.raises(TrackerError, match=message):
        resolve_specs([f"{file}{option}"])
    assert sys.argv == before
    file.write_text(
        "import sys\nassert len(sys.argv) == 1, sys.argv\n" + TRACKER.format(arguments="")
    )
    assert resolve_specs([f"{file}{option}"])
