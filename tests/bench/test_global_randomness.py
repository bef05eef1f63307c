"""Trackers that draw from global random generators, by all ways in."""

import sys

import cv2
import numpy as np
import pytest

import trackmark as tm
from trackmark.bench.evaluation.loop import evaluate_run, run_protocol
from trackmark.bench.execution.executor import Execution
from trackmark.bench.experiments.experiment import Experiment, SequenceSpec
from trackmark.bench.experiments.tracker_spec import parse_tracker

SOURCE = '''
import random
import cv2
import numpy as np

AT_IMPORT = np.random.random()

class Base:
    def init(self, image, box):
        self.box = np.array(box, float)

    def update(self, image):
        return self.box + [*self.draw(), 0, 0]

class Python(Base):
    def draw(self): return random.gauss(0, 1), random.random()

class Numpy(Base):
    def draw(self): return AT_IMPORT, np.random.normal()

class OpenCV(Base):
    def draw(self):
        step = np.zeros((1, 2))
        cv2.randn(step, 0, 1.5)
        return step[0]

class Fails(Base):
    def draw(self): raise ValueError("no model")

class DrawsAndFails(Base):
    def draw(self): raise ValueError(f"{random.random()}")

class Mil:
    """OpenCV's tracker draws from its own generator and that of C."""
    def init(self, image, box):
        self.tracker = cv2.TrackerMIL_create()
        self.tracker.init(image, tuple(int(value) for value in box))

    def update(self, image):
        return self.tracker.update(image)[1]
'''
NAMES = ["Python", "Numpy", "OpenCV"]


@pytest.fixture
def file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "drawing.py"
    file.write_text(SOURCE)
    return file


def execute(file, names, output, jobs=1, repetitions=2):
    """Return execution and boxes by key."""
    texts = tuple(f"{file}:{name}" for name in names)
    sources = (SequenceSpec("plain/target:length=12:scene=1"),)
    experiment = Experiment("e", texts, sources, repetitions)
    execution = Execution(experiment, output, jobs)
    list(execution.rows())
    runs = tm.load_runs(execution.folder)
    assert [run.failure for run in runs.values()] == [""] * len(runs)
    return execution, {key: run.boxes for key, run in runs.items()}


@pytest.mark.slow
@pytest.mark.parametrize("name", [*NAMES, "Mil"])
def test_boxes_depend_on_seed_only_in_one_process(file, name, make_sequence):
    text = f"{file}:{name}"
    sequence = tm.load_sequence("samples/face")[:9] if name == "Mil" else make_sequence(n=9)
    alone = [evaluate_run(text, sequence, n).boxes for n in (0, 1)]
    cv2.setRNGSeed(3)
    np.random.seed(3)  # noqa: NPY002  # the global generator is tested
    spec, other = parse_tracker(text), parse_tracker(f"{file}:OpenCV")
    runs = run_protocol([(other, 0), (spec, 0), (spec, 1)], sequence).runs[1:]
    for run, boxes in zip(runs, alone, strict=True):
        np.testing.assert_array_equal(run.boxes, boxes)
        assert run.metadata["generators"]
    assert not np.array_equal(*alone)


@pytest.mark.parametrize(("name", "generators"), [("Fails", None), ("DrawsAndFails", ["random"])])
def test_failed_run_names_its_own_generators_only(file, make_sequence, name, generators):
    run = evaluate_run(f"{file}:{name}", make_sequence(n=9))
    assert "ValueError" in run.failure
    assert run.metadata.get("generators") == generators


@pytest.mark.slow
def test_stochastic_trackers_are_repeated_and_reported(file, tmp_path, caplog):
    _, first = execute(file, ["Numpy"], tmp_path / "first", repetitions=1)
    assert len(first) == 1
    caplog.clear()
    names = ["OpenCV", "Numpy"]
    execution, boxes = execute(file, names, tmp_path / "first")
    assert len(boxes) == len(execution.plan) == 4
    drew = [message.split()[0] for message in caplog.messages if "draws from" in message]
    assert drew == ["drawing.py:OpenCV"]  # the other tracker is known
    (key,) = first
    np.testing.assert_array_equal(boxes[key], first[key])
    _, others = execute(file, names[::-1], tmp_path / "second", jobs=2)
    assert others.keys() == boxes.keys()
    for key in boxes:
        np.testing.assert_array_equal(boxes[key], others[key])


@pytest.mark.slow
def test_evaluate_repeats_and_reports_stochastic_classes(file, tmp_path):
    texts = [f"{file}:{name}" for name in NAMES]
    with pytest.warns(RuntimeWarning) as warned:
        results = tm.evaluate([*texts, "static"], "plain/target:length=12:scene=1", repetitions=2)
    assert [str(warning.message) for warning in warned] == [
        f"drawing.py:{name} draws from global random generators ({generator}), so it counts as "
        "stochastic. They are seeded for each run."
        for name, generator in zip(NAMES, ("random", "numpy.random", "OpenCV"), strict=True)
    ]
    assert len(results) == 7
    _, stored = execute(file, NAMES, tmp_path)
    for key, boxes in stored.items():
        np.testing.assert_array_equal(results[key].boxes, boxes)


def test_other_interpreter_gives_the_same_boxes(file, make_sequence):
    for name in NAMES:
        text = f"{file}:{name}"
        far = evaluate_run(f"{text}:python={sys.executable}", make_sequence(n=9), 1)
        near = evaluate_run(text, make_sequence(n=9), 1)
        np.testing.assert_array_equal(far.boxes, near.boxes)
        assert far.metadata["generators"] == near.metadata["generators"]


def test_built_in_trackers_do_not_pay(make_sequence, monkeypatch):
    monkeypatch.setattr("trackmark.bench.evaluation.run_context.GlobalGenerators", None)
    assert not evaluate_run("camshift", make_sequence(n=3)).failure
