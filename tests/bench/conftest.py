"""Small sequences and trackers that misbehave, for the harness's tests."""

import os
import re
import subprocess
import sys
import threading
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from matplotlib.figure import Figure

from tests import browser
from trackmark import datasets
from trackmark.bench.cli import main
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.execution import worker
from trackmark.bench.execution.executor import run_experiment
from trackmark.bench.experiments.experiment import Experiment, SequenceSpec
from trackmark.bench.experiments.tracker_spec import Identity
from trackmark.bench.store.database import run_key
from trackmark.bench.store.run_store import RunStore
from trackmark.bench.store.truth import StoredTruth


class Noise:
    """Frames of reproducible noise, generated on request; `requested` lists their numbers."""

    def __init__(self, n, height=24, width=32):
        self.n, self.shape = n, (height, width, 3)
        self.requested = []

    def __len__(self):
        return self.n

    def __getitem__(self, frame):
        self.requested.append(frame)
        return np.random.default_rng(frame).integers(0, 256, self.shape, dtype=np.uint8)


def straight_line(n, absent=()):
    """Return boxes of a target of 8 x 6 px that moves 0.5 px per frame."""
    boxes = np.array([[2.0 + 0.5 * i, 3.0, 8.0, 6.0] for i in range(n)])
    boxes[list(absent)] = np.nan
    return boxes


@pytest.fixture
def make_sequence():
    def make(n=20, absent=(), name="line", **options):
        return datasets.Sequence(
            name, Noise(n), straight_line(n, absent), fingerprint=f"noise {n} {absent}", **options
        )

    return make


KNOB_TRACKER = '''
"""A tracker with a knob."""
from pydantic import Field
from trackmark.trackers.base.interface import Estimate, Randomness, TrackerPlugin
from trackmark.trackers.base.parameters import Parameters


class KnobParameters(Parameters):
    knob: int = Field(1, description="knob [frames]")


class Knob(TrackerPlugin):
    """Draws."""

    randomness = Randomness.GENERATOR
    Parameters = KnobParameters

    def init(self, image, box, mask=None):
        import numpy
        self.random = numpy.random.default_rng(self.seed)
        self.box = box

    def update(self, image):
        return Estimate(self.box + [self.random.random(), 0, 0, 0])
'''


@pytest.fixture(scope="session")
def otb():
    """Return a function that writes an OTB sequence of noise whose target never moves."""

    def write(folder, frames, first=1):
        (folder / "img").mkdir(parents=True)
        for i in range(frames):
            image = np.random.default_rng(i).integers(0, 256, (40, 50, 3), dtype=np.uint8)
            cv2.imwrite(str(folder / "img" / f"{first + i:04}.png"), image)
        (folder / "groundtruth_rect.txt").write_text("5,6,10,12\n" * frames)
        return folder

    return write


@pytest.fixture
def workspace(tmp_path, otb):
    """Return a folder with an OTB sequence and a tracker file."""
    otb(tmp_path / "data" / "Small", 5)
    (tmp_path / "knob.py").write_text(KNOB_TRACKER)
    return tmp_path


@pytest.fixture(scope="session")
def chromium(tmp_path_factory):
    opened = browser.Browser(tmp_path_factory.mktemp("profile"))
    yield opened
    opened.close()


@pytest.fixture(scope="session")
def axe():
    """Provide the script of axe-core."""
    return pytest.importorskip("axe_core_python.base").AXE_SCRIPT


class InProcessPool:
    """Pool that executes tasks in this process."""

    lock = threading.Lock()

    def __init__(self, n_workers, limits=None, environment=None):
        self.limits = limits

    def run(self, next_call):
        while (call := next_call()) is not None:
            yield call, call()

    def run_tasks(self, tasks, progress=lambda work: None):
        work = 0
        for task in tasks:
            try:
                with self.lock:
                    result = worker.run_task(task, self.limits)
            except datasets.SequenceError as error:
                result = error
            work += task.work
            progress(work)
            yield task, result

    def close(self):
        """Do nothing: there is no process to end."""


@pytest.fixture(scope="session")
def without_processes():
    """Run trackers in this process. The tests of the pool check that workers give equal results."""

    @contextmanager
    def within():
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("trackmark.bench.execution.pool.Pool", InProcessPool)
            yield

    return within


@pytest.fixture(scope="session")
def run_trial(without_processes):
    """Return a function that runs a small experiment in this process and returns its folder."""

    def run(folder, trackers, sequences, **options):
        sources = tuple(map(SequenceSpec, sequences))
        with without_processes():
            return run_experiment(
                Experiment("trial", tuple(trackers), sources, **options), folder, jobs=1
            )

    return run


@pytest.fixture(scope="session")
def store_many():
    """Return a function that stores runs of any number of trackers and sequences.

    The estimates are the boxes of the ground truth with noise. The sequences cannot be opened.
    """

    def store(folder, n_sequences, n_trackers, n_frames=12, source="1"):
        random, truths, runs = np.random.default_rng(0), [], []
        for s in range(n_sequences):
            name, fingerprint = f"sequence-{s}", f"fingerprint {s}"
            boxes = straight_line(n_frames)
            attributes = {"OCC": np.arange(n_frames) > 5}
            visibility = np.ones(n_frames)
            truths.append(
                StoredTruth(name, fingerprint, boxes, {}, visibility, attributes, 30.0, (320, 240))
            )
            for t in range(n_trackers):
                version = {"source": source, "libraries": {}}
                tracker = f"tracker-{t}", f"tracker-{t}", "recommended", {}, version
                noise = random.normal(0, 1 + t / n_trackers, boxes.shape) * [1, 1, 0, 0]
                noise[0] = 0
                run = Run(
                    Identity(*tracker, name, fingerprint, 0, "one-pass"),
                    boxes + noise,
                    np.ones(n_frames, np.bool_),
                    np.full(n_frames, np.nan),
                    metadata={"seconds": 0.1, "update_seconds": 0.01, "source": f"/{name}"},
                )
                runs.append(run)
        results = RunStore(folder)
        requested = {run_key(run.identity): run.identity.version for run in runs}
        results.add_requests(requested, "Many runs")
        results.add_all([(run, "") for run in runs], truths)
        return results

    return store


@pytest.fixture
def in_this_process(without_processes):
    """Run trackers in this process during a test."""
    with without_processes():
        yield


@pytest.fixture
def trackmark(workspace, in_this_process, monkeypatch, capsys):
    """Return a function that runs a command line in this process, in a folder with data."""
    monkeypatch.chdir(workspace)
    monkeypatch.setenv("TRACKMARK_CACHE", str(workspace / "cache"))
    monkeypatch.setattr("trackmark.bench.cli.prepare_numba", lambda tell: None)
    monkeypatch.setattr(
        "trackmark.bench.commands._progress.NOTICE_DELAY", 1e6
    )  # seconds: no notices of slow steps

    def call(*arguments, status=0):
        capsys.readouterr()
        with pytest.raises(SystemExit) as ended:
            main(list(map(str, arguments)))
        printed = capsys.readouterr()
        assert (ended.value.code or 0) == status, printed.out + printed.err
        return SimpleNamespace(stdout=printed.out, stderr=printed.err)

    return call


@pytest.fixture
def trackmark_process(workspace):
    """Run the command in a process of its own, which starts others for its trackers.

    `status`: expected exit status; None accepts any.
    """
    script = Path(sys.executable).parent / "trackmark"

    def call(*arguments, status=0, **options):
        done = subprocess.run(
            [script, *map(str, arguments)],
            cwd=workspace,
            capture_output=True,
            text=True,
            timeout=900,
            env=os.environ | {"TRACKMARK_CACHE": str(workspace / "cache")},
            **options,
        )
        error_lines = done.stderr.splitlines(keepends=True)
        # Drop notices of slow steps: they depend on the load of the machine.
        done.stderr = "".join(line for line in error_lines if not line.endswith(" …\n"))
        assert "Traceback" not in done.stderr, done.stderr
        assert status in (None, done.returncode), done.stdout + done.stderr
        return done

    return call


def messages(done):
    """Return the lines that a command printed to standard error, except progress and hints."""
    hint = r"\d\d:\d\d:\d\d |Next  |Random trackers|Runs are in|.*: read as |$"
    return [line for line in done.stderr.splitlines() if not re.match(hint, line)]


@pytest.fixture
def one_line():
    """Return a function that returns the only error line of a command, apart from progress."""

    def line_of(done):
        (line,) = messages(done)
        return line

    return line_of


@pytest.fixture
def blank_figures(monkeypatch):
    """Write files without content instead of figures: drawing takes most of a report's time."""
    monkeypatch.setattr(Figure, "savefig", lambda figure, file, **options: Path(file).touch())


@pytest.fixture
def break_tracker(workspace):
    """Replace the return statement of the tracker in knob.py; by default it raises."""

    def replace_return(statement="raise ValueError('no idea')"):
        file = workspace / "knob.py"
        file.write_text(file.read_text().replace("return Estimate", f"{statement}  #"))

    return replace_return
