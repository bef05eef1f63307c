"""Criteria of the multi-part sequences on painted people whose margins are known."""

import numpy as np
import pytest

from tests.bench.papers.criteria.scenes import inside, painted
from trackmark.bench.papers.criteria import multipart as criteria

BOX = np.array([150.0, 60.0, 26.0, 100.0])
GREY, RED, BLUE = (128, 128, 128), (40, 40, 200), (200, 60, 40)


def scene(upper, lower, others, visibility=None):
    """Return a person on grey; `others`: by frame, None or a second person (left, upper, lower)."""
    images = []
    for other in others:
        image = np.full((240, 320, 3), GREY, np.uint8)
        for left, top, bottom in filter(None, [(150, upper, lower), other]):
            image[60:110, left : left + 26] = top
            image[110:160, left : left + 26] = bottom
        images.append(image)
    boxes = np.tile(BOX, (len(images), 1))
    masks = [inside(images[0].shape, (150, 60, 20, 100))] * len(images)
    return painted(images, boxes, masks, visibility=visibility, regions={"full": boxes})


def test_right_choice_follows_the_colours_of_both_halves():
    two, plain = scene(RED, BLUE, [None]), scene(RED, RED, [None])
    assert criteria.right_choice(two, two_coloured=True) == 1.0
    assert criteria.right_choice(plain, two_coloured=False) == 1.0
    assert criteria.right_choice(plain, two_coloured=True) == 0.0


def test_margin_of_exchanged_colours_is_low_for_one_part_only():
    images = scene(RED, BLUE, [None] * 6 + [(202, BLUE, RED)] * 4)
    assert criteria.low_margin_share(images, parts=1, below=0.05) == pytest.approx(0.4)
    assert criteria.low_margin_share(images, parts=2, below=0.15) == 0.0
    assert criteria.low_margin_stretch(images, parts=1, below=0.05) == 4
    assert criteria.low_margin_share(images, parts=1, below=0.05, until=0.8) == pytest.approx(0.25)


def test_distant_or_occluded_frames_do_not_lower_the_margin():
    far = scene(RED, BLUE, [(290, RED, BLUE)] * 4)
    assert criteria.low_margin_share(far, parts=1, below=0.15) == 0.0
    occluded = scene(RED, BLUE, [None] * 2 + [(202, RED, BLUE)] * 2, [1, 1, 0.5, 0.5])
    assert criteria.low_margin_share(occluded, parts=1, below=0.15) == 0.0


def test_crossing_is_found_at_its_part_of_the_sequence():
    others = [None] * 18 + [(202, RED, RED), None]
    images = scene(RED, RED, others, [1] * 17 + [0.2, 1, 1])
    assert criteria.crossing_time(images, after=0.8) == pytest.approx(0.85)
    assert criteria.crossing_margin(images, after=0.8) == pytest.approx(0.0, abs=0.01)


def test_background_in_person_is_the_unmasked_share():
    assert criteria.background_in_person(scene(RED, RED, [None])) == pytest.approx(6 / 26)
