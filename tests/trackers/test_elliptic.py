"""Parts of the elliptic particle filter: likelihood, motion, background, placement, model."""

from dataclasses import replace
from math import exp, pi, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.trackers.slow_ellipses import codes_of, histogram_of
from trackmark.trackers.base.sharing import SharedFrame
from trackmark.trackers.histograms.bins import JointBins
from trackmark.trackers.histograms.ellipses import EllipseCounts
from trackmark.trackers.histograms.motion import (
    LocationMemory,
    MotionModel,
    ellipse_in,
    states_at_rest,
)
from trackmark.trackers.histograms.target_model import (
    Background,
    EllipseHistograms,
    Likelihood,
    TargetModel,
    grid_spacing,
)


@given(st.sampled_from(["peak", "printed", "density", "variance"]), st.floats(0.03, 0.15))
def test_the_least_coefficient_solves_equations_10_and_11(reading, sigma):
    likelihood = Likelihood(sigma, reading, 0.9)
    rho = likelihood.least_coefficient
    prefix = {"peak": 1.0, "density": 1 / (sqrt(2 * pi) * sigma)}.get(
        reading, 1 / sqrt(2 * pi * sigma)
    )
    square = sigma if reading == "variance" else sigma**2
    assert prefix * exp(-(1 - rho) / (2 * square)) == pytest.approx(0.9)
    assert prefix * exp(likelihood.log(rho)) == pytest.approx(0.9)
    assert (
        replace(likelihood, threshold=prefix).least_coefficient == np.inf
    )  # no more than its peak
    assert replace(likelihood, interpretation="always").least_coefficient == -np.inf


def motion(**changes):
    quiet = MotionModel("first-order", "together", "linear", 1.0, 0.0, 0.0, 0.0, 0.0)
    return replace(quiet, **changes)


def steps(model, state, n=1, rates=(0.0, 0.0, 0.0), seed=0, aspect=None, particles=1):
    states, rates = np.tile(np.array(state, float), (particles, 1)), np.tile(rates, (particles, 1))
    aspect = state[5] / state[4] if aspect is None else aspect
    generator = np.random.default_rng(seed)
    for _ in range(n):
        states, rates = model.step(states, rates, state[4], aspect, (640, 480), generator)
    return states


STATE = [100.0, 80.0, 3.0, -2.0, 20.0, 30.0, 0.5]


def test_motion_without_noise_is_constant_or_damped():
    actual = steps(motion(), STATE, n=4)
    np.testing.assert_allclose(actual[0], [112, 72, 3, -2, 22, 33, 0.5])
    damped = steps(motion(scale_persistence=0.9), STATE, n=3)
    assert damped[0, 6] == pytest.approx(0.5 * 0.9**3)
    assert damped[0, 4] == pytest.approx(20 + 0.5 * (1 + 0.9 + 0.81))
    factors = motion(scale_change="multiplicative", axes="apart")
    actual = steps(factors, [*STATE[:6], 0.02], n=3)
    np.testing.assert_allclose(actual[0, 4:6], np.array([20, 30]) * 1.02**3)


def test_second_order_has_constant_rates_of_change():
    actual = steps(motion(dynamics="second-order"), STATE, n=3, rates=(1.0, 0.5, 0.1))
    np.testing.assert_allclose(actual[0, :2], [100 + 3 * 3 + 3, 80 - 3 * 2 + 1.5])
    np.testing.assert_allclose(actual[0, [2, 3, 6]], [6.0, -0.5, 0.8])


@pytest.mark.parametrize("scale_change", ["linear", "multiplicative"])
def test_noise_has_the_deviations_that_are_asked_for(scale_change):
    model = MotionModel("first-order", "apart", scale_change, 1.0, 0.12, 0.05, 0.02, 0.004)
    state = [300.0, 200.0, 0.0, 0.0, 20.0, 30.0, 0.0]
    moved = steps(model, state, particles=40_000)
    spread = (moved - state).std(axis=0)
    of_ratio = 20 * 0.004 if scale_change == "linear" else 0.004
    np.testing.assert_allclose(spread, [2.4, 2.4, 1, 1, 0.4, 0.6, of_ratio], rtol=0.03)
    correlations = np.corrcoef((moved - state).T)
    assert np.abs(correlations - np.eye(7)).max() < 0.03


def test_axes_together_keep_their_ratio_and_share_one_noise():
    model = motion(size_noise=0.05, scale_noise=0.01)
    moved = steps(model, [*STATE[:6], 0.0], n=5, particles=50)
    np.testing.assert_allclose(moved[:, 5] / moved[:, 4], 1.5)
    assert moved[:, 4].std() > 0


@pytest.mark.parametrize("axes", ["together", "apart"])
@pytest.mark.parametrize("change", [-500.0, 500.0])
def test_half_axes_stay_between_three_pixels_and_the_image(axes, change):
    moved = steps(motion(axes=axes), [*STATE[:6], change])
    assert 3 <= moved[0, 4] <= 640
    assert 3 <= moved[0, 5] <= 480
    if axes == "together":
        assert moved[0, 5] / moved[0, 4] == pytest.approx(1.5)


def test_the_model_does_not_change_how_many_numbers_are_drawn():
    states = states_at_rest(np.zeros((3, 2)), np.array([4.0, 5.0]))
    for dynamics in ("first-order", "second-order", "random-walk"):
        generator, expected = np.random.default_rng(5), np.random.default_rng(5)
        motion(dynamics=dynamics).step(states, np.zeros((3, 3)), 4, 1.25, (9, 9), generator)
        expected.standard_normal((3, 10))
        assert generator.random() == expected.random()


def test_an_ellipse_in_a_box_has_its_middle_and_half_its_size():
    np.testing.assert_array_equal(
        ellipse_in(np.array([10, 20, 30, 50.0])), [25, 45, 0, 0, 15, 25, 0]
    )
    np.testing.assert_array_equal(ellipse_in(np.array([10, 20, 2, 4.0]))[4:6], [3, 3])


def picture(seed=0, height=80, width=100):
    return np.random.default_rng(seed).integers(0, 256, (height, width, 3)).astype(np.uint8)


def test_background_is_examined_at_every_place_of_the_grid():
    image = picture()
    half_axes = np.array([8.0, 11.0])
    background = Background(SharedFrame(image), half_axes, 8.0, JointBins(), "isotropic")
    columns, rows = np.arange(8, 92.01, 8), np.arange(11, 69.01, 8)
    assert len(background.positions) == len(columns) * len(rows)
    np.testing.assert_allclose(np.unique(background.positions[:, 0]), columns)
    np.testing.assert_allclose(np.unique(background.positions[:, 1]), rows)
    model = np.random.default_rng(2).dirichlet(np.ones(512))
    expected = [
        np.sqrt(
            histogram_of(codes_of(image), 512, (*centre, *half_axes), "isotropic") * model
        ).sum()
        for centre in background.positions[:6]
    ]
    actual = background.coefficients(model)
    np.testing.assert_allclose(actual[:6], expected, atol=1e-5)
    mean = sum(actual) / len(actual)
    deviation = sqrt(sum((rho - mean) ** 2 for rho in actual) / len(actual))  # equations 13, 14
    assert background.threshold(model) == pytest.approx(mean + 2 * deviation, rel=1e-12)


@given(st.integers(50, 2000), st.floats(3, 60), st.floats(3, 60))
def test_the_grid_has_about_as_many_positions_as_asked_for(positions, half_x, half_y):
    half_axes = np.array([half_x, half_y])
    spacing = grid_spacing(positions, half_axes, (640, 480))
    across, down = (
        len(np.arange(half, size - half + 1e-9, spacing))
        for half, size in zip(half_axes, (640, 480), strict=True)
    )
    assert positions <= across * down <= 1.4 * positions + 50


def test_the_surroundings_of_the_target_are_not_background():
    half_axes, target = np.array([6.0, 9.0]), np.array([50.0, 40.0])
    arguments = SharedFrame(picture()), half_axes, 3.0, JointBins(), "isotropic"
    background, whole = Background(*arguments, target), Background(*arguments)
    away = np.abs(background.positions - target) / half_axes
    assert (away.max(axis=1) >= 2 - 1e-9).all()
    near = np.abs(whole.positions - target) / half_axes
    assert len(background.positions) == (near.max(axis=1) >= 2).sum() < len(whole.positions)


def test_a_target_that_fills_the_image_leaves_no_background():
    large = np.array([60.0, 41.0])
    background = Background(SharedFrame(picture()), large, 3.0, JointBins(), "isotropic")
    assert background.threshold(np.full(512, 1 / 512)) == 0.0


def whereabouts(**changes):
    return LocationMemory(np.array([10.0, 20.0]), (640, 480), **changes)


def placed(where, placement, n=4000, frame=0):
    return where.particles(placement, n, frame, np.random.default_rng(0))


BORDERS = np.array([[5.0, 230.0, 10.0, 20.0], [625.0, 230.0, 10.0, 20.0]])
DOORS = np.array([[100.0, 50.0, 20.0, 40.0], [400.0, 60.0, 4.0, 8.0]])
WHOLE = np.array([[10.0, 20.0, 620.0, 440.0]])


@pytest.mark.parametrize(
    ("placement", "entries", "expected"),
    [
        *((placement, None, BORDERS) for placement in ("last", "predicted", "borders")),
        ("borders", DOORS, DOORS),
        ("image", DOORS, DOORS),
        ("image", None, WHOLE),  # of centres of ellipses that are whole inside
    ],
)
def test_unseen_target_is_searched_in_entry_boxes(placement, entries, expected):
    places = placed(whereabouts(entries=entries), placement)[:, np.newaxis, :2]
    inside = ((places >= expected[:, :2]) & (places <= expected[:, :2] + expected[:, 2:])).all(
        axis=2
    )
    assert (inside.sum(axis=1) == 1).all()
    np.testing.assert_allclose(inside.mean(axis=0), 1 / len(expected), atol=0.05)
    for scaled, box in zip(inside.T, expected, strict=True):
        middle, spread = box[:2] + box[2:] / 2, box[2:] / np.sqrt(12)
        np.testing.assert_allclose(places[scaled, 0].mean(axis=0), middle, atol=spread.max() / 5)
        np.testing.assert_allclose(places[scaled, 0].std(axis=0), spread, rtol=0.1)


def test_placement_last_keeps_half_at_the_last_position():
    where = whereabouts()
    where.record_probable(np.array([200.0, 300.0]), np.array([12.0, 24.0]))
    particles = placed(where, "last")
    near = np.abs(particles[:, 0] - 200) < 170
    assert near.mean() == pytest.approx(0.5, abs=0.01)
    np.testing.assert_allclose(particles[near, :2].std(axis=0), [36, 12], rtol=0.06)
    assert (particles[:, 4:6] == [12, 24]).all()
    assert not particles[:, [2, 3, 6]].any()
    assert particles[~near, 1].mean() == pytest.approx(300, abs=2)


def test_a_prediction_goes_on_as_the_target_did():
    where = whereabouts()
    where.record_probable(np.array([200.0, 300.0]), np.array([10.0, 20.0]))
    for frame in range(30):
        where.record_certain(frame, np.array([100.0 + 2 * frame, 300.0]))
    particles = placed(where, "predicted", frame=39)
    near = np.abs(particles[:, 0] - 178) < 100
    assert near.mean() == pytest.approx(0.7, abs=0.02)
    assert particles[near, 0].mean() == pytest.approx(100 + 2 * 39, abs=1)
    np.testing.assert_allclose(particles[near, :2].std(axis=0), [15, 5], rtol=0.06)
    assert np.log(particles[:, 4] / 10).std() == pytest.approx(0.08, rel=0.05)
    np.testing.assert_allclose(particles[:, 5] / particles[:, 4], 2)


def test_a_speed_that_no_target_has_is_not_believed():
    where = whereabouts()
    for frame in range(3):
        where.record_certain(frame, np.array([100.0 + 50 * frame, 300.0]))
    particles = placed(where, "predicted", frame=12)
    near = np.abs(particles[:, 0] - 240) < 100
    assert particles[near, 0].mean() == pytest.approx(200 + 10 * 4, abs=1.5)


def counts_of(rows):
    rows = np.array(rows, np.int64)
    return EllipseCounts(rows, rows.sum(axis=1), np.full(len(rows), 99))


def test_a_model_forgets_exponentially():
    first, later = np.array([1.0, 0.0]), np.array([0.0, 1.0])
    model = TargetModel(first, 3, apart=False, alpha=0.1)
    for _ in range(7):
        model.update(later, 1.0, counts_of([[1, 1]] * 3), np.ones(3) / 3, 0.5)
    np.testing.assert_allclose(model.current, [0.9**7, 1 - 0.9**7])
    np.testing.assert_array_equal(model.first, first)


@pytest.mark.parametrize(("coefficient", "updated"), [(0.90, 0.0), (0.91, 1.0)])
def test_a_model_follows_only_what_is_more_like_it_than_asked(coefficient, updated):
    model = TargetModel(np.array([0.5, 0.5]), 3, apart=False, alpha=0.1)
    actual = counts_of([[1, 1]] * 3)
    assert model.update(np.array([0.2, 0.8]), coefficient, actual, np.ones(3) / 3, 0.9) == updated
    np.testing.assert_allclose(model.current, [0.47, 0.53] if updated else [0.5, 0.5])


def test_nothing_that_is_outside_the_image_enters_a_model():
    model = TargetModel(np.array([0.5, 0.5]), 3, apart=False, alpha=0.1)
    actual = counts_of([[1, 1]] * 3)
    assert model.update(None, 0.0, actual, np.ones(3) / 3, -np.inf) == 0.0


def test_models_per_particle_follow_their_particles():
    model = TargetModel(np.array([0.5, 0.5]), 3, apart=True, alpha=0.5)
    actual = counts_of([[1, 1], [1, 0], [0, 0]])
    assert model.update(None, 0.0, actual, np.array([0.5, 0.25, 0.25]), 0.1) == pytest.approx(2 / 3)
    np.testing.assert_allclose(model.current, [0.5625, 0.4375])
    model.select(np.array([1, 1, 0]))
    expected = [1 * sqrt(0.75), 1 * sqrt(0.75), sqrt(0.5)]
    np.testing.assert_allclose(model.coefficients(counts_of([[1, 0]] * 3)), expected)
    model.reset()
    expected = sqrt(model.current[0])
    np.testing.assert_allclose(model.coefficients(counts_of([[1, 0]] * 3)), expected)


def test_an_ellipse_counts_only_with_a_quarter_inside():
    ellipses, frame = EllipseHistograms(JointBins(), "isotropic"), SharedFrame(picture())
    inside = [-6.0 + 0.5 * i for i in range(20)]
    states = states_at_rest(np.array([[x, 40.0] for x in inside]), np.array([8.0, 8.0]))
    actual = ellipses.counts(frame, states, np.arange(512))
    shares = actual.pixels / (pi * 64)
    assert ((actual.totals > 0) == (shares >= 0.25)).all()
    assert 0 < (actual.totals > 0).sum() < 20
