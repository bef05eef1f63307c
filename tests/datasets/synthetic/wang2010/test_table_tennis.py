"""`wang2010/table-tennis`: how the ball flies, and that what is seen is what is true."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import datasets
from datasets.synthetic.render.sprite import blend_sprite
from datasets.synthetic.wang2010.knobs import TableTennisKnobs
from datasets.synthetic.wang2010.table_tennis import scene as table_tennis
from datasets.synthetic.wang2010.table_tennis.play import Play
from datasets.synthetic.wang2010.table_tennis.player import blend_swung
from tests.datasets.synthetic.scenes import SEEDS

NAME = "wang2010/table-tennis"
STROKE = 11  # the paper's frame 12


def centres(sequence):
    return sequence.boxes[:, :2] + sequence.boxes[:, 2:] / 2


def climbs(sequence):
    """How far the ball goes up to each frame from the one before, in diameters; 0 in the first."""
    up = -np.diff(centres(sequence)[:, 1], prepend=centres(sequence)[0, 1])
    return up / sequence.boxes[0, 2]


@pytest.fixture(scope="module")
def sequence():
    return datasets.load(NAME)


@pytest.fixture
def play():
    return Play(3, *table_tennis.SIZE)


@settings(max_examples=15, deadline=None)
@given(seed=SEEDS)
def test_in_every_scene_the_ball_stays_in_the_picture_and_is_struck_in_frame_12(seed):
    sequence = datasets.load(f"{NAME}:scene={seed}")
    x, y, width, height = sequence.boxes.T
    assert np.ptp(width) == np.ptp(height) == 0
    assert (width == height).all()
    assert 10 <= width[0] <= 11
    assert x.min() > 15
    assert y.min() > 15
    assert (x + width).max() < 127
    assert (y + height).max() < 105
    step = np.hypot(*np.diff(centres(sequence), axis=0).T)
    assert step[: STROKE - 1].max() < 3.2  # as any tracker follows
    up = climbs(sequence)
    assert up[STROKE - 4 : STROKE].min() > 0  # the bat lifts it
    assert np.abs(up[STROKE : STROKE + 2] - 1).max() < 0.2
    assert up[STROKE + 3 :].max() < 0.8  # there is no second stroke
    assert sequence.visibility.min() == 1


def test_gravity_is_that_of_a_ball_of_40_millimetres_at_25_frames_a_second(play):
    metres = 0.040 / play.diameter
    times = np.arange(13.0, 17.5, 0.5)  # in the air
    assert (play.bat(times)[:, 1] - play.ball(times)[:, 1] > play.diameter).all()
    fall = np.polyfit(times / 25, play.ball(times)[:, 1] * metres, 2)[0] * 2
    assert fall == pytest.approx(9.81, rel=0.01)
    across = np.diff(play.ball(times)[:, 0])
    assert np.ptp(across) < 0.04  # nothing pushes it aside


@settings(max_examples=15, deadline=None)
@given(seed=SEEDS)
def test_in_the_second_version_the_ball_gets_faster_in_frame_12_and_the_arm_does_not(seed):
    sequence = datasets.load(f"{NAME}:scene={seed}:version=2")
    x, y, width, height = sequence.boxes.T
    assert min(x.min(), y.min()) > 15
    assert (x + width).max() < 127
    assert (y + height).max() < 110
    up = climbs(sequence)
    assert up[STROKE - 4 : STROKE].min() > 0  # it is lifted, and then sent up
    assert up[STROKE - 4 : STROKE].max() < 0.25
    assert up[STROKE] == pytest.approx(1, abs=0.1)
    assert up[STROKE + 2 :].max() < 0.8
    play, times = Play(seed, *table_tennis.SIZE, 2), np.arange(50)
    arm = play.bat(times)[:, 1] - play.tip(times)
    assert np.abs(np.diff(arm)).max() < 2
    assert play.tip(times).min() > -play.diameter / 2
    assert (play.tip([0, 9, 19]) == 0).all()  # else the bat is level


def test_in_the_second_version_the_ball_is_half_as_bright_in_the_same_colour():
    colours = []
    for version in (1, 2):
        scene = table_tennis.scene(TableTennisKnobs(scene=4, version=version))
        column, row = scene.play.ball(0).astype(int)  # mixed with no ground
        colours.append(scene[0][row - 2 : row + 3, column - 2 : column + 3].mean(axis=(0, 1)))
    assert colours[1] == pytest.approx(colours[0] / 2, abs=2)


@settings(max_examples=8, deadline=None)
@given(seed=SEEDS, version=st.sampled_from([1, 2]))
def test_the_ball_is_never_in_the_bat_and_leaves_it_with_the_restitution(seed, version):
    play = Play(seed, *table_tennis.SIZE, version)
    times = np.arange(0, 49, 1 / 64)
    ball, bat = play.ball(times), play.bat(times)
    gap = bat[:, 1] - play.diameter / 2 - ball[:, 1]
    assert gap.min() > -0.03
    assert np.abs(ball[:, 0] - bat[:, 0]).max() < 12  # well on the blade
    assert np.abs(gap[: 64 * (STROKE - 1)]).max() < 0.03  # it lies there until it is struck
    landing = np.flatnonzero((gap < 0.03) & (times > 13))[0]
    assert 16 < times[landing] < 19
    over = 16
    pace = (bat[landing + over, 1] - bat[landing - over, 1]) * 64 / (2 * over)
    half = play.gravity * over / 64 / 2
    comes = (ball[landing - 1, 1] - ball[landing - 1 - over, 1]) * 64 / over + half - pace
    goes = (ball[landing + 1 + over, 1] - ball[landing + 1, 1]) * 64 / over - half - pace
    assert -goes / comes == pytest.approx(play.restitution, abs=0.05)


def test_speed_up_is_from_the_stroke_to_the_top(sequence):
    flagged = np.flatnonzero(sequence.attributes["speed-up"])
    assert flagged[0] == STROKE
    assert (np.diff(flagged) == 1).all()
    assert 3 <= len(flagged) <= 5
    top = np.argmin(centres(sequence)[:, 1])
    assert flagged[-1] == top


@pytest.mark.parametrize("seed", [0, 7])
def test_a_box_holds_the_mask_and_no_more(seed):
    sequence = datasets.load(f"{NAME}:scene={seed}")
    for frame in range(0, 50, 3):
        rows, columns = np.nonzero(sequence.mask(frame))
        x, y, width, height = sequence.boxes[frame]
        area = np.pi / 4 * width * height
        assert len(rows) == pytest.approx(area, rel=0.08)
        middle = columns.mean() + 0.5, rows.mean() + 0.5
        assert middle == pytest.approx((x + width / 2, y + height / 2), abs=0.2)
        found = np.array([columns.min(), rows.min(), columns.max() + 1, rows.max() + 1])
        assert np.abs(found - (x, y, x + width, y + height)).max() < 1.5  # its rim is thin there


@pytest.fixture(scope="module")
def pair():
    """A scene, and the same with a black ball."""
    one, other = (table_tennis.scene(TableTennisKnobs(scene=2)) for _ in range(2))
    other._ball = one._ball.silhouette(0)
    for part in ("_ball_shadow", "_player", "_wall"):
        setattr(other, part, getattr(one, part))
    return one, other


def test_the_blur_is_as_long_as_the_exposure(pair):
    """Weighed by its colour, the struck ball is drawn out upwards by its way in 0.45 frames."""
    spreads = []
    for frame in (4, STROKE):
        red, dark = (scene[frame][:, :, 2].astype(float) for scene in pair)
        weight = np.clip(red - dark - 12, 0, None)
        rows, columns = np.indices(weight.shape) + 0.5
        centre = (weight * rows).sum() / weight.sum()
        spreads.append((weight * (rows - centre) ** 2).sum() / weight.sum())
        x, y, width, height = datasets.load(f"{NAME}:scene=2").boxes[frame]
        assert centre == pytest.approx(y + height / 2, abs=0.8)  # lit from above
        across = (weight * columns).sum() / weight.sum()
        assert across == pytest.approx(x + width / 2, abs=0.8)
    way = pair[0].play.diameter * 0.45
    assert spreads[1] - spreads[0] == pytest.approx(way**2 / 12, rel=0.5)


def test_the_ball_is_orange_before_grey():
    """The ball is the most saturated in its colour; the wall has none."""
    for seed in (0, 4):
        sequence = datasets.load(f"{NAME}:scene={seed}")
        image, mask = sequence[5].astype(float), sequence.mask(5)
        blue, green, red = image[mask].mean(axis=0)
        assert red > 1.3 * green > 1.6 * blue
        wall = image[2:30, 2:-2].mean(axis=(0, 1))
        assert np.ptp(wall) < 0.15 * wall.mean()
        assert image[2:30, 2:-2].mean(axis=2).std() > 8  # but it is speckled


def swung(sprite, left, top, swings, shares):
    canvas = np.full((60, 70, 3), 90, np.uint8)
    still = np.zeros_like(left), np.zeros(sprite.shape[1], np.int64)
    blend_swung(canvas, sprite, left, top, swings, np.full(sprite.shape[1], shares), *still)
    return canvas


@pytest.fixture(scope="module")
def limb():
    return table_tennis.scene(TableTennisKnobs(scene=3))._ball.levels[1]


@pytest.mark.parametrize("count", [1, 4])
def test_columns_go_along_with_the_swing_by_their_share(limb, count):
    random = np.random.default_rng(0)
    left, top = random.integers(-20 * 64, 60 * 64, (2, count))
    swings = 2 * random.integers(-10 * 64, 10 * 64, count)
    quarter = np.floor(swings / 4 + 0.5).astype(int)
    for shares, by in ((256, swings), (128, swings // 2), (64, quarter), (0, 0 * swings)):
        drawn = np.full((60, 70, 3), 90, np.uint8)
        blend_sprite(drawn, limb, left, top + by, 1 << 16)
        assert (swung(limb, left, top, swings, shares) == drawn).all()
    assert (drawn != 90).any()


@pytest.mark.parametrize(("seed", "side", "border"), [(3, 1, 141), (0, -1, 0)])
def test_the_hand_goes_with_the_bat_and_the_arm_less_towards_the_elbow(seed, side, border):
    """Where the sleeve's upper edge is, at the border; where the thumb's is, at the blade."""
    one = table_tennis.scene(TableTennisKnobs(scene=seed))
    assert one.play.side == side
    at = one.play.bat(0)
    tops = []
    for up in (0, 16):
        canvas = np.zeros((115, 142, 3), np.uint8)
        one._player.draw(canvas, (at - (0, up))[None], at[1], np.zeros(1))
        covered = canvas.any(axis=2)
        tops.append([covered[:, column].argmax() for column in (round(at[0]) + 35 * side, border)])
    assert tops[0][0] - tops[1][0] == 16
    assert 2 <= tops[0][1] - tops[1][1] <= 10
