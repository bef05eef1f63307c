"""Criteria of nummiaro2003 on small painted scenes with known answers."""

import numpy as np
import pytest

from bench.papers.criteria import nummiaro2003 as criteria
from bench.papers.criteria.shared import SceneImages
from datasets import Sequence

SIZE = 40, 30
BOX = 10.0, 5.0, 20.0, 20.0
RED, BLUE, GREEN = (0, 0, 255), (255, 0, 0), (0, 255, 0)

VISIBILITY = np.ones(60)
VISIBILITY[:5] = 0  # before the target enters
VISIBILITY[20:30] = [0.6, 0.4, 0.2, 0.0, 0.0, 0.2, 0.25, 0.4, 0.6, 0.95]  # the tree
VISIBILITY[40:43] = 0.1
VISIBILITY[48:50] = [0.3, 0.4]
VISIBILITY[57:] = [0.4, 0.2, 0]  # it leaves


def painted(targets, hider=GREEN):
    """Scene whose target box is filled from above by a hider, down to the visible share."""
    images, masks = [], []
    for colour, visible in zip(targets, VISIBILITY, strict=False):
        image, mask = np.zeros((SIZE[1], SIZE[0], 3), np.uint8), np.zeros(SIZE[::-1], bool)
        edge = 5 + round(20 * (1 - visible))
        image[5:edge, 10:30], image[edge:25, 10:30], mask[edge:25, 10:30] = hider, colour, True
        images.append(image)
        masks.append(mask)
    visibility = VISIBILITY[: len(images)]
    boxes = np.where(visibility[:, None] > 0, BOX, np.nan)
    boxes[20:30] = BOX
    attributes = {"turning": np.arange(len(images)) % 4 == 0}
    sequence = Sequence(
        "painted", images, boxes, visibility=visibility, attributes=attributes,
        masks=lambda frame: masks[frame], image_size=SIZE, fingerprint="painted",
    )  # fmt: skip
    return SceneImages(sequence)


@pytest.fixture(scope="module")
def students():
    return painted([RED] * 60)


def test_occlusions_exclude_entering_and_leaving():
    assert criteria.occlusions(VISIBILITY, 0.5) == [(21, 28), (40, 43), (48, 50)]
    assert criteria.tree_occlusion(VISIBILITY, 0.3) == (22, 27)


def test_frame_after_tree_is_the_first_in_full_view():
    assert criteria.frame_after_tree(VISIBILITY) == 30


def test_measures_of_the_occlusions(students):
    assert criteria.tree_frames(students, visible=0.3) == 5
    assert criteria.least_visible_at_tree(students) == 0
    assert criteria.number_of_short_occlusions(students) == 2
    assert criteria.longest_short_occlusion(students) == 3
    assert criteria.frames_before_short_occlusions(students) == 10


def test_hider_distance_is_one_for_other_colours_and_zero_for_the_same(students):
    assert criteria.distance_of_students(students) == pytest.approx(1)
    assert criteria.distance_of_tree(students) == pytest.approx(1)
    assert criteria.distance_of_students(painted([RED] * 60, hider=RED)) == pytest.approx(0)


def test_changed_share_counts_frames_with_another_histogram():
    scene = painted([RED] * 30 + [BLUE] * 25)
    frames = np.arange(5, 55, 5)
    assert criteria.changed_share(scene, distance=0.5) == pytest.approx(np.mean(frames >= 30))


def test_attribute_share_counts_flagged_frames(students):
    assert criteria.attribute_share(students, attribute="turning") == 0.25
