"""Scenes of `wang2010`: cup, hand and table tennis."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings

from tests.datasets.synthetic.scenes import (
    SEEDS,
    box_centres,
    grown,
    mask_edges,
    scenes_of,
    slow_if_unchanged,
)
from trackmark import datasets
from trackmark.datasets.synthetic.parameters import SceneParameters
from trackmark.datasets.synthetic.wang2010 import table_tennis
from trackmark.datasets.synthetic.wang2010.table_tennis import Play

pytestmark = slow_if_unchanged("wang2010/cup", "wang2010/hand", "wang2010/table-tennis")


open_cup, _ = scenes_of("wang2010/cup")

EVENT = 35
"""Frame 36 of the paper."""

MORE, SLOW = range(1, 8), pytest.mark.slow
"""Seeds of further scenes, and the mark for their tests: each scene takes seconds."""


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
    pixel = np.round(cup.colour).astype(np.uint8)[None, None]
    return float(cv2.cvtColor(pixel, cv2.COLOR_BGR2HSV)[0, 0, 0])


@pytest.mark.parametrize("seed", range(2))
def test_cup_box_is_tight_and_contains_the_mask(seed):
    cup = open_cup(seed)
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
    cup = open_cup(seed)
    image = cup.render(0)
    hue = hue_of_cup(cup)
    carried = grown(as_in_image(cup, cup.carried.render_at(*cup._pose(0))[..., 3]) > 0.01, 1)
    box = as_in_image(cup, cup.hidden) > 0.99
    behind = (as_in_image(cup, cup.similar) > 0.99) & ~grown(box, 2)
    for part in (shrunk(cup.mask(0), 1), box & ~carried, behind & ~carried):
        assert part.sum() > 100
        assert np.nanmedian(hue_apart(coloured(image)[part], hue)) < 4
    assert cup.similar.sum() > 700
    assert cup.hidden.sum() > 350


@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=SLOW) for k in MORE)])
def test_other_objects_lack_the_cup_hue(seed):
    cup = open_cup(seed)
    image = cup.render(0)
    allowed = cup.mask(0) | (as_in_image(cup, cup.similar + cup.hidden) > 0)
    near = hue_apart(coloured(image), hue_of_cup(cup)) < 7
    assert near[~grown(allowed, 2)].mean() < 0.01


def test_cup_is_surrounded_by_its_colour_at_the_event():
    for seed in range(3):
        cup = open_cup(seed)
        whole, _ = cup.seen(EVENT)
        around = grown(whole > 0.5, 3) & ~grown(whole > 0.5, 1)
        same = np.maximum(cup.similar, cup.hidden) > 0.5
        assert same[around].mean() > 0.6
        assert (whole * cup.similar).sum() > 0.6 * whole.sum()


open_hand, _ = scenes_of("wang2010/hand")

CENTRED = 48
"""Frame 49 of the paper."""


def has_skin_hue(image):
    """Return the saturated pixels between red and orange."""
    hue, saturation, _ = np.moveaxis(cv2.cvtColor(image, cv2.COLOR_BGR2HSV).astype(int), 2, 0)
    return (hue >= 4) & (hue <= 18) & (saturation > 50)


@pytest.mark.parametrize("seed", range(3))
def test_hand_is_centred_on_the_face_in_paper_frame_49(seed):
    hand = open_hand(seed)
    image, mask = hand.render(0), hand.mask(0)
    bright = image.max(axis=2) > 0.6 * np.median(image[mask].max(axis=1))  # without hair
    skin = has_skin_hue(image) & bright & ~grown(mask, 3)
    skin[:, :50] = skin[:, 110:] = False  # objects in the room
    skin = cv2.morphologyEx(skin.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3)))
    rows, columns = np.nonzero(skin)
    assert len(rows) > 250
    face = np.median(columns) + 0.5, np.median(rows) + 0.5
    assert box_centres(hand.truth())[CENTRED] == pytest.approx(face, abs=6)


@pytest.mark.parametrize("seed", range(2))
def test_face_has_the_hand_colour(seed):
    mask = open_hand(seed).mask(5)
    away = ~grown(mask, 2)
    with_face = has_skin_hue(open_hand(seed).render(5))
    assert with_face[mask].mean() > 0.8
    assert with_face[away].sum() > 0.8 * mask.sum()


@pytest.mark.parametrize("seed", range(4))
def test_office_lacks_the_hue_of_skin(seed):
    assert has_skin_hue(open_hand(seed)._room).mean() < 0.01


TABLE_TENNIS = "wang2010/table-tennis"
STROKE = 11  # the paper's frame 12


@pytest.fixture(scope="module")
def sequence():
    return datasets.load(TABLE_TENNIS)


@settings(max_examples=8, deadline=None)
@given(seed=SEEDS)
def test_ball_is_in_free_flight_or_on_the_bat(seed):
    play = Play(seed, *table_tennis.SIZE)
    times = np.arange(0, 49, 1 / 64)
    ball, bat = play.ball(times), play.bat(times)
    gap = bat[:, 1] - play.diameter / 2 - ball[:, 1]
    flying = np.zeros(len(times), bool)
    for start, end in play.flights:
        flying |= (times > start) & (times < end)
    assert gap.min() > -0.03
    assert np.abs(gap[~flying]).max() < 0.03
    assert np.abs(ball[:, 0] - bat[:, 0]).max() < 4  # the ball is on the blade
    arm = np.diff(bat[:, 1] - play.tip(times)) * 64
    assert np.abs(arm).max() < 12  # no jump


def test_gravity_matches_a_40_mm_ball_at_30_fps():
    play = Play(3, *table_tennis.SIZE)
    metres = 0.040 / play.diameter
    times = np.arange(11.0, 15.0, 0.5)
    fall = np.polyfit(times / 30, play.ball(times)[:, 1] * metres, 2)[0] * 2
    assert fall == pytest.approx(9.81, rel=0.02)


def test_speed_up_lasts_from_the_stroke_to_the_top(sequence):
    flagged = np.flatnonzero(sequence.attributes["speed-up"])
    assert flagged[0] == STROKE
    assert (np.diff(flagged) == 1).all()
    assert 3 <= len(flagged) <= 5
    assert flagged[-1] == STROKE + np.argmin(box_centres(sequence)[STROKE : STROKE + 8, 1])


@pytest.fixture(scope="module")
def pair():
    """Return a scene, and the same scene with a black ball."""
    first, second = (table_tennis.TableTennisScene(SceneParameters(scene=2)) for _ in range(2))
    second._ball = first._ball.silhouette(0)
    for part in ("_ball_shadow", "_player", "_wall"):
        setattr(second, part, getattr(first, part))
    return first, second


def test_ball_blur_has_the_length_of_the_exposure(pair):
    """Check that the struck ball is longer by its motion during 0.45 frames."""
    spreads = []
    for frame in (8, STROKE):
        red, dark = (scene[frame][:, :, 2].astype(float) for scene in pair)
        weight = np.clip(red - dark - 12, 0, None)
        rows, columns = np.indices(weight.shape) + 0.5
        centre = (weight * rows).sum() / weight.sum()
        spreads.append((weight * (rows - centre) ** 2).sum() / weight.sum())
        x, y, width, height = datasets.load(f"{TABLE_TENNIS}:scene=2").boxes[frame]
        assert centre == pytest.approx(y + height / 2, abs=0.8)  # light from above
        across = (weight * columns).sum() / weight.sum()
        assert across == pytest.approx(x + width / 2, abs=0.8)
    still, struck = (np.ptp(pair[0].play.ball([k - 0.225, k + 0.225])[:, 1]) for k in (8, STROKE))
    assert spreads[1] - spreads[0] == pytest.approx((struck**2 - still**2) / 12, rel=0.5)
