"""Parts of the template tracker where its plain reference does not look.

What each setting does is compared with the plain reference in `test_nguyen2002_against_plain.py`.
"""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.trackers import plain_matching as plain
from trackmark.trackers.templates.appearance import NoiseModel, TemplateFilter, raise_eigenvalues
from trackmark.trackers.templates.matching import FeatureWindow, Pose, find_pose, search_bounds

LIMIT = {1: 6.6349, 3: 11.3449}


def noise(d=3, **changes):
    usual = NoiseModel(LIMIT[d], 1e-4, 1.0, 0.25, True, 0.0, 10, True, True, True, patience=10**9)
    return usual._replace(**changes)


def sample_at(appearance, features):
    """See a view as the tracker does."""
    first = not appearance.noise_known
    if first:
        appearance.start(features)
    seen = appearance.compare(features)
    appearance.update(seen, first=first)
    return seen


def views(number, d=3, sd=2.0, shape=(30, 40), seed=0):
    random = np.random.default_rng(seed)
    truth = random.uniform(0, 255, (*shape, d))
    return truth, [truth + random.normal(0, sd, truth.shape) for _ in range(number)]


@pytest.mark.parametrize("full", [True, False])
def test_grey_noise_covariance_is_regularised(full):
    random = np.random.default_rng(0)
    grey = random.uniform(0, 255, (30, 40, 1))
    seen = [np.repeat(grey + random.normal(0, 3, grey.shape), 3, axis=2) for _ in range(12)]
    appearance = TemplateFilter(noise(floor=1.0, full=full), seen[0])
    for features in seen[1:]:
        assert sample_at(appearance, features).share < 0.2
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


def test_view_without_inliers_keeps_the_covariance():
    _, seen = views(2)
    appearance = TemplateFilter(noise(), seen[0])
    appearance.start(seen[1])
    before = appearance.residual
    lost = appearance.compare(seen[1] + 1e4)
    assert lost.share == 1
    np.testing.assert_allclose(lost.covariance, before, rtol=1e-12)


def test_eigenvalues_are_raised_and_nothing_else_is_changed():
    rotation, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))
    matrix = rotation @ np.diag([-2.0, 0.5, 3.0]) @ rotation.T
    expected = rotation @ np.diag([1.0, 1.0, 3.0]) @ rotation.T
    np.testing.assert_allclose(raise_eigenvalues(matrix, 1.0), expected, atol=1e-12)
    np.testing.assert_array_equal(raise_eigenvalues(expected, 0.9), (expected + expected.T) / 2)
    skewed = expected + np.array([[0, 1e-3, 0], [-1e-3, 0, 0], [0, 0, 0]])
    np.testing.assert_allclose(raise_eigenvalues(skewed, 0.9), expected, atol=1e-12)


ROWS, COLUMNS = 70, 90
CUTOFF = 3.368
COVARIANCE = np.array([[30.0, 12.0, 5.0], [12.0, 25.0, -6.0], [5.0, -6.0, 20.0]])


def texture(rows=ROWS, columns=COLUMNS, d=3, seed=0, blur=3.0):
    noise = np.random.default_rng(seed).normal(0, 300, (rows, columns, d))
    return cv2.GaussianBlur(noise, (0, 0), blur).reshape(rows, columns, d)


def whole(features):
    return FeatureWindow(features, 0, 0, *features.shape[:2])


def cropped(features, pose, search_range, shape):
    left, top, right, bottom = search_bounds(pose, search_range, shape, *features.shape[:2])
    return FeatureWindow(features[top:bottom, left:right].copy(), left, top, *features.shape[:2])


def costs(features, template, poses, bilinear=False, cutoff=CUTOFF):
    arguments = features, template, np.linalg.inv(COVARIANCE)
    ways = {"stride": 2, "bilinear": bilinear}
    return np.array([plain.matching_cost(*arguments, pose, cutoff, **ways) for pose in poses])


@pytest.mark.parametrize(("seed", "scale"), [(0, 1.0), (1, 0.99), (0, 1.02)])
def test_whole_pixels_are_those_of_an_exhaustive_search(seed, scale):
    random = np.random.default_rng(seed)
    features = texture(seed=seed)
    x, y = 45 + random.uniform(-8, 8), 35 + random.uniform(-8, 8)
    template = plain.sample(features, plain.Pose(x, y, scale), 15, 19, bilinear=True)
    template += random.normal(0, 2, template.shape)
    actual = find_pose(whole(features), template, COVARIANCE, Pose(45, 35, 1.0), 8, CUTOFF, False)
    everywhere = [
        plain.Pose(45 + across, 35 + down, coarse * fine)
        for coarse in (0.98, 1.0, 1.02)
        for fine in (0.99, 1.0, 1.01)
        for down in range(-10, 11)
        for across in range(-10, 11)
    ]
    all_costs = costs(features, template, everywhere)
    best = everywhere[all_costs.argmin()]
    assert (actual.pose.x, actual.pose.y) == (best.x, best.y)
    assert actual.pose.scale == pytest.approx(best.scale, abs=0.02)
    assert actual.cost <= np.partition(all_costs, 9)[9]  # scales differ by little at this size
    assert actual.cost == pytest.approx(costs(features, template, [actual.pose])[0])


def on_flat_ground(pose, search_range, subpixel, ties="ascending"):
    flat = np.zeros((ROWS, COLUMNS, 3))
    arguments = flat[:12, :12], COVARIANCE, pose, search_range, CUTOFF, subpixel, ties
    return find_pose(whole(flat), *arguments).pose


@pytest.mark.parametrize(("scale", "limit"), [(0.5, 0.5), (0.4, 0.5), (2.3, 2.0)])
def test_scales_stay_between_a_half_and_two(scale, limit):
    actual = on_flat_ground(Pose(45, 35, scale), 16, False).scale
    assert 0.5 <= actual <= 2.0
    assert actual == pytest.approx(limit, rel=0.031)


POSES = st.builds(
    Pose, st.floats(-60, COLUMNS + 60), st.floats(-60, ROWS + 60), st.floats(0.5, 2.0)
)


@settings(max_examples=15)
@given(
    pose=POSES,
    height=st.integers(4, 20),
    width=st.integers(4, 20),
    search_range=st.sampled_from([4, 16, 26]),
)
def test_search_window_does_not_change_the_result(pose, height, width, search_range):
    features = texture(blur=1.5)
    template = plain.sample(features, plain.Pose(47.3, 31.8, 1.1), height, width, bilinear=True)
    window = cropped(features, pose, search_range, template.shape)
    for subpixel in (False, True):
        arguments = template, COVARIANCE, pose, search_range, CUTOFF, subpixel
        assert find_pose(window, *arguments) == find_pose(whole(features), *arguments)
