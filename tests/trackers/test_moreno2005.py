"""Trackers `moreno2005` and `contour-smooth-color`, also compared with plain NumPy."""

import cv2
import numpy as np
import pytest

from tests.trackers.following import box_of
from tests.trackers.references.moreno2005 import PlainContourSmoothColor, PlainMoreno2005
from trackmark import trackers
from trackmark.trackers import TrackerError
from trackmark.trackers.contours.outline import bounding_box, fill_contour

PLAIN = {"moreno2005": PlainMoreno2005, "contour-smooth-color": PlainContourSmoothColor}
FEW = {
    "moreno2005": {"plane_samples": 6, "colour_samples": 20, "contour_samples": 30},
    "contour-smooth-color": {"contour_samples": 30},
}
# Tolerances; posteriors and edge maps have single precision.
WEIGHTS, POSTERIORS, PIXELS, STATES = 1e-5, 1e-5, 5e-5, 1e-9

OTHER_VALUES = {
    "association": "uniform",
    "ring": 2.5,
    "outside": "image",
    "weights": "literal",
    "snake_feedback": 0.3,
    "snake_edges": "all",
    "start": "box",
}
WIDE = {"object_prior": "area", "window_margin": 60.0, "eigenvalue_spread": 0.7}
EVERYDAY = [
    ("moreno2005", {}),
    ("moreno2005", {"preset": "as-written"}),
    ("moreno2005", {"colour_dynamics": "diagonal", **WIDE}),
    ("moreno2005", {"feedback": "marginal", "colour_model": "refitted"}),
    ("moreno2005", OTHER_VALUES),
    ("contour-smooth-color", {"mixing": 0.5, "plane": "refitted"}),
    ("contour-smooth-color", {"preset": "as-written"}),
]
SINGLY = [
    {"feedback": "marginal"},
    {"feedback": "joint"},
    {"association": "uniform"},
    {"colour_dynamics": "diagonal"},
    {"colour_dynamics": "shared"},
    {"colour_model": "refitted"},
    {"weights": "literal"},
    {"weights": "exponential", "contour_temperature": 0.1},
    {"outside": "window"},
    {"outside": "image"},
    {"object_prior": "area"},
    {"object_prior": 0.2},
    {"ring": 2.0},
    {"window_margin": 12.0, "window_growth": 0.4},
    {"snake": False},
    {"snake_edges": "all"},
    {"snake_feedback": 0.5},
    {"start": "box"},
    {"colour_levels": 9},
    {"contour_points": 17},
    {"object_components": 4, "background_components": 3, "window_components": 1},
    {"plane_spread": 0.1, "shear_x_spread": 0.1, "shift_y_spread": 6.0},
]
BASELINE = [
    {"mixing": mixing, "plane": plane, "preset": preset}
    for mixing in (1.0, 0.3)
    for plane in ("first", "refitted")
    for preset in ("as-written", "recommended")
]


def ellipse_clip(frames, height=72, width=96, seed=5, step=3, axes=(15, 10)):
    """Return images and masks of an ellipse of changing position, shape and colour."""
    random = np.random.default_rng(seed)
    ground = cv2.GaussianBlur(random.uniform(0, 255, (height, width, 3)), (0, 0), 6)
    ground = (ground - ground.min()) / np.ptp(ground) * 255
    images, masks = [], []
    for frame in range(frames):
        mask = np.zeros((height, width), np.uint8)
        centre, size = (40 + step * frame, 36 + 2 * frame), (axes[0], axes[1] + frame)
        cv2.ellipse(mask, centre, size, 20 + 5 * frame, 0, 360, 1, -1)
        image = ground.copy()
        image[mask > 0] = (40 + 10 * frame, 90, 200 - 15 * frame)
        image += random.normal(0, 8, image.shape)
        images.append(np.clip(image, 0, 255).astype(np.uint8))
        masks.append(mask > 0)
    return images, masks


def pair(name, first, mask, seed=0, **parameters):
    """Return the tracker, the plain one, and the list of the hypotheses of each frame."""
    settings = {"preset": "recommended", **FEW[name], **parameters}
    fast = trackers.create(name, seed=seed, **settings)
    values = {**type(fast).presets[settings.pop("preset")], **settings}
    slow = PLAIN[name](np.random.SeedSequence(seed), **values)
    for tracker in (fast, slow):
        tracker.init(first, box_of(mask), mask)
    actual, step = [], fast.chain.step
    fast.chain.step = lambda *seen: actual.append(step(*seen)) or actual[-1]
    return fast, slow, actual


def check_against_plain(name, frames, seed=0, step=3, axes=(15, 10), **parameters):
    images, masks = ellipse_clip(frames, step=step, axes=axes)
    fast, slow, actual = pair(name, images[0], masks[0], seed, **parameters)
    np.testing.assert_allclose(slow.contour, fast.contour, rtol=0, atol=STATES)
    snakes = 0
    for image in images[1:]:
        estimate, expected = fast.update(image), slow.update(image)
        check_cues(fast, slow, actual[-1], parameters)
        for key, tolerance in (
            ("posterior", POSTERIORS),
            ("mean_contour", PIXELS),
            ("contour", PIXELS),
        ):
            np.testing.assert_allclose(
                estimate.arrays[key], getattr(expected, key), rtol=0, atol=tolerance, err_msg=key
            )
        np.testing.assert_allclose(estimate.box, expected.box, rtol=0, atol=PIXELS)
        assert (estimate.mask != expected.mask).sum() <= 1  # a pixel centre may lie on the contour
        assert estimate.details["snake"] == expected.snake
        assert estimate.details["score"] == pytest.approx(expected.score, abs=POSTERIORS)
        snakes += expected.snake
    return snakes


def check_cues(fast, slow, actual, parameters):
    """Compare states, attachments and weights of the frame, and weights for the next frame."""
    moved = PIXELS if parameters.get("snake_feedback") else STATES
    cues = [(slow.contours, actual[2], fast.chain.cues[2], moved)]
    if isinstance(slow, PlainMoreno2005):
        refitted = parameters.get("colour_model") == "refitted"
        cues += [(slow.planes, actual[0], fast.chain.cues[0], STATES)]
        cues += [(slow.colours, actual[1], None if refitted else fast.chain.cues[1], STATES)]
        np.testing.assert_array_equal(slow.colours.attached, actual[1].attached)
    np.testing.assert_array_equal(slow.contours.attached, actual[2].attached)
    for plain, hypotheses, cue, tolerance in cues:
        np.testing.assert_allclose(plain.states, hypotheses.states, rtol=0, atol=tolerance)
        np.testing.assert_allclose(plain.weights, hypotheses.weights, rtol=0, atol=WEIGHTS)
        if cue is not None:
            np.testing.assert_allclose(plain.carried, cue.weights, rtol=0, atol=WEIGHTS)


@pytest.mark.parametrize(("name", "parameters"), EVERYDAY)
def test_moreno2005_equals_plain_numpy(name, parameters):
    assert check_against_plain(name, 3, **parameters) > 0


def test_contours_around_few_pixels_equal_plain_numpy():
    name = "contour-smooth-color"
    check_against_plain(name, 3, axes=(4, 4), preset="as-written", plane="refitted")


@pytest.mark.slow
@pytest.mark.parametrize("parameters", SINGLY, ids=str)
@pytest.mark.parametrize("preset", ["as-written", "recommended"])
def test_each_moreno2005_parameter_equals_plain_numpy(preset, parameters):
    check_against_plain("moreno2005", 5, seed=1, preset=preset, **parameters)


@pytest.mark.slow
@pytest.mark.parametrize("parameters", BASELINE, ids=str)
def test_each_baseline_parameter_equals_plain_numpy(parameters):
    check_against_plain("contour-smooth-color", 7, seed=1, **parameters)


@pytest.mark.slow
@pytest.mark.parametrize("name", PLAIN)
def test_contours_leaving_the_image_equal_plain_numpy(name):
    check_against_plain(name, 7, step=12)


@pytest.mark.slow
def test_recommended_sample_numbers_equal_plain_numpy():
    every = {"plane_samples": 20, "colour_samples": 300, "contour_samples": 500}
    check_against_plain("moreno2005", 3, **every)


def similarity(mask, other):
    return (mask & other).sum() / (mask | other).sum()


@pytest.fixture(scope="module")
def clip():
    return ellipse_clip(6, 120, 160, axes=(22, 14))


def run(name, clip, **parameters):
    """Return the tracker and its estimates of a clip."""
    images, masks = clip
    tracker = trackers.create(name, seed=0, **parameters)
    tracker.init(images[0], box_of(masks[0]), masks[0])
    return tracker, [tracker.update(image) for image in images[1:]]


VARIANTS = [
    ("moreno2005", {}),
    ("moreno2005", {"position": "kalman"}),
    ("contour-smooth-color", {"mixing": 1.0}),
]


@pytest.mark.parametrize(("name", "parameters"), VARIANTS)
def test_ellipse_is_segmented_while_its_colour_changes(clip, name, parameters):
    _, estimates = run(name, clip, **parameters)
    actual = [similarity(e.mask, mask) for e, mask in zip(estimates, clip[1][1:], strict=True)]
    assert min(actual) > 0.75
    assert np.mean(actual) > 0.85


def test_output_can_be_mean_contour_or_posterior(clip):
    answers = {
        key: run("moreno2005", clip, output=key)[1] for key in ("snake", "mean", "posterior")
    }
    for snake, mean, posterior in zip(*answers.values(), strict=True):
        for key, array in snake.arrays.items():
            np.testing.assert_array_equal(array, mean.arrays[key])
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
@pytest.mark.parametrize("name", PLAIN)
def test_invalid_init_mask_is_rejected(clip, name, mask, words):
    with pytest.raises(TrackerError, match=words):
        trackers.create(name).init(clip[0][0], box_of(clip[1][0]), mask)


def test_vanished_target_lowers_the_confidence(clip):
    images, _ = clip
    tracker, before = run("moreno2005", clip, contour_samples=60)
    empty = np.random.default_rng(0).integers(80, 100, images[0].shape).astype(np.uint8)
    for _ in range(6):
        estimate = tracker.update(empty)
        assert np.isfinite(estimate.box).all()
    assert estimate.confidence < 0.5 * before[-1].confidence


def test_empty_segmentation_keeps_the_model(clip):
    images, masks = clip
    nothing = np.zeros((120, 160), bool)
    tracker, _ = run("contour-smooth-color", (images[:1], masks), output="posterior")
    before = tracker.colours.fits
    for inside in (nothing, ~nothing):
        tracker.learn(images[1], inside, [])
        assert tracker.colours.fits is before
    box, mask = tracker._select_output(tracker.contour, nothing, nothing.astype(np.float32))
    np.testing.assert_array_equal(box, bounding_box(tracker.contour))
    assert not mask.any()
