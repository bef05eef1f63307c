"""The pixels' filters against the textbook, and their covariances where these are singular.

What each setting does is compared with the plain reference in `test_nguyen2002_against_plain.py`.
"""

import numpy as np
import pytest

from tests.trackers import plain_matching as plain
from trackmark.trackers.templates.appearance import (
    FLOORS,
    Appearance,
    Noise,
    dimension,
    features_of,
    raised,
)

LIMIT = {1: 6.6349, 3: 11.3449}


def noise(d=3, **changes):
    usual = Noise(LIMIT[d], 1e-4, 1.0, 0.25, True, 0.0, 10, True, True, True, patience=10**9)
    return usual._replace(**changes)


def shown(appearance, features):
    """See a view as the tracker does."""
    first = not appearance.started
    if first:
        appearance.start(features)
    seen = appearance.seen(features)
    appearance.update(seen, first=first)
    return seen


def views(number, d=3, sd=2.0, shape=(30, 40), seed=0):
    random = np.random.default_rng(seed)
    truth = random.uniform(0, 255, (*shape, d))
    return truth, [truth + random.normal(0, sd, truth.shape) for _ in range(number)]


def test_with_the_consistency_factor_the_first_covariance_is_that_of_the_noise():
    _, seen = views(2, sd=3.0, shape=(200, 200))
    biased, unbiased = (
        Appearance(noise(factor=factor, first_spread=1.0), seen[0]) for factor in (1.0, 1.0366)
    )
    for appearance in (biased, unbiased):
        appearance.start(seen[1])
    assert np.diag(unbiased.residual).mean() == pytest.approx(18, rel=0.01)
    assert np.diag(biased.residual).mean() < 17.3


def test_the_first_covariance_is_that_of_all_pixels_unless_it_is_trimmed():
    _, seen = views(2, sd=1.0)
    seen[1][:6] += 40  # a fifth, which any covariance of the others calls outliers
    residuals = (seen[1] - seen[0]).reshape(-1, 3)
    for factor in (1.0, 1.0366):  # which makes up for what is cut off: nothing is
        every = Appearance(noise(trimmed=False, factor=factor), seen[0])
        every.start(seen[1])
        expected = residuals.T @ residuals / len(residuals)
        np.testing.assert_allclose(every.residual, expected, rtol=1e-12)
        np.testing.assert_allclose(every.measurement, expected / 2, rtol=1e-12)
    trimmed = Appearance(noise(first_spread=0.05), seen[0])
    trimmed.start(seen[1])
    assert np.diag(trimmed.residual).max() < 3
    assert np.diag(every.residual).min() > 300


@pytest.mark.parametrize("full", [True, False])
def test_grey_noise_is_singular_and_kept_off_singularity_in_the_other_directions_only(full):
    random = np.random.default_rng(0)
    grey = random.uniform(0, 255, (30, 40, 1))
    seen = [np.repeat(grey + random.normal(0, 3, grey.shape), 3, axis=2) for _ in range(12)]
    appearance = Appearance(noise(floor=1.0, full=full), seen[0])
    for features in seen[1:]:
        assert shown(appearance, features).share < 0.2
        for matrix in (appearance.residual, appearance.state, appearance.measurement):
            assert np.isfinite(matrix).all()
            assert np.linalg.eigvalsh(matrix)[0] > -1e-9
    variances = np.linalg.eigvalsh(appearance.residual)
    if full:
        assert variances[:2] == pytest.approx(1.0, abs=1e-9)
        assert variances[2] > 15
    else:
        assert variances.max() < 1.2 * variances.min()
        np.testing.assert_array_equal(appearance.residual, np.diag(np.diag(appearance.residual)))


def test_a_view_without_any_inlier_leaves_the_covariance_as_it_was():
    _, seen = views(2)
    appearance = Appearance(noise(), seen[0])
    appearance.start(seen[1])
    before = appearance.residual
    lost = appearance.seen(seen[1] + 1e4)
    assert lost.share == 1
    np.testing.assert_allclose(lost.covariance, before, rtol=1e-12)


def test_eigenvalues_are_raised_and_nothing_else_is_changed():
    rotation, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))
    matrix = rotation @ np.diag([-2.0, 0.5, 3.0]) @ rotation.T
    expected = rotation @ np.diag([1.0, 1.0, 3.0]) @ rotation.T
    np.testing.assert_allclose(raised(matrix, 1.0), expected, atol=1e-12)
    np.testing.assert_array_equal(raised(expected, 0.9), (expected + expected.T) / 2)
    skewed = expected + np.array([[0, 1e-3, 0], [-1e-3, 0, 0], [0, 0, 0]])
    np.testing.assert_allclose(raised(skewed, 0.9), expected, atol=1e-12)


BLACK, BLUE, GREY, SKIN = (0, 0, 0), (200, 0, 0), (90, 90, 90), (60, 80, 160)


def of_pixel(pixel, kind):
    return features_of(np.array([[pixel]], np.uint8), kind)[0, 0]


@pytest.mark.parametrize(
    ("pixel", "expected"),
    [
        (SKIN, [160 / 80, 80 / 160, 60 / 160]),
        (BLACK, [0, 0, 0]),  # a largest of 0 counts as one grey level
        (BLUE, [0, 0, 200]),
        (GREY, [1, 1, 1]),
    ],
)
def test_a_pixel_in_bgr_has_the_features_of_equation_18(pixel, expected):
    assert of_pixel(pixel, "invariants") == pytest.approx(expected)
    assert of_pixel(pixel, "arctan") == pytest.approx(np.arctan(expected))
    assert of_pixel(pixel, "rgb").tolist() == [*pixel[::-1]]
    assert of_pixel(pixel, "intensity").tolist() == [sum(pixel)]


@pytest.mark.parametrize("kind", FLOORS)
def test_an_image_has_the_features_of_the_plain_reference(kind):
    image = np.random.default_rng(1).integers(0, 256, (40, 50, 3), dtype=np.uint8)
    image[:8] //= 64  # many zeros
    found = features_of(image, kind)
    assert found.shape == (40, 50, dimension(kind))
    np.testing.assert_allclose(found, plain.features_of(image, kind), rtol=0, atol=1e-15)
