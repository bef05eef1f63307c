"""The tracker of Nguyen & Smeulders against its plain reference, and through occlusions."""

import tracemalloc

import cv2
import numpy as np
import pytest

import trackers
from bench.metrics.overlap import overlap
from bench.papers.nguyen2002.plain import PlainNguyen2002, Settings, track_offline
from trackers.base.parameters import TrackerError
from trackers.template.appearance import Appearance
from trackers.template.features import features_of

ROWS, COLUMNS, WIDTH, HEIGHT = 64, 110, 18, 16
AS_WRITTEN = trackers.resolve("nguyen2002").plugin.presets["as-written"]
ROBUST = trackers.resolve("nguyen2002").plugin.presets["robust"]


def texture(random, rows, columns, colour, contrast):
    noise = cv2.GaussianBlur(random.normal(0, contrast, (rows, columns, 3)), (0, 0), 1.2)
    return np.array(colour) + 3 * noise


def clip(n_frames=36, hidden=7, start=10, seed=0, noise=2.5):
    """A coloured target that moves and grows; from `start` on a board passes over it.

    It covers the target wholly for `hidden` frames.
    """
    random = np.random.default_rng(seed)
    wall = texture(random, ROWS, COLUMNS, (120, 125, 115), 15)
    target = texture(random, HEIGHT, WIDTH, (70, 110, 190), 25)
    board_width = WIDTH + 5 * hidden
    board = texture(random, ROWS, board_width, (150, 90, 60), 20)
    images, boxes = [], []
    for frame in range(n_frames):
        x, y, scale = 14 + 0.9 * frame, 20 + 0.3 * frame, 1 + 0.002 * frame
        placed = np.array([[scale, 0, x], [0, scale, y]])
        size = COLUMNS, ROWS
        share = cv2.warpAffine(np.ones((HEIGHT, WIDTH)), placed, size)[:, :, np.newaxis]
        image = wall * (1 - share) + cv2.warpAffine(target, placed, size)
        left = round(x) - board_width + 5 * (frame - start)
        seen = slice(max(left, 0), max(left + board_width, 0))
        if frame >= start:
            part = board[:, max(-left, 0) :][:, : max(COLUMNS - max(left, 0), 0)]
            image[:, seen] = part
        image += random.normal(0, noise, image.shape)
        images.append(np.clip(image, 0, 255).astype(np.uint8))
        # The first pixel's centre comes to lie at x: its box begins half a (scaled) pixel before.
        corner = np.array([x, y]) + 0.5 - scale / 2
        boxes.append([*corner, WIDTH * scale, HEIGHT * scale])
    return images, np.array(boxes)


def made(images, box, **parameters):
    tracker = trackers.create("nguyen2002", **parameters)
    tracker.init(images[0], np.asarray(box, float))
    return tracker


def track(images, box, **parameters):
    tracker = made(images, box, **parameters)
    return [tracker.update(image) for image in images[1:]], dict(tracker.finish())


def centre_errors(boxes, truth):
    found = boxes[:, :2] + boxes[:, 2:] / 2 - truth[:, :2] - truth[:, 2:] / 2
    return np.hypot(*found.T)


def final(images, box, **parameters):
    """Boxes of all frames after all revisions."""
    estimates, last = track(images, box, **parameters)
    boxes = np.array([box] + [estimate.box for estimate in estimates])
    for revised in [*(estimate.revised or {} for estimate in estimates), last]:
        for frame, better in revised.items():
            boxes[frame] = better
    return boxes


EVERYDAY = [
    {"longest_occlusion": 19},
    {"longest_occlusion": 11} | AS_WRITTEN,
    {"longest_occlusion": 19} | ROBUST,
    {
        "features": "intensity",
        "candidates": "all",
        "longest_occlusion": 16,
        "norm": "quadratic",
        "outlier_rule": "reaches",
    },
    {
        "features": "arctan",
        "covariance": "diagonal",
        "adaptive_noise": False,
        "reinitialise": "keep",
        "average": 3,
        "report": "raw",
        "longest_occlusion": 7,
    },
    {
        "features": "rgb",
        "gate": False,
        "search_range": 8,
        "delta": 0.9,
        "gamma": 0.45,
        "end": "first",
    },
]
SINGLY = [
    {"preset": preset} | parameters
    for preset in ("as-written", "recommended")
    for parameters in (
        {"features": "rgb"},
        {"features": "intensity"},
        {"features": "arctan"},
        {"delta": 0.95},
        {"gamma": 0.4},
        {"minimal_speed": 0.1},
        {"outlier_rule": "reaches"},
        {"longest_occlusion": 19},
        {"candidates": "all"},
        {"average": 1},
        {"search_range": 24},
        {"subpixel": True},
        {"misregistration": True},
        {"consistency": True},
        {"norm": "quadratic"},
        {"covariance": "diagonal"},
        {"adaptive_noise": False},
        {"gate": False},
        {"rebootstrap": False},
        {"reinitialise": "keep"},
        {"report": "raw"},
        {"first_spread": 1.0},
        {"end": "first", "accept": 0.7},
    )
]


def assert_it_is_the_plain_reference(images, box, **parameters):
    fast = made(images, box, **parameters)
    plain = dict(parameters)
    preset = plain.pop("preset", "recommended")
    slow = PlainNguyen2002(**type(fast).presets[preset] | plain)
    slow.init(images[0], box)
    revisions = 0
    for image in images[1:]:
        estimate, (expected, hidden, revised) = fast.update(image), slow.update(image)
        assert estimate.box == pytest.approx(expected, abs=1e-9)
        assert estimate.visible is not hidden
        assert_equal_boxes(estimate.revised or {}, revised)
        assert estimate.details["revision"] == len(revised)
        appearance = slow.target.appearance
        for name, matrix in (
            ("state_noise", appearance.c_w),
            ("measurement_noise", appearance.c_f),
            ("residual", appearance.r_bar),
        ):
            assert estimate.details[name] == pytest.approx(np.trace(matrix), rel=1e-9, abs=1e-12)
        revisions += len(revised)
    assert_equal_boxes(fast.finish(), slow.finish())
    return revisions


def assert_equal_boxes(found, expected):
    assert set(found) == set(expected)
    for frame, box in expected.items():
        assert found[frame] == pytest.approx(box, abs=1e-9)


@pytest.mark.parametrize("parameters", EVERYDAY)
def test_boxes_and_events_are_those_of_plain_numpy(parameters):
    images, boxes = clip()
    box = boxes[0] + [0.3, -0.2, 0.4, -0.7]
    assert assert_it_is_the_plain_reference(images, box, **parameters) > 0


@pytest.mark.slow
@pytest.mark.parametrize("parameters", SINGLY)
@pytest.mark.parametrize("seed", [1, 2])
def test_boxes_and_events_are_those_of_plain_numpy_with_every_parameter(parameters, seed):
    images, boxes = clip(70, hidden=9, seed=seed, noise=2.0 + 3 * (seed - 1))
    assert assert_it_is_the_plain_reference(images, boxes[0], **parameters) > 0


@pytest.mark.parametrize("start", [(-3.0, 20.0), (98.0, 54.0)])
def test_also_where_the_target_leaves_the_image_the_boxes_are_those_of_plain_numpy(start):
    images, _ = clip(20, start=100)
    leaving = [np.roll(image, shift, axis=1) for shift, image in enumerate(images)]
    assert_it_is_the_plain_reference(
        leaving, np.array([*start, 17.0, 15.0]), features="rgb", longest_occlusion=7
    )


@pytest.mark.parametrize(
    "parameters",
    [
        {"longest_occlusion": 19},
        {"longest_occlusion": 11, "gamma": 0.1},
        {"end": "first"},
        {"end": "first", "gamma": 0.1, "longest_occlusion": 11, "candidates": "all"},
    ],
)
@pytest.mark.parametrize("n_frames", [36, 19])
def test_after_all_revisions_boxes_are_those_of_an_offline_run(parameters, n_frames):
    images, boxes = clip(n_frames)
    expected, occlusions = track_offline(images, boxes[0], **parameters)
    assert occlusions
    np.testing.assert_allclose(final(images, boxes[0], **parameters), expected, atol=1e-9)


@pytest.mark.parametrize(
    ("features", "limit", "factor"),
    [("intensity", 6.635, 1.0814), ("rgb", 11.345, 1.0366), ("invariants", 11.345, 1.0366)],
)
def test_the_gate_is_the_99_percent_quantile_of_chi_square(features, limit, factor):
    settings = Settings(features=features)
    assert settings.limit == pytest.approx(limit, abs=5e-4)
    assert settings.consistency_factor == pytest.approx(factor, abs=5e-5)
    images, boxes = clip(2)
    noise = made(images, boxes[0], features=features)._noise
    assert noise.limit == pytest.approx(settings.limit, rel=1e-9)
    assert noise.factor == pytest.approx(settings.consistency_factor, rel=1e-9)


def test_as_written_takes_the_text_literally():
    written = trackers.resolve("nguyen2002", preset="as-written").parameters
    assert not any([written.subpixel, written.misregistration, written.consistency])
    assert written.features == "invariants"
    assert written.outlier_rule == "exceeds"
    assert written.reinitialise == "bootstrap"
    assert written.report == "smoothed"
    assert (written.norm, written.covariance, written.candidates) == ("huber", "full", "skipped")
    assert all([written.adaptive_noise, written.gate, written.rebootstrap])
    assert written.end == "minimum"
    constants = written.delta, written.gamma, written.minimal_speed, written.longest_occlusion
    assert constants == (0.99, 0.25, 0.05, 35)


# Through an occlusion.


def test_an_occlusion_is_declared_bridged_and_revised():
    images, truth = clip(60)
    estimates, left = track(images, truth[0])
    hidden = [frame for frame, e in enumerate(estimates, 1) if not e.visible]
    declared, decided = hidden[0], hidden[-1] + 1
    assert 10 < declared <= 14  # the board has begun to cover the target, not yet wholly
    assert decided == declared + 35
    assert hidden == list(range(declared, decided))
    revised = estimates[decided - 1].revised
    assert sorted(revised) == hidden
    assert all(e.revised is None for frame, e in enumerate(estimates, 1) if frame != decided)
    assert left == {}
    boxes = final(images, truth[0])
    assert centre_errors(boxes, truth).max() < 1.5
    ends = np.array([revised[frame] for frame in (declared, declared + 1, declared + 2)])
    np.testing.assert_allclose(np.diff(ends, 2, axis=0), 0, atol=1e-9)  # on a straight line


def test_while_it_lasts_the_box_goes_on_as_it_went():
    images, truth = clip(40, hidden=30)
    estimates, _ = track(images, truth[0], report="raw")
    hidden = [e.box for e in estimates if not e.visible]
    np.testing.assert_allclose(np.diff(hidden, 2, axis=0), 0, atol=1e-9)
    step = np.diff(hidden, axis=0)[0]
    assert step == pytest.approx([0.9, 0.3, 0, 0], abs=0.2)


def test_what_was_said_online_depends_on_nothing_that_comes_later():
    images, truth = clip(36)
    parameters = {"features": "rgb", "longest_occlusion": 11}
    tracker = made(images, truth[0], **parameters)
    said, kept = [], []
    for image in images[1:]:
        said.append(tracker.update(image))
        kept.append(said[-1].box.copy())
    assert any(estimate.revised for estimate in said)
    np.testing.assert_array_equal([estimate.box for estimate in said], kept)
    for n in range(12, 36, 6):
        shorter, _ = track(images[:n], truth[0], **parameters)
        np.testing.assert_array_equal([estimate.box for estimate in shorter], kept[: n - 1])


def test_an_occlusion_that_the_sequences_end_cuts_short_is_resolved_by_what_was_seen():
    whole, truth = clip(60, hidden=4)
    declared = next(frame for frame, e in enumerate(track(whole, truth[0])[0], 1) if not e.visible)
    images = whole[: declared + 22]  # the candidate 19 frames after the beginning is there
    estimates, left = track(images, truth[0])
    assert not estimates[-1].visible
    assert sorted(left) == list(range(declared, len(images)))
    boxes = final(images, truth[0])
    assert centre_errors(boxes, truth[: len(images)]).max() < 1.5


def test_before_the_first_candidate_there_is_nothing_to_resolve_by():
    images, truth = clip(16)
    estimates, left = track(images, truth[0])
    assert not estimates[-1].visible
    assert left == {}


@pytest.mark.parametrize(("longest", "found"), [(19, False), (35, True)])
def test_an_occlusion_of_25_frames_needs_a_candidate_after_it(longest, found):
    images, truth = clip(60, hidden=25)
    boxes = final(images, truth[0], longest_occlusion=longest, features="rgb")
    assert (overlap(boxes, truth)[-5:].min() >= 0.5) == found


@pytest.mark.parametrize(
    ("longest", "last"), [(5, 5), (6, 5), (7, 7), (18, 11), (34, 19), (35, 35), (66, 35), (67, 67)]
)
@pytest.mark.parametrize("candidates", ["skipped", "all"])
def test_candidates_are_farther_and_farther_apart_up_to_the_longest_occlusion(
    longest, last, candidates
):
    images, truth = clip(14 + 67, hidden=90)
    estimates, _ = track(images, truth[0], longest_occlusion=longest, candidates=candidates)
    decided = next(e.revised for e in estimates if e.revised)
    assert len(decided) == (last if candidates == "skipped" else longest)
    examined = {e.details["cost"] for e in estimates[: max(decided)] if not e.visible}
    assert len(examined) == 1  # of the last match before


def test_the_first_candidate_with_few_outliers_ends_an_occlusion_at_once():
    images, truth = clip(36, hidden=2)
    estimates, _ = track(images, truth[0], preset="robust")
    (decided,) = (frame for frame, e in enumerate(estimates, 1) if e.revised)
    hidden = [frame for frame, e in enumerate(estimates, 1) if not e.visible]
    assert decided == hidden[0] + 11 == hidden[-1] + 1
    assert sorted(estimates[decided - 1].revised) == hidden
    online = np.array([truth[0]] + [estimate.box for estimate in estimates])
    assert centre_errors(online, truth)[decided:].max() < 1.5
    none, _ = track(images, truth[0], preset="robust", accept=0.0)
    assert not none[-1].visible


# Slow occluders, and whether they creep into the template.


def creeping(speed, features="rgb", **parameters):
    """A still target without noise, over which a board creeps by so many of 100 columns a frame.

    Returns the frame after the board's arrival in which an occlusion is declared, or None, and
    the share of the template that the board is then.
    """
    random = np.random.default_rng(0)
    still = random.integers(0, 200, (40, 100, 3), dtype=np.uint8)
    tracker = made([still], (0, 0, 100, 40), features=features, **parameters)
    target = features_of(still, features)
    appearance = Appearance(tracker._noise, target)
    appearance.start(target)
    for frame in range(60):
        image = still.copy()
        image[:, : speed * frame] = 250
        seen = appearance.seen(features_of(image, features))
        changed = float((appearance.template != target).any(axis=2).mean())
        if seen.share > tracker.parameters.gamma:
            return frame, changed
        appearance.update(seen, first=frame == 0)
    return None, changed


@pytest.mark.parametrize("features", ["rgb", "intensity"])
@pytest.mark.parametrize(("speed", "declared"), [(5, 6), (6, 5), (8, 4)])
def test_an_occluder_at_the_slowest_speed_or_faster_is_declared_before_it_is_in_the_template(
    speed, declared, features
):
    assert creeping(speed, features) == (declared, 0.0)


def test_where_reaching_n_omax_is_enough_such_an_occluder_becomes_the_template():
    assert creeping(5, outlier_rule="reaches") == (None, 1.0)
    assert creeping(6, outlier_rule="reaches") == (5, 0.0)
    assert creeping(5, outlier_rule="reaches", rebootstrap=False) == (6, 0.0)


def test_an_occluder_slower_than_that_becomes_the_template():
    assert creeping(4) == (None, 1.0)
    assert creeping(4, minimal_speed=0.04) == (7, 0.0)


@pytest.mark.parametrize("rule", ["exceeds", "reaches"])
def test_n_omax_is_rounded_neither_way_by_arithmetic(rule):
    images, truth = clip(1)
    # 0.3 / 0.05 is less than 6 in floating point.
    noise = made(images, truth[0], gamma=0.3, minimal_speed=0.05, outlier_rule=rule)._noise
    assert noise.patience == {"exceeds": 7, "reaches": 6}[rule]
    between = made(images, truth[0], gamma=0.25, minimal_speed=0.1, outlier_rule=rule)._noise
    assert between.patience == 3


# What it reports, refuses and keeps.


def test_raw_boxes_stand_on_whole_pixels_and_smoothed_ones_between_them():
    images, truth = clip(10)
    box = np.floor(truth[0])
    for report in ("raw", "smoothed"):
        estimates, _ = track(images, box, preset="as-written", report=report, features="rgb")
        centres = np.array([e.box[:2] + e.box[2:] / 2 - 0.5 for e in estimates])
        whole = np.abs(centres - np.round(centres)) < 1e-9
        assert whole.all() if report == "raw" else not whole.all()


def test_details_say_what_the_estimate_says():
    images, truth = clip(36)
    for estimate in track(images, truth[0], longest_occlusion=11)[0]:
        details = estimate.details
        assert details["occluded"] == float(not estimate.visible)
        assert details["revision"] == len(estimate.revised or {})
        assert details["outliers"] > 0.25 or estimate.visible
        assert min(details["residual"], details["cost"]) > 0


def test_an_instance_that_is_initialised_again_says_the_same_again():
    images, truth = clip(20)
    tracker = made(images, truth[0])
    first = [tracker.update(image) for image in images[1:]]
    assert not first[-1].visible  # left within an occlusion
    tracker.init(images[0], truth[0])
    again = [tracker.update(image) for image in images[1:]]
    for one, other in zip(first, again, strict=True):
        np.testing.assert_array_equal(one.box, other.box)
        assert one.details == other.details


def test_a_readers_buffer_may_be_used_for_every_frame():
    images, truth = clip(36)
    expected = final(images, truth[0], longest_occlusion=11)
    buffer = images[0].copy()
    tracker = made([buffer], truth[0], longest_occlusion=11)
    boxes = [truth[0]]
    for image in images[1:]:
        buffer[:] = image
        estimate = tracker.update(buffer)
        boxes.append(estimate.box)
        for frame, box in (estimate.revised or {}).items():
            boxes[frame] = box
    for frame, box in tracker.finish().items():
        boxes[frame] = box
    np.testing.assert_array_equal(boxes, expected)


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
        for frame in range(200):
            hidden += not tracker.update(images[frame % 15]).visible
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert hidden > 150
    assert 19 < (peak - before) / images[0].nbytes < 20 + 3  # and what one search works on


def test_a_frame_of_another_size_is_refused():
    images, truth = clip(3)
    tracker = made(images, truth[0])
    tracker.update(images[1])
    with pytest.raises(TrackerError, match="100x64 pixels after one of 110x64"):
        tracker.update(np.ascontiguousarray(images[2][:, :100]))


@pytest.mark.parametrize(
    "box", [(20, 20, 3.4, 20), (20, 20, 20, 3.4), (-30, 20, 20, 20), (20, 60, 20, 20)]
)
def test_a_box_without_room_for_a_template_is_refused(box):
    images, _ = clip(1)
    with pytest.raises(TrackerError, match="4 pixels or more either way"):
        made(images, box)
    assert made(images, (20, 20, 3.5, 3.5)).update(images[0]).box.shape == (4,)
