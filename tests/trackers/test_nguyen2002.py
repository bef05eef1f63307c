"""Tracker `nguyen2002`, also compared with its plain reference."""

import tracemalloc

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.trackers.references import nguyen2002 as plain
from tests.trackers.references.nguyen2002 import track_offline
from trackmark import trackers
from trackmark.trackers.base.parameters import TrackerError
from trackmark.trackers.templates.appearance import TemplateFilter
from trackmark.trackers.templates.matching import FeatureWindow, Pose, find_pose, search_bounds

ROWS, COLUMNS, WIDTH, HEIGHT = 64, 110, 18, 16


def texture(random, rows, columns, colour, contrast):
    noise = cv2.GaussianBlur(random.normal(0, contrast, (rows, columns, 3)), (0, 0), 1.2)
    return np.array(colour) + 3 * noise


def clip(n_frames=36, hidden=7, start=10, seed=0, noise=2.5):
    """Return images and boxes of a moving, growing target that a board passes from `start` on.

    The board covers the target completely for `hidden` frames.
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
        # x is the centre of the first pixel: its box begins half a scaled pixel before.
        corner = np.array([x, y]) + 0.5 - scale / 2
        boxes.append([*corner, WIDTH * scale, HEIGHT * scale])
    return images, np.array(boxes)


def create_tracker(images, box, **parameters):
    tracker = trackers.create("nguyen2002", **parameters)
    tracker.init(images[0], np.asarray(box, float))
    return tracker


def track(images, box, **parameters):
    tracker = create_tracker(images, box, **parameters)
    return [tracker.update(image) for image in images[1:]], dict(tracker.finish())


def revised(box, estimates, last):
    """Return the boxes of all frames with their revisions."""
    boxes = np.array([box] + [estimate.box for estimate in estimates])
    for better in [*(estimate.revised or {} for estimate in estimates), last]:
        for frame, revised_box in better.items():
            boxes[frame] = revised_box
    return boxes


EVERYDAY = [
    {"longest_occlusion": 19},
    {"longest_occlusion": 11, "preset": "as-written"},
    {"features": "arctan", "covariance": "diagonal", "adaptive_noise": False, "average": 3}
    | {"reinitialise": "keep", "report": "raw", "longest_occlusion": 7},
    {"features": "rgb", "gate": False, "search_range": 8, "delta": 0.9, "gamma": 0.45}
    | {"end": "first"},
]
TOGETHER = [
    {"features": "rgb", "gamma": 0.4, "end": "first"},
    {"features": "intensity", "candidates": "all", "longest_occlusion": 16}
    | {"norm": "quadratic", "outlier_rule": "reaches"},
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
        {"norm": "quadratic"},
        {"covariance": "diagonal"},
        {"adaptive_noise": False},
        {"gate": False},
        {"rebootstrap": False},
        {"reinitialise": "keep"},
        {"report": "raw"},
        {"first_spread": 1.0},
        {"first_covariance": "all"},
        {"first_covariance": "inliers"},
        {"end": "first", "accept": 0.7},
    )
]


def check_against_plain(images, box, **parameters):
    """Compare all revised boxes and the final noise, and return the occlusions."""
    tracker = create_tracker(images, box, **parameters)
    settings = dict(parameters)
    settings = {**type(tracker).presets[settings.pop("preset", "recommended")], **settings}
    expected, occlusions, noise = track_offline(images, box, **settings)
    estimates = [tracker.update(image) for image in images[1:]]
    actual = revised(box, estimates, tracker.finish())
    np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-9)
    ours = tracker._filter
    if not occlusions or occlusions[-1][1] < len(images):
        pairs = (ours.state, noise.c_w), (ours.measurement, noise.c_f), (ours.residual, noise.r_bar)
        for matrix, other in pairs:
            np.testing.assert_allclose(matrix, other, rtol=1e-7, atol=1e-10)
    beginnings = {frame for e in estimates if not np.isnan(frame := e.details["beginning"])}
    assert beginnings <= {beginning for beginning, _ in occlusions}
    return occlusions


@pytest.mark.parametrize("parameters", EVERYDAY)
def test_nguyen2002_equals_plain_numpy(parameters):
    images, boxes = clip()
    box = boxes[0] + [0.3, -0.2, 0.4, -0.7]
    assert check_against_plain(images, box, **parameters)


@pytest.mark.slow
@pytest.mark.parametrize("parameters", TOGETHER + SINGLY)
def test_each_nguyen2002_parameter_equals_plain_numpy(parameters):
    seed = 2 if parameters.get("preset") == "recommended" else 1
    images, boxes = clip(70, hidden=9, seed=seed, noise=2.0 + 3 * (seed - 1))
    assert check_against_plain(images, boxes[0], **parameters)


def test_nguyen2002_target_leaving_the_image_equals_plain_numpy():
    images, _ = clip(16, start=100)
    leaving = [np.roll(image, shift, axis=1) for shift, image in enumerate(images)]
    box = np.array([98.0, 54.0, 17.0, 15.0])
    check_against_plain(leaving, box, features="rgb", longest_occlusion=7)


@pytest.mark.parametrize("preset", ["as-written", "recommended"])
def test_centre_of_the_template_stays_in_the_image(preset):
    """On a plain wall, every pose beyond the border has the same cost."""
    target = texture(np.random.default_rng(0), HEIGHT, WIDTH, (70, 110, 190), 25)
    images = []
    for frame in range(60):
        image = np.full((ROWS, COLUMNS, 3), (120.0, 125.0, 115.0))
        width = min(WIDTH, max(0, 34 - 2 * frame + WIDTH))
        left = max(0, 34 - 2 * frame)
        image[20 : 20 + HEIGHT, left : left + width] = target[:, WIDTH - width :]
        images.append(np.clip(image, 0, 255).astype(np.uint8))
    estimates, last = track(images, [34, 20, WIDTH, HEIGHT], preset=preset)
    boxes = revised([34, 20, WIDTH, HEIGHT], estimates, last)
    centres = boxes[:, :2] + boxes[:, 2:] / 2
    assert (centres >= 0.5).all()
    assert (centres <= [COLUMNS - 0.5, ROWS - 0.5]).all()


@pytest.mark.parametrize(
    ("n_frames", "parameters"),
    [
        (19, {"longest_occlusion": 19}),
        (36, {"end": "first", "gamma": 0.1, "longest_occlusion": 11, "candidates": "all"}),
    ],
)
def test_several_and_open_occlusions_equal_plain_numpy(n_frames, parameters):
    images, boxes = clip(n_frames)
    assert check_against_plain(images, boxes[0], **parameters)


@pytest.mark.parametrize(("width", "height"), [(18, 16), (17, 15), (18, 15)])
@pytest.mark.parametrize("preset", ["as-written", "recommended"])
def test_search_in_whole_pixels_shifts_even_sides_by_a_half(preset, width, height):
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
    parameters = {"preset": preset, "report": "raw", "features": "rgb"}
    estimates, _ = track(images, truth[0], **parameters)
    actual = np.array([estimate.box for estimate in estimates])
    centres = actual[:, :2] + actual[:, 2:] / 2
    whole = preset == "as-written"
    before = [0.5 * (whole and side % 2 == 0) for side in (width, height)]
    expected = np.array(truth[1:])[:, :2] + [width / 2, height / 2] - before
    np.testing.assert_allclose(centres, expected, atol=1e-9)


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
        tracker.init(images[0], truth[0])  # watched frames belong to the previous sequence
        again = [tracker.update(image).details["beginning"] for image in images[1:]]
        assert np.nanmin(again) == reports[0][1]
    assert reports[5] == tuple(frame + 5 for frame in reports[0])


@pytest.mark.parametrize("end", ["minimum", "first"])
def test_kept_images_are_limited_by_the_longest_occlusion(end):
    random = np.random.default_rng(0)
    images = [random.integers(0, 256, (240, 320, 3), dtype=np.uint8) for _ in range(15)]
    parameters = {"end": end, "search_range": 4, "longest_occlusion": 19, "subpixel": False}
    # Otherwise, few residuals between images of noise are outliers.
    parameters |= {"first_covariance": "inliers", "gamma": 0.1}
    tracker = create_tracker(images, [100, 100, 12, 12], **parameters)
    for frame in range(80):  # compile all kernels
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
    assert 19 < (peak - before) / images[0].nbytes < 20 + 3  # 3: memory of one search


def test_nguyen2002_rejects_a_frame_of_another_size():
    images, truth = clip(3)
    tracker = create_tracker(images, truth[0])
    tracker.update(images[1])
    with pytest.raises(TrackerError, match="a frame has 100x64 pixels, the first one 110x64"):
        tracker.update(np.ascontiguousarray(images[2][:, :100]))


@pytest.mark.parametrize("rule", ["exceeds", "reaches"])
def test_patience_is_exact_for_decimal_fractions(rule):
    images, truth = clip(1)
    # 0.3 / 0.05 is less than 6 in floating point.
    options = {"outlier_rule": rule}
    tracked = create_tracker(images, truth[0], gamma=0.3, minimal_speed=0.05, **options)._filter
    assert tracked.patience == {"exceeds": 7, "reaches": 6}[rule]
    between = create_tracker(images, truth[0], gamma=0.25, minimal_speed=0.1, **options)._filter
    assert between.patience == 3


def views(number, d=3, sd=2.0, shape=(30, 40), seed=0):
    random = np.random.default_rng(seed)
    truth = random.uniform(0, 255, (*shape, d))
    return truth, [truth + random.normal(0, sd, truth.shape) for _ in range(number)]


def test_view_without_inliers_keeps_the_covariance():
    _, seen = views(2)
    parameters = trackers.resolve("nguyen2002", features="rgb").parameters
    appearance = TemplateFilter(parameters, seen[0])
    appearance.start(seen[1])
    before = appearance.residual
    lost = appearance.compare(seen[1] + 1e4)
    assert lost.share == 1
    np.testing.assert_allclose(lost.covariance, before, rtol=1e-12)


@pytest.mark.parametrize(("preset", "frames"), [("as-written", 5), ("recommended", 6)])
def test_outlier_becomes_the_template_as_in_equation_11(preset, frames):
    """Worked by hand: n_omax = γ / κ = 0.25 / 0.05 = 5, and equation 11 prints n_o ≥ n_omax."""
    images, truth = clip(1)
    tracker = create_tracker(images, truth[0], preset=preset, features="rgb")
    _, seen = views(9)
    appearance = TemplateFilter(tracker.parameters, seen[0])
    appearance.start(seen[1])
    replaced = []
    for number, view in enumerate(seen[1:]):
        changed = view.copy()
        changed[3, 4] += 100
        appearance.update(appearance.compare(changed), is_first=number == 0)
        replaced.append((appearance.template[3, 4] == changed[3, 4]).all())
    assert replaced.index(True) + 1 == frames


N_ROWS, N_COLUMNS = 70, 90
CUTOFF = 3.368
COVARIANCE = np.array([[30.0, 12.0, 5.0], [12.0, 25.0, -6.0], [5.0, -6.0, 20.0]])


def smooth_features(rows=N_ROWS, columns=N_COLUMNS, d=3, seed=0, blur=3.0):
    noise = np.random.default_rng(seed).normal(0, 300, (rows, columns, d))
    return cv2.GaussianBlur(noise, (0, 0), blur).reshape(rows, columns, d)


def whole(features):
    return FeatureWindow(features, 0, 0, *features.shape[:2])


def cropped(features, pose, search_range, shape):
    left, top, right, bottom = search_bounds(pose, search_range, shape, *features.shape[:2])
    return FeatureWindow(features[top:bottom, left:right].copy(), left, top, *features.shape[:2])


def on_flat_ground(pose, search_range, subpixel):
    flat = np.zeros((N_ROWS, N_COLUMNS, 3))
    arguments = flat[:12, :12], COVARIANCE, pose, search_range, CUTOFF, subpixel
    return find_pose(whole(flat), *arguments).pose


@pytest.mark.parametrize(("scale", "limit"), [(0.5, 0.5), (0.4, 0.5), (2.3, 2.0)])
def test_template_scale_stays_between_half_and_two(scale, limit):
    actual = on_flat_ground(Pose(45, 35, scale), 16, False).scale
    assert 0.5 <= actual <= 2.0
    assert actual == pytest.approx(limit, rel=0.031)


POSES = st.builds(Pose, st.floats(0, N_COLUMNS - 1), st.floats(0, N_ROWS - 1), st.floats(0.5, 2.0))


@settings(max_examples=15)
@given(
    pose=POSES,
    height=st.integers(4, 20),
    width=st.integers(4, 20),
    search_range=st.sampled_from([4, 16, 26]),
)
def test_template_search_in_a_window_equals_that_in_the_image(pose, height, width, search_range):
    features = smooth_features(blur=1.5)
    template = plain.sample(features, plain.Pose(47.3, 31.8, 1.1), height, width, bilinear=True)
    window = cropped(features, pose, search_range, template.shape)
    for subpixel in (False, True):
        arguments = template, COVARIANCE, pose, search_range, CUTOFF, subpixel
        assert find_pose(window, *arguments) == find_pose(whole(features), *arguments)
