"""The multi-part particle filter beside what else one could use: 640x480, target 60x140.

Ratios of processor time in one process, on the same frames and in turns; `pytest -s` shows
them, and how well each follows.
"""

from statistics import median
from time import thread_time

import cv2
import numpy as np
import pytest

import trackers
from tests.speed.rivals import MeanShift, compare, run, say
from trackers.base.parameters import TrackerError
from trackers.base.sharing import SharedFrame


def multipart(clip, **parameters):
    tracker = trackers.create("multipart", **parameters)
    run(tracker, clip, n=3)  # compiles, fills tables
    return tracker


@pytest.mark.parametrize("representation", ["single", "multi"])
def test_it_costs_no_more_than_opencvs_mean_shift_on_the_whole_frame(clip, representation):
    ours = multipart(clip, representation=representation)
    assert compare(clip, ours, MeanShift()) > 1 / 1.1


def test_beside_opencvs_mean_shift_on_the_search_window(clip):
    assert compare(clip, multipart(clip), MeanShift(40)) > 1 / 4


@pytest.mark.parametrize(
    ("name", "at_least"), [("opencv-mil", 25), ("opencv-csrt", 25), ("opencv-kcf", 3.5)]
)
def test_it_is_many_times_quicker_than_opencvs_trackers(clip, name, at_least):
    try:
        theirs = trackers.create(name)
    except TrackerError as error:
        pytest.skip(str(error))
    assert compare(clip, multipart(clip), theirs, rounds=1, n=20) > at_least


def with_numpys_histograms(luv, regions):
    for left, top, right, bottom in regions:
        region = luv[top:bottom, left:right].reshape(-1, 3)
        lightness, _ = np.histogram(region[:, 0], 10, (0, 256))
        chromaticity, *_ = np.histogram2d(region[:, 1], region[:, 2], 10, [[0, 256], [0, 256]])
        yield np.concatenate([chromaticity.ravel(), lightness])


def with_bincount(luv, regions):
    bins = luv.astype(int) * 10 // 256
    joint = bins[..., 0] * 100 + bins[..., 1] * 10 + bins[..., 2]
    for left, top, right, bottom in regions:
        counts = np.bincount(joint[top:bottom, left:right].ravel(), minlength=1000)
        counts = counts.reshape(10, 100)
        yield np.concatenate([counts.sum(axis=0), counts.sum(axis=1)])


def numpy_distances(image, references, regions, histograms):
    left, top = regions[..., :2].min(axis=(0, 1))
    right, bottom = regions[..., 2:].max(axis=(0, 1))
    luv = cv2.cvtColor(image[top:bottom, left:right], cv2.COLOR_BGR2LUV)
    total = 0.0
    for reference, part in zip(references, regions - [left, top, left, top], strict=True):
        p = np.array(list(histograms(luv, part)), float)
        p /= p.sum(axis=1, keepdims=True)
        total = total + np.sqrt(np.maximum(0, 1 - np.sqrt(p * reference).sum(axis=1)))
    return total / len(references)


@pytest.mark.parametrize(
    ("histograms", "at_least"), [(with_numpys_histograms, 100), (with_bincount, 10)]
)
def test_weighing_is_many_times_quicker_than_in_numpy(clip, histograms, at_least):
    images, _ = clip
    ours = multipart(clip, representation="multi")
    run(ours, clip, n=20)
    first = np.array([[290, 250, 350, 320], [290, 320, 350, 390]])
    references = np.array(list(with_bincount(cv2.cvtColor(images[0], cv2.COLOR_BGR2LUV), first)))
    references = references / references.sum(axis=1, keepdims=True)
    our_seconds, their_seconds = [], []
    for image in images[20:23]:
        ours._propagate()
        regions = ours._regions(SharedFrame(image), ours._states, 2).parts
        begin = thread_time()
        found, _ = ours._distances(SharedFrame(image))
        middle = thread_time()
        expected = numpy_distances(image, references, regions, histograms)
        their_seconds.append(thread_time() - middle)
        our_seconds.append(middle - begin)
        np.testing.assert_allclose(found, expected, atol=1e-7)
    ratio = median(their_seconds) / median(our_seconds)
    say(f"weighing {median(our_seconds) * 1e3:.3f} ms, in NumPy {ratio:.0f} times that")
    assert ratio > at_least


def test_a_cloud_over_the_whole_frame_costs_little_more_than_reading_the_frame(clip):
    images, _ = clip
    tracker = multipart(clip)
    rng = np.random.default_rng(0)
    lost, usual, anchor = [], [], []
    for _ in range(2):
        run(tracker, clip, usual)
        run(MeanShift(), clip, anchor)
        for image in images[1:]:
            tracker._states = np.column_stack(
                [rng.uniform(30, 610, 200), rng.uniform(70, 410, 200), np.full(200, 8400.0)]
            )
            begin = thread_time()
            tracker.update(image)
            lost.append(thread_time() - begin)
    say(
        f"lost {median(lost) * 1e3:.3f} ms: {median(lost) / median(usual):.1f} usual frames, "
        f"{median(lost) / median(anchor):.1f} of mean shift on the whole frame"
    )
    assert median(lost) < 5 * median(anchor)  # 3.4 where this was written


def medians(cases):
    """Median time of an update for each of (images, box, parameters), all in turns."""
    seconds = [[] for _ in cases]
    for _ in range(3):
        for (images, box, parameters), own in zip(cases, seconds, strict=True):
            tracker = trackers.create("multipart", **parameters)
            tracker.init(images[0], box)
            tracker.update(images[1])
            for image in images[2:]:
                begin = thread_time()
                tracker.update(image)
                own.append(thread_time() - begin)
    return [median(own) for own in seconds]


def test_time_grows_no_faster_than_the_number_of_particles(clip):
    images, truth = clip[0][:12], clip[1][0]
    numbers = [100, 200, 400, 800, 1600]
    found = medians([(images, truth, {"particles": n}) for n in numbers])
    say({n: f"{value * 1e3:.3f} ms" for n, value in zip(numbers, found, strict=True)})
    assert found[-1] < 4.5 * found[2]
    assert found[-1] < 16 * found[0]


def test_time_grows_no_faster_than_the_targets_area(clip):
    cases, areas = [], []
    for scale in (0.5, 1.0, 2.0):  # the same colours on more pixels
        images = [
            cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_NEAREST)
            for image in clip[0][:12]
        ]
        cases.append((images, clip[1][0] * scale, {}))
        areas.append(60 * 140 * scale**2)
    found = medians(cases)
    say({f"{n:.0f} pixels": f"{value * 1e3:.3f} ms" for n, value in zip(areas, found, strict=True)})
    assert found[1] < 4.5 * found[0]
    assert found[2] < 4.5 * found[1]


@pytest.mark.parametrize("size", [(43, 140), (60, 140), (94, 260)])
def test_many_in_lock_step_cost_less_than_each_alone(clip, size):
    images, truth = clip
    box = np.array([*truth[0, :2] - [0, 70], *size])
    company = [
        trackers.create("multipart", seed, representation=("single", "multi")[seed % 2])
        for seed in range(60)
    ]
    for tracker in company:
        tracker.init(images[0], box)
    alone, first, others = [], [], []
    for number, image in enumerate(images[1:13]):
        frame = SharedFrame(image, 60 if number % 2 else 1)
        begin = thread_time()
        company[0].update_shared(frame)
        after_first = thread_time()
        for tracker in company[1:]:
            tracker.update_shared(frame)
        each = (thread_time() - after_first) / 59
        if number % 2:
            first.append(after_first - begin)
            others.append(each)
        else:
            alone.append(each)
    say(
        f"{size}: alone {median(alone) * 1e3:.3f} ms, in lock step {median(others) * 1e3:.3f} ms "
        f"and {(median(first) - median(others)) * 1e3:.2f} ms once a frame"
    )
    assert median(first) + 59 * median(others) < 60 * median(alone)


def test_speed_of_multipart(benchmark, clip):
    benchmark(run, multipart(clip), clip)
