"""The particle filters and the improved CamShift of Wang & Tang against the paper's equations."""

from math import sqrt

import numpy as np
import pytest

from tests.trackers.following import track
from trackmark.bench.papers.wang2010 import plain

ORANGE, SIMILAR, WALL = np.array([[40, 140, 230], [45, 120, 215], [120, 125, 130]])
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
def test_boxes_are_those_of_plain_numpy(name, parameters):
    images, boxes = clip(10, shift=(4.0, -1.5))
    first = boxes[0] + [0.3, -0.2, 0.4, 0.4]
    actual = track(name, images, first, 3, preset="as-written", **parameters)
    slow = PLAIN[name](np.random.SeedSequence(3), **parameters)
    slow.init(images[0], first)
    for frame, estimate in zip(images[1:], actual, strict=True):
        assert estimate.box == pytest.approx(slow.update(frame), abs=1e-9)
        if name != "camshift-improved":
            for key in ("particles", "predicted", "weights", "similarity"):
                expected = getattr(slow, key)
                np.testing.assert_allclose(estimate.arrays[key], expected, rtol=1e-9, atol=1e-9)


def test_without_any_weight_the_target_counts_as_not_visible():
    orange, blue = np.zeros((2, 60, 80, 3), np.uint8)
    orange[:], blue[:] = (0, 140, 230), (200, 90, 60)  # of another hue, and less saturated
    for name in ("wang2010", "particle-filter", "camshift-improved"):
        (estimate,) = track(name, [orange, blue], [30, 20, 10, 13])
        assert not estimate.visible
        assert estimate.confidence == 0
        assert np.isfinite(estimate.box).all()


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
