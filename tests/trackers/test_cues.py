"""What cues are shown, and what of them no plain reference has (see `plain_moreno2005.py`)."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from trackers.contours.colour_cue import ColourDynamics, Fit, Palettes, RefittedColours
from trackers.contours.contour_cue import ContourCue, ContourDynamics, KalmanContourCue
from trackers.contours.mixture import (
    Mixture,
    components_of,
    fitted,
)
from trackers.contours.observation import (
    colour_cells,
    observe,
)
from trackers.contours.plane_cue import PlaneCue

BASIS = np.linalg.qr(np.array([[1.0, 0.2], [0.1, 1.0], [-0.5, 0.3]]))[0]
SQUARE = np.array([[20.0, 10.0], [50.0, 10.0], [50.0, 40.0], [20.0, 40.0]])
STILL = ContourDynamics(np.zeros((2, 2)), np.zeros(2))


@pytest.fixture(scope="module")
def image():
    random = np.random.default_rng(4)
    picture = random.integers(0, 120, (60, 80, 3))
    picture[10:40, 20:50] = random.integers(100, 255, (30, 30, 3))
    return picture.astype(np.uint8)


def pair():
    """Two mixtures on a plane, of the same number of components."""
    random = np.random.default_rng(0)
    return [fitted(random.normal(0.4, 0.2, (600, 2)), 3, random) for _ in range(2)]


def mixtures(seed=0, of_target=2, of_background=3):
    random = np.random.default_rng(seed)
    return components_of(
        Mixture(
            np.concatenate([np.full(of_target, 1 / of_target), np.full(of_background, 1 / 3)]),
            random.uniform(0, 1, (of_target + of_background, 2)),
            np.eye(2) * random.uniform(0.01, 0.05, (of_target + of_background, 1, 1)),
        )
    )


# What the cues are shown.


@pytest.mark.parametrize("levels", [1, 20, 64])
def test_cells_are_the_unique_rows_of_the_grid_and_have_their_pixels_mean(image, levels):
    coarse = image.copy()
    coarse[:30] = coarse[:30] // 64 * 85  # cells of many pixels, and extreme ones
    rgb = coarse[..., ::-1].reshape(-1, 3).astype(int)
    _, numbers, sizes = np.unique(
        rgb * levels // 256, axis=0, return_inverse=True, return_counts=True
    )
    cells = colour_cells(coarse, levels)
    np.testing.assert_array_equal(cells.image, numbers.reshape(60, 80))
    np.testing.assert_array_equal(cells.sizes, sizes)
    means = [rgb[numbers == cell].mean(axis=0) / 255 for cell in range(len(sizes))]
    np.testing.assert_allclose(cells.colours, means, rtol=1e-13)


# Cues.


def test_a_cue_says_what_must_come_before_it(image):
    seen = observe(colour_cells(image, 8), (16, 6, 54, 44))
    planes = PlaneCue(BASIS, 3, 0.05, "literal", 1.0, 0.05)
    palettes = Palettes(2, "literal", 1.0, 0.05)
    colours = RefittedColours(Fit(np.zeros((0, 3)), np.zeros((0, 3)), *pair()), 1, 1.0, palettes)
    contours = ContourCue(SQUARE, 3, STILL, "window", "literal", 1.0)
    for cue, words in (
        (planes, "sets of colours"),
        (colours, "planes comes before"),
        (contours, "colours comes before"),
    ):
        with pytest.raises(ValueError, match=words):
            cue.weigh(seen, cue.sample(np.random.default_rng(0)), None, ())


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30)
def test_mixtures_stay_mixtures(seed):
    states = np.repeat(mixtures(seed)[np.newaxis], 20, axis=0)
    wild = ColourDynamics("shared", 0.0, 0.0, 2.0, 0.5, 3.0, 2.0, 3.0, 0.0)
    before = states.copy()
    moved = wild.propagated(states, 2, np.random.default_rng(seed))
    np.testing.assert_array_equal(states, before)
    assert (moved[:, :, 3:5] >= 2e-4).all()
    assert (moved[:, :, 3:5] <= 0.15).all()
    np.testing.assert_allclose(moved[:, :2, 0].sum(axis=1), 1.0)
    np.testing.assert_allclose(moved[:, 2:, 0].sum(axis=1), 1.0)


def test_the_kalman_filter_ends_with_the_weighted_contours_mean_and_variance():
    motion = ContourDynamics(np.zeros((2, 2)), np.array([3.0, 2.0]))
    cue = KalmanContourCue(SQUARE, 4000, motion, "window", "literal", 1.0)
    random = np.random.default_rng(0)
    for target in ((38.0, 26.0), (41.0, 27.0)):
        states = cue.sample(random)
        centres = states.mean(axis=1)
        weights = np.exp(-0.5 * ((centres - target) ** 2).sum(axis=1))
        weights /= weights.sum()
        cue.receive(states, weights)
        mean = weights @ centres
        np.testing.assert_allclose(cue.place.position, mean, atol=1e-9)
        np.testing.assert_allclose(
            cue.place.covariances[:, 0, 0], weights @ (centres - mean) ** 2, rtol=1e-9
        )


def test_equal_weights_tell_the_kalman_filter_next_to_nothing():
    motion = ContourDynamics(np.zeros((2, 2)), np.array([3.0, 2.0]))
    cue = KalmanContourCue(SQUARE, 200_00, motion, "window", "literal", 1.0)
    states = cue.sample(np.random.default_rng(0))
    before = cue.place.covariances[:, 0, 0].copy()
    cue.receive(states, np.full(len(states), 1 / len(states)))
    np.testing.assert_allclose(cue.place.covariances[:, 0, 0], before, rtol=0.05)
    np.testing.assert_allclose(cue.place.position, SQUARE.mean(axis=0), atol=0.2)
