"""OpenCV's trackers behind our interface."""

import ctypes

import cv2
import numpy as np
import pytest

import trackers
from trackers.base.opencv import OpenCVTracker, factory, pixel_rectangle
from trackers.base.parameters import Parameters, TrackerError


def boxes_of(tracker, clip):
    tracker.init(clip.images[0], clip.boxes[0])
    return np.array([tracker.update(image).box for image in clip.images[1:]])


def usable(name):
    try:
        return trackers.resolve(name)
    except TrackerError as error:
        pytest.skip(str(error))


class Scripted(OpenCVTracker):
    """Says what a test wants of it."""

    def _make(self):
        return self.script


def scripted(*answers):
    class Script:
        def init(self, image, rectangle):
            self.rectangle = rectangle
            self.left = list(answers)

        def update(self, image):
            return self.left.pop(0)

    tracker = Scripted(Parameters(), np.random.SeedSequence(0))
    tracker.script = Script()
    return tracker


IMAGE = np.zeros((60, 80, 3), np.uint8)


@pytest.mark.parametrize(
    "answer",
    [(False, (0, 0, 0, 0)), (False, (9, 9, 9, 9)), (True, (5, 5, 0, 7)), (True, (5, 5, 7, -1))]
    + [(True, (np.nan, 5, 7, 7)), (True, (5, np.inf, 7, 7))],
)
def test_a_lost_target_or_a_box_without_area_is_the_last_good_box_not_visible(answer):
    tracker = scripted(answer, (True, (4.5, 4, 4, 4.25)), answer, answer)
    first = np.array([1.5, 2.5, 10.25, 10.0])
    tracker.init(IMAGE, first)
    first[:] = -1  # the caller's own
    lost = tracker.update(IMAGE)
    assert lost.box.tolist() == [1.5, 2.5, 10.25, 10.0]
    assert not lost.visible
    found = tracker.update(IMAGE)
    assert found.visible
    assert found.box.tolist() == [4.5, 4, 4, 4.25]  # as it is given
    for _ in range(2):
        lost = tracker.update(IMAGE)
        assert lost.box.tolist() == [4.5, 4, 4, 4.25]
        assert not lost.visible
        lost.box[:] = -1  # the caller's own as well


@pytest.mark.parametrize(
    ("box", "expected"),
    [
        ((3, 4, 5, 6), (3, 4, 5, 6)),
        ((3.4, 4.6, 5, 6), (3, 5, 5, 6)),
        ((-5, -5, 20, 20), (0, 0, 15, 15)),
        ((70, 50, 20, 20), (70, 50, 10, 10)),
        ((79.8, 59.9, 0.1, 0.1), (79, 59, 1, 1)),
    ],
)
def test_first_boxes_by_hand(box, expected):
    assert pixel_rectangle(np.array(box, float), IMAGE) == expected


def test_a_target_too_small_for_opencv_is_refused_in_one_line():
    # OpenCV's own init would never return.
    tracker = trackers.create("opencv-mil")
    with pytest.raises(TrackerError, match="MIL needs a first box of at least 5 x 5 pixels"):
        tracker.init(IMAGE, np.array([10.0, 10.0, 30.0, 4.0]))


def test_what_opencv_refuses_is_a_clear_error(moving_target):
    clip = moving_target(size=(120, 90), start=(0, 0), velocity=(0, 0))
    with pytest.raises(TrackerError, match=r"MIL refuses the first box \(0, 0, 120, 90\)"):
        trackers.create("opencv-mil").init(clip.images[0], clip.boxes[0])


def test_a_tracker_that_the_installed_opencv_lacks_says_what_to_install():
    with pytest.raises(ImportError, match="has no TrackerOfTheFuture; install opencv-contrib"):
        factory("OfTheFuture")


def test_every_opencv_tracker_is_listed_and_either_there_or_says_what_to_install():
    listed = [name for name in trackers.names() if name.startswith("opencv-")]
    kinds = ["boosting", "camshift", "csrt", "kcf", "median-flow", "mil", "mosse", "tld"]
    assert listed == [f"opencv-{kind}" for kind in kinds]
    listed.remove("opencv-camshift")  # a function of OpenCV's, no tracker class
    for name in listed:
        try:
            assert trackers.resolve(name).plugin.__base__ is OpenCVTracker
        except TrackerError as error:
            assert "opencv-contrib-python-headless" in str(error)  # noqa: PT017  # or is there


@pytest.mark.parametrize("name", ["opencv-mil", "opencv-tld", "opencv-boosting"])
def test_the_seed_alone_decides_whatever_the_process_drew_before(name, moving_target):
    specification = usable(name)
    assert specification.randomness is trackers.Randomness.PROCESS
    # Fast enough to be nearly lost: on an easy clip every seed of Boosting gives the same.
    clip = moving_target(12, 140, 200, velocity=(10, 5), seed=4)
    found = boxes_of(specification.create(1), clip)
    ctypes.CDLL(None).srand(99)
    cv2.setRNGSeed(99)
    np.testing.assert_array_equal(boxes_of(specification.create(1), clip), found)
    others = (boxes_of(specification.create(seed), clip) for seed in range(2, 8))
    assert any((other != found).any() for other in others)


@pytest.mark.parametrize(
    "name", ["opencv-kcf", "opencv-csrt", "opencv-mosse", "opencv-median-flow"]
)
def test_a_tracker_that_declares_no_randomness_ignores_the_process(name, moving_target):
    specification = usable(name)
    assert specification.randomness is trackers.Randomness.NONE
    clip = moving_target(12, velocity=(3, 1), seed=3)
    found = boxes_of(specification.create(1), clip)
    tracker = specification.create(2)
    tracker.init(clip.images[0], clip.boxes[0])
    for image, expected in zip(clip.images[1:], found, strict=True):
        ctypes.CDLL(None).srand(5)
        cv2.setRNGSeed(5)
        np.testing.assert_array_equal(tracker.update(image).box, expected)


def test_mil_has_opencvs_defaults_and_hands_its_parameters_on(monkeypatch):
    handed = []
    plugin = trackers.resolve("opencv-mil").plugin
    monkeypatch.setattr(plugin, "create_tracker", handed.append)
    names = [name for name in dir(cv2.TrackerMIL_Params) if not name.startswith("_")]
    trackers.create("opencv-mil")._make()
    defaults = cv2.TrackerMIL_Params()
    assert all(getattr(handed[0], name) == getattr(defaults, name) for name in names)
    fields = list(plugin.Parameters.model_fields)
    assert len(fields) == len(names)
    for number, field in enumerate(fields):
        trackers.create("opencv-mil", **{field: 200 + number})._make()
        changed = {n for n in names if getattr(handed[-1], n) != getattr(defaults, n)}
        assert len(changed) == 1, field
        assert getattr(handed[-1], changed.pop()) == 200 + number
