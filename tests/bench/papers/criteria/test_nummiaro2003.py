"""Criteria of nummiaro2003 on small painted scenes with known answers."""

import numpy as np
import pytest

from tests.bench.papers.criteria.scenes import inside, painted
from trackmark.bench.papers.criteria import nummiaro2003 as criteria

BOX = 10.0, 5.0, 20.0, 20.0
RED, BLUE, GREEN = (0, 0, 255), (255, 0, 0), (0, 255, 0)

VISIBILITY = np.ones(60)
VISIBILITY[:5] = 0  # before the target enters
VISIBILITY[20:30] = [0.6, 0.4, 0.2, 0.0, 0.0, 0.2, 0.25, 0.4, 0.6, 0.95]  # the tree
VISIBILITY[40:43] = 0.1
VISIBILITY[48:50] = [0.3, 0.4]
VISIBILITY[57:] = [0.4, 0.2, 0]  # it leaves


def students_of(colours, hider=GREEN):
    """Return a scene whose target is covered from above, down to the visible share."""
    images, masks = [], []
    visibility = VISIBILITY[: len(colours)]
    for colour, visible in zip(colours, visibility, strict=True):
        edge = 20 * (1 - visible)
        mask = inside((30, 40), (10, 5 + edge, 20, 20 - edge))
        image = np.zeros((30, 40, 3), np.uint8)
        image[inside(image.shape, BOX)] = hider
        image[mask] = colour
        images.append(image)
        masks.append(mask)
    boxes = np.where(visibility[:, None] > 0, BOX, np.nan)
    boxes[20:30] = BOX
    turning = np.arange(len(images)) % 4 == 0
    return painted(images, boxes, masks, visibility=visibility, attributes={"turning": turning})


@pytest.fixture(scope="module")
def students():
    return students_of([RED] * 60)


def test_occlusions_exclude_entering_and_leaving():
    assert criteria.occlusions(VISIBILITY, 0.5) == [(21, 28), (40, 43), (48, 50)]
    assert criteria.tree_occlusion(VISIBILITY, 0.3) == (22, 27)
    assert criteria.frame_after_tree(VISIBILITY) == 30  # the first in full view


def test_measures_of_the_occlusions(students):
    assert criteria.tree_frames(students, visible=0.3) == 5
    assert criteria.least_visible_at_tree(students) == 0
    assert criteria.number_of_short_occlusions(students) == 2
    assert criteria.longest_short_occlusion(students) == 3
    assert criteria.frames_before_short_occlusions(students) == 10


def test_hider_distance_spans_zero_to_one(students):
    assert criteria.distance_of_students(students) == pytest.approx(1)
    assert criteria.distance_of_tree(students) == pytest.approx(1)
    assert criteria.distance_of_students(students_of([RED] * 60, hider=RED)) == pytest.approx(0)


def test_changed_share_counts_frames_with_another_histogram():
    scene = students_of([RED] * 30 + [BLUE] * 25)
    frames = np.arange(5, 55, 5)
    assert criteria.changed_share(scene, distance=0.5) == pytest.approx(np.mean(frames >= 30))


def test_attribute_share_counts_flagged_frames(students):
    assert criteria.attribute_share(students, attribute="turning") == 0.25
