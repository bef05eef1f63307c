"""`wang2010/hand`: place of the hand, overlap with the face, and colours."""

import cv2
import numpy as np
import pytest

from tests.datasets.synthetic.scenes import box_centres, grown, scenes_of, unless_sealed
from trackmark.datasets.synthetic.wang2010.hand import scene as palm

pytestmark = unless_sealed("wang2010/hand")

NAME = "wang2010/hand"

opened, _ = scenes_of(NAME)

CENTRED = 48
"""Frame 49 of the paper."""


def in_the_hue_of_skin(image):
    """Return the saturated pixels between red and orange."""
    hue, saturation, _ = np.moveaxis(cv2.cvtColor(image, cv2.COLOR_BGR2HSV).astype(int), 2, 0)
    return (hue >= 4) & (hue <= 18) & (saturation > 50)


@pytest.mark.parametrize("seed", range(3))
def test_hand_is_centred_on_the_face_in_paper_frame_49(seed):
    hand = opened(seed)
    image, mask = hand.render(0), hand.mask(0)
    bright = image.max(axis=2) > 0.6 * np.median(image[mask].max(axis=1))  # not hair
    skin = in_the_hue_of_skin(image) & bright & ~grown(mask, 3)
    skin[:, :50] = skin[:, 110:] = False  # what stands in the room
    skin = cv2.morphologyEx(skin.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3)))
    rows, columns = np.nonzero(skin)
    assert len(rows) > 250
    face = np.median(columns) + 0.5, np.median(rows) + 0.5
    assert box_centres(hand.truth())[CENTRED] == pytest.approx(face, abs=6)


@pytest.mark.parametrize("seed", range(2))
def test_face_has_the_hand_colour(seed):
    mask = opened(seed).mask(5)
    away = ~grown(mask, 2)
    with_face = in_the_hue_of_skin(opened(seed).render(5))
    assert with_face[mask].mean() > 0.8
    assert with_face[away].sum() > 0.8 * mask.sum()


@pytest.mark.parametrize("seed", range(4))
def test_office_lacks_the_hue_of_skin(seed):
    assert in_the_hue_of_skin(opened(seed)._room).mean() < 0.01


@pytest.mark.parametrize("side", [-1, 1])
def test_thumb_crease_is_on_the_side_of_the_thumb(side):
    skin, _ = palm.hand_textures(np.random.default_rng(0), side)
    ball = skin[
        round(palm.WRIST_ROW - 4.5 * palm.TEXELS) : round(palm.WRIST_ROW - 1.5 * palm.TEXELS)
    ]
    dark = np.nonzero(ball < 0.88)[1] - palm.SIDE / 2
    assert 0 < side * np.median(dark) < 2 * palm.TEXELS
