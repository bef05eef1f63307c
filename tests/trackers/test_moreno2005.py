"""moreno2005 and its baseline on a disc that moves and changes colour before a few shapes."""

import cv2
import numpy as np
import pytest

from tests.trackers.following import box_of
from trackmark import trackers
from trackmark.trackers import TrackerError
from trackmark.trackers.contours.outline import bounding_box, fill_contour

NAMES = ["moreno2005", "contour-smooth-color"]
FEW = {"contour_samples": 60}
FRAMES = 8


def make_clip(frames=FRAMES, height=120, width=160):
    """Images, masks and boxes of a disc whose colour goes from red to blue."""
    random = np.random.default_rng(0)
    ground = np.full((height, width, 3), 90.0)
    for _ in range(25):
        x, y, radius = (int(random.integers(v)) for v in (width, height, 14))
        cv2.circle(ground, (x, y), radius + 4, random.integers(40, 160, 3).tolist(), -1)
    images, masks = [], []
    columns, rows = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    for frame in range(frames):
        mask = (columns - 60 - 2.5 * frame) ** 2 + (rows - 55 - frame) ** 2 <= 18**2
        share = frame / frames
        picture = ground.copy()
        picture[mask] = (60 + 150 * share, 40, 220 - 150 * share)
        picture += random.normal(0, 5, picture.shape)
        image = np.clip(picture, 0, 255).astype(np.uint8)
        image.flags.writeable = False
        images.append(image)
        masks.append(mask)
    return images, masks, [box_of(mask) for mask in masks]


def similarity(mask, other):
    return (mask & other).sum() / (mask | other).sum()


@pytest.fixture(scope="module")
def disc():
    return make_clip()


def run(name, clip, seed=0, with_mask=True, frames=FRAMES, **parameters):
    images, masks, boxes = clip
    tracker = trackers.create(name, seed=seed, **parameters)
    tracker.init(images[0], boxes[0], masks[0] if with_mask else None)
    return tracker, [tracker.update(image) for image in images[1:frames]]


VARIANTS = [
    ("moreno2005", {}),
    ("moreno2005", {"position": "kalman"}),
    ("contour-smooth-color", {}),
]


@pytest.mark.parametrize(("name", "parameters"), VARIANTS)
def test_a_disc_is_segmented_while_its_colour_changes(disc, name, parameters):
    _, estimates = run(name, disc, **parameters)
    actual = [similarity(e.mask, mask) for e, mask in zip(estimates, disc[1][1:], strict=True)]
    assert min(actual) > 0.75
    assert np.mean(actual) > 0.85


def test_output_can_be_mean_contour_or_posterior(disc):
    answers = {
        key: run("moreno2005", disc, output=key)[1] for key in ("snake", "mean", "posterior")
    }
    for snake, mean, posterior in zip(*answers.values(), strict=True):
        for key, array in snake.arrays.items():
            np.testing.assert_array_equal(array, mean.arrays[key])  # what goes on is the same
            np.testing.assert_array_equal(array, posterior.arrays[key])
        np.testing.assert_array_equal(
            mean.mask, fill_contour(snake.arrays["mean_contour"], 120, 160)
        )
        np.testing.assert_array_equal(posterior.mask, snake.arrays["posterior"] > 0.5)
        np.testing.assert_array_equal(posterior.box, box_of(posterior.mask))


@pytest.mark.parametrize(
    ("mask", "words"),
    [
        (
            np.ones((100, 60), bool),
            r"mask is bool of shape .* Expected: bool of the image's shape \(120, 160\)",
        ),
        (np.ones((120, 160), int), r"mask is int64"),
        (np.zeros((120, 160), bool), r"^mask: the target covers no pixel"),
    ],
)
@pytest.mark.parametrize("name", NAMES)
def test_a_mask_that_does_not_fit_is_refused(disc, name, mask, words):
    with pytest.raises(TrackerError, match=words):
        trackers.create(name).init(disc[0][0], disc[2][0], mask)


def test_a_target_that_vanishes_costs_nothing_but_confidence(disc):
    images, _, _ = disc
    tracker, before = run("moreno2005", disc, **FEW)
    empty = np.random.default_rng(0).integers(80, 100, images[0].shape).astype(np.uint8)
    for _ in range(6):
        estimate = tracker.update(empty)
        assert np.isfinite(estimate.box).all()
    assert estimate.confidence < 0.5 * before[-1].confidence


def test_empty_segmentation_keeps_the_model(disc):
    images, _, _ = disc
    nothing = np.zeros((120, 160), bool)
    tracker, _ = run("contour-smooth-color", disc, frames=1, output="posterior")
    before = tracker.colours.fits
    for inside in (nothing, ~nothing):
        tracker.learn(images[1], inside, [])
        assert tracker.colours.fits is before
    box, mask = tracker._select_output(tracker.contour, nothing, nothing.astype(np.float32))
    np.testing.assert_array_equal(box, bounding_box(tracker.contour))
    assert not mask.any()
