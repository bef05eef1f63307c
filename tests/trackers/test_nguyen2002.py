"""The tracker of Nguyen & Smeulders: what its presets are, what it reports, refuses and keeps."""

import tracemalloc

import numpy as np
import pytest

from tests.trackers import plain_nguyen2002 as plain
from tests.trackers.template_clip import clip, made, texture, track
from trackers.base.parameters import TrackerError


@pytest.mark.parametrize(
    ("features", "limit", "factor"),
    [("intensity", 6.635, 1.0814), ("rgb", 11.345, 1.0366), ("invariants", 11.345, 1.0366)],
)
def test_the_gate_is_the_99_percent_quantile_of_chi_square(features, limit, factor):
    settings = plain.Settings(features=features)
    assert settings.limit == pytest.approx(limit, abs=5e-4)
    assert settings.consistency_factor == pytest.approx(factor, abs=5e-5)
    images, boxes = clip(2)
    noise = made(images, boxes[0], features=features)._noise
    assert noise.limit == pytest.approx(settings.limit, rel=1e-9)
    assert noise.factor == pytest.approx(settings.consistency_factor, rel=1e-9)


@pytest.mark.parametrize(("width", "height"), [(18, 16), (17, 15), (18, 15)])
@pytest.mark.parametrize("preset", ["as-written", "recommended"])
def test_in_whole_pixels_boxes_of_even_sides_stand_half_a_pixel_before_what_is_seen(
    preset, width, height
):
    random = np.random.default_rng(3)
    wall, target = (
        texture(random, *size, (120, 125, 115), 40) for size in ((64, 110), (height, width))
    )
    images, truth = [], []
    for frame in range(8):
        x, y = 20 + 3 * frame, 22 + frame
        wall_and_target = wall.copy()
        wall_and_target[y : y + height, x : x + width] = target
        images.append(np.clip(wall_and_target, 0, 255).astype(np.uint8))
        truth.append([x, y, width, height])
    parameters = {"preset": preset, "report": "raw", "features": "rgb", "ties": "unchanged"}
    estimates, _ = track(images, truth[0], **parameters)
    found = np.array([estimate.box for estimate in estimates])
    whole = preset == "as-written"
    before = [0.5 * (whole and side % 2 == 0) for side in (width, height)]
    np.testing.assert_allclose(found, np.array(truth[1:]) - [*before, 0, 0], atol=1e-9)


def test_details_say_what_the_estimate_says():
    images, truth = clip(36)
    for estimate in track(images, truth[0], longest_occlusion=11)[0]:
        details = estimate.details
        assert details["occluded"] == float(not estimate.visible)
        assert details["revision"] == len(estimate.revised or {})
        assert details["outliers"] > 0.25 or estimate.visible
        assert min(details["residual"], details["cost"]) > 0
        assert np.isnan(details["candidate"]) or details["occluded"]


def test_frames_are_counted_from_the_sequences_first_also_where_the_target_is_not_there_yet():
    images, truth = clip(36)
    said = {}
    for before in (0, 5, 0):
        tracker = made(images[:1], truth[0], longest_occlusion=11)
        for _ in range(before):
            tracker.watch(images[0])
        tracker.init(images[0], truth[0])
        estimates = [tracker.update(image) for image in images[1:]]
        last = next(estimate for estimate in estimates if estimate.revised)
        beginnings = [estimate.details["beginning"] for estimate in estimates]
        said[before] = min(last.revised), np.nanmin(beginnings), last.details["end"]
        tracker.init(images[0], truth[0])  # what was watched belongs to the sequence before
        again = [tracker.update(image).details["beginning"] for image in images[1:]]
        assert np.nanmin(again) == said[0][1]
    assert said[5] == tuple(frame + 5 for frame in said[0])


@pytest.mark.parametrize("end", ["minimum", "first"])
def test_no_more_images_are_kept_than_the_longest_occlusion_has(end):
    random = np.random.default_rng(0)
    images = [random.integers(0, 256, (240, 320, 3), dtype=np.uint8) for _ in range(15)]
    parameters = {"end": end, "search_range": 4, "longest_occlusion": 19, "subpixel": False}
    tracker = made(images, [100, 100, 12, 12], **parameters)
    tracker.update(images[1])  # compiled
    tracemalloc.start()
    try:
        before, _ = tracemalloc.get_traced_memory()
        hidden = 0
        for frame in range(80):
            hidden += not tracker.update(images[frame % 15]).visible
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert hidden > 60
    assert 19 < (peak - before) / images[0].nbytes < 20 + 3  # and what one search works on


def test_a_frame_of_another_size_is_refused():
    images, truth = clip(3)
    tracker = made(images, truth[0])
    tracker.update(images[1])
    with pytest.raises(TrackerError, match="100x64 pixels after one of 110x64"):
        tracker.update(np.ascontiguousarray(images[2][:, :100]))
