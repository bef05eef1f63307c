"""`wang2010/cup`: position, occlusion and surroundings of the cup."""

import cv2
import numpy as np
import pytest

from tests.datasets.synthetic.scenes import grown, mask_edges, scenes_of, unless_sealed

pytestmark = unless_sealed("wang2010/cup")

NAME = "wang2010/cup"

opened, _ = scenes_of(NAME)

EVENT = 35
"""Frame 36 of the paper."""

MORE, SLOW = range(1, 8), pytest.mark.slow
"""Other scenes; each takes seconds."""


def shrunk(mask, pixels):
    return ~grown(~mask, pixels)


def as_in_image(cup, part):
    """Return a part of the setting, flipped like the images."""
    return part[:, ::-1] if cup.plan.mirrored else part


def coloured(image):
    """Return the hue of saturated pixels in [0, 180), and NaN for other pixels."""
    hue, saturation, value = np.moveaxis(cv2.cvtColor(image, cv2.COLOR_BGR2HSV), 2, 0)
    return np.where((saturation > 70) & (value > 50), hue.astype(float), np.nan)


def hue_apart(hue, other_hue):
    """Return the distance of hues, in [0, 90]; NaN without hue."""
    return np.abs((hue - other_hue + 90) % 180 - 90)


def hue_of_cup(cup):
    pixel = np.round(cup.setting.colour).astype(np.uint8)[None, None]
    return float(cv2.cvtColor(pixel, cv2.COLOR_BGR2HSV)[0, 0, 0])


@pytest.mark.parametrize("seed", range(2))
def test_cup_box_is_tight_and_contains_the_mask(seed):
    cup = opened(seed)
    for frame in range(0, 80, 9):
        x, y, width, height = cup.truth().boxes[frame]
        ends = [x, y, x + width, y + height]
        whole, _ = cup.seen(frame)
        assert mask_edges(as_in_image(cup, whole) >= 0.5) == pytest.approx(ends, abs=1)
        beyond = (mask_edges(cup.mask(frame)) - ends) * [-1, -1, 1, 1]
        assert (beyond[:2] <= 1).all()
        assert (beyond[2:] < 1).all()


@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=SLOW) for k in MORE)])
def test_similar_object_and_box_have_the_cup_hue(seed):
    cup = opened(seed)
    image = cup.render(0)
    hue = hue_of_cup(cup)
    carried = grown(
        as_in_image(cup, cup.setting.carried.render_at(*cup._pose(0))[..., 3]) > 0.01, 1
    )
    box = as_in_image(cup, cup.setting.hidden) > 0.99
    behind = (as_in_image(cup, cup.setting.similar) > 0.99) & ~grown(box, 2)
    for part in (shrunk(cup.mask(0), 1), box & ~carried, behind & ~carried):
        assert part.sum() > 100
        assert np.nanmedian(hue_apart(coloured(image)[part], hue)) < 4
    assert cup.setting.similar.sum() > 700
    assert cup.setting.hidden.sum() > 350


@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=SLOW) for k in MORE)])
def test_other_objects_lack_the_cup_hue(seed):
    cup = opened(seed)
    image = cup.render(0)
    allowed = cup.mask(0) | (as_in_image(cup, cup.setting.similar + cup.setting.hidden) > 0)
    near = hue_apart(coloured(image), hue_of_cup(cup)) < 7
    assert near[~grown(allowed, 2)].mean() < 0.01


def test_cup_is_surrounded_by_its_colour_at_the_event():
    for seed in range(3):
        cup = opened(seed)
        whole, _ = cup.seen(EVENT)
        around = grown(whole > 0.5, 3) & ~grown(whole > 0.5, 1)
        same = np.maximum(cup.setting.similar, cup.setting.hidden) > 0.5
        assert same[around].mean() > 0.6
        assert (whole * cup.setting.similar).sum() > 0.6 * whole.sum()
