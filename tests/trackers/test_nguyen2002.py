"""The tracker of Nguyen & Smeulders: what its presets are, what it reports, refuses and keeps."""

import tracemalloc

import numpy as np
import pytest

from tests.trackers import plain_nguyen2002 as plain
from tests.trackers.template_clip import clip, create_tracker, texture, track
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.trackers.base.parameters import TrackerError
from trackmark.trackers.templates.appearance import TemplateFilter, compute_features


@pytest.mark.parametrize(
    ("features", "limit", "factor"),
    [("intensity", 6.635, 1.0814), ("rgb", 11.345, 1.0366), ("invariants", 11.345, 1.0366)],
)
def test_the_gate_is_the_99_percent_quantile_of_chi_square(features, limit, factor):
    settings = plain.Settings(features=features)
    assert settings.limit == pytest.approx(limit, abs=5e-4)
    assert settings.consistency_factor == pytest.approx(factor, abs=5e-5)
    images, boxes = clip(2)
    noise = create_tracker(images, boxes[0], features=features)._noise
    assert noise.limit == pytest.approx(settings.limit, rel=1e-9)
    assert noise.factor == pytest.approx(settings.consistency_factor, rel=1e-9)


def test_default_first_covariance_is_not_in_the_identity():
    for text in ("nguyen2002", "nguyen2002:preset=robust"):
        assert "first_covariance" not in parse_tracker(text).parameters
    assert parse_tracker("nguyen2002:preset=as-written").parameters["first_covariance"] == "all"


@pytest.mark.parametrize(("width", "height"), [(18, 16), (17, 15), (18, 15)])
@pytest.mark.parametrize("preset", ["as-written", "recommended"])
def test_even_sides_are_half_a_pixel_off_in_whole_pixels(preset, width, height):
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
    actual = np.array([estimate.box for estimate in estimates])
    whole = preset == "as-written"
    before = [0.5 * (whole and side % 2 == 0) for side in (width, height)]
    np.testing.assert_allclose(actual, np.array(truth[1:]) - [*before, 0, 0], atol=1e-9)


def test_frame_numbers_include_watched_frames():
    images, truth = clip(36)
    reports = {}
    for before in (0, 5, 0):
        tracker = create_tracker(images[:1], truth[0], longest_occlusion=11)
        for _ in range(before):
            tracker.watch(images[0])
        tracker.init(images[0], truth[0])
        estimates = [tracker.update(image) for image in images[1:]]
        last = next(estimate for estimate in estimates if estimate.revised)
        beginnings = [estimate.details["beginning"] for estimate in estimates]
        reports[before] = min(last.revised), np.nanmin(beginnings), last.details["end"]
        tracker.init(images[0], truth[0])  # what was watched belongs to the sequence before
        again = [tracker.update(image).details["beginning"] for image in images[1:]]
        assert np.nanmin(again) == reports[0][1]
    assert reports[5] == tuple(frame + 5 for frame in reports[0])


@pytest.mark.parametrize("end", ["minimum", "first"])
def test_no_more_images_are_kept_than_the_longest_occlusion_has(end):
    random = np.random.default_rng(0)
    images = [random.integers(0, 256, (240, 320, 3), dtype=np.uint8) for _ in range(15)]
    parameters = {"end": end, "search_range": 4, "longest_occlusion": 19, "subpixel": False}
    tracker = create_tracker(images, [100, 100, 12, 12], **parameters)
    for frame in range(80):  # all that an occlusion and its end need is compiled
        tracker.update(images[frame % 15])
    tracker = create_tracker(images, [100, 100, 12, 12], **parameters)
    tracker.update(images[1])
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
    tracker = create_tracker(images, truth[0])
    tracker.update(images[1])
    with pytest.raises(TrackerError, match="a frame has 100x64 pixels, the first one 110x64"):
        tracker.update(np.ascontiguousarray(images[2][:, :100]))


# The tracker of Nguyen & Smeulders through occlusions, and slow ones that it takes in.


@pytest.mark.parametrize(("longest", "last"), [(6, 5), (34, 19), (35, 35)])
@pytest.mark.parametrize("candidates", ["skipped", "all"])
def test_candidate_offsets_grow_to_the_longest_occlusion(longest, last, candidates):
    images, truth = clip(14 + 35, hidden=60)
    estimates, _ = track(images, truth[0], longest_occlusion=longest, candidates=candidates)
    decided = next(e.revised for e in estimates if e.revised)
    assert len(decided) == (last if candidates == "skipped" else longest)
    examined = {e.details["cost"] for e in estimates[: max(decided)] if not e.visible}
    assert len(examined) == 1  # of the last match before


# Slow occluders, and whether they creep into the template.


def creeping(speed, features="rgb", **parameters):
    """A still target without noise, over which a board creeps by so many of 100 columns a frame.

    Returns the frame after the board's arrival in which an occlusion is declared, or None, and
    the share of the template that the board is then.
    """
    random = np.random.default_rng(0)
    still = random.integers(0, 200, (40, 100, 3), dtype=np.uint8)
    tracker = create_tracker([still], (0, 0, 100, 40), features=features, **parameters)
    target = compute_features(still, features)
    appearance = TemplateFilter(tracker._noise, target)
    appearance.start(target)
    for frame in range(60):
        image = still.copy()
        image[:, : speed * frame] = 250
        seen = appearance.compare(compute_features(image, features))
        changed = float((appearance.template != target).any(axis=2).mean())
        if seen.share > tracker.parameters.gamma:
            return frame, changed
        appearance.update(seen, first=frame == 0)
    return None, changed


@pytest.mark.parametrize("features", ["rgb", "intensity"])
@pytest.mark.parametrize(("speed", "declared"), [(5, 6), (6, 5), (8, 4)])
def test_fast_occluder_is_detected(speed, declared, features):
    assert creeping(speed, features) == (declared, 0.0)


def test_slow_occluder_becomes_the_template():
    assert creeping(4) == (None, 1.0)
    assert creeping(4, minimal_speed=0.04) == (7, 0.0)
    assert creeping(5, outlier_rule="reaches") == (None, 1.0)
    assert creeping(6, outlier_rule="reaches") == (5, 0.0)
    assert creeping(5, outlier_rule="reaches", rebootstrap=False) == (6, 0.0)


@pytest.mark.parametrize("rule", ["exceeds", "reaches"])
def test_n_omax_is_rounded_neither_way_by_arithmetic(rule):
    images, truth = clip(1)
    # 0.3 / 0.05 is less than 6 in floating point.
    options = {"outlier_rule": rule}
    noise = create_tracker(images, truth[0], gamma=0.3, minimal_speed=0.05, **options)._noise
    assert noise.patience == {"exceeds": 7, "reaches": 6}[rule]
    between = create_tracker(images, truth[0], gamma=0.25, minimal_speed=0.1, **options)._noise
    assert between.patience == 3
