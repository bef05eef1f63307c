"""Criteria of moreno2005's scenes, on small painted images with a known answer."""

import numpy as np
import pytest

from tests.tools.criteria.scenes import blocks, inside, painted
from tools.criteria import moreno2005 as criteria

BOX = 20, 20, 20, 20
SIZE = 60, 60


def test_outline_is_visible_if_both_sides_differ():
    image = np.full((*SIZE, 3), 60, np.uint8)
    image[:, 30:] = 120  # the right half of the target differs from the ground on its left only
    image[20:40, 20:40] = 120
    scene = painted([image], [BOX], [inside(SIZE, BOX)])
    share = criteria.visible_outline(scene, percentile=50, contrast=0.12)
    assert share == pytest.approx(0.5, abs=0.06)
    # The distance in RGB is sqrt(3) * 60 / 255 = 0.41.
    assert criteria.visible_outline(scene, percentile=50, contrast=0.42) == 0


def test_hard_share_counts_frames_in_steps():
    clear, hidden = (BOX, 200, 60), (BOX, 60, 60)
    scene = blocks([clear, hidden, clear, hidden, hidden], SIZE)
    assert criteria.hard_share(scene, limit=0.9, age=0) == pytest.approx(0.6)
    assert criteria.hard_share(scene, limit=0.9, age=0, step=2) == pytest.approx(1 / 3)
