"""Criteria of nguyen2002's scenes, on small painted images with a known answer."""

import numpy as np
import pytest

from tests.tools.criteria.scenes import blocks, inside, painted
from tools.criteria import nguyen2002 as criteria
from tools.criteria.nguyen2002 import ClipSet

BOX = 20, 20, 20, 20
SIZE = 60, 60


def clip(target, ground, frames=1, **others):
    return blocks([(BOX, target, ground)] * frames, SIZE, **others)


def test_hidden_frames_are_those_of_complete_occlusions():
    first = [1, 0.5, 0.02, 0, 0, 0.4, 1, 0.3, 1]  # 3 frames; the second occlusion is partial
    second = [1, 0, 0, 0, 0, 0, 1, 1, 0]  # 5 frames and 1 frame
    clips = ClipSet([clip(200, 50, 9, visibility=each) for each in (first, second)])
    assert criteria.complete_occlusions(clips) == 3
    assert criteria.hidden_frames(clips) == 3


def test_saturation_is_relative_to_the_largest_channel():
    colours = [(50, 100, 200), (200, 200, 200), (100, 100, 200)]
    clips = ClipSet([clip(colour, 0, 3) for colour in colours])
    assert criteria.target_saturation(clips, pairs=2) == pytest.approx(0.5)


def test_target_in_box_is_the_share_of_the_mask():
    whole, mask = clip(200, 50, 2), inside(SIZE, BOX)
    images = [whole.image(0)] * 2
    half = painted(images, [(31, 20, 20, 20)] * 2, [mask] * 2)  # the box is taken a pixel larger
    assert criteria.target_in_box(ClipSet([whole]), pairs=1) == 1
    assert criteria.target_in_box(ClipSet([whole, half]), pairs=1) == pytest.approx(0.5)


def test_noise_of_chroma_lowers_invariants_more_than_rgb():
    random = np.random.default_rng(0)
    brightness = random.integers(60, 200, (60, 60, 1))
    tint = random.integers(-10, 11, (60, 60, 3))

    def images(chroma):
        noise = [
            random.normal(0, chroma, (60, 60, 3)) + random.normal(0, 3, (60, 60, 1)) for _ in "ab"
        ]
        return [np.clip(brightness + tint + n, 0, 255).astype(np.uint8) for n in noise]

    ratios = [
        criteria.feature_noise_ratio(ClipSet([painted(images(c), [BOX] * 2)]), pairs=1)
        for c in (1, 6)
    ]
    assert ratios[1] < 0.5 * ratios[0]


def test_light_ratio_is_of_linear_light():
    levels = [200, 200, 200 * 0.5 ** (1 / 2.2), 100, 200]
    lamp_off = np.array([False, False, True, True, False])
    images = [np.full((*SIZE, 3), level, np.uint8) for level in levels]
    scene = painted(images, [BOX] * 5, attributes={"lamp off": lamp_off})
    assert criteria.light_ratio(scene, switch="off") == pytest.approx(0.5, rel=0.02)
    assert criteria.light_ratio(scene, switch="on") == pytest.approx(2**2.2, rel=1e-6)


@pytest.mark.parametrize(("dark_target", "expected"), [(200, 1.0), (90, 0.0)])
def test_light_change_is_judged_by_colours_of_before(dark_target, expected):
    bright, dark = (BOX, 200, 90), (BOX, dark_target, 290 - dark_target)
    lamp_off = np.array([False, False, True, True, False])
    scene = blocks([bright] * 2 + [dark] * 3, SIZE, attributes={"lamp off": lamp_off})
    assert criteria.light_change_auc(scene, switch="off") == pytest.approx(expected)
    assert criteria.light_change_auc(scene, switch="on") == 1  # no colour changes there
