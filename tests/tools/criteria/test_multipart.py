"""Criteria of the multipart and wang2010 scenes that need no histogram, on painted frames."""

import numpy as np
import pytest

from tests.tools.criteria.scenes import blank, inside, painted
from tools.criteria import multipart as criteria
from tools.criteria.wang2010 import first_overlap

BOX = [20, 10, 12, 40]


@pytest.mark.parametrize(
    ("trousers", "difference"),
    [
        ((0, 0, 0), 100.0),  # white is (100, 0, 0) in L*u*v*, and black is (0, 0, 0)
        ((0, 0, 255), 185.0),  # red is (53.2, 175.0, 37.8)
        ((255, 255, 255), 0.0),
    ],
)
def test_difference_of_halves_is_a_distance_in_luv(trousers, difference):
    image = np.full((60, 60, 3), 90, np.uint8)
    image[inside(image.shape, BOX)] = trousers
    image[inside(image.shape, [*BOX[:3], 20])] = (255, 255, 255)
    assert criteria.halves_difference(painted([image], [BOX])) == pytest.approx(difference, abs=0.5)


def test_occlusions_are_stretches_of_low_visibility():
    scene = blank([[5, 5, 4, 4]] * 7, visibility=[0.4, 0.9, 0.4, 0.3, 0.5, 1.0, 0.49])
    assert criteria.occlusions(scene, visible=0.5) == 3
    assert criteria.occlusions(scene, visible=0.3) == 0


def test_sampled_frames_are_evenly_spaced_and_limited():
    assert criteria.sampled_frames(10, 4).tolist() == [0, 3, 6, 9]
    assert len(criteria.sampled_frames(788, 40)) == 40


def test_first_overlap_counts_frames_from_one():
    flags = np.array([False, False, True, True])
    scene = blank([[5, 5, 4, 4]] * 4, attributes={"on the face": flags})
    assert first_overlap(scene) == 3
