"""OpenCV's trackers behind our interface."""

import ctypes
import typing

import cv2
import numpy as np
import pytest

from trackmark import trackers
from trackmark.trackers.base.opencv import OpenCVTracker, find_factory, pixel_rectangle
from trackmark.trackers.base.parameters import Parameters, TrackerError


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
def test_lost_target_keeps_the_last_valid_box(answer):
    tracker = scripted(answer, (True, (4.5, 4, 4, 4.25)), answer, answer)
    first = np.array([1.5, 2.5, 10.25, 10.0])
    tracker.init(IMAGE, first)
    first[:] = -1  # the caller's own
    lost = tracker.update(IMAGE)
    assert lost.box.tolist() == [1.5, 2.5, 10.25, 10.0]
    assert not lost.visible
    actual = tracker.update(IMAGE)
    assert actual.visible
    assert actual.box.tolist() == [4.5, 4, 4, 4.25]  # as it is given
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
    with pytest.raises(TrackerError, match="MIL needs an init box with at least 5 x 5 pixels"):
        tracker.init(IMAGE, np.array([10.0, 10.0, 30.0, 4.0]))


def test_what_opencv_refuses_is_a_clear_error(moving_target):
    clip = moving_target(size=(120, 90), start=(0, 0), velocity=(0, 0))
    with pytest.raises(TrackerError, match=r"MIL rejects the init box \(0, 0, 120, 90\)"):
        trackers.create("opencv-mil").init(clip.images[0], clip.boxes[0])


def test_missing_opencv_tracker_error_has_a_remedy():
    with pytest.raises(ImportError, match="has no TrackerOfTheFuture; install opencv-contrib"):
        find_factory("OfTheFuture")


@pytest.mark.parametrize("name", ["opencv-mil", "opencv-tld", "opencv-boosting"])
def test_the_seed_alone_decides_whatever_the_process_drew_before(name, moving_target):
    specification = usable(name)
    assert specification.randomness is trackers.Randomness.PROCESS
    # Fast enough to be nearly lost: on an easy clip every seed of Boosting gives the same.
    clip = moving_target(7, 140, 200, velocity=(10, 5), seed=4)
    actual = boxes_of(specification.create(1), clip)
    ctypes.CDLL(None).srand(99)
    cv2.setRNGSeed(99)
    np.testing.assert_array_equal(boxes_of(specification.create(1), clip), actual)
    others = (boxes_of(specification.create(seed), clip) for seed in range(2, 8))
    assert any((other != actual).any() for other in others)


@pytest.mark.parametrize(
    "name", ["opencv-kcf", "opencv-csrt", "opencv-mosse", "opencv-median-flow"]
)
def test_deterministic_trackers_ignore_process_state(name, moving_target):
    specification = usable(name)
    assert specification.randomness is trackers.Randomness.NONE
    clip = moving_target(12, velocity=(3, 1), seed=3)
    actual = boxes_of(specification.create(1), clip)
    tracker = specification.create(2)
    tracker.init(clip.images[0], clip.boxes[0])
    for image, expected in zip(clip.images[1:], actual, strict=True):
        ctypes.CDLL(None).srand(5)
        cv2.setRNGSeed(5)
        np.testing.assert_array_equal(tracker.update(image).box, expected)


def another(value, annotation):
    """A value that a parameter may have besides its own."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, str):
        return next(other for other in typing.get_args(annotation) if other != value)
    if isinstance(value, int):
        return value + 1 if value <= 3 else value - 1
    return value * 1.01 if value > 1 else value / 2


def changed_alone(name):
    """The tracker, made with its defaults, and with each parameter changed alone."""
    plugin = usable(name).plugin
    yield "", trackers.create(name)
    for field, about in plugin.Parameters.model_fields.items():
        yield field, trackers.create(name, **{field: another(about.default, about.annotation)})


@pytest.mark.parametrize("name", ["opencv-mil", "opencv-kcf", "opencv-csrt"])
def test_opencv_parameters_and_defaults_are_passed_on(name, monkeypatch):
    plugin = usable(name).plugin
    handed = []
    monkeypatch.setattr(plugin, "create_tracker", handed.append)
    fields = [field for field, tracker in changed_alone(name) if tracker._make() is None]
    kind = getattr(cv2, plugin.opencv_parameters)
    names = [key for key in dir(kind) if not key.startswith("_")]
    assert len(names) == len(fields) - 1
    values = [{key: getattr(options, key) for key in names} for options in (kind(), *handed)]
    defaults, ours, *others = values
    assert ours == defaults
    changed = [{key for key in names if other[key] != ours[key]} for other in others]
    assert all(len(keys) == 1 for keys in changed)
    assert set.union(*changed) == set(names)


def written(tracker):
    """Parameters that a tracker of `cv2.legacy` writes, by OpenCV's names."""
    storage = cv2.FileStorage(".yml", cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
    tracker.write(storage)
    lines = storage.releaseAndGetString().splitlines()
    return dict(line.split(": ") for line in lines if ": " in line)


@pytest.mark.parametrize("name", ["opencv-median-flow", "opencv-boosting"])
def test_legacy_parameters_and_defaults_are_passed_on(name):
    plugin = usable(name).plugin
    (_, ours), *others = (
        (field, written(changed._make())) for field, changed in changed_alone(name)
    )
    assert ours == written(plugin.create_tracker())
    for field, other in others:
        changed = {key.lower() for key in other if other[key] != ours[key]}
        assert len({key.removeprefix("sampler") for key in changed}) == 1, field


@pytest.mark.parametrize(
    ("name", "threshold"), [("opencv-kcf", "detect_thresh"), ("opencv-csrt", "psr_threshold")]
)
def test_only_opencv_gives_up_where_the_answer_is_weak(name, threshold, moving_target):
    usable(name)
    presets = [trackers.resolve(name, preset=key).parameters for key in ("opencv", "recommended")]
    assert trackers.resolve(name).parameters == presets[0]
    other = {key for key, value in presets[0] if value != getattr(presets[1], key)}
    assert other == {threshold}
    assert getattr(presets[1], threshold) == 0
    clip = moving_target(4)
    for value, expected in ((0, True), (100, False)):
        tracker = trackers.create(name, **{threshold: value})
        tracker.init(clip.images[0], clip.boxes[0])
        visible = [tracker.update(image).visible for image in clip.images[1:]]
        assert set(visible[1:]) == {expected}  # KCF looks for nothing in its first update


def test_missing_opencv_parameter_is_rejected(monkeypatch):
    monkeypatch.setattr(cv2, "TrackerMIL_Params", object)
    with pytest.raises(
        TrackerError, match=r"has no parameter sampler.* TrackerMIL_Params. Install a newer"
    ):
        trackers.create("opencv-mil")._make()


def test_a_filter_without_features_is_refused():
    usable("opencv-csrt")  # OpenCV's own code ends the process
    off = dict.fromkeys(["use_hog", "use_color_names", "use_gray", "use_rgb"], False)
    with pytest.raises(TrackerError, match="opencv-csrt needs features"):
        trackers.create("opencv-csrt", **off).init(IMAGE, np.array([10.0, 10, 20, 20]))
