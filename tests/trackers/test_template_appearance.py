"""The pixels' filters and their covariances against the textbook, and where these are singular."""

import numpy as np
import pytest

from trackers.templates.appearance import Appearance, Noise, raised

LIMIT = {1: 6.6349, 3: 11.3449}
NEVER = 10**9


def noise(d=3, **changes):
    settings = {
        "limit": LIMIT[d],
        "floor": 1e-4,
        "factor": 1.0,
        "first_spread": 0.25,
        "grid_step": 0.0,
        "average": 10,
        "full": True,
        "adaptive": True,
        "gate": True,
        "patience": NEVER,
    }
    return Noise(**settings | changes)


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


def test_without_state_noise_a_pixel_is_the_mean_of_what_was_seen():
    _, seen = views(8)
    appearance = Appearance(noise(adaptive=False, gate=False), seen[0])
    for n, features in enumerate(seen[1:], 2):
        shown(appearance, features)
        np.testing.assert_allclose(appearance.template, np.mean(seen[:n], axis=0), atol=1e-9)
        assert not appearance.state.any()


@pytest.mark.parametrize("d", [1, 3])
def test_a_pixel_is_the_textbooks_kalman_filter(d):
    _, seen = views(12, d)
    seen = [features + 1.5 * n for n, features in enumerate(seen)]  # what is seen changes
    appearance = Appearance(noise(d, gate=False), seen[0])
    pixel = 7, 11
    x = seen[0][pixel]
    for n, features in enumerate(seen[1:], 1):
        shown(appearance, features)
        measured, changed = appearance.measurement, appearance.state
        if n == 1:
            p = measured  # equation 15: as uncertain as a measurement
            np.testing.assert_array_equal(changed, np.zeros((d, d)))
        else:
            values, vectors = np.linalg.eigh(appearance.residual - measured - p)
            expected = vectors @ np.diag(np.maximum(values, 0)) @ vectors.T  # equation 14
            np.testing.assert_allclose(changed, expected, atol=1e-9)
        p = p + changed
        gain = p @ np.linalg.inv(p + measured)
        x = x + gain @ (features[pixel] - x)
        p = (np.eye(d) - gain) @ p
        np.testing.assert_allclose(appearance.template[pixel], x, atol=1e-9)
        if n == 1:
            np.testing.assert_allclose(gain, np.eye(d) / 2, atol=1e-12)
    assert changed.trace() > 0.1


def test_the_first_covariance_is_halved_between_template_and_measurement():
    _, seen = views(2, sd=3.0)
    appearance = Appearance(noise(), seen[0])
    appearance.start(seen[1])
    np.testing.assert_allclose(appearance.measurement, appearance.residual / 2)
    # Of the difference of two views, less what lies beyond the gate.
    np.testing.assert_allclose(appearance.residual, 18 * np.eye(3), atol=2.5)


def test_with_the_consistency_factor_the_first_covariance_is_that_of_the_noise():
    _, seen = views(2, sd=3.0, shape=(200, 200))
    biased, unbiased = (
        Appearance(noise(factor=factor, first_spread=1.0), seen[0]) for factor in (1.0, 1.0366)
    )
    for appearance in (biased, unbiased):
        appearance.start(seen[1])
    assert np.diag(unbiased.residual).mean() == pytest.approx(18, rel=0.01)
    assert np.diag(biased.residual).mean() < 17.3


def test_the_search_grids_step_is_added_as_the_gradients_spread():
    slope = np.array([3.0, -2.0, 1.0])
    plane = np.arange(40.0)[np.newaxis, :, np.newaxis] * slope + np.zeros((30, 1, 1))
    for step in (1.0, 0.25):
        with_step, without = (
            Appearance(noise(grid_step=grid_step), plane) for grid_step in (step, 0.0)
        )
        for appearance in (with_step, without):
            appearance.start(plane)
        added = with_step.residual - without.residual
        np.testing.assert_allclose(added, step**2 / 6 * np.outer(slope, slope), atol=1e-3)


def test_what_residuals_are_measured_by_is_the_mean_of_the_last_covariances():
    _, seen = views(9)
    appearance = Appearance(noise(average=3), seen[0])
    covariances = []
    for features in seen[1:]:
        covariances.append(shown(appearance, features).covariance)
        if len(covariances) == 1:
            covariances = [appearance.residual]
        expected = np.mean(covariances[-3:], axis=0)
        np.testing.assert_allclose(appearance.residual, expected, rtol=1e-12)


def test_where_what_is_seen_changes_state_noise_keeps_the_template_up_to_date():
    truth, seen = views(40, sd=2.0)
    adaptive, fixed = (Appearance(noise(adaptive=adaptive), seen[0]) for adaptive in (True, False))
    for features in seen[1:20]:
        shown(adaptive, features)
        shown(fixed, features)
    steady = adaptive.state.trace()
    for n, features in enumerate(seen[20:], 1):
        shown(adaptive, features + 0.8 * n)
        shown(fixed, features + 0.8 * n)
    assert adaptive.state.trace() > 3 * steady
    behind = [abs((one.template - truth).mean() - 0.8 * 20) for one in (adaptive, fixed)]
    assert behind[0] < behind[1] / 3


def test_a_grey_target_seen_by_invariants_has_the_least_noise_and_no_more():
    ones = np.ones((12, 10, 3))
    appearance = Appearance(noise(), ones)
    for _ in range(5):
        seen = shown(appearance, ones)
        assert seen.share == 0
        np.testing.assert_allclose(appearance.residual, 1e-4 * np.eye(3), atol=1e-18)
        np.testing.assert_array_equal(appearance.template, ones)
    assert shown(appearance, ones + 0.1).share == 1


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


def test_an_outlier_stands_still_until_it_was_one_for_too_long():
    truth, seen = views(12, sd=1.0)
    appearance = Appearance(noise(patience=6), seen[0])
    for features in seen[1:4]:
        shown(appearance, features)
    still, kept = (3, 4), appearance.template[3, 4].copy()
    for frame, features in enumerate(seen[4:10], 1):
        features[still] = truth[still] + 500
        shown(appearance, features)
        if frame < 6:
            np.testing.assert_array_equal(appearance.template[still], kept)
    np.testing.assert_array_equal(appearance.template[still], seen[9][still])


def test_only_outliers_in_succession_are_counted():
    truth, seen = views(12, sd=1.0)
    appearance = Appearance(noise(patience=3), seen[0])
    shown(appearance, seen[1])
    for frame, features in enumerate(seen[2:]):
        if frame % 3 < 2:
            features[5, 5] = truth[5, 5] + 500
        shown(appearance, features)
        assert abs(appearance.template[5, 5] - truth[5, 5]).max() < 10


def test_without_the_gate_outliers_are_counted_but_taken_in():
    truth, seen = views(3, sd=1.0)
    appearance = Appearance(noise(gate=False), seen[0])
    shown(appearance, seen[1])
    seen[2][5, :4] += 200
    share = shown(appearance, seen[2]).share
    assert share >= 4 / 1200
    assert abs(appearance.template[5, 0] - truth[5, 0]).min() > 20


def test_a_template_taken_anew_keeps_the_first_noise_only_if_asked_to():
    _, seen = views(8)
    appearance = Appearance(noise(), seen[0])
    for features in seen[1:]:
        shown(appearance, features)
    measurement = appearance.measurement.copy()
    appearance.take_keeping_noise(seen[3])
    np.testing.assert_allclose(appearance.residual, 2 * measurement)
    np.testing.assert_array_equal(appearance.template, seen[3])
    before = appearance.template.copy()
    appearance.update(appearance.seen(seen[4]), first=False)
    assert (appearance.template != before).any()
    np.testing.assert_allclose(appearance.measurement, measurement)
    appearance.take(seen[5])
    assert not appearance.started
