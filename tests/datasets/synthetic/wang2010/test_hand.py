"""`wang2010/hand`: where the hand is, when it is before the face, and what has its colour."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings

from tests.datasets.synthetic.scenes import SEEDS, grown, scenes_of
from trackmark.datasets.synthetic.wang2010.hand import hand as palm

NAME = "wang2010/hand"

opened, _ = scenes_of(NAME)

CENTRED = 48
"""Frame 49 of the paper."""


def middles(boxes):
    return boxes[:, :2] + boxes[:, 2:] / 2


def in_the_hue_of_skin(image):
    """Pixels with a clear colour between red and orange."""
    hue, saturation, _ = np.moveaxis(cv2.cvtColor(image, cv2.COLOR_BGR2HSV).astype(int), 2, 0)
    return (hue >= 4) & (hue <= 18) & (saturation > 50)


@pytest.mark.parametrize("seed", range(3))
def test_the_hand_is_centred_on_the_face_in_frame_49_of_the_paper(seed):
    hand = opened(seed)
    image, mask = hand.render(0), hand.mask(0)
    bright = image.max(axis=2) > 0.6 * np.median(image[mask].max(axis=1))  # not hair
    skin = in_the_hue_of_skin(image) & bright & ~grown(mask, 3)
    skin[:, :50] = skin[:, 110:] = False  # what stands in the room
    skin = cv2.morphologyEx(skin.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3)))
    rows, columns = np.nonzero(skin)
    assert len(rows) > 250
    face = np.median(columns) + 0.5, np.median(rows) + 0.5
    assert middles(hand.truth().boxes)[CENTRED] == pytest.approx(face, abs=6)


@settings(max_examples=10, deadline=None)
@given(seed=SEEDS)
def test_the_hand_crosses_the_face_once_and_stays_in_view(seed):
    truth = opened(seed).truth()
    x, y, width, height = truth.boxes.T
    assert x.min() > 0
    assert y.min() > 20
    assert (x + width).max() < 160
    assert (y + height).max() < 95
    assert 11 < width.min() <= width.max() < 20
    assert 20 < height.min() <= height.max() < 36
    way = middles(truth.boxes)
    direction = np.sign(way[-1, 0] - way[0, 0])
    assert (direction * np.diff(way[:, 0]) > 0.1).all()
    steps = np.hypot(*np.diff(way, axis=0).T)
    assert 0.9 < steps.mean() < 1.6
    assert steps.max() < 2.6


@settings(max_examples=10, deadline=None)
@given(seed=SEEDS)
def test_the_frames_that_the_paper_shows(seed):
    """10: far from the face; 38: comes near; 49: on it; 58: leaves it, on the other side."""
    truth = opened(seed).truth()
    before = truth.attributes["on the face"]
    assert not before[:25].any()
    assert not before[75:].any()
    assert before[40:57].all()
    assert np.abs(np.diff(before.astype(int))).sum() == 2
    off = (middles(truth.boxes)[:, 0] - middles(truth.boxes)[CENTRED, 0]) / truth.boxes[:, 2]
    assert off[9] * off[57] < 0
    assert np.abs(off[9]) > 1.7
    assert 0.6 < np.abs(off[37]) < 1.9
    assert 0.5 < np.abs(off[57]) < 1.7
    assert (truth.visibility == 1).all()


@pytest.mark.parametrize("seed", range(2))
def test_the_face_has_the_hands_colour(seed):
    mask = opened(seed).mask(5)
    away = ~grown(mask, 2)
    with_face = in_the_hue_of_skin(opened(seed).render(5))
    assert with_face[mask].mean() > 0.8
    assert with_face[away].sum() > 0.8 * mask.sum()


@pytest.mark.parametrize("seed", range(4))
def test_nothing_else_in_the_office_has_the_hue_of_skin(seed):
    assert in_the_hue_of_skin(opened(seed)._room).mean() < 0.01


@pytest.mark.parametrize("side", [-1, 1])
def test_the_line_around_the_thumbs_ball_is_on_the_thumbs_side(side):
    skin, _ = palm.textures(np.random.default_rng(0), side)
    ball = skin[
        round(palm.WRIST_ROW - 4.5 * palm.TEXELS) : round(palm.WRIST_ROW - 1.5 * palm.TEXELS)
    ]
    dark = np.nonzero(ball < 0.88)[1] - palm.SIDE / 2
    assert 0 < side * np.median(dark) < 2 * palm.TEXELS
