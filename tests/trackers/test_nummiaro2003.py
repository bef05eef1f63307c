"""The tracker's promises: when it tracks, when it waits, when its model follows."""

import numpy as np
import pytest

from trackmark import trackers
from trackmark.trackers.base.parameters import TrackerError

RED, BLUE = (30, 40, 210), (210, 60, 30)
HEIGHT, WIDTH = 120, 200
SIZE = 20, 28


def ground(seed=0):
    """Greyish ground with some texture."""
    return np.random.default_rng(seed).integers(70, 140, (HEIGHT, WIDTH, 3)).astype(np.uint8)


def with_target(x, y=50, colour=RED, size=SIZE, image=None):
    """The ground with a target whose left top corner is there."""
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
    [{}, {"preset": "as-written", "dynamics": "random-walk"}, {"colour": "hsv"}],
)
def test_a_target_that_moves_is_followed(parameters):
    tracker = started(**parameters)
    for frame, estimate in enumerate(follow(tracker, [with_target(40 + 2 * k) for k in range(20)])):
        # On the target; inside one of a single colour every smaller ellipse looks the same.
        assert (np.abs(centre(estimate) - [50 + 2 * frame, 64]) < (12, 16)).all()
        assert estimate.visible
        assert estimate.details["mode"] == 1
        assert estimate.details["coefficient"] > 0.7


def test_second_order_dynamics_follow_acceleration():
    tracker = started(x=10, dynamics="second-order", velocity_noise=0.01, scale_noise=0.0)
    ways = [round(0.2 * frame**2) for frame in range(1, 26)]
    for way, estimate in zip(
        ways, follow(tracker, [with_target(10 + w) for w in ways]), strict=True
    ):
        assert (np.abs(centre(estimate) - [20 + way, 64]) < (14, 16)).all()


def test_the_estimate_is_the_weighted_mean_of_the_particles():
    tracker = started()
    for estimate in follow(tracker, [with_target(40 + k) for k in range(5)]):
        particles, weights = estimate.arrays["particles"], estimate.arrays["weights"]
        mean = (weights[:, np.newaxis] * particles).sum(axis=0)  # equation 1
        np.testing.assert_allclose(centre(estimate), mean[:2], rtol=1e-12)
        np.testing.assert_allclose(estimate.box[2:], 2 * mean[4:6], rtol=1e-12)
        assert estimate.details["half_width"] == pytest.approx(mean[4])
        assert estimate.details["half_height"] == pytest.approx(mean[5])
        assert weights.sum() == pytest.approx(1.0)
        assert estimate.confidence == estimate.details["likelihood"]


def test_weights_are_equation_10():
    tracker = started(sigma=0.1, model_update=False)
    model = tracker.histogram_of(with_target(40), box_at(40))
    image = with_target(42)
    estimate = tracker.update(image)
    particles, weights = estimate.arrays["particles"], estimate.arrays["weights"]
    likelihoods = []
    for x, y, _, _, half_x, half_y, _ in particles:
        box = np.array([x - half_x, y - half_y, 2 * half_x, 2 * half_y])
        rho = np.sqrt(tracker.histogram_of(image, box) * model).sum()
        likelihoods.append(np.exp(-(1 - rho) / (2 * 0.1**2)) / np.sqrt(2 * np.pi * 0.1))
    np.testing.assert_allclose(weights, likelihoods / np.sum(likelihoods), rtol=1e-9)


def test_a_target_that_is_hidden_is_waited_for_and_found_again():
    tracker = started(seed=3)
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
def test_it_takes_some_frames_with_too_few_to_give_up(frames):
    tracker = started(loss_frames=frames)
    modes = [e.details["mode"] for e in follow(tracker, [ground(k) for k in range(8)])]
    assert modes == [1] * (frames - 1) + [0] * (9 - frames)


def fading(share):
    speckled = np.random.default_rng(0).random(SIZE[::-1]) < share
    return with_target(40, colour=np.where(speckled[..., None], BLUE, RED))


def test_only_certain_positions_are_stored():
    tracker = trackers.create("nummiaro2003", sigma=0.1, model_update=False, reinitialise=False)
    tracker.watch(with_target(120, y=10, size=(30, 40)))  # reddish things are about
    tracker.init(with_target(40), box_at(40))
    noted = []
    tracker._locations.record_certain = lambda frame, centre: noted.append(frame)
    actual = follow(tracker, [fading(share) for share in np.linspace(0, 1, 20)])
    sure = [e.details["coefficient"] > (1 + e.details["appearance_threshold"]) / 2 for e in actual]
    assert noted == [frame for frame, seen in enumerate(sure, 1) if seen]
    assert 0 < len(noted) < 20


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
    assert threshold(watching) == usual  # what was watched served one initialisation
    watching.watch(redder)
    with pytest.raises(TrackerError, match="less than a quarter"):  # which may fail
        watching.init(ground(), box_at(-60))
    assert threshold(watching) == usual


def test_a_known_histogram_waits_for_the_target_to_come_in():
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


@pytest.mark.parametrize("placement", ["last", "predicted", "borders", "image"])
def test_a_known_histogram_can_wait_at_doors(placement):
    tracker = trackers.create("nummiaro2003", sigma=0.1, placement=placement)
    model = tracker.histogram_of(with_target(40), box_at(40))
    door = np.array([[90.0, 50.0, 20.0, 20.0]])
    tracker.init_by_histogram(ground(), model, np.array(SIZE) / 2, door)
    places = tracker.update(ground(1)).arrays["particles"][:, :2]
    assert (np.abs(places - [100, 60]) <= 10).all()
    assert follow(tracker, [with_target(90, y=46)] * 3)[-1].details["mode"] == 1


def test_what_is_no_histogram_no_size_or_no_region_is_refused():
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


def test_a_detector_is_asked_until_it_finds_something():
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


def test_what_a_detector_gives_besides_boxes_is_refused():
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


def test_first_model_counts_after_model_updates():
    tracker = started(alpha=1.0, appearance="first", update_reading="always", reinitialise=False)
    follow(tracker, [with_target(40, colour=BLUE)] * 2)
    assert tracker.update(with_target(40)).details["positive_appearances"] > 50


def test_models_of_their_own_follow_as_well():
    tracker = started(models="per-particle")
    estimates = follow(tracker, [with_target(40 + k) for k in range(20)])
    assert np.abs(centre(estimates[-1]) - [69, 64]).max() < 10
    assert 0 < estimates[-1].details["updated"] <= 1


@pytest.mark.parametrize("update", [True, False])
def test_an_image_of_one_colour_tells_nothing_and_does_no_harm(update):
    image = np.full((HEIGHT, WIDTH, 3), 128, np.uint8)
    tracker = trackers.create("nummiaro2003", model_update=update)
    tracker.init(image, box_at(40))
    estimates = follow(tracker, [image] * 6)
    assert estimates[0].details["appearance_threshold"] == pytest.approx(1.0)
    assert estimates[0].details["positive_appearances"] == 0  # nothing exceeds its background
    assert [e.details["mode"] for e in estimates] == [1, 1, 0, 0, 0, 0]
    assert all(np.isfinite(e.box).all() for e in estimates)
