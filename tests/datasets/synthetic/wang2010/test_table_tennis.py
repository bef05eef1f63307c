"""`wang2010/table-tennis`: motion of ball and bat, images compared with ground truth."""

import numpy as np
import pytest
from hypothesis import given, settings

from tests.datasets.synthetic.scenes import SEEDS, box_centres, unless_sealed
from trackmark import datasets
from trackmark.datasets.synthetic.parameters import SceneParameters
from trackmark.datasets.synthetic.render.sprite import blend_sprite
from trackmark.datasets.synthetic.wang2010 import table_tennis
from trackmark.datasets.synthetic.wang2010.table_tennis import CATCH, Play, blend_swung

pytestmark = unless_sealed("wang2010/table-tennis")

NAME = "wang2010/table-tennis"
STROKE = 11  # the paper's frame 12


@pytest.fixture(scope="module")
def sequence():
    return datasets.load(NAME)


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
    assert np.abs(ball[:, 0] - bat[:, 0]).max() < 4  # well on the blade
    arm = np.diff(bat[:, 1] - play.tip(times)) * 64
    assert np.abs(arm).max() < 12  # and never jumps


def test_gravity_matches_a_40_mm_ball_at_30_fps():
    play = Play(3, *table_tennis.SIZE)
    metres = 0.040 / play.diameter
    times = np.arange(11.0, 15.0, 0.5)
    fall = np.polyfit(times / 30, play.ball(times)[:, 1] * metres, 2)[0] * 2
    assert fall == pytest.approx(9.81, rel=0.02)


def test_bat_catches_the_ball_with_even_deceleration():
    play = Play(3, *table_tennis.SIZE)
    times = np.linspace(play.flights[1, 1], play.flights[2, 0], 9)
    deceleration = -np.polyfit(times, play.ball(times)[:, 1], 2)[0] * 2
    assert deceleration == pytest.approx(CATCH, rel=0.02)


def test_stroke_moves_the_wrist_but_not_the_arm():
    play = Play(3, *table_tennis.SIZE)
    frames = np.arange(50)
    assert (play.tip(frames[:STROKE]) == 0).all()
    assert -3 < play.tip(STROKE) < -1
    arm = play.bat(frames)[:, 1] - play.tip(frames)
    assert np.abs(np.diff(arm, n=2))[STROKE - 2] < 3


def test_speed_up_lasts_from_the_stroke_to_the_top(sequence):
    flagged = np.flatnonzero(sequence.attributes["speed-up"])
    assert flagged[0] == STROKE
    assert (np.diff(flagged) == 1).all()
    assert 3 <= len(flagged) <= 5
    assert flagged[-1] == STROKE + np.argmin(box_centres(sequence)[STROKE : STROKE + 8, 1])


@pytest.fixture(scope="module")
def pair():
    """Return a scene, and the same scene with a black ball."""
    first, second = (table_tennis.scene(SceneParameters(scene=2)) for _ in range(2))
    second._ball = first._ball.silhouette(0)
    for part in ("_ball_shadow", "_player", "_wall"):
        setattr(second, part, getattr(first, part))
    return first, second


def test_ball_blur_has_the_length_of_the_exposure(pair):
    """Weighted by its colour, the struck ball is longer by its motion in 0.45 frames."""
    spreads = []
    for frame in (8, STROKE):
        red, dark = (scene[frame][:, :, 2].astype(float) for scene in pair)
        weight = np.clip(red - dark - 12, 0, None)
        rows, columns = np.indices(weight.shape) + 0.5
        centre = (weight * rows).sum() / weight.sum()
        spreads.append((weight * (rows - centre) ** 2).sum() / weight.sum())
        x, y, width, height = datasets.load(f"{NAME}:scene=2").boxes[frame]
        assert centre == pytest.approx(y + height / 2, abs=0.8)  # lit from above
        across = (weight * columns).sum() / weight.sum()
        assert across == pytest.approx(x + width / 2, abs=0.8)
    still, struck = (np.ptp(pair[0].play.ball([k - 0.225, k + 0.225])[:, 1]) for k in (8, STROKE))
    assert spreads[1] - spreads[0] == pytest.approx((struck**2 - still**2) / 12, rel=0.5)


def swung(sprite, left, top, swings, shares):
    canvas = np.full((60, 70, 3), 90, np.uint8)
    still = np.zeros_like(left), np.zeros(sprite.shape[1], np.int64)
    blend_swung(canvas, sprite, left, top, swings, np.full(sprite.shape[1], shares), *still)
    return canvas


@pytest.fixture(scope="module")
def limb():
    return table_tennis.scene(SceneParameters(scene=3))._ball.levels[1]


@pytest.mark.parametrize("count", [1, 4])
def test_blend_swung_shifts_columns_by_their_share(limb, count):
    random = np.random.default_rng(0)
    left, top = random.integers(-20 * 64, 60 * 64, (2, count))
    swings = 2 * random.integers(-10 * 64, 10 * 64, count)
    quarter = np.floor(swings / 4 + 0.5).astype(int)
    for shares, shift in ((256, swings), (128, swings // 2), (64, quarter), (0, 0 * swings)):
        drawn = np.full((60, 70, 3), 90, np.uint8)
        blend_sprite(drawn, limb, left, top + shift, 1 << 16)
        assert (swung(limb, left, top, swings, shares) == drawn).all()
    assert (drawn != 90).any()


@pytest.mark.parametrize(("seed", "side", "border"), [(3, 1, 141), (1, -1, 0)])
def test_player_swing_decreases_towards_the_elbow(seed, side, border):
    """Compare the sleeve's upper edge at the border with the thumb's at the blade."""
    scene = table_tennis.scene(SceneParameters(scene=seed))
    assert scene.play.side == side
    bat = scene.play.bat(25)
    tops = []
    for up in (0, 16):
        canvas = np.zeros((115, 142, 3), np.uint8)
        scene._player.draw(canvas, (bat - (0, up))[None], bat[1], np.zeros(1))
        covered = canvas.any(axis=2)
        tops.append([covered[:, column].argmax() for column in (round(bat[0]) + 35 * side, border)])
    assert tops[0][0] - tops[1][0] == 16
    assert 2 <= tops[0][1] - tops[1][1] <= 12
