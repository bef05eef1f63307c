"""Trackers of Python files in another interpreter."""

import ast
from pathlib import Path

import numpy as np
import pytest

from tests.bench.external.conftest import DRIFT, living
from trackmark.bench.evaluation.loop import evaluate_run
from trackmark.bench.experiments.tracker_spec import describe_tracker, parse_tracker
from trackmark.bench.external.definition import open_external
from trackmark.bench.external.worker_process import WORKER
from trackmark.trackers import Randomness
from trackmark.trackers.base import estimate_check, global_generators, plain_class

NAME = "plain_tracker.py"
pytestmark = pytest.mark.usefixtures("folder")


def content(run):
    segmentation = run.segmentation and run.segmentation.region_similarity.tobytes()
    details = {name: values.tobytes() for name, values in run.details.items()}
    rows = run.boxes.tobytes(), run.visible.tobytes(), run.confidence.tobytes()
    return run.failure, rows, details, segmentation


@pytest.mark.parametrize(
    ("mode", "protocol"), [("calm", "tre:starts=3"), ("rich", "one-pass"), ("flood", "one-pass")]
)
def test_boxes_equal_those_of_the_own_interpreter(environment, mode, protocol):
    """Each segment of a protocol has a new tracker in the same process of its environment."""
    expected, external = (
        evaluate_run(f"{NAME}{python}:mode={mode}", "Noise", repetition=3, protocol=protocol)
        for python in ("", f":python={environment}")
    )
    assert not expected.failure
    assert content(external) == content(expected)
    assert external.identity.tracker == expected.identity.tracker
    assert len(living(str(WORKER))) == 2


@pytest.mark.slow
def test_other_version_of_python_gives_equal_boxes(other_environment):
    for mode in ("calm", "rich"):
        external = evaluate_run(f"{NAME}:python={other_environment}:mode={mode}", "Noise")
        assert content(external) == content(evaluate_run(f"{NAME}:mode={mode}", "Noise"))


MASKED = """
class Masked:
    def init(self, image, box, mask): self.box, self.mask = box, mask
    def update(self, image): return {"box": self.box, "mask": self.mask}
"""


def test_masks_are_passed_in_both_directions(environment, folder):
    (folder / "masked.py").write_text(MASKED)
    tracker = open_external("masked.py", {"python": str(environment)}).create()
    image = np.random.default_rng(0).integers(0, 256, (30, 41, 3), np.uint8)
    mask = image[::-1, :, 0] > 99
    tracker.init(image, np.array([1.0, 2, 3, 4]), mask)
    assert np.array_equal(tracker.update(image).mask, mask)


def test_interpreter_may_print_before_it_starts(environment, folder):
    (folder / "activate.sh").write_text(
        f'#!/bin/sh\necho ready\nexec {environment}/bin/python "$@"'
    )
    (folder / "activate.sh").chmod(0o755)
    assert not evaluate_run(f"{NAME}:python=./activate.sh", "Noise").failure


DRAWING = """
import random
import numpy as np
class Drawing:
    def __init__(self, rng): self.rng = rng
    def init(self, image, box): pass
    def update(self, image):
        return [self.rng.random(), np.random.rand(), random.random(), 1]
"""


def test_seeds_are_those_of_the_repetition(environment, folder):
    (folder / "drawing.py").write_text(DRAWING)
    text = f"drawing.py:python={environment}"
    assert parse_tracker(text).randomness is Randomness.GENERATOR
    first, again, other = (evaluate_run(text, "Noise", repetition=n) for n in (0, 0, 1))
    assert content(first) == content(again)
    assert (first.boxes[1:, :3] != other.boxes[1:, :3]).all()


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


WORKER_FILES = [WORKER, *(m.__file__ for m in (plain_class, estimate_check, global_generators))]


@pytest.mark.parametrize("file", WORKER_FILES)
def test_worker_has_syntax_of_python_3_6(file):
    ast.parse(Path(file).read_text("utf-8"), feature_version=(3, 6))
