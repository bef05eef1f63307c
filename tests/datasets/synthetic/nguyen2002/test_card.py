"""Cards lie where their pose says."""

import numpy as np
import pytest

from datasets.synthetic.nguyen2002.lights.setting import Card, Pose

POSES = [Pose((100.0, 80.0)), Pose((121.4, 77.3), 1.1, 0.02), Pose((60.0, 140.25), 0.9, -0.3)]


@pytest.fixture
def card():
    """40 x 60 pixels in three samples each, anchored in its middle."""
    sheet = np.ones((180, 120, 4), np.float32)
    return Card([sheet, sheet], (20.0, 30.0), 3)


@pytest.mark.parametrize("pose", POSES)
def test_a_card_covers_its_area_around_its_place(card, pose):
    coverage = card.at(pose)[0][..., 3].astype(float)
    rows, columns = np.indices(coverage.shape) + 0.5
    middle = np.array([(coverage * at).sum() for at in (columns, rows)]) / coverage.sum()
    assert middle == pytest.approx(pose._place, abs=0.02)
    assert coverage.sum() == pytest.approx(2400 * pose._scale**2, rel=0.02)


def test_a_card_leans_to_the_right():
    corner = Pose((0.0, 0.0), 1.0, 0.1).onto_picture(np.array([[0.0, -30.0]]))[0]
    assert corner == pytest.approx([30 * np.sin(0.1), -30 * np.cos(0.1)])


@pytest.mark.parametrize("pose", POSES)
def test_a_point_goes_onto_the_picture_and_back_onto_its_sample(pose):
    anchor = np.array([20.0, 30.0])
    point = np.array([[3.0, -7.0]])
    there = pose.onto_card(anchor, 3)
    sample = there[:, :2] @ pose.onto_picture(point)[0] + there[:, 2]
    assert sample == pytest.approx(3 * (anchor + point[0]) - 0.5)


def test_a_shade_is_the_coverage_softened(card):
    pose = POSES[1]
    rows, columns = np.indices((240, 320)) + 0.5
    points = np.stack([columns, rows], axis=2).astype(np.float32)
    sharp, soft = card.shade().at(pose, points), card.shade(4.0).at(pose, points)
    assert np.abs(sharp - card.at(pose)[0][..., 3]).mean() < 0.001
    assert soft.sum() == pytest.approx(sharp.sum(), rel=0.01)
    edge = points[80, 148]  # about its right edge
    assert edge[0] - pose._place[0] == pytest.approx(22, abs=6)
    assert np.abs(np.diff(soft[80])).max() < 0.15 < np.abs(np.diff(sharp[80])).max()
