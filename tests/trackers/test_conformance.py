"""Conformance of all trackers with the interface."""

import importlib
import math
import pickle
import random
import re
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tests.trackers.following import boxes_of
from tests.trackers.tiny_models import write_models
from trackmark import trackers
from trackmark.trackers.base import catalogue
from trackmark.trackers.base.parameters import TrackerError
from trackmark.trackers.base.sharing import SharedFrame, SharingTracker

SEED = 7

FOLDER = tempfile.TemporaryDirectory()  # model files exist before tests are collected
GIVEN = write_models(Path(FOLDER.name))


@cache
def resolved(name):
    """Return the tracker's specification, or the error of resolving it."""
    try:
        return trackers.resolve(name, **GIVEN.get(name, {}))
    except TrackerError as error:
        return error


USABLE = [name for name in trackers.names() if not isinstance(resolved(name), TrackerError)]


@pytest.mark.parametrize("name", trackers.names())
def test_every_tracker_is_usable_or_lacks_a_dependency(name):
    actual = resolved(name)
    if isinstance(actual, TrackerError):
        wants_files = name == "opencv-dasiamrpn" and "is missing. Set it by" in str(actual)
        if not (isinstance(actual.__cause__, ImportError) or wants_files):
            raise actual
        pytest.skip(str(actual))


@pytest.fixture(params=USABLE, scope="module")
def specification(request):
    return resolved(request.param)


@pytest.fixture(scope="module")
def clip(moving_target):
    return moving_target(4)


@pytest.fixture(scope="module")
def other_clip(moving_target):
    return moving_target(4, 71, 95, (16, 22), (50, 40), (-2, -1.5), seed=1)


def started(specification, clip, seed=SEED):
    tracker = specification.create(seed)
    tracker.init(clip.images[0], clip.boxes[0].copy())
    return tracker


def estimates(tracker, clip):
    return [tracker.update(image) for image in clip.images[1:]]


def assert_well_formed(estimate, image):
    assert isinstance(estimate.box, np.ndarray)
    assert estimate.box.shape == (4,)
    assert estimate.box.dtype == np.float64
    assert np.isfinite(estimate.box).all()
    assert (estimate.box[2:] > 0).all()
    assert isinstance(estimate.visible, bool)
    assert math.isnan(estimate.confidence) or 0 <= estimate.confidence <= 1
    assert all(type(value) is float for value in estimate.details.values())
    if estimate.mask is not None:
        assert estimate.mask.shape == image.shape[:2]
        assert estimate.mask.dtype == np.bool_
    for box in (estimate.revised or {}).values():
        assert box.shape == (4,)


@pytest.fixture(scope="module")
def run(specification, clip):
    return estimates(started(specification, clip), clip)


def test_maps_have_the_image_size_and_no_side_effect(specification, clip, run):
    tracker = started(specification, clip)
    if not isinstance(tracker, trackers.WeightMapTracker):
        pytest.skip("it has no maps")
    for image, before in zip(clip.images[1:], run, strict=True):
        estimate = tracker.update(image)
        assert (estimate.box == before.box).all()
        maps = tracker.maps(image)
        assert maps
        for weights in maps.values():
            assert weights.shape == image.shape[:2]
            assert 0 <= weights.min() < weights.max() <= 1


def test_tracker_file_exports_exactly_one_class(specification):
    if specification.file.parent != catalogue.FOLDER:
        pytest.skip("not in this package")
    module = importlib.import_module(f"trackmark.trackers.{specification.file.stem}")
    assert module.__all__ == [specification.plugin.__name__]


def test_tracker_class_and_file_have_a_summary(specification):
    assert re.match(r"[^\n]{10,99}\.(\n|$)", specification.plugin.__doc__)
    assert trackers.summary(specification.name)


def test_parameters_have_meanings_and_units(specification):
    for parameter in trackers.describe(specification.name)["parameters"]:
        assert len(parameter["meaning"]) > 10, parameter
        if parameter["type"] in {"int", "float"}:
            assert re.search(r"\[[a-z].*\]$", parameter["meaning"]), parameter


def test_every_preset_creates_a_tracker(specification, clip):
    for preset in specification.plugin.presets:
        tracker = started(trackers.resolve(specification.name, preset=preset), clip)
        assert_well_formed(tracker.update(clip.images[1]), clip.images[1])


def test_tracker_of_a_paper_has_both_presets(specification):
    presets = set(specification.plugin.presets)
    if re.search(r"\d{4}$", specification.name) or "as-written" in presets:
        assert presets >= {"as-written", "recommended"}
    if presets:
        assert specification.plugin.paper


def test_every_estimate_is_well_formed(run, clip):
    for estimate, image in zip(run, clip.images[1:], strict=True):
        assert_well_formed(estimate, image)


def test_details_have_the_same_names_in_every_frame(run):
    assert len({tuple(estimate.details) for estimate in run}) == 1


def test_equal_seed_gives_bit_identical_boxes(specification, clip, run):
    # An integer seed equals its SeedSequence.
    again = estimates(started(specification, clip, np.random.SeedSequence(SEED)), clip)
    np.testing.assert_array_equal(boxes_of(again), boxes_of(run))


def test_two_instances_are_independent(specification, clip, other_clip, run):
    tracker_of_clip = started(specification, clip)
    if specification.randomness is trackers.Randomness.PROCESS:
        # Only one such tracker runs in a process at a time.
        estimates(started(specification, other_clip, seed=1), other_clip)
        tracker_of_clip = started(specification, clip)
        actual = estimates(tracker_of_clip, clip)
    else:
        other = started(specification, other_clip, seed=1)
        actual = []
        for frame, image in enumerate(clip.images[1:], start=1):
            other.update(other_clip.images[frame % len(other_clip.images)])
            actual.append(tracker_of_clip.update(image))
    np.testing.assert_array_equal(boxes_of(actual), boxes_of(run))


def test_second_init_forgets_the_first_sequence(specification, clip, other_clip, run):
    tracker = started(specification, other_clip)
    estimates(tracker, other_clip)
    tracker.init(clip.images[0], clip.boxes[0].copy())
    np.testing.assert_array_equal(boxes_of(estimates(tracker, clip)), boxes_of(run))


def test_inputs_are_neither_modified_nor_referenced(specification, clip, run):
    states = pickle.dumps((np.random.get_state(), random.getstate()))  # noqa: NPY002  # legacy state
    tracker = specification.create(SEED)
    first = clip.boxes[0].copy()
    reused = clip.images[0].copy()  # a reader may decode every frame into the same array
    tracker.init(reused, first)
    np.testing.assert_array_equal(first, clip.boxes[0])
    first[:] = -1
    actual = []
    for image in clip.images[1:]:
        reused[:] = image
        estimate = tracker.update(reused)
        np.testing.assert_array_equal(reused, image)
        actual.append(estimate.box.copy())
        estimate.box[:] = -1
    np.testing.assert_array_equal(actual, boxes_of(run))
    assert pickle.dumps((np.random.get_state(), random.getstate())) == states  # noqa: NPY002  # as above


def test_parameters_are_frozen_and_travel_between_processes(specification):
    parameters = specification.parameters
    assert pickle.loads(pickle.dumps(parameters)) == parameters
    for name in type(parameters).model_fields:
        with pytest.raises(ValueError, match="frozen"):
            setattr(parameters, name, getattr(parameters, name))


@pytest.fixture(scope="module")
def crowded(clip):
    """Return frames that all sharing trackers have already processed with another box."""
    frames = [SharedFrame(image) for image in clip.images]
    for other in map(resolved, USABLE):
        if issubclass(other.plugin, SharingTracker):
            company = other.create(SEED + 1)
            company.init_shared(frames[0], clip.boxes[0] + [15, -10, 3, -5])
            for frame in frames[1:]:
                company.update_shared(frame)
    return frames


@pytest.mark.parametrize("sharers", [1, 60])
def test_shared_frames_give_the_boxes_of_plain_images(specification, clip, crowded, run, sharers):
    if not issubclass(specification.plugin, SharingTracker):
        pytest.skip("shares nothing")
    shared = crowded if sharers == 1 else [SharedFrame(image, sharers) for image in clip.images]
    tracker = specification.create(SEED)
    tracker.init_shared(shared[0], clip.boxes[0].copy())
    actual = [tracker.update_shared(frame) for frame in shared[1:]]
    np.testing.assert_array_equal(boxes_of(actual), boxes_of(run))
    assert [estimate.details for estimate in actual] == [estimate.details for estimate in run]


HARD = {
    "the target at the left top corner": {"start": (0, 0), "velocity": (0, 0)},
    "the target at the right bottom corner": {"start": (100, 60), "velocity": (0, 0)},
    "the target leaves to the left": {"start": (6, 30), "velocity": (-9, 0)},
    "the target leaves downwards": {"start": (50, 55), "velocity": (0, 11)},
    "the first box hangs over the border": {"start": (-8, -9), "velocity": (2, 2)},
    "the target fills the image": {"size": (120, 90), "start": (0, 0), "velocity": (0, 0)},
    "a target of one pixel": {"size": (1, 1)},
    "a target of one column": {"size": (1, 40)},
    "a target of a few pixels": {"size": (3, 4)},
    "a grey image": {"grey": True},
    "odd image sides": {"height": 61, "width": 83, "start": (20, 15)},
    "an image hardly larger than the target": {"height": 33, "width": 24, "start": (1, 1)}
    | {"velocity": (0.3, 0.2)},
}


CRASHES = {("opencv-tld", "an image hardly larger than the target")}  # in OpenCV's own code


def test_hard_cases_give_valid_boxes_or_are_rejected(specification, moving_target):
    for case, changes in HARD.items():
        if (specification.name, case) not in CRASHES:
            clip = moving_target(3, **changes)
            assert_well_formed_or_rejected(specification, clip, clip.boxes[0])


NO_BOXES = [(20, 20, 12, 0), (20, 20, -5, 9), (20, 20, np.nan, 9), (1, 2, np.inf, 4)]
NO_BOXES += [(20, 20, 9), ((20, 20, 9, 9),), ("a", "b", "c", "d"), "box", None]


def test_init_boxes_outside_are_tracked_or_rejected(specification, clip):
    for x, y in ((500, 400), (-20, 20), (-18, 20)):  # far outside, at the border, hardly inside
        assert_well_formed_or_rejected(specification, clip, np.array([x, y, 20, 30], float))


def test_invalid_init_box_is_rejected(specification, clip):
    for box in NO_BOXES:
        with pytest.raises(TrackerError, match="box") as refusal:
            specification.create(SEED).init(clip.images[0], box)
        assert "\n" not in str(refusal.value)


def assert_well_formed_or_rejected(specification, clip, box):
    tracker = specification.create(SEED)
    try:
        tracker.init(clip.images[0], box.copy())
    except TrackerError as refusal:
        assert re.search("box|window", str(refusal))  # noqa: PT017  # both outcomes are valid
        assert "\n" not in str(refusal)  # noqa: PT017  # as above
        return
    assert box.shape == (4,)
    assert np.isfinite(box).all()
    for image in clip.images[1:]:
        assert_well_formed(tracker.update(image), image)
