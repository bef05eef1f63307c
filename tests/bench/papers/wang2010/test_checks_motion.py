"""What the motion map finds of what moves: closed forms on painted squares."""

import cv2
import numpy as np
import pytest

import datasets
from bench.papers.scenes import Remembered, with_contrast
from bench.papers.wang2010.checks import averaging, threshold, window
from bench.papers.wang2010.checks.motion import (
    MovingThings,
    averaged,
    found,
    latest,
    target_mask,
)
from bench.papers.wang2010.checks.silhouettes import silhouettes
from bench.papers.wang2010.plain import moving
from datasets import Sequence, SequenceError

HEIGHT, WIDTH, SIDE, SPEED = 120, 160, 20, 4
GROUND, LIGHT = 128, 192


def square(x, y=50):
    """Pixels of a square whose left top corner is there."""
    mask = np.zeros((HEIGHT, WIDTH), bool)
    mask[y : y + SIDE, x : x + SIDE] = True
    return mask


def painted(*things):
    """Things of the given grey level, each over those before it."""
    image = np.full((HEIGHT, WIDTH, 3), GROUND, np.uint8)
    for mask, level in things:
        image[mask] = level
    return image


class Painted(list):
    """Images, and what moves in them."""

    things = ()


@silhouettes.register
def _(scene: Painted, frame):
    return [masks[frame] for masks in scene.things]


def sequence(images, masks, *others):
    """A sequence of which these are the target's masks, and those of other things."""
    boxes = [[columns.min(), rows.min(), SIDE, SIDE] for rows, columns in map(np.nonzero, masks)]
    scene = Painted(images)
    scene.things = (masks, *others)
    return Sequence(
        "painted", scene, np.array(boxes, float), fingerprint="p", masks=lambda frame: masks[frame]
    )


def cross(level):
    """A square of a grey level that crosses the image at four pixels a frame."""
    masks = [square(10 + SPEED * frame) for frame in range(24)]
    return sequence([painted((mask, level)) for mask in masks], masks)


@pytest.fixture(scope="module")
def crossing():
    return cross(LIGHT)


@pytest.fixture(scope="module")
def by_differences(crossing):
    """Table of the maps with one difference and with two."""
    return averaging.measure(crossing, quick=False)["wa-5"]


def test_what_moves_is_where_it_is_not_what_it_was(crossing):
    things = MovingThings(crossing)
    for frame in range(24):
        assert (things[frame] == crossing.mask(frame)).all()


def test_a_thing_that_rests_does_not_move_and_the_others_do():
    masks = [square(10 + SPEED * frame) for frame in range(24)]
    rests = [square(130, 5)] * 4 + [square(130 - 3 * frame, 5) for frame in range(1, 21)]
    things = MovingThings(sequence([painted()] * 24, masks, rests))
    for frame in range(4):
        assert (things[frame] == masks[frame]).all()
    for frame in range(4, 24):
        assert (things[frame] == masks[frame] | rests[frame]).all()


def test_in_the_first_frame_that_moves_which_the_next_has_elsewhere():
    masks = [square(10)] * 2 + [square(10 + SPEED * frame) for frame in range(20)]
    things = MovingThings(sequence([painted()] * 22, masks))
    assert not things[0].any()
    assert (MovingThings(sequence([painted()] * 20, masks[2:]))[0] == masks[0]).all()


def test_what_things_sweep_is_where_they_are_in_any_of_the_frames(crossing):
    swept = MovingThings(crossing).swept([3, 5, 5])
    assert (swept == (crossing.mask(3) | crossing.mask(5))).all()


def test_frames_in_which_something_moves_have_two_before_them(crossing):
    assert MovingThings(crossing).frames(100) == list(range(2, 24))
    assert MovingThings(crossing).frames(2) == [2, 23]
    masks = [square(10)] * 10 + [square(40)] * 10
    assert MovingThings(sequence([painted()] * 20, masks)).frames(100) == [10]


def test_remembered_frames_are_seen_through_to_their_scene(crossing):
    kept = sequence(list(crossing), [crossing.mask(frame) for frame in range(24)])
    kept.frames = Remembered(kept.frames)
    assert (MovingThings(kept)[7] == crossing.mask(7)).all()


def test_a_scene_of_which_it_is_not_known_what_moves_is_refused(crossing):
    other = Sequence("other", list(crossing), crossing.boxes, fingerprint="o")
    with pytest.raises(SequenceError, match="list: it is not known what moves"):
        MovingThings(other)[3]


def test_a_sequence_without_masks_is_refused(crossing):
    bare = Sequence("bare", list(crossing), crossing.boxes, fingerprint="b")
    with pytest.raises(SequenceError, match="bare, frame 3: there is no mask"):
        target_mask(bare, 3)


@pytest.mark.parametrize(
    "name",
    [
        "wang2010/table-tennis:scene=3",
        "wang2010/hand:scene=3",
        pytest.param("wang2010/cup:scene=1", marks=pytest.mark.slow),  # mirrored
        pytest.param("wang2010/cup:scene=3", marks=pytest.mark.slow),
    ],
)
def test_what_moves_in_a_scene_holds_the_target_and_hides_the_ground(name):
    """They hold the target, and what changes is near them: all but shadows."""
    scene = datasets.load(name)
    things = MovingThings(scene)
    for frame in (12, 30):
        target = scene.mask(frame)
        assert np.count_nonzero(target & things[frame]) > 0.97 * np.count_nonzero(target)
        assert np.count_nonzero(things[frame]) > 1.2 * np.count_nonzero(target)
        assert things[frame].mean() < 0.4
        changed = np.abs(scene[frame].astype(int) - scene[frame - 1]).max(axis=2) > 40
        near = cv2.dilate(things.swept([frame - 1, frame]).astype(np.uint8), np.ones((5, 5)))
        assert np.count_nonzero(changed & (near > 0)) > 0.8 * np.count_nonzero(changed)


def test_the_averaged_difference_is_of_the_last_frame_and_of_the_one_before():
    images = tuple(painted((square(0), level)) for level in (200, 150, 140))
    found_difference = averaged(images, window=1)
    assert (found_difference == np.where(square(0), 3 * (50 + 10) / 2, 0)).all()


def test_recall_precision_and_their_mean_are_shares_of_pixels():
    marked, truth = np.array([1, 1, 1, 0, 0], bool), np.array([1, 0, 0, 1, 0], bool)
    assert found(marked, truth) == {"recall": 1 / 2, "precision": 1 / 3, "f1": 2 / 5}
    nothing = np.zeros(5, bool)
    assert found(nothing, truth) == {"recall": 0.0, "precision": 0.0, "f1": 0.0}
    assert np.isnan(found(nothing, nothing)["recall"])


def test_without_a_window_only_the_edges_of_a_uniform_square_are_found(crossing):
    rows = window.measure(crossing, quick=False)["wa-4"].set_index(["window", "frame"])
    alone = rows.loc[1]
    # Both differences have a strip at the front and one behind, as wide as the square moves.
    assert (alone["recall"] == 2 * SPEED / SIDE).all()
    assert (alone["precision"] == 1 / 2).all()
    assert (alone["precision_swept"] == 1.0).all()
    recall = rows["recall"].groupby("window").mean()
    assert recall.is_monotonic_increasing
    assert recall[7] > 0.5
    assert rows.loc[7, "precision_swept"].max() < 1.0


def test_the_map_of_the_table_is_that_of_three_frames(crossing):
    marked = moving(averaged((crossing[9], crossing[8], crossing[7]), 5))
    rows = window.measure(crossing, quick=False)["wa-4"].set_index(["window", "frame"])
    recall = np.count_nonzero(marked & crossing.mask(9)) / SIDE**2
    assert rows.loc[(5, 9), "recall"] == recall
    assert (np.stack(latest(crossing, 9)) == np.stack([crossing[k] for k in (9, 8, 7)])).all()


def test_of_what_moves_slowly_two_differences_mark_more_than_one():
    """Strips as wide as a square moves in one frame, and in two."""
    paces = [1, 1, 1, 1, 8, 8, 8, 8, 8]
    masks = [square(20 + sum(paces[:frame])) for frame in range(len(paces) + 1)]
    shown = sequence([painted((mask, LIGHT)) for mask in masks], masks)
    rows = averaging.measure(shown, quick=False)["wa-5"].query("noise == 0 and step == 1")
    assert rows.groupby("frame")["slow"].first().to_dict() == {
        frame: float(frame <= 4) for frame in range(2, 10)
    }
    recall = rows[rows["slow"] == 1].groupby("differences")["recall"].mean()
    assert recall["two"] > recall["one"] > 0


def test_the_speed_is_that_of_the_frames_that_are_seen(by_differences):
    rows = by_differences
    assert (rows["speed"] == SPEED * rows["step"]).all()
    assert rows.loc[rows["step"] == 3, "frame"].min() >= 6  # two images before it are there
    assert rows.loc[rows["step"] == 1, "frame"].min() == 2
    assert not rows["slow"].any()  # at an even pace none is slower than the others


def test_what_two_differences_mark_of_a_fast_square_is_where_it_was_in_three_frames(by_differences):
    """Strips as wide as it moves, and two pixels of the window around them."""
    fast = by_differences.query("noise == 0 and step == 3 and differences == 'two'")
    assert (fast["precision_swept"] > 0.75).all()
    assert (fast["precision"] < 0.5).all()


def test_the_mean_of_two_differences_suppresses_noise():
    faint = cross(GROUND + 20)
    rows = averaging.measure(faint, quick=False)["wa-5"].query("step == 1 and noise == 16")
    precision = rows.groupby("differences")["precision_swept"].mean()
    assert precision["one"] < 0.5
    assert precision["two"] > precision["one"] + 0.05
    once, again = (averaging.measure(faint, quick=True)["wa-5"] for _ in range(2))
    assert once.equals(again)


def test_an_adaptive_threshold_knows_no_contrast_and_a_fixed_one_does(crossing):
    rows = threshold.measure(crossing, quick=False)["wa-6"].query("noise == 0")
    f1 = rows.set_index(["rule", "level", "contrast"])["f1"]
    adaptive = f1["adaptive"].unstack("contrast")
    assert (adaptive[2.0:6.0].nunique(axis=1) == 1).all()
    assert adaptive.loc[2.0].min() > 0.3
    # A square 16 levels lighter than the ground differs by 16 at most, one by 64 by more.
    assert f1["fixed", 16.0, 0.25] == 0.0
    assert f1["fixed", 16.0, 1.0] > 0.3
    assert f1["fixed", 0.5, 0.25] > 0.3


def test_the_best_level_of_a_rule_is_best_over_all_contrasts_and_noises(crossing):
    rows = threshold.measure(crossing, quick=True)["wa-6"]
    for _, part in rows.groupby("rule"):
        means = part.groupby("level")["f1"].mean()
        assert part.loc[part["best"] == 1, "level"].unique().tolist() == [means.idxmax()]
        assert part["best"].sum() == 9
    assert len(rows) == 9 * (len(threshold.FACTORS) + len(threshold.LEVELS))


def test_where_nothing_moves_there_is_no_row():
    masks = [square(50)] * 8
    still = sequence([painted((mask, LIGHT)) for mask in masks], masks)
    for measure in (window.measure, averaging.measure, threshold.measure):
        (table,) = measure(still, quick=False).values()
        assert len(table) == 0


def test_contrast_changes_about_the_middle():
    image = np.array([[[128, 192, 64]]], np.uint8)
    assert with_contrast(image, 0.5).tolist() == [[[128, 160, 96]]]
    assert with_contrast(image, 4.0).tolist() == [[[128, 255, 0]]]
