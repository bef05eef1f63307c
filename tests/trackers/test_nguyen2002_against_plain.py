"""The tracker of Nguyen & Smeulders against its plain reference, which looks ahead."""

import numpy as np
import pytest

from tests.trackers.plain_nguyen2002 import track_offline
from tests.trackers.template_clip import clip, create_tracker, revised
from trackmark import trackers

AS_WRITTEN = trackers.resolve("nguyen2002").plugin.presets["as-written"]
ROBUST = trackers.resolve("nguyen2002").plugin.presets["robust"]

EVERYDAY = [
    {"longest_occlusion": 19},
    {"longest_occlusion": 11} | AS_WRITTEN,
    {"features": "arctan", "covariance": "diagonal", "adaptive_noise": False, "average": 3}
    | {"reinitialise": "keep", "report": "raw", "longest_occlusion": 7},
    {"features": "rgb", "gate": False, "search_range": 8, "delta": 0.9, "gamma": 0.45}
    | {"end": "first"},
]
TOGETHER = [
    ROBUST,
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
        {"first_covariance": "all"},
        {"first_covariance": "inliers"},
        {"end": "first", "accept": 0.7},
    )
]


def assert_it_is_the_plain_reference(images, box, **parameters):
    """All boxes after all revisions, and the noise in the end; gives the occlusions."""
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
def test_boxes_and_events_are_those_of_plain_numpy(parameters):
    images, boxes = clip()
    box = boxes[0] + [0.3, -0.2, 0.4, -0.7]
    assert assert_it_is_the_plain_reference(images, box, **parameters)


@pytest.mark.slow
@pytest.mark.parametrize("parameters", TOGETHER + SINGLY)
@pytest.mark.parametrize("seed", [1, 2])
def test_boxes_and_events_equal_plain_numpy(parameters, seed):
    images, boxes = clip(70, hidden=9, seed=seed, noise=2.0 + 3 * (seed - 1))
    assert assert_it_is_the_plain_reference(images, boxes[0], **parameters)


@pytest.mark.parametrize("start", [(98.0, 54.0)])
def test_target_leaving_the_image_equals_plain_numpy(start):
    images, _ = clip(16, start=100)
    leaving = [np.roll(image, shift, axis=1) for shift, image in enumerate(images)]
    assert_it_is_the_plain_reference(
        leaving, np.array([*start, 17.0, 15.0]), features="rgb", longest_occlusion=7
    )


@pytest.mark.parametrize(
    ("n_frames", "parameters"),
    [
        (19, {"longest_occlusion": 19}),
        (36, {"end": "first", "gamma": 0.1, "longest_occlusion": 11, "candidates": "all"}),
    ],
)
def test_several_and_open_occlusions_equal_plain_numpy(n_frames, parameters):
    images, boxes = clip(n_frames)
    assert assert_it_is_the_plain_reference(images, boxes[0], **parameters)
