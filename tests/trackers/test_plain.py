"""Adapter of plain trackers: signatures, returned values, parameters and random numbers."""

from types import SimpleNamespace

import numpy as np
import pytest

from trackmark import trackers
from trackmark.trackers import Estimate, Randomness, TrackerError
from trackmark.trackers.base.plain import to_estimate, to_plugin
from trackmark.trackers.base.plain_class import adapt_init

BOX = [1.0, 2.0, 3.0, 4.0]
IMAGE = np.zeros((9, 9, 3), np.uint8)
SOURCE = """
class Plain:
    \"\"\"Moves right.\"\"\"

    def __init__(self, seed, step: float = 1, twice=False, callback=None):
        self.step, self.seed = step * (1 + twice), seed

    def init(self, image, box):
        self.box = box

    def update(self, image):
        self.box = [self.box[0] + self.step, *self.box[1:]]
        return self.box, 0.5
"""


@pytest.fixture
def plain(tmp_path):
    file = tmp_path / "plain.py"
    file.write_text(SOURCE)
    return str(file)


def test_plain_class_of_a_file_is_a_tracker_with_parameters(plain):
    described = trackers.describe(plain)
    assert (described["name"], described["summary"]) == ("plain.py:Plain", "Moves right.")
    assert described["randomness"] == "generator"
    assert [(p["name"], p["type"], p["default"]) for p in described["parameters"]] == [
        ("step", "float", 1.0),
        ("twice", "bool", False),
    ]
    tracker = trackers.create(plain, step="2.5", twice="true")
    tracker.init(IMAGE, np.array(BOX))
    estimate = tracker.update(IMAGE)
    assert (estimate.box, estimate.confidence) == ([6.0, 2.0, 3.0, 4.0], 0.5)


@pytest.mark.parametrize(
    "answer",
    [
        BOX,
        np.array(BOX),
        (*BOX,),
        (BOX, 0.5),
        {"box": BOX, "confidence": 0.5},
        SimpleNamespace(box=BOX, visible=True),
        {"box": BOX, "visible": None, "confidence": None, "details": None},
        Estimate(np.array(BOX)),
    ],
)
def test_returned_value_of_each_form_is_an_estimate(answer):
    estimate = to_estimate(answer)
    assert list(estimate.box) == BOX
    assert estimate.visible is True
    assert estimate.details == {}


def test_dict_with_an_unknown_key_is_an_error():
    with pytest.raises(TrackerError, match=r"keys 'box', 'score'\. Expected: 'box', and only"):
        to_estimate({"box": BOX, "score": 1.0})


@pytest.mark.parametrize(
    ("init", "arguments"),
    [
        (lambda image, box: (image, box), (1, 2)),
        (lambda image, box, scale=1: (image, box, scale), (1, 2, 1)),
        (lambda *images: images, (1, 2)),
        (lambda image, box, mask: (image, box, mask), (1, 2, 3)),
        (lambda image, box, *, mask=None: (image, box, mask), (1, 2, 3)),
    ],
)
def test_mask_is_passed_if_the_signature_has_it(init, arguments):
    assert adapt_init(init)(1, 2, 3) == arguments


def test_random_arguments_are_equal_for_equal_seeds():
    class Random:
        def __init__(self, **values):
            vars(self).update(values)

        def init(self, image, box):
            self.box = box

        def update(self, image):
            return self.box

    def make(seed, rng):
        return Random(seed=seed, draw=rng.normal())

    plugin = to_plugin(make)
    assert plugin.randomness is Randomness.GENERATOR
    created = [plugin(plugin.Parameters(), np.random.SeedSequence(s))._tracker for s in (1, 1, 2)]
    assert (created[0].seed, created[0].draw) == (created[1].seed, created[1].draw)
    assert created[0].seed != created[2].seed
    assert type(created[0].seed) is int
    assert to_plugin(Random).randomness is Randomness.NONE


def test_unusable_class_is_an_error_before_it_is_created():
    class Lacks:
        def init(self, image, box): ...

    class Takes(Lacks):
        update = print

        def __init__(self, size): ...

    class Short(Lacks):
        update = print

        def init(self, image): ...

    class Odd(Lacks):
        update = print
        randomness = "some"

    class Reserved(Lacks):
        update = print

        def __init__(self, model_config="a.yaml"): ...

    for tracker, message in (
        (Lacks, "'Lacks': it lacks update"),
        (Takes, "the argument 'size' has no default"),
        (Short, r"init takes \(image\). Expected: init\(image, box\)"),
        (Reserved, "the argument 'model_config' has a reserved name"),
        (Odd, "the randomness is 'some'. Expected one of: none, generator, process"),
    ):
        with pytest.raises(TrackerError, match=message):
            to_plugin(tracker)


def test_file_imports_modules_next_to_it(tmp_path):
    (tmp_path / "steps_of_plain.py").write_text("STEP = 7")
    code = "from steps_of_plain import STEP\n" + SOURCE.replace("step: float = 1", "step=STEP")
    (tmp_path / "importing.py").write_text(code)
    assert trackers.describe(str(tmp_path / "importing.py"))["parameters"][0]["default"] == 7
