"""The multi-part particle filter beside OpenCV's trackers and NumPy: 640x480, target 60x140.

Ratios of processor time in one process, on the same frames and in turns; `pytest -s` shows
them, and how well each follows.
"""

from statistics import median
from time import thread_time

import cv2
import numpy as np
import pytest

from tests.speed import clips
from tests.speed.rivals import compare, run, say, warm
from trackmark import trackers
from trackmark.trackers.base.parameters import TrackerError
from trackmark.trackers.base.sharing import SharedFrame


@pytest.mark.parametrize(
    ("name", "at_least"), [("opencv-mil", 25), ("opencv-csrt", 25), ("opencv-kcf", 3.5)]
)
def test_it_is_many_times_quicker_than_opencvs_trackers(name, at_least):
    try:
        theirs = trackers.create(name)
    except TrackerError as error:
        pytest.skip(str(error))
    assert (
        compare(clips.large(), warm("multipart", clips.large()), theirs, rounds=1, n=20) > at_least
    )


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
def test_weighing_is_many_times_quicker_than_in_numpy(histograms, at_least):
    images, _ = clips.large()
    ours = warm("multipart:representation=multi", clips.large())
    run(ours, clips.large(), n=20)
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
