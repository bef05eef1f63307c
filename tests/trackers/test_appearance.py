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


@pytest.mark.parametrize("kind", FLOORS)
def test_an_image_has_the_features_of_the_plain_reference(kind):
    image = np.random.default_rng(1).integers(0, 256, (40, 50, 3), dtype=np.uint8)
    image[:8] //= 64  # many zeros
    found = features_of(image, kind)
    assert found.shape == (40, 50, dimension(kind))
    np.testing.assert_allclose(found, plain.features_of(image, kind), rtol=0, atol=1e-15)
