"""Adapter of plain trackers: signatures, returned values, parameters and random numbers."""

from types import SimpleNamespace

import numpy as np
import pytest

from trackmark import trackers
from trackmark.trackers import Estimate, Randomness, TrackerError
from trackmark.trackers.base.estimate_check import MalformedEstimateError, read_estimate
from trackmark.trackers.base.plain import to_plugin
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
    assert (estimate.box.tolist(), estimate.confidence) == ([6.0, 2.0, 3.0, 4.0], 0.5)


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
    fields = read_estimate(answer, IMAGE.shape)
    assert fields["box"] == BOX
    assert fields["visible"] is True
    assert fields["details"] == {}


class Hostile:
    """Object whose attributes and text raise exceptions."""

    def __getattr__(self, name):
        raise RuntimeError("no\nattributes")

    def __repr__(self):
        raise RuntimeError


MALFORMED = [
    ({"box": BOX, "score": 1.0}, "keys 'box', 'score'. Expected: 'box', and only"),
    ({}, "a dict with the keys (none). Expected: 'box'"),
    ((True, BOX), "update returned (True, [1.0, 2.0, 3.0, 4.0]). This looks like (ok, box)"),
    ((0.5, BOX), "Expected: (box, confidence), in this order"),
    ([BOX], "the box is [[1.0, 2.0, 3.0, 4.0]]. Expected: four numbers"),
    (np.array([BOX]), "the box is an array of shape (1, 4) and type float64"),
    (np.ma.array(BOX, mask=[0, 0, 1, 0]), "an array has masked values"),
    (["1", "2", "3", "4"], "the box is ['1', '2', '3', '4']"),
    ([True] * 4, "the box is [True, True, True, True]"),
    (np.array(BOX, complex), "the box is array([1.+0.j"),
    (np.array([np.inf, 2, 3, 4], np.float16), "the box [inf, 2.0, 3.0, 4.0] is invalid"),
    ([1, 2, 0, 4], "the box [1.0, 2.0, 0.0, 4.0] is invalid"),
    (Hostile, "an object of type Hostile, whose attributes raise RuntimeError("),
    ((BOX, "0.5"), "the confidence is '0.5'. Expected: a number in [0, 1], or NaN"),
    ((BOX, np.inf), "the confidence inf is not in [0, 1] or NaN"),
    ({"box": BOX, "visible": "no"}, "visible is 'no'. Expected: true or false"),
    ({"box": BOX, "mask": [[True]]}, "the mask is of type list. Expected: an array of bool"),
    ({"box": BOX, "mask": np.zeros((9, 8), bool)}, "Expected: bool of the image's shape (9, 9)"),
    ({"box": BOX, "details": [1]}, "the details are [1]. Expected: a dict of numbers by name"),
    ({"box": BOX, "details": {"a": np.zeros((5, 5))}}, "details['a'] is an array of shape (5, 5)"),
    ({"box": BOX, "details": {1: 1.0}}, "details[1] is 1.0. Expected: a number by its name"),
]


@pytest.mark.parametrize(("answer", "problem"), MALFORMED)
def test_malformed_estimate_has_a_reason_of_one_line(answer, problem):
    with pytest.raises(MalformedEstimateError) as raised:
        read_estimate(Hostile() if answer is Hostile else answer, IMAGE.shape)
    assert problem in str(raised.value)
    assert "\n" not in str(raised.value)
    assert len(str(raised.value)) < 300


@pytest.mark.parametrize(
    "answer",
    [
        None,
        (None, 0.25),
        [0, 0, 0, 0],
        (np.zeros(4), 0.25),
        {"visible": False},
        {"box": None, "visible": np.False_, "confidence": 0.25},
        Estimate(np.zeros(4)),
    ],
)
def test_missing_box_keeps_the_last_box_and_is_not_visible(answer):
    class Lost:
        def init(self, image, box):
            self.answers = [[1, 2, 5, 6], answer]

        def update(self, image):
            return self.answers.pop(0)

    plugin = to_plugin(Lost)
    tracker = plugin(plugin.Parameters(), np.random.SeedSequence(0))
    tracker.init(IMAGE, np.array(BOX))
    estimates = [tracker.update(IMAGE) for _ in range(2)]
    assert [estimate.visible for estimate in estimates] == [True, False]
    assert [estimate.box.tolist() for estimate in estimates] == [[1, 2, 5, 6]] * 2


def test_static_methods_are_methods_of_a_tracker():
    class Static:
        @staticmethod
        def init(image, box): ...

        @staticmethod
        def update(image):
            return BOX

    plugin = to_plugin(Static)
    tracker = plugin(plugin.Parameters(), np.random.SeedSequence(0))
    tracker.init(IMAGE, np.array(BOX))
    assert tracker.update(IMAGE).box.tolist() == BOX


@pytest.mark.parametrize(
    ("images", "pixel"), [("bgr", [10, 20, 30]), ("rgb", [30, 20, 10]), ("grey", 22)]
)
def test_images_have_the_declared_channels(tmp_path, images, pixel):
    seen = "self.seen = image[0, 0].tolist(), image.flags.writeable"
    update = f"def update(self, image): {seen}; return [1, 2, 3, 4]"
    declared = f"class Colour:\n    images = {images!r}\n    def init(self, image, box): ...\n"
    (tmp_path / "declared.py").write_text(f"{declared}    {update}\n")
    (tmp_path / "option.py").write_text(f"{declared}    {update}\n".replace(repr(images), "[]"))
    image = np.full((9, 9, 3), [10, 20, 30], np.uint8)
    image.flags.writeable = False
    for tracker in (
        trackers.create(str(tmp_path / "declared.py")),
        trackers.create(str(tmp_path / "option.py"), images=images),
    ):
        tracker.init(image, np.array(BOX))
        tracker.update(image)
        assert tracker.plain.seen == (pixel, False)


def test_invalid_images_are_an_error_before_the_run(plain):
    with pytest.raises(TrackerError, match=r"value of images of .* 'gray'\. Did you mean 'grey'"):
        trackers.create(plain, images="gray")
    with pytest.raises(TrackerError, match="parameter of camshift 'images'"):
        trackers.create("camshift", images="rgb")


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
    created = [plugin(plugin.Parameters(), np.random.SeedSequence(s)).plain for s in (1, 1, 2)]
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

    class Painted(Lacks):
        update = print
        images = "RGB"

    class Reserved(Lacks):
        update = print

        def __init__(self, model_config="a.yaml"): ...

    for tracker, message in (
        (Lacks, "'Lacks': it lacks update"),
        (Takes, "the argument 'size' has no default"),
        (Short, r"init takes \(image\). Expected: init\(image, box\)"),
        (Reserved, "the argument 'model_config' has a reserved name"),
        (Painted, "images is 'RGB'. Expected one of: bgr, rgb, grey"),
        (Odd, "the randomness is 'some'. Expected one of: none, generator, process"),
    ):
        with pytest.raises(TrackerError, match=message):
            to_plugin(tracker)


def test_file_imports_modules_next_to_it(tmp_path):
    (tmp_path / "steps_of_plain.py").write_text("STEP = 7")
    code = "from steps_of_plain import STEP\n" + SOURCE.replace("step: float = 1", "step=STEP")
    (tmp_path / "importing.py").write_text(code)
    assert trackers.describe(str(tmp_path / "importing.py"))["parameters"][0]["default"] == 7
