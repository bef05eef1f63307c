"""Trackers of Wang & Tang, compared with the paper's equations in plain NumPy."""

from itertools import pairwise
from math import sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from tests.trackers.following import track
from trackmark.bench.papers.wang2010 import plain, plain_maps
from trackmark.bench.papers.wang2010.plain_maps import JointMaps
from trackmark.trackers.base.parameters import TrackerError
from trackmark.trackers.base.sharing import SharedFrame
from trackmark.trackers.maps.differences import compare_frames, first_frame
from trackmark.trackers.maps.joint_map import (
    ColourBinning,
    ColourMotionModel,
    ColourMotionParameters,
    colour_bins,
    window_region,
)

pictures = arrays.arrays(
    np.uint8,
    st.tuples(st.integers(1, 9), st.integers(1, 9), st.just(3)),
    elements=st.integers(0, 255),
)


def random_image(seed, rows=24, columns=31):
    return np.random.default_rng(seed).integers(0, 256, (rows, columns, 3), dtype=np.uint8)


def bins_of(image, hue_bins=32, saturation_bins=32, limits=(0.0, 0.0, 1.0)):
    rows, columns = image.shape[:2]
    actual = np.empty((rows, columns), np.int32)
    for row in range(rows):
        colour_bins(
            image, row, 0, columns, ColourBinning(hue_bins, saturation_bins, *limits), actual[row]
        )
    return actual


@pytest.mark.parametrize("bins", [1, 7, 32, 255, 256])
def test_colour_bins_are_exact_for_all_quotients_of_bytes(bins):
    # Hue depends on (spread, difference of two channels), saturation on (largest, spread).
    largest, spread = np.meshgrid(np.arange(256), np.arange(256), indexing="ij")
    spread = np.minimum(spread, largest)
    image = np.stack([largest - spread, largest, largest - spread // 3], axis=2).astype(np.uint8)
    more = np.stack([np.zeros_like(spread), spread, largest], axis=2).astype(np.uint8)
    for picture in (image, more, more[:, :, ::-1].copy(), more[:, :, [1, 0, 2]].copy()):
        hue, saturation = plain_maps.colour_bins(picture, bins, bins)
        np.testing.assert_array_equal(bins_of(picture, bins, bins), hue * bins + saturation)


def test_pale_dark_and_bright_pixels_have_an_extra_bin():
    pixels = [[100, 100, 140], [100, 100, 141], [0, 0, 51], [0, 0, 50], [0, 0, 204], [0, 0, 205]]
    actual = bins_of(np.array([pixels], np.uint8), 4, 4, limits=(0.29, 0.2, 0.8))
    assert (actual == 16).tolist() == [[True, False, False, True, False, True]]


@settings(max_examples=40)
@given(pictures, st.sampled_from([1, 3, 5, 7, 9]), st.integers(0, 99), st.booleans())
def test_local_differences_are_sums_over_windows(image, window, seed, averaged):
    rng = np.random.default_rng(seed)
    images = [image, *(rng.integers(0, 256, image.shape, dtype=np.uint8) for _ in range(2))]
    motion = first_frame(images[0])
    expected = None
    for before, after in pairwise(images):
        motion = compare_frames(after, motion, window, averaged)
        last, expected = expected, plain_maps.local_difference(after, before, window)
        both = expected + (last if averaged and last is not None else expected)
        np.testing.assert_array_equal(motion.latest, expected)
        np.testing.assert_array_equal(motion.latest.astype(int) + motion.earlier.astype(int), both)
        assert motion.mean == pytest.approx(both.mean(), rel=1e-12)
        assert motion.deviation == pytest.approx(both.std(), rel=1e-6, abs=1e-3)
        assert motion.changing == np.mean(both >= 2 * 3 * 8 * window**2)


def test_largest_differences_do_not_overflow():
    black, white = np.zeros((20, 20, 3), np.uint8), np.full((20, 20, 3), 255, np.uint8)
    motion = compare_frames(white, first_frame(black), 9, True)
    motion = compare_frames(black, motion, 9, True)
    assert motion.latest[10, 10] == 81 * 765
    assert motion.changing == 1.0
    assert motion.mean == 2 * motion.latest.mean()


@pytest.mark.parametrize(("level", "changing"), [(7, 0.0), (8, 1.0)])
def test_changing_share_counts_changes_of_eight_grey_levels(level, changing):
    black = first_frame(np.zeros((20, 20, 3), np.uint8))
    grey = np.full((20, 20, 3), level, np.uint8)
    assert compare_frames(grey, black, 1, False).changing == changing


def test_window_region_tolerates_rounding_at_an_edge():
    for off in (-6e-12, 0.0, 6e-12):
        assert window_region(13.5 + off, 9.0 + off, 10, 7, 24, 31) == (9, 6, 19, 13)
    assert window_region(13.5 - 1e-6, 9.0, 10, 7, 24, 31).left == 8


def learned(image, box=(8, 6, 10, 9), frames=(), **parameters):
    """Return the appearance model of a box, and the joint map of the last frame."""
    x, y, width, height = box
    frame = SharedFrame(image)
    centre = np.array([x + width / 2, y + height / 2])
    model = ColourMotionModel(
        "some-tracker", ColourMotionParameters(**parameters), frame, centre, (width, height)
    )
    joint = None
    for later in frames:
        joint = model.observe(SharedFrame(later))
    return model, joint


INTERPRETATIONS = [
    {},
    {"alpha": 1.0, "beta": 0.0},
    {"alpha": 0.5, "beta": 1.0, "hue_bins": 7, "saturation_bins": 3},
    {"difference_window": 1, "threshold_factor": 1.0},
    {"difference_window": 9, "differences": "one", "threshold_factor": 0.5},
    {"motion_threshold": 80.0, "difference_window": 3},
    {"minimum_saturation": 0.5, "minimum_value": 0.4},
]


@pytest.mark.parametrize("parameters", INTERPRETATIONS, ids=str)
@pytest.mark.parametrize("n_frames", [1, 3])
def test_joint_map_equals_equation_5(parameters, n_frames):
    images = [random_image(seed) for seed in range(n_frames + 1)]
    _, joint = learned(images[0], frames=images[1:], **parameters)
    maps = JointMaps(**parameters)
    maps.init(images[0], np.array([8.0, 6, 10, 9]))
    for image in images[1:]:
        maps.update(image)
    rows, columns = np.mgrid[:24, :31]
    points = np.stack([columns.ravel(), rows.ravel()], axis=1) + 0.5
    moved = joint.drift(points, (1, 1), 0.0, 0)  # windows of a pixel: the map itself
    np.testing.assert_allclose(moved.after * joint.unit, maps.joint.ravel(), atol=1e-11)
    details = joint.details(np.array([12.0, 11.0]), (6, 4))
    assert details["moving"] == maps.moving.mean()
    assert details["moving_inside"] == maps.moving[9:13, 9:15].mean()
    assert details["similarity"] == pytest.approx(maps.joint[9:13, 9:15].mean(), abs=1e-11)


def test_frame_of_another_size_is_rejected():
    model, _ = learned(random_image(0))
    with pytest.raises(
        TrackerError, match="some-tracker: a frame has 30x24 pixels, the previous one 31"
    ):
        model.observe(SharedFrame(random_image(1, columns=30)))


def test_window_without_usable_pixels_is_rejected():
    with pytest.raises(TrackerError, match="some-tracker: no pixel of the 10x9 window around"):
        learned(np.full((24, 31, 3), 7, np.uint8), minimum_value=0.5)
    with pytest.raises(TrackerError, match="no pixel"):
        learned(random_image(0), box=(90, 90, 10, 9))


@pytest.mark.parametrize("window", [2, 8, 11, 0])
def test_difference_window_is_odd_and_at_most_nine(window):
    with pytest.raises(ValueError, match="difference_window"):
        ColourMotionParameters(difference_window=window)


ORANGE, SIMILAR, WALL = np.array([[40, 140, 230], [45, 120, 215], [120, 125, 130]])
PLAIN = {
    "wang2010": plain.PlainWang2010,
    "particle-filter": plain.PlainParticleFilter,
    "camshift-improved": plain.PlainImprovedCamShift,
}


def clip(n_frames=12, shift=(2.0, 1.0), rows=60, columns=80, seed=0):
    """Return images of an orange target that passes a similar object, and its boxes."""
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


PARTICLE_FILTERS = [
    {},
    {"sigma": 0.1, "radius": 10.0, "difference_window": 7},
    {"alpha": 1.0, "beta": 0.0, "particles": 15},
    {"resampling": "multinomial", "estimate": "best"},
    {"velocity": "mean", "estimate": "resampled", "differences": "one"},
    {"motion_threshold": 12.0, "hue_bins": 16, "saturation_bins": 8, "threshold_factor": 3.0},
    {"minimum_saturation": 0.2, "minimum_value": 0.1, "sigma": 0.158, "particles": 7},
]
CAMSHIFT = [
    {},
    {"window": "adaptive"},
    {"stop_distance": 0.5, "difference_window": 7, "max_iterations": 3},
    {"beta": 0.0, "window": "adaptive", "differences": "one"},
]


@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        (name, parameters)
        for name in ("wang2010", "particle-filter")
        for parameters in PARTICLE_FILTERS
    ]
    + [("camshift-improved", parameters) for parameters in CAMSHIFT],
    ids=str,
)
def test_wang2010_trackers_equal_plain_numpy(name, parameters):
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


def test_target_without_any_weight_is_not_visible():
    orange, blue = np.zeros((2, 60, 80, 3), np.uint8)
    orange[:], blue[:] = (0, 140, 230), (200, 90, 60)
    for name in ("wang2010", "particle-filter", "camshift-improved"):
        (estimate,) = track(name, [orange, blue], [30, 20, 10, 13])
        assert not estimate.visible
        assert estimate.confidence == 0
        assert np.isfinite(estimate.box).all()


def test_wang2010_details_describe_the_particles():
    images, boxes = clip()
    for estimate in track("wang2010", images, boxes[0], sigma=0.1):
        weights, places = estimate.arrays["weights"], estimate.arrays["particles"]
        details = estimate.details
        assert details["effective_sample_size"] == pytest.approx(1 / (weights**2).sum() / 60)
        assert details["weight_ratio"] == pytest.approx(weights.max() * 60)
        distances = ((places - places.mean(axis=0)) ** 2).sum(axis=1)
        assert details["spread"] == pytest.approx(sqrt(distances.mean()))
        assert details["modes"] == len({tuple(place) for place in np.floor(places).tolist()})
