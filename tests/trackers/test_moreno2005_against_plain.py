"""moreno2005 and its baseline against the same methods in plain NumPy, with the same draws.

Compiled tables of posteriors and the snake's maps are of single precision: posteriors are within
3e-6 of the plain ones, and what follows from them within as little. (Literal weights of a target
that is lost are not: where no difference is above 0, rounding says which hypothesis is the best.)
"""

import cv2
import numpy as np
import pytest

from tests.trackers.following import box_of
from tests.trackers.plain_moreno2005 import PlainContourSmoothColor, PlainMoreno2005
from trackmark import trackers

PLAIN = {"moreno2005": PlainMoreno2005, "contour-smooth-color": PlainContourSmoothColor}
FEW = {
    "moreno2005": {"plane_samples": 6, "colour_samples": 20, "contour_samples": 30},
    "contour-smooth-color": {"contour_samples": 30},
}
WEIGHTS, POSTERIORS, PIXELS = 1e-5, 1e-5, 5e-5
STATES = 1e-9  # the same draws, from weights that draw the same

OTHERWISE = {
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
    ("moreno2005", {"preset": "robust", "colour_dynamics": "diagonal", **WIDE}),
    ("moreno2005", {"feedback": "marginal", "colour_model": "refitted"}),
    ("moreno2005", OTHERWISE),
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
    {"colour_floor": 0.0},
    {"colour_floor": 0.5},
    {"snake": False},
    {"snake_edges": "all"},
    {"snake_stiffness": "constant"},
    {"snake_stiffness": "of-change"},
    {"snake_feedback": 0.5},
    {"start": "box"},
    {"colour_levels": 9},
    {"contour_points": 17},
    {"object_components": 4, "background_components": 3, "window_components": 1},
    {"plane_spread": 0.1, "shear_x_spread": 0.1, "shift_y_spread": 6.0},
]
OF_THE_BASELINE = [
    {"mixing": mixing, "plane": plane, "preset": preset}
    for mixing in (1.0, 0.3)
    for plane in ("first", "refitted")
    for preset in ("as-written", "recommended", "robust")
]


def clip(frames, height=72, width=96, seed=5, step=3, axes=(15, 10)):
    """An ellipse that changes its place, shape and colour before smooth colours; with noise."""
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
    """The compiled tracker, which keeps what its cues found, and the plain one."""
    settings = {"preset": "recommended", **FEW[name], **parameters}
    fast = trackers.create(name, seed=seed, **settings)
    values = {**type(fast).presets[settings.pop("preset")], **settings}
    slow = PLAIN[name](np.random.SeedSequence(seed), **values)
    for tracker in (fast, slow):
        tracker.init(first, box_of(mask), mask)
    actual, step = [], fast.chain.step
    fast.chain.step = lambda *seen: actual.append(step(*seen)) or actual[-1]
    return fast, slow, actual


def assert_it_is_the_plain_reference(name, frames, seed=0, step=3, axes=(15, 10), **parameters):
    images, masks = clip(frames, step=step, axes=axes)
    fast, slow, actual = pair(name, images[0], masks[0], seed, **parameters)
    np.testing.assert_allclose(slow.contour, fast.contour, rtol=0, atol=STATES)
    snakes = 0
    for image in images[1:]:
        estimate, expected = fast.update(image), slow.update(image)
        assert_cues_are_the_same(fast, slow, actual[-1], parameters)
        for key, tolerance in (
            ("posterior", POSTERIORS),
            ("mean_contour", PIXELS),
            ("contour", PIXELS),
        ):
            np.testing.assert_allclose(
                estimate.arrays[key], getattr(expected, key), rtol=0, atol=tolerance, err_msg=key
            )
        np.testing.assert_allclose(estimate.box, expected.box, rtol=0, atol=PIXELS)
        assert (estimate.mask != expected.mask).sum() <= 1  # a centre may be on the contour
        assert estimate.details["snake"] == expected.snake
        assert estimate.details["score"] == pytest.approx(expected.score, abs=POSTERIORS)
        snakes += expected.snake
    return snakes


def assert_cues_are_the_same(fast, slow, actual, parameters):
    """States, what they were attached to, and weights: of the frame, and those that go on."""
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
    assert assert_it_is_the_plain_reference(name, 3, **parameters) > 0


def test_contours_around_few_pixels_are_those_of_plain_numpy():
    name = "contour-smooth-color"
    assert_it_is_the_plain_reference(name, 3, axes=(4, 4), preset="as-written", plane="refitted")


@pytest.mark.slow
@pytest.mark.parametrize("parameters", SINGLY, ids=str)
@pytest.mark.parametrize("preset", ["as-written", "recommended"])
def test_parameters_equal_plain_numpy(preset, parameters):
    assert_it_is_the_plain_reference("moreno2005", 5, seed=1, preset=preset, **parameters)


@pytest.mark.slow
@pytest.mark.parametrize("parameters", OF_THE_BASELINE, ids=str)
def test_each_reading_of_the_baseline_is_that_of_plain_numpy(parameters):
    assert_it_is_the_plain_reference("contour-smooth-color", 7, seed=1, **parameters)


@pytest.mark.slow
@pytest.mark.parametrize("name", PLAIN)
def test_target_leaving_the_image_equals_plain_numpy(name):
    assert_it_is_the_plain_reference(name, 7, step=12)


@pytest.mark.slow
def test_recommended_sample_numbers_equal_plain_numpy():
    every = {"plane_samples": 20, "colour_samples": 300, "contour_samples": 500}
    assert_it_is_the_plain_reference("moreno2005", 3, **every)
