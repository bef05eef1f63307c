"""Criteria of nguyen2002's scenes, on small painted images with a known answer."""

import numpy as np
import pytest

from bench.papers.criteria.nguyen2002 import (
    ClipSet,
    SceneImages,
    complete_occlusions,
    feature_noise_ratio,
    hidden_frames,
    light_change_auc,
    target_in_box,
    target_saturation,
)


class Painted:
    """A sequence of equal masks, with a box around the target of 20 by 20 pixels."""

    name = "painted"

    def __init__(self, images, visibility=None, attributes=None):
        self._images = images
        self.boxes = np.tile([20.0, 20.0, 20.0, 20.0], (len(images), 1))
        self.visibility = np.ones(len(images)) if visibility is None else np.array(visibility)
        self.attributes = attributes or {}

    def __getitem__(self, frame):
        return self._images[frame]

    def mask(self, frame):
        inside = np.zeros((60, 60), bool)
        inside[20:40, 20:40] = True
        return inside


def painted(target, background, frames=1):
    image = np.empty((60, 60, 3), np.uint8)
    image[:] = background
    image[20:40, 20:40] = target
    return [image] * frames


def clip_set(*sequences):
    return ClipSet([SceneImages(sequence) for sequence in sequences])


def test_hidden_frames_are_those_of_complete_occlusions():
    first = [1, 0.5, 0.02, 0, 0, 0.4, 1, 0.3, 1]  # 3 frames; the second occlusion is partial
    second = [1, 0, 0, 0, 0, 0, 1, 1, 0]  # 5 frames and 1 frame
    images = painted(200, 50, 9)
    clips = clip_set(Painted(images, first), Painted(images, second))
    assert complete_occlusions(clips) == 3
    assert hidden_frames(clips) == 3


def test_saturation_is_relative_to_the_largest_channel():
    colours = [(50, 100, 200), (200, 200, 200), (100, 100, 200)]
    clips = clip_set(*(Painted(painted(colour, 0, 3)) for colour in colours))
    assert target_saturation(clips, pairs=2) == pytest.approx(0.5)


def test_target_in_box_is_the_share_of_the_mask():
    whole, half = Painted(painted(200, 50, 2)), Painted(painted(200, 50, 2))
    half.boxes[:, 0] += 11  # the box is taken as one pixel larger on either side
    assert target_in_box(clip_set(whole), pairs=1) == 1
    assert target_in_box(clip_set(whole, half), pairs=1) == pytest.approx(0.5)


def test_noise_of_chroma_lowers_invariants_more_than_rgb():
    random = np.random.default_rng(0)
    brightness = random.integers(60, 200, (60, 60, 1))
    tint = random.integers(-10, 11, (60, 60, 3))

    def images(chroma):
        noise = [
            random.normal(0, chroma, (60, 60, 3)) + random.normal(0, 3, (60, 60, 1)) for _ in "ab"
        ]
        return [np.clip(brightness + tint + n, 0, 255).astype(np.uint8) for n in noise]

    ratios = [feature_noise_ratio(clip_set(Painted(images(c))), pairs=1) for c in (1, 6)]
    assert ratios[1] < 0.5 * ratios[0]


@pytest.mark.parametrize(("dark_target", "expected"), [(200, 1.0), (90, 0.0)])
def test_light_change_is_judged_by_colours_of_before(dark_target, expected):
    bright, dark = painted(200, 90), painted(dark_target, 290 - dark_target)
    lamp_off = [False, False, True, True, False]
    sequence = Painted(bright * 2 + dark * 2 + bright, attributes={"lamp off": lamp_off})
    for switch in ("off", "on"):
        assert light_change_auc(SceneImages(sequence), switch=switch) == pytest.approx(expected)
