"""What the motion map finds of what moves: closed forms on painted squares."""

import numpy as np
import pytest

from bench.papers.wang2010.checks import averaging, threshold, window
from bench.papers.wang2010.checks.motion import (
    averaged,
    found,
    latest,
    moving_frames,
    moving_things,
    target_mask,
)
from bench.papers.wang2010.checks.views import with_contrast, with_noise
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


def sequence(images, masks):
    boxes = [[columns.min(), rows.min(), SIDE, SIDE] for rows, columns in map(np.nonzero, masks)]
    return Sequence(
        "painted", images, np.array(boxes, float), fingerprint="p", masks=lambda frame: masks[frame]
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


def test_what_moves_is_the_target_where_nothing_else_does(crossing):
    things = moving_things(crossing)
    for frame in range(24):
        assert (things[frame] == target_mask(crossing, frame)).all()


def test_ground_that_is_uncovered_does_not_move():
    masks = [square(SIDE * frame) for frame in range(8)]  # a fiftieth of the ground at once
    things = moving_things(sequence([painted((mask, LIGHT)) for mask in masks], masks))
    assert (things == np.stack(masks)).all()


def test_whoever_comes_with_the_target_moves_too_and_what_rests_does_not():
    poster = square(120, 90), 60
    masks = [square(10 + SPEED * frame) for frame in range(24)]
    others = [square(130 - 3 * frame, 5) for frame in range(20)]
    others += [others[-1]] * 4  # it has come to rest
    images = [
        painted(poster, (mask, LIGHT), (other, 90))
        for mask, other in zip(masks, others, strict=True)
    ]
    things = moving_things(sequence(images, masks))
    for frame in range(20):
        assert (things[frame] == (masks[frame] | others[frame])).all()
    assert (things[21] == masks[21]).all()


def test_a_target_in_the_grounds_colour_moves_if_its_edges_do():
    masks = [square(10 + SPEED * frame) for frame in range(24)]
    images = [painted((mask, LIGHT), (np.roll(mask, 2, axis=1) & mask, GROUND)) for mask in masks]
    things = moving_things(sequence(images, masks))
    assert (things[5] == masks[5]).all()


def test_in_the_first_frame_that_moves_which_the_next_has_elsewhere():
    masks = [square(10)] * 2 + [square(10 + SPEED * frame) for frame in range(20)]
    things = moving_things(sequence([painted((mask, LIGHT)) for mask in masks], masks))
    assert not things[:3].any()
    assert (things[3] == masks[3]).all()


def test_a_speck_is_no_thing(crossing):
    images = [image.copy() for image in crossing]
    images[7][100:103, 100:103] = 255
    flickering = sequence(images, [crossing.mask(frame) for frame in range(24)])
    assert (moving_things(flickering) == moving_things(crossing)).all()


def test_noise_moves_nothing(crossing):
    generator = np.random.default_rng(0)
    masks = [crossing.mask(frame) for frame in range(24)]
    noisy = sequence([with_noise(image, 2.0, generator) for image in crossing], masks)
    assert (moving_things(noisy) == np.stack(masks)).mean() > 0.9999


def test_a_sequence_without_masks_is_refused(crossing):
    bare = Sequence("bare", list(crossing), crossing.boxes, fingerprint="b")
    with pytest.raises(SequenceError, match="bare, frame 0: there is no mask"):
        moving_things(bare)


def test_frames_in_which_something_moves_have_two_before_them():
    things = np.zeros((10, 2, 2), bool)
    assert moving_frames(things, 5) == []
    things[1:9, 0, 0] = True
    assert moving_frames(things, 100) == [2, 3, 4, 5, 6, 7, 8]
    assert moving_frames(things, 2) == [2, 8]


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


def test_one_difference_sees_nothing_of_an_image_shown_twice_and_the_mean_of_two_as_much(
    by_differences,
):
    still = by_differences.query("noise == 0 and step == 0.5")
    by_map = {key: part.set_index("frame") for key, part in still.groupby(["differences", "phase"])}
    columns = ["recall", "precision", "f1"]
    assert (by_map["one", 1][columns] == 0).all(axis=None)
    assert (by_map["one", 0]["recall"] > 0.2).all()
    for phase in (0, 1):
        assert by_map["two", phase][columns].equals(by_map["one", 0][columns])


def test_the_speed_is_that_of_the_frames_that_are_seen(by_differences):
    rows = by_differences
    assert (rows["speed"] == SPEED * rows["step"]).all()
    assert rows.loc[rows["step"] == 3, "frame"].min() >= 6  # two images before it are there
    assert rows.loc[rows["step"] == 1, "frame"].min() == 2


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
