"""Tracker `nummiaro2003` and its parts: likelihood, motion, background, placement, target model."""

from dataclasses import replace
from math import exp, pi, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackmark import trackers
from trackmark.trackers.base.parameters import TrackerError
from trackmark.trackers.base.sharing import SharedFrame
from trackmark.trackers.histograms.bins import JointBins
from trackmark.trackers.histograms.ellipses import EllipseCounts
from trackmark.trackers.histograms.motion import (
    LocationMemory,
    ellipse_in,
    propagate,
    states_at_rest,
)
from trackmark.trackers.histograms.target_model import (
    Background,
    EllipseHistograms,
    Likelihood,
    TargetModel,
)


@given(st.sampled_from(["peak", "printed", "density", "variance"]), st.floats(0.03, 0.15))
def test_least_coefficient_solves_equations_10_and_11(interpretation, sigma):
    likelihood = Likelihood(sigma, interpretation, 0.9)
    rho = likelihood.least_coefficient
    prefix = {"peak": 1.0, "density": 1 / (sqrt(2 * pi) * sigma)}.get(
        interpretation, 1 / sqrt(2 * pi * sigma)
    )
    square = sigma if interpretation == "variance" else sigma**2
    assert prefix * exp(-(1 - rho) / (2 * square)) == pytest.approx(0.9)
    assert prefix * exp(likelihood.log(rho)) == pytest.approx(0.9)
    assert replace(likelihood, threshold=prefix).least_coefficient == np.inf  # above the peak
    assert replace(likelihood, interpretation="always").least_coefficient == -np.inf


@pytest.mark.parametrize(
    ("rho", "likelihood"),
    [(1.0, 1.261566), (0.99325, 0.900193), (0.9932, 0.897945), (0.98, 0.464104)],
)
def test_nummiaro2003_as_written_has_the_printed_equation_10(rho, likelihood):
    """Worked by hand: 1 / √(2π · 0.1) = 1 / 0.792665 = 1.261566, exp(-0.3375) = 0.713552."""
    equation = trackers.create("nummiaro2003", preset="as-written")._likelihood
    assert equation.sigma == 0.1
    factor = 1 / 0.792665
    assert factor * exp(equation.log(rho)) == pytest.approx(likelihood, abs=1e-5)
    assert (rho > equation.least_coefficient) == (likelihood > 0.9)


def motion(**changes):
    noises = ("position_noise", "velocity_noise", "size_noise", "scale_noise")
    parameters = trackers.resolve("nummiaro2003", preset="as-written").parameters
    return parameters.model_copy(update={**dict.fromkeys(noises, 0.0), **changes})


def steps(model, state, n=1, rates=(0.0, 0.0, 0.0), seed=0, aspect=None, particles=1):
    states, rates = np.tile(np.array(state, float), (particles, 1)), np.tile(rates, (particles, 1))
    aspect = state[5] / state[4] if aspect is None else aspect
    generator = np.random.default_rng(seed)
    for _ in range(n):
        states, rates = propagate(model, states, rates, state[4], aspect, (640, 480), generator)
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


def test_second_order_motion_has_constant_acceleration():
    actual = steps(motion(dynamics="second-order"), STATE, n=3, rates=(1.0, 0.5, 0.1))
    np.testing.assert_allclose(actual[0, :2], [100 + 3 * 3 + 3, 80 - 3 * 2 + 1.5])
    np.testing.assert_allclose(actual[0, [2, 3, 6]], [6.0, -0.5, 0.8])


@pytest.mark.parametrize("scale_change", ["linear", "multiplicative"])
def test_motion_noise_has_the_requested_deviations(scale_change):
    noises = {"position_noise": 0.12, "velocity_noise": 0.05, "size_noise": 0.02}
    model = motion(axes="apart", scale_change=scale_change, scale_noise=0.004, **noises)
    state = [300.0, 200.0, 0.0, 0.0, 20.0, 30.0, 0.0]
    moved = steps(model, state, particles=40_000)
    spread = (moved - state).std(axis=0)
    of_ratio = 20 * 0.004 if scale_change == "linear" else 0.004
    np.testing.assert_allclose(spread, [2.4, 2.4, 1, 1, 0.4, 0.6, of_ratio], rtol=0.03)
    correlations = np.corrcoef((moved - state).T)
    assert np.abs(correlations - np.eye(7)).max() < 0.03


@pytest.mark.parametrize("axes", ["together", "apart"])
@pytest.mark.parametrize("change", [-500.0, 500.0])
def test_half_axes_stay_between_three_pixels_and_the_image(axes, change):
    moved = steps(motion(axes=axes), [*STATE[:6], change])
    assert 3 <= moved[0, 4] <= 640
    assert 3 <= moved[0, 5] <= 480
    assert ellipse_in(np.array([10, 20, 2, 4.0])).tolist() == [11, 22, 0, 0, 3, 3, 0]
    if axes == "together":
        assert moved[0, 5] / moved[0, 4] == pytest.approx(1.5)


def test_motion_draws_as_many_numbers_for_all_dynamics():
    states = states_at_rest(np.zeros((3, 2)), np.array([4.0, 5.0]))
    for dynamics in ("first-order", "second-order", "random-walk"):
        generator, expected = np.random.default_rng(5), np.random.default_rng(5)
        propagate(motion(dynamics=dynamics), states, np.zeros((3, 3)), 4, 1.25, (9, 9), generator)
        expected.standard_normal((3, 10))
        assert generator.random() == expected.random()


def picture(seed=0, height=80, width=100):
    return np.random.default_rng(seed).integers(0, 256, (height, width, 3)).astype(np.uint8)


def test_background_excludes_surroundings_of_the_target():
    half_axes, target = np.array([6.0, 9.0]), np.array([50.0, 40.0])
    arguments = SharedFrame(picture()), half_axes, 3.0, JointBins(), "isotropic"
    background, whole = Background(*arguments, target), Background(*arguments)
    away = np.abs(background.positions - target) / half_axes
    assert (away.max(axis=1) >= 2 - 1e-9).all()
    near = np.abs(whole.positions - target) / half_axes
    assert len(background.positions) == (near.max(axis=1) >= 2).sum() < len(whole.positions)


def location_memory(**changes):
    return LocationMemory(np.array([10.0, 20.0]), (640, 480), **changes)


def placed_particles(memory, placement, n=4000, frame=0):
    return memory.particles(placement, n, frame, np.random.default_rng(0))


BORDERS = np.array([[5.0, 230.0, 10.0, 20.0], [625.0, 230.0, 10.0, 20.0]])
DOORS = np.array([[100.0, 50.0, 20.0, 40.0], [400.0, 60.0, 4.0, 8.0]])
IMAGE_BOX = np.array([[10.0, 20.0, 620.0, 440.0]])


@pytest.mark.parametrize(
    ("placement", "entries", "expected"),
    [
        *((placement, None, BORDERS) for placement in ("last", "predicted", "borders")),
        ("borders", DOORS, DOORS),
        ("image", DOORS, DOORS),
        ("image", None, IMAGE_BOX),  # centres of ellipses completely inside
    ],
)
def test_unseen_target_is_searched_in_entry_boxes(placement, entries, expected):
    places = placed_particles(location_memory(entry_boxes=entries), placement)[:, np.newaxis, :2]
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
    memory = location_memory()
    memory.record_probable(np.array([200.0, 300.0]), np.array([12.0, 24.0]))
    particles = placed_particles(memory, "last")
    near = np.abs(particles[:, 0] - 200) < 170
    assert near.mean() == pytest.approx(0.5, abs=0.01)
    np.testing.assert_allclose(particles[near, :2].std(axis=0), [36, 12], rtol=0.06)
    assert (particles[:, 4:6] == [12, 24]).all()
    assert not particles[:, [2, 3, 6]].any()
    assert particles[~near, 1].mean() == pytest.approx(300, abs=2)


def test_placement_predicted_extrapolates_the_motion():
    memory = location_memory()
    memory.record_probable(np.array([200.0, 300.0]), np.array([10.0, 20.0]))
    for frame in range(30):
        memory.record_certain(frame, np.array([100.0 + 2 * frame, 300.0]))
    particles = placed_particles(memory, "predicted", frame=39)
    near = np.abs(particles[:, 0] - 178) < 100
    assert near.mean() == pytest.approx(0.7, abs=0.02)
    assert particles[near, 0].mean() == pytest.approx(100 + 2 * 39, abs=1)
    np.testing.assert_allclose(particles[near, :2].std(axis=0), [15, 5], rtol=0.06)
    assert np.log(particles[:, 4] / 10).std() == pytest.approx(0.08, rel=0.05)
    np.testing.assert_allclose(particles[:, 5] / particles[:, 4], 2)


def test_predicted_speed_is_limited():
    memory = location_memory()
    for frame in range(3):
        memory.record_certain(frame, np.array([100.0 + 50 * frame, 300.0]))
    particles = placed_particles(memory, "predicted", frame=12)
    near = np.abs(particles[:, 0] - 240) < 100
    assert particles[near, 0].mean() == pytest.approx(200 + 10 * 4, abs=1.5)


def counts_of(rows):
    rows = np.array(rows, np.int64)
    return EllipseCounts(rows, rows.sum(axis=1), np.full(len(rows), 99))


@pytest.mark.parametrize(("coefficient", "updated"), [(0.90, 0.0), (0.91, 1.0)])
def test_target_model_is_updated_above_the_coefficient(coefficient, updated):
    model = TargetModel(np.array([0.5, 0.5]), 3, apart=False, alpha=0.1)
    actual = counts_of([[1, 1]] * 3)
    assert model.update(np.array([0.2, 0.8]), coefficient, actual, np.ones(3) / 3, 0.9) == updated
    np.testing.assert_allclose(model.current, [0.47, 0.53] if updated else [0.5, 0.5])
    assert model.update(None, 0.0, actual, np.ones(3) / 3, -np.inf) == 0.0  # outside the image


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


def test_ellipse_counts_only_with_a_quarter_inside():
    ellipses, frame = EllipseHistograms(JointBins(), "isotropic"), SharedFrame(picture())
    inside = [-6.0 + 0.5 * i for i in range(20)]
    states = states_at_rest(np.array([[x, 40.0] for x in inside]), np.array([8.0, 8.0]))
    actual = ellipses.counts(frame, states, np.arange(512))
    shares = actual.pixels / (pi * 64)
    assert ((actual.totals > 0) == (shares >= 0.25)).all()
    assert 0 < (actual.totals > 0).sum() < 20


RED, BLUE = (30, 40, 210), (210, 60, 30)
HEIGHT, WIDTH = 120, 200
SIZE = 20, 28


def ground(seed=0):
    """Return an image of textured, grey ground."""
    return np.random.default_rng(seed).integers(70, 140, (HEIGHT, WIDTH, 3)).astype(np.uint8)


def with_target(x, y=50, colour=RED, size=SIZE, image=None):
    """Return the ground with a target whose top left corner is (x, y)."""
    image = ground() if image is None else image
    image[max(y, 0) : max(y + size[1], 0), max(x, 0) : max(x + size[0], 0)] = colour
    return image


def box_at(x, y=50, size=SIZE):
    return np.array([x, y, *size], float)


def follow(tracker, images):
    return [tracker.update(image) for image in images]


def centre(estimate):
    return estimate.box[:2] + estimate.box[2:] / 2


def started(x=40, **parameters):
    tracker = trackers.create("nummiaro2003", **parameters)
    tracker.init(with_target(x), box_at(x))
    return tracker


@pytest.mark.parametrize(
    "parameters",
    [{}, {"preset": "as-written", "dynamics": "random-walk"}, {"colour": "hsv"}]
    + [{"models": "per-particle"}],
)
def test_moving_target_is_followed(parameters):
    tracker = started(**parameters)
    for frame, estimate in enumerate(follow(tracker, [with_target(40 + 2 * k) for k in range(20)])):
        # Inside a target of one colour, all smaller ellipses have equal histograms.
        assert (np.abs(centre(estimate) - [50 + 2 * frame, 64]) < (12, 16)).all()
        assert estimate.visible
        assert estimate.details["mode"] == 1
        assert estimate.details["coefficient"] > 0.7


def test_hidden_target_is_found_again():
    tracker = started(seed=3, sigma=0.05)
    follow(tracker, [with_target(40 + k) for k in range(8)])
    hidden = follow(tracker, [ground(k) for k in range(10)])
    assert [estimate.details["mode"] for estimate in hidden[:2]] == [1, 1]
    assert [estimate.details["mode"] for estimate in hidden[2:]] == [0] * 8
    assert all(estimate.details["positive_appearances"] < 10 for estimate in hidden)
    assert not any(estimate.visible for estimate in hidden[2:])
    for estimate in hidden[3:]:
        np.testing.assert_array_equal(estimate.box, hidden[2].box)
    actual = follow(tracker, [with_target(58 + k) for k in range(12)])
    assert actual[-1].details["mode"] == 1
    assert np.abs(centre(actual[-1]) - [79, 64]).max() < 12


@pytest.mark.parametrize("frames", [1, 2, 5])
def test_target_is_lost_after_loss_frames(frames):
    tracker = started(loss_frames=frames)
    modes = [e.details["mode"] for e in follow(tracker, [ground(k) for k in range(8)])]
    assert modes == [1] * (frames - 1) + [0] * (9 - frames)


def fading(share):
    speckled = np.random.default_rng(0).random(SIZE[::-1]) < share
    return with_target(40, colour=np.where(speckled[..., None], BLUE, RED))


def test_model_adapts_to_gradual_change_only():
    updated = started(sigma=0.1, alpha=0.3, update_reading="coefficient")
    fixed = started(sigma=0.1, model_update=False)
    slowly = [fading(share) for share in np.linspace(0, 1, 60)]
    assert follow(updated, slowly)[-1].details["coefficient"] > 0.85
    last = follow(fixed, slowly)[-1].details
    assert last["updated"] == 0
    assert last["coefficient"] < 0.75
    sudden = started(sigma=0.1, alpha=0.3, update_reading="coefficient")
    assert follow(sudden, [fading(1.0)] * 3)[0].details["updated"] == 0


def test_threshold_uses_the_selected_model():
    images = [with_target(40, colour=(30 + 8 * k, 40, 210 - 8 * k)) for k in range(20)]
    current = follow(started(update_reading="always"), images)
    first = follow(started(update_reading="always", appearance="first"), images)
    assert len({e.details["appearance_threshold"] for e in current}) > 10
    assert len({e.details["appearance_threshold"] for e in first}) == 1


def test_watched_frame_is_the_background_once():
    def threshold(tracker):
        tracker.init(with_target(40), box_at(40))
        return tracker.update(with_target(40)).details["appearance_threshold"]

    plain, watching = (trackers.create("nummiaro2003") for _ in range(2))
    redder = with_target(120, y=10, size=(60, 90))
    usual = threshold(plain)
    watching.watch(redder)
    assert threshold(watching) > usual + 0.1
    assert threshold(watching) == usual  # the watched frame is used once
    watching.watch(redder)
    with pytest.raises(TrackerError, match="less than a quarter"):  # a failed init uses it, too
        watching.init(ground(), box_at(-60))
    assert threshold(watching) == usual


def test_init_by_histogram_waits_for_the_target():
    tracker = trackers.create("nummiaro2003", sigma=0.1)
    model = tracker.histogram_of(with_target(40), box_at(40))
    tracker.init_by_histogram(ground(), model, np.array(SIZE) / 2)
    waiting = follow(tracker, [ground(k) for k in range(1, 10)])
    assert {e.details["mode"] for e in waiting} == {0.0}
    x = waiting[-1].arrays["particles"][:, 0]
    assert ((x < 20) | (x > WIDTH - 20)).all()
    coming = follow(tracker, [with_target(-30 + 2 * k, y=46) for k in range(36)])
    modes = [e.details["mode"] for e in coming]
    assert modes[0] == 0
    assert modes[-1] == 1
    assert np.abs(centre(coming[-1]) - [50, 60]).max() < 12


def test_init_by_histogram_rejects_invalid_arguments():
    tracker = trackers.create("nummiaro2003")
    good, size = np.full(512, 1 / 512), np.array([10.0, 14.0])
    negative = good.copy()
    negative[:2] = -0.5, 0.5 + 2 / 512
    with pytest.raises(TrackerError, match="less than a quarter"):
        tracker.histogram_of(ground(), box_at(-60))
    for histogram in (np.ones(512), np.ones(10) / 10, negative):
        with pytest.raises(TrackerError, match="Expected: 512 values ≥ 0 of sum 1"):
            tracker.init_by_histogram(ground(), histogram, size)
    for half_axes in ([0.0, 14.0], [10.0], [np.nan, 3.0], 7.0):
        with pytest.raises(TrackerError, match="two lengths above 0"):
            tracker.init_by_histogram(ground(), good, np.array(half_axes))
    for regions in (np.zeros((0, 4)), np.zeros(4), np.array([[0.0, 0, -3, 5]])):
        with pytest.raises(TrackerError, match="regions"):
            tracker.init_by_histogram(ground(), good, size, regions)
    tracker.init_by_histogram(ground(), good, np.array([1.0, 1.0]))
    assert (tracker.update(ground()).box[2:] >= 6).all()


def test_detector_is_called_until_it_returns_a_box():
    calls = []

    def detect(image):
        calls.append(image)
        reddish = (image == RED).all(axis=2)
        if not reddish.any():
            return np.zeros((0, 4))
        rows, columns = np.nonzero(reddish)
        return np.array([[columns.min(), rows.min(), np.ptp(columns) + 1, np.ptp(rows) + 1]])

    tracker = trackers.create("nummiaro2003")
    tracker.init_by_detector(ground(), detect)
    empty = tracker.update(ground(1))
    assert not empty.visible
    np.testing.assert_array_equal(empty.box, [0, 0, WIDTH, HEIGHT])
    np.testing.assert_array_equal(tracker.update(with_target(60)).box, box_at(60))
    assert len(calls) == 3
    later = follow(tracker, [with_target(60 + k) for k in range(10)])
    assert len(calls) == 3
    assert np.abs(centre(later[-1]) - [79, 64]).max() < 10


def test_invalid_result_of_a_detector_is_rejected():
    tracker = trackers.create("nummiaro2003")
    for nothing in (None, [1.0, 2.0, 3.0]):
        with pytest.raises(TrackerError, match="the detector returned"):
            tracker.init_by_detector(ground(), lambda image, nothing=nothing: nothing)


def test_detection_mostly_outside_is_ignored():
    outside, inside = box_at(WIDTH - 2), box_at(60)
    tracker = trackers.create("nummiaro2003")
    tracker.init_by_detector(ground(), lambda image: np.array([outside]))
    assert not tracker.update(ground(1)).visible
    tracker.init_by_detector(with_target(60), lambda image: np.array([outside, inside]))
    assert np.abs(centre(tracker.update(with_target(61))) - [70, 64]).max() < 10


@pytest.mark.parametrize("update", [True, False])
def test_uniform_image_loses_the_target(update):
    image = np.full((HEIGHT, WIDTH, 3), 128, np.uint8)
    tracker = trackers.create("nummiaro2003", model_update=update)
    tracker.init(image, box_at(40))
    estimates = follow(tracker, [image] * 6)
    assert estimates[0].details["appearance_threshold"] == pytest.approx(1.0)
    assert estimates[0].details["positive_appearances"] == 0  # no particle exceeds the background
    assert [e.details["mode"] for e in estimates] == [1, 1, 0, 0, 0, 0]
    assert all(np.isfinite(e.box).all() for e in estimates)
