"""What maps find of the target and of what moves: closed forms on painted squares."""

import cv2
import numpy as np
import pytest

import datasets
from bench.evaluation.timing import Remembered
from bench.papers.wang2010.plain_maps import moving
from bench.papers.wang2010.scenes import (
    FACTORS,
    LEVELS,
    averaged,
    change_by_light,
    colour_contrast,
    found_by_differences,
    found_by_threshold,
    found_by_window,
    latest,
    on_the_target,
    surroundings,
)
from bench.papers.wang2010.silhouettes import MovingThings, found, target_mask
from datasets import Sequence, SequenceError

SIDE, SPEED, LIGHT = 20, 4, (192, 192, 192)
GREEN, PALE_GREEN, WHITE = (0, 160, 0), (80, 160, 80), (255, 255, 255)


@pytest.fixture(scope="module")
def cross(paint):
    """A square of a colour that crosses the image at four pixels a frame."""

    def cross(colour):
        masks = [paint.square(10 + SPEED * frame) for frame in range(24)]
        return paint.sequence([paint.image((mask, colour)) for mask in masks], masks)

    return cross


@pytest.fixture(scope="module")
def crossing(cross):
    return cross(LIGHT)


def test_what_moves_is_where_it_is_not_what_it_was_and_what_rests_does_not(crossing, paint):
    masks = [crossing.mask(frame) for frame in range(24)]
    things = MovingThings(crossing)
    assert all((things[frame] == masks[frame]).all() for frame in range(24))
    assert (things.swept([3, 5, 5]) == (masks[3] | masks[5])).all()
    rests = [paint.square(130, 5)] * 4 + [paint.square(130 - 3 * k, 5) for k in range(1, 21)]
    both = MovingThings(paint.sequence([paint.image()] * 24, masks, rests))
    assert all((both[frame] == masks[frame]).all() for frame in range(4))
    assert all((both[frame] == masks[frame] | rests[frame]).all() for frame in range(4, 24))


def test_in_the_first_frame_that_moves_which_the_next_has_elsewhere(paint):
    masks = [paint.square(10)] * 2 + [paint.square(10 + SPEED * frame) for frame in range(20)]
    assert not MovingThings(paint.sequence([paint.image()] * 22, masks))[0].any()
    moved = MovingThings(paint.sequence([paint.image()] * 20, masks[2:]))
    assert (moved[0] == masks[0]).all()


def test_frames_in_which_something_moves_have_two_before_them(crossing, paint):
    assert MovingThings(crossing).frames(100) == list(range(2, 24))
    assert MovingThings(crossing).frames(2) == [2, 23]
    masks = [paint.square(10)] * 10 + [paint.square(40)] * 10
    assert MovingThings(paint.sequence([paint.image()] * 20, masks)).frames(100) == [10]


def test_what_moves_is_known_of_remembered_frames_and_not_of_any_scene(crossing, paint):
    masks = [crossing.mask(frame) for frame in range(24)]
    kept = paint.sequence(list(crossing), masks)
    kept.frames = Remembered(kept.frames)
    assert (MovingThings(kept)[7] == masks[7]).all()
    other = Sequence("other", list(crossing), crossing.boxes, fingerprint="o")
    with pytest.raises(SequenceError, match="list: it is not known what moves"):
        MovingThings(other)[3]
    with pytest.raises(SequenceError, match="other, frame 3: there is no mask"):
        target_mask(other, 3)


@pytest.mark.parametrize(
    "name",
    [
        "wang2010/table-tennis:scene=3",
        "wang2010/table-tennis:scene=3:version=2",
        "wang2010/hand:scene=3",
        pytest.param("wang2010/cup:scene=1", marks=pytest.mark.slow),  # mirrored
        pytest.param("wang2010/cup:scene=3", marks=pytest.mark.slow),
    ],
)
def test_what_moves_in_a_scene_holds_the_target_and_hides_the_ground(name):
    """They hold the target, and what changes is near them: all but shadows."""
    scene = datasets.load(name)
    things = MovingThings(scene)
    target, moves = scene.mask(12), things[12]
    assert np.count_nonzero(target & moves) > 0.97 * np.count_nonzero(target)
    assert np.count_nonzero(moves) > 1.2 * np.count_nonzero(target)
    assert moves.mean() < 0.4
    changed = np.abs(scene[12].astype(int) - scene[11]).max(axis=2) > 40
    near = cv2.dilate(things.swept([11, 12]).astype(np.uint8), np.ones((5, 5)))
    assert np.count_nonzero(changed & (near > 0)) > 0.8 * np.count_nonzero(changed)


def test_recall_precision_and_their_mean_are_shares_of_pixels():
    marked, truth = np.array([1, 1, 1, 0, 0], bool), np.array([1, 0, 0, 1, 0], bool)
    assert found(marked, truth) == {"recall": 1 / 2, "precision": 1 / 3, "f1": 2 / 5}
    nothing = np.zeros(5, bool)
    assert found(nothing, truth) == {"recall": 0.0, "precision": 0.0, "f1": 0.0}
    assert np.isnan(found(nothing, nothing)["recall"])


def test_saturation_sets_a_target_off_from_pale_surroundings_of_its_hue(paint):
    mask, around = paint.square(50), paint.square(30, 30, 60)
    pale = paint.image((around, PALE_GREEN), (mask, GREEN))
    plain = paint.image((mask, GREEN))
    similar = {"similar background": np.array([False, True, False])}
    shown = paint.sequence([plain, pale, plain], [mask] * 3, attributes=similar)
    rows = colour_contrast(shown, quick=False)["wa-2"].set_index(["frame", "map"])
    assert rows.loc[(1, "hue"), "contrast"] == 0.0
    told = rows.loc[(1, "hue and saturation"), ["inside", "outside", "difference", "contrast"]]
    assert told.tolist() == pytest.approx([1.0, 0.7, 0.3, 0.3 / 1.7])
    assert rows["similar"].tolist() == [1.0, 1.0, 0.0, 0.0]
    assert rows.loc[2, "contrast"].tolist() == [1.0, 1.0]
    box = np.array([50.0, 50.0, 20.0, 20.0])
    assert (surroundings(box, mask) == (around & ~mask)).all()


def test_a_target_that_is_hidden_makes_no_row(paint):
    mask, hidden = paint.square(50), np.zeros((120, 160), bool)
    images = [paint.image((mask, GREEN)), paint.image(), paint.image((mask, GREEN))]
    shown = paint.sequence(images, [mask, hidden, mask])
    assert colour_contrast(shown, quick=False)["wa-2"]["frame"].unique().tolist() == [2]
    assert 1 not in change_by_light(shown, quick=False)["wa-3"]["frame"].to_numpy()


def test_hue_and_saturation_of_a_pure_colour_outlast_a_gain_and_its_value_does_not(paint):
    mask = paint.square(50)
    shown = paint.sequence([paint.image((mask, GREEN))] * 3, [mask] * 3)
    rows = change_by_light(shown, quick=False)["wa-3"]
    assert sorted(rows["gain"].unique()) == [0.5, 0.75, 1.25, 1.5]
    by_map = rows.groupby("map")
    assert (by_map.get_group("without value")["change"] == 0.0).all()
    assert by_map.get_group("with value")["change"].to_numpy() == pytest.approx(0.15)
    assert by_map.get_group("with value")["inside"].to_numpy() == pytest.approx(0.85)


def test_without_a_window_only_the_edges_of_a_uniform_square_are_found(crossing):
    rows = found_by_window(crossing, quick=False)["wa-4"].set_index(["window", "frame"])
    alone = rows.loc[1]
    # Both differences have a strip at the front and one behind, as wide as the square moves.
    assert (alone["recall"] == 2 * SPEED / SIDE).all()
    assert (alone["precision"] == 1 / 2).all()
    assert (alone["precision_swept"] == 1.0).all()
    recall = rows["recall"].groupby("window").mean()
    assert recall.is_monotonic_increasing
    assert recall[7] > 0.5
    assert rows.loc[7, "precision_swept"].max() < 1.0
    marked = moving(averaged((crossing[9], crossing[8], crossing[7]), 5))
    assert rows.loc[(5, 9), "recall"] == np.count_nonzero(marked & crossing.mask(9)) / SIDE**2


def test_the_averaged_difference_is_of_the_last_frame_and_of_the_one_before(paint):
    images = tuple(paint.image((paint.square(0), [level] * 3)) for level in (200, 150, 140))
    expected = np.where(paint.square(0), 3 * (50 + 10) / 2, 0)
    assert (averaged(images, window=1) == expected).all()


def test_of_what_moves_slowly_two_differences_mark_more_than_one(paint):
    """Strips as wide as a square moves in one frame, and in two."""
    paces = [1, 1, 1, 1, 8, 8, 8, 8, 8]
    masks = [paint.square(20 + sum(paces[:frame])) for frame in range(len(paces) + 1)]
    shown = paint.sequence([paint.image((mask, LIGHT)) for mask in masks], masks)
    rows = found_by_differences(shown, quick=False)["wa-5"].query("noise == 0 and step == 1")
    assert rows.groupby("frame")["slow"].first().to_dict() == {
        frame: float(frame <= 4) for frame in range(2, 10)
    }
    recall = rows[rows["slow"] == 1].groupby("differences")["recall"].mean()
    assert recall["two"] > recall["one"] > 0


def test_two_differences_mark_a_fast_square_where_it_was_and_suppress_noise(cross):
    rows = found_by_differences(cross([148] * 3), quick=False)["wa-5"]
    assert (rows["speed"] == SPEED * rows["step"]).all()
    assert rows.groupby("step")["frame"].min().to_dict() == {1: 2, 2: 4, 3: 6}
    assert not rows["slow"].any()  # at an even pace none is slower than the others
    # Strips as wide as it moves, and two pixels of the window around them.
    fast = rows.query("noise == 0 and step == 3 and differences == 'two'")
    assert (fast["precision_swept"] > 0.75).all()
    assert (fast["precision"] < 0.5).all()
    noisy = rows.query("step == 1 and noise == 16").groupby("differences")["precision_swept"].mean()
    assert noisy["one"] < 0.5
    assert noisy["two"] > noisy["one"] + 0.05


def test_an_adaptive_threshold_knows_no_contrast_and_a_fixed_one_does(crossing):
    every = found_by_threshold(crossing, quick=True)["wa-6"]
    f1 = every.query("noise == 0").set_index(["rule", "level", "contrast"])["f1"]
    adaptive = f1["adaptive"].unstack("contrast")
    assert (adaptive.loc[2.0:6.0].nunique(axis=1) == 1).all()
    assert adaptive.loc[2.0].min() > 0.3
    # A square 16 levels lighter than the ground differs by 16 at most, one by 64 by more.
    assert f1["fixed", 16.0, 0.25] == 0.0
    assert f1["fixed", 16.0, 1.0] > 0.3
    assert f1["fixed", 0.5, 0.25] > 0.3
    assert len(every) == 9 * (len(FACTORS) + len(LEVELS))
    for _, part in every.groupby("rule"):
        means = part.groupby("level")["f1"].mean()
        assert part.loc[part["best"] == 1, "level"].unique().tolist() == [means.idxmax()]
        assert part["best"].sum() == 9


def test_what_is_drawn_of_noise_is_the_same_again_and_where_nothing_moves_there_is_no_row(
    crossing, paint
):
    masks = [paint.square(50)] * 8
    still = paint.sequence([paint.image((mask, LIGHT)) for mask in masks], masks)
    for measure in (found_by_window, found_by_differences, found_by_threshold):
        ((name, table),) = measure(still, quick=False).items()
        assert len(table) == 0
        once, again = (measure(crossing, quick=True)[name] for _ in range(2))
        assert once.equals(again)


def test_what_moves_in_the_targets_colours_is_the_target_alone(paint):
    masks = [paint.square(10 + 4 * frame) for frame in range(14)]
    others = [paint.square(120 - 4 * frame, 5) for frame in range(14)]
    poster = paint.square(130, 90)
    images = [
        paint.image((poster, GREEN), (other, WHITE), (mask, GREEN))
        for mask, other in zip(masks, others, strict=True)
    ]
    rows = on_the_target(paint.sequence(images, masks), quick=False)["wa-7"]
    by_map = {name: part.set_index("frame") for name, part in rows.groupby("map")}
    assert (by_map["colour"]["inside"] == 0.5).all()  # a poster of its colour and size
    assert (by_map["colour"]["covered"] == 1.0).all()
    assert (by_map["colour and moving"]["inside"] == 1.0).all()
    assert (by_map["moving"]["inside"] < 0.5).all()  # something white moves, too
    assert by_map["colour and moving"]["covered"].equals(by_map["moving"]["covered"])
    assert rows.loc[rows["figure"] == 1, "frame"].unique().tolist() == [10, 11]
    still = paint.sequence([images[0]] * 4, masks[:1] * 4)
    nothing = on_the_target(still, quick=False)["wa-7"].groupby("map")["inside"]
    assert nothing.get_group("moving").isna().all()


def marked_of_the_target(name, frames, scenes):
    """Share of the target that the motion map marks, mean over frames of so many scenes."""
    shares = []
    for scene in range(scenes):
        sequence = datasets.load(f"{name}:scene={scene}")
        for frame in frames:
            marked = moving(averaged(latest(sequence, frame)))
            shares.append(marked[sequence.mask(frame)].mean())
    return np.mean(shares)


BALL = "wang2010/table-tennis:version={}".format


def test_the_motion_map_marks_the_struck_ball_as_in_the_papers_figure_1():
    assert marked_of_the_target(BALL(2), [11], 2) > 0.8
    assert marked_of_the_target(BALL(1), [11], 2) < 0.15


@pytest.mark.slow
def test_the_motion_map_marks_no_less_of_the_struck_ball_than_of_hand_and_cup():
    others = [marked_of_the_target(f"wang2010/{name}", (20, 48), 6) for name in ("hand", "cup")]
    assert marked_of_the_target(BALL(2), range(11, 16), 6) > max(others) > 0.85
