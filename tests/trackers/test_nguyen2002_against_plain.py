"""The tracker of Nguyen & Smeulders against its plain reference, and one that looks ahead."""

import numpy as np
import pytest

import trackers
from tests.trackers.plain_nguyen2002 import PlainNguyen2002, track_offline
from tests.trackers.template_clip import clip, final, made

AS_WRITTEN = trackers.resolve("nguyen2002").plugin.presets["as-written"]
ROBUST = trackers.resolve("nguyen2002").plugin.presets["robust"]

EVERYDAY = [
    {"longest_occlusion": 19},
    {"longest_occlusion": 11} | AS_WRITTEN,
    {"longest_occlusion": 19} | ROBUST,
    {"features": "intensity", "candidates": "all", "longest_occlusion": 16}
    | {"norm": "quadratic", "outlier_rule": "reaches"},
    {"features": "arctan", "covariance": "diagonal", "adaptive_noise": False, "average": 3}
    | {"reinitialise": "keep", "report": "raw", "longest_occlusion": 7},
    {"features": "rgb", "gate": False, "search_range": 8, "delta": 0.9, "gamma": 0.45}
    | {"end": "first"},
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
    ("n_frames", "parameters"),
    [
        (36, {"longest_occlusion": 11, "gamma": 0.1}),
        (19, {"longest_occlusion": 19}),
        (36, {"end": "first", "gamma": 0.1, "longest_occlusion": 11, "candidates": "all"}),
        (19, {"end": "first"}),
    ],
)
def test_after_all_revisions_boxes_are_those_of_an_offline_run(n_frames, parameters):
    images, boxes = clip(n_frames)
    expected, occlusions = track_offline(images, boxes[0], **parameters)
    assert occlusions
    np.testing.assert_allclose(final(images, boxes[0], **parameters), expected, atol=1e-9)
