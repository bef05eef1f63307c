"""The particle filters and the improved CamShift of Wang & Tang against the paper's equations."""

from math import exp, sqrt

import numpy as np
import pytest

import trackers
from bench.papers.wang2010 import plain
from trackers.base.parameters import TrackerError

ORANGE, SIMILAR, WALL = (
    np.array([40, 140, 230]),
    np.array([45, 120, 215]),
    np.array([120, 125, 130]),
)
PLAIN = {
    "wang2010": plain.PlainWang2010,
    "particle-filter": plain.PlainParticleFilter,
    "camshift-improved": plain.PlainImprovedCamShift,
}


def clip(n_frames=12, shift=(2.0, 1.0), rows=60, columns=80, seed=0):
    """A textured orange target that moves past a thing of nearly its colour, with noise."""
    rng = np.random.default_rng(seed)
    wall = WALL + rng.normal(0, 12, (rows, columns, 3))
    wall[25:45, 40:52] = SIMILAR + rng.normal(0, 8, (20, 12, 3))
    target = ORANGE + rng.normal(0, 10, (13, 10, 3))
    images, boxes = [], []
    for frame in range(n_frames):
        x, y = round(14 + shift[0] * frame), round(16 + shift[1] * frame)
        image = wall + rng.normal(0, 3, wall.shape)
        image[y : y + 13, x : x + 10] = target + rng.normal(0, 3, target.shape)
        images.append(np.clip(image, 0, 255).astype(np.uint8))
        boxes.append([x, y, 10, 13])
    return images, np.array(boxes, float)


def track(name, images, box, **parameters):
    tracker = trackers.create(name, **{"seed": 3} | parameters)
    tracker.init(images[0], np.asarray(box, float))
    return [tracker.update(image) for image in images[1:]]


def boxes_of(estimates):
    return np.array([estimate.box for estimate in estimates])


def centre_errors(estimates, truth):
    found = boxes_of(estimates)
    return np.hypot(*(found[:, :2] + found[:, 2:] / 2 - truth[1:, :2] - truth[1:, 2:] / 2).T)


CLOUDS = [
    {},
    {"sigma": 0.1, "radius": 10.0, "difference_window": 7},
    {"alpha": 1.0, "beta": 0.0, "particles": 15},
    {"resampling": "multinomial", "estimate": "best"},
    {"velocity": "mean", "estimate": "resampled", "differences": "one"},
    {"motion_threshold": 12.0, "hue_bins": 16, "saturation_bins": 8, "threshold_factor": 3.0},
    {"minimum_saturation": 0.2, "minimum_value": 0.1, "sigma": 0.158, "particles": 7},
]
WINDOWS = [
    {},
    {"window": "adaptive"},
    {"stop_distance": 0.5, "difference_window": 7, "max_iterations": 3},
    {"beta": 0.0, "window": "adaptive", "differences": "one"},
]


@pytest.mark.parametrize(
    ("name", "parameters"),
    [(name, parameters) for name in ("wang2010", "particle-filter") for parameters in CLOUDS]
    + [("camshift-improved", parameters) for parameters in WINDOWS],
    ids=str,
)
@pytest.mark.parametrize("shift", [(2.0, 1.0), (4.0, 0.5)])
def test_boxes_are_those_of_plain_numpy(name, parameters, shift):
    images, boxes = clip(shift=shift)
    first = boxes[0] + [0.3, -0.2, 0.4, 0.4]
    found = track(name, images, first, preset="as-written", **parameters)
    slow = PLAIN[name](np.random.SeedSequence(3), **parameters)
    slow.init(images[0], first)
    for frame, estimate in zip(images[1:], found, strict=True):
        assert estimate.box == pytest.approx(slow.update(frame), abs=1e-9)
        if name != "camshift-improved":
            np.testing.assert_allclose(estimate.arrays["particles"], slow.particles, atol=1e-9)
            np.testing.assert_allclose(estimate.arrays["predicted"], slow.predicted, atol=1e-9)
            np.testing.assert_allclose(estimate.arrays["weights"], slow.weights, rtol=1e-9)
            np.testing.assert_allclose(estimate.arrays["similarity"], slow.similarity, atol=1e-9)


@pytest.mark.parametrize("name", ["wang2010", "particle-filter"])
def test_the_weights_are_equations_9_to_11_and_the_estimate_is_12(name):
    images, boxes = clip()
    for estimate in track(name, images, boxes[0], sigma=0.3):
        weights = np.array([exp(-(1 - m) / (2 * 0.09)) for m in estimate.arrays["similarity"]])
        weights /= weights.sum()
        np.testing.assert_allclose(estimate.arrays["weights"], weights, rtol=1e-12)
        centre = estimate.box[:2] + estimate.box[2:] / 2
        assert centre == pytest.approx(weights @ estimate.arrays["particles"], abs=1e-12)


def test_with_sigma_1_no_weight_is_more_than_root_e_times_another():
    images, boxes = clip(shift=(6.0, 0.0), n_frames=8)
    for estimate in track("particle-filter", images, boxes[0], preset="as-written"):
        weights = estimate.arrays["weights"]
        assert weights.max() / weights.min() < sqrt(np.e)
        assert estimate.details["effective_sample_size"] > 0.98


@pytest.mark.parametrize(("particles", "radius"), [(60, sqrt(60) / 2), (400, 10.0)])
def test_particles_are_thrown_by_half_the_root_of_their_number(particles, radius):
    images, boxes = clip(1)
    still = [images[0]] * 2
    (estimate,) = track("particle-filter", still, boxes[0], particles=particles)
    thrown = estimate.arrays["predicted"] - (boxes[0, :2] + boxes[0, 2:] / 2)
    assert np.abs(thrown).max() <= 2 * radius  # at the start, and again before the first frame
    assert np.abs(thrown).max() > 1.3 * radius
    assert thrown.mean(axis=0) == pytest.approx([0, 0], abs=4 * radius / sqrt(particles))


def test_a_particle_keeps_the_velocity_of_its_ancestor():
    images, boxes = clip(3)
    first, second = (
        e.arrays for e in track("particle-filter", images, boxes[0], radius=0.0, particles=5)
    )
    # Nothing is thrown: every particle stands where the target was, and its step is zero.
    np.testing.assert_array_equal(first["predicted"], second["predicted"])
    climbed = track("wang2010", images, boxes[0], radius=0.0, particles=5)
    before = boxes[0, :2] + boxes[0, 2:] / 2
    after = climbed[0].arrays["particles"][0]
    np.testing.assert_allclose(climbed[1].arrays["predicted"][0], 2 * after - before)


def test_the_drift_raises_what_the_windows_hold():
    images, boxes = clip()
    for estimate in track("wang2010", images, boxes[0])[1:]:
        before, after = (
            estimate.arrays[key].mean() for key in ("predicted_similarity", "similarity")
        )
        assert after > before


@pytest.mark.parametrize("name", ["wang2010", "particle-filter", "camshift-improved"])
def test_a_slow_target_is_followed(name):
    images, boxes = clip(20, shift=(1.0, 0.5))
    errors = centre_errors(track(name, images, boxes[0]), boxes)
    assert np.median(errors) < 2
    assert errors.max() < 5.75  # half the mean side


def test_the_size_stays_and_an_adaptive_windows_follows_bradski():
    images, boxes = clip()
    for name in ("wang2010", "particle-filter", "camshift-improved"):
        assert (boxes_of(track(name, images, boxes[0]))[:, 2:] == boxes[0, 2:]).all()
    (first, *_) = track("camshift-improved", images, boxes[0], window="adaptive")
    weight = first.details["similarity"] * 130
    width, height = 2 * sqrt(weight * 10 / 13), 2 * sqrt(weight * 13 / 10)
    assert first.box[2:].tolist() == [int(width + 0.5), int(height + 0.5)]


def test_without_any_weight_the_target_counts_as_not_visible():
    orange, blue = np.zeros((2, 60, 80, 3), np.uint8)
    orange[:], blue[:] = (0, 140, 230), (200, 90, 60)  # of another hue, and less saturated
    for name in ("wang2010", "particle-filter", "camshift-improved"):
        (estimate,) = track(name, [orange, blue], [30, 20, 10, 13])
        assert not estimate.visible
        assert estimate.confidence == 0
        assert np.isfinite(estimate.box).all()


def test_a_cloud_at_the_rim_stays_in_the_image():
    images, boxes = clip(9, shift=(-1.0, -1.5))
    for name in ("wang2010", "particle-filter"):
        for estimate in track(name, images, boxes[0], radius=30.0):
            predicted = estimate.arrays["predicted"]
            assert predicted.min() >= 0.5
            assert (predicted <= [79.5, 59.5]).all()


def test_details_say_what_became_of_the_particles():
    images, boxes = clip()
    for estimate in track("wang2010", images, boxes[0], sigma=0.1):
        weights, places = estimate.arrays["weights"], estimate.arrays["particles"]
        details = estimate.details
        assert details["effective_sample_size"] == pytest.approx(1 / (weights**2).sum() / 60)
        assert details["weight_ratio"] == pytest.approx(weights.max() * 60)
        distances = ((places - places.mean(axis=0)) ** 2).sum(axis=1)
        assert details["spread"] == pytest.approx(sqrt(distances.mean()))
        assert details["modes"] == len({tuple(place) for place in np.floor(places).tolist()})


def test_changing_tells_a_moving_camera():
    rng = np.random.default_rng(0)
    world = np.clip(rng.normal(130, 40, (80, 140, 3)), 0, 255).astype(np.uint8)
    at_rest = [world[:60, :80].copy() for _ in range(4)]
    panned = [world[:60, 3 * i : 3 * i + 80].copy() for i in range(4)]
    for images in (at_rest, panned):
        for i, image in enumerate(images):
            image[20:33, 14 + 2 * i : 24 + 2 * i] = ORANGE
    box = [14, 20, 10, 13]
    for name in ("wang2010", "camshift-improved"):
        rest = track(name, at_rest, box)[-1].details
        moves = track(name, panned, box)[-1].details
        assert rest["changing"] < 0.1
        assert moves["changing"] > 0.9
        # The threshold adapts: what passes it is no longer the target.
        assert rest["moving_inside"] > 0.5
        assert moves["moving_inside"] < rest["moving_inside"] / 2


def test_a_box_outside_the_image_is_refused_by_the_trackers_name():
    images, _ = clip(1)
    for name in ("wang2010", "particle-filter", "camshift-improved"):
        with pytest.raises(TrackerError, match=f"{name}: no pixel of the 10x13 window"):
            track(name, images, [200, 200, 10, 13])


@pytest.mark.parametrize(("name", "words"), [("radius", "rule"), ("motion_threshold", "adaptive")])
def test_a_rule_may_be_named_and_a_number_is_checked(name, words):
    assert getattr(trackers.create("wang2010", **{name: words}).parameters, name) == words
    assert getattr(trackers.create("wang2010", **{name: "3.5"}).parameters, name) == 3.5
    for wrong in (-1.0, "sometimes"):
        with pytest.raises(TrackerError, match=f"wang2010: parameter {name}={wrong}"):
            trackers.create("wang2010", **{name: wrong})


def test_presets_are_those_of_the_paper_and_of_the_literature():
    assert trackers.create("wang2010", preset="as-written").parameters.sigma == 1.0
    for preset in ("recommended", "sharp"):
        assert trackers.create("wang2010", preset=preset).parameters.sigma == 0.158
        assert trackers.create("particle-filter", preset=preset).parameters.sigma == 0.158
    robust = trackers.create("wang2010", preset="robust").parameters
    assert (robust.sigma, robust.radius, robust.stop_distance) == (0.1, 10.0, 0.5)
    assert robust.difference_window == 7
    assert trackers.create("particle-filter", preset="robust").parameters.particles == 400
