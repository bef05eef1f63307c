"""What happened in a run, from boxes and details whose story is known."""

from types import SimpleNamespace

import numpy as np
import pytest

from bench.papers.nummiaro2003.courses import COURSE, Hiding, course_of, hidings
from bench.papers.nummiaro2003.scores import _with_the_target

N, COMES, LEAVES = 240, 20, 230
TREE = slice(100, 116)
SHORT = slice(180, 184), slice(200, 203)


def truth(**changes):
    """A target that comes, is hidden by a tree and twice by others, and leaves."""
    boxes = np.full((N, 4), np.nan)
    frames = np.arange(COMES, LEAVES)
    boxes[frames] = np.column_stack(
        [3.0 * frames, 50 + 0 * frames, 40 + 0 * frames, 90 + 0 * frames]
    )
    visibility = np.ones(N)
    visibility[TREE] = 0.0
    visibility[96:100] = visibility[116:120] = 0.6
    for one in SHORT:
        visibility[one] = 0.2
    visibility[:COMES] = visibility[LEAVES:] = 0.0
    visibility[LEAVES - 3 : LEAVES] = 0.3
    told = {"boxes": boxes, "regions": {}, "visibility": visibility, **changes}
    return SimpleNamespace(**told)


def run(boxes=None, **details):
    """A run that follows the truth and sees what the truth says, but for the changes."""
    there = truth()
    usual = {
        "mode": np.ones(N),
        "positive_appearances": np.where(there.visibility > 0.1, 90.0, 3.0),
        "updated": (there.visibility > 0.5).astype(float),
    }
    return SimpleNamespace(
        boxes=np.nan_to_num(there.boxes, nan=1.0) if boxes is None else boxes,
        details={key: np.asarray(value, float) for key, value in {**usual, **details}.items()},
        identity=SimpleNamespace(parameters={"kick_off": 0.1, "particles": 100}),
    )


def shifted(frames, by=500.0):
    boxes = np.nan_to_num(truth().boxes, nan=1.0)
    boxes[frames, 0] += by
    return boxes


def test_hidings_are_told_by_how_completely_and_leaving_is_none():
    there = truth()
    expected = [Hiding(100, 116, True), Hiding(180, 184, False), Hiding(200, 203, False)]
    assert hidings(there.visibility, COMES, LEAVES) == expected
    assert hidings(np.ones(N), COMES, LEAVES) == []
    assert hidings(np.full(N, np.nan), COMES, LEAVES) == []


def test_a_run_as_the_paper_tells_it():
    mode = np.ones(N)
    mode[104:118] = 0
    found = course_of(run(mode=mode), truth())
    assert set(found) == set(COURSE)
    for event in ("recovered", "count_fell", "initialised", "tracking_again", "bridged"):
        assert found[event] == 1.0, event
    assert found["right_at_end"] == found["count_fell_at_end"] == 1.0
    assert found["size_error"] == found["size_bias"] == found["centre_rms"] == 0.0
    assert np.isnan(found["size_correlation"])  # neither size changes
    # It initialises in two good frames and in twelve others.
    assert found["good_updates"] == found["good_frames"] == LEAVES - COMES - 1 - 16 - 4 - 3 - 3 - 2
    assert found["other_updates"] == 0.0
    assert (found["waiting_frames"], found["count_fell_shortly"]) == (12, 0.0)
    assert found["good_frames"] + found["other_frames"] == N - COMES - 1 - 14
    assert found["update_share"] == found["good_frames"] / (N - COMES - 1 - 14)


def test_a_target_that_is_found_too_late_or_for_a_moment_is_not_recovered():
    assert course_of(run(shifted(slice(100, 151))), truth())["recovered"] == 0.0
    assert course_of(run(shifted(slice(100, 140))), truth())["recovered"] == 1.0
    boxes = shifted(slice(100, N))
    boxes[125:129] = truth().boxes[125:129]  # four frames in a row
    found = course_of(run(boxes), truth())
    assert (found["recovered"], found["right_at_end"]) == (0.0, 0.0)
    assert np.isnan(found["bridged"])  # it was on the target before neither


def test_a_target_that_walks_through_a_frozen_box_is_not_recovered():
    waits = np.where(np.arange(N) >= 104, 0.0, 1.0)
    assert course_of(run(mode=waits), truth())["recovered"] == 0.0
    assert np.isnan(course_of(run(mode=waits), truth())["bridged"])  # followed it before neither
    late = np.where((np.arange(N) >= 104) & (np.arange(N) < 140), 0.0, 1.0)
    assert course_of(run(mode=late), truth())["recovered"] == 1.0


def test_frames_in_which_nothing_can_be_updated_are_no_credit_to_the_condition():
    hidden = np.arange(N) >= LEAVES
    found = course_of(run(updated=np.ones(N) - hidden, mode=1.0 - hidden), truth())
    assert found["other_updates"] == found["other_frames"] == 16 + 4 + 3 + 3
    assert found["waiting_frames"] == N - LEAVES


def test_a_count_that_falls_in_a_short_hiding_is_told_where_the_tracker_was_on_target():
    low = np.full(N, 50.0)
    low[SHORT[1]] = 9
    assert course_of(run(positive_appearances=low), truth())["count_fell_shortly"] == 1.0
    beside = course_of(run(shifted(slice(190, 205)), positive_appearances=low), truth())
    assert beside["count_fell_shortly"] == 0.0


@pytest.mark.parametrize(
    ("changes", "bridged"),
    [
        ({}, 1.0),
        ({"boxes": shifted(slice(181, 200))}, 0.0),  # off the target for too long
        ({"boxes": shifted(slice(181, 190))}, 1.0),
        ({"mode": np.where(np.arange(N) == 205, 0.0, 1.0)}, 0.0),  # initialises
        ({"boxes": shifted(slice(170, 195))}, 1.0),  # was on the target before the second alone
    ],
)
def test_short_hidings_are_bridged_by_propagation_alone(changes, bridged):
    assert course_of(run(**changes), truth())["bridged"] == bridged


def test_a_count_that_stays_up_falls_nowhere():
    found = course_of(run(positive_appearances=np.full(N, 10.0)), truth())
    assert (found["count_fell"], found["count_fell_at_end"]) == (0.0, 0.0)
    late = np.full(N, 50.0)
    late[LEAVES + 9] = 9
    assert course_of(run(positive_appearances=late), truth())["count_fell_at_end"] == 1.0


def test_updates_beside_the_target_or_in_its_absence_are_no_good():
    found = course_of(run(shifted(slice(150, 160)), updated=np.ones(N)), truth())
    assert found["other_updates"] == found["other_frames"]
    assert found["other_frames"] == 16 + 4 + 3 + 3 + (N - LEAVES) + 10


def test_half_axes_are_told_by_error_bias_and_correlation():
    boxes = truth().boxes
    width = np.linspace(40, 80, N)
    boxes[COMES:LEAVES, 2] = width[COMES:LEAVES]
    there = truth(boxes=boxes)
    found = np.nan_to_num(boxes, nan=1.0)
    found[:, 2] *= np.where(np.arange(N) % 2, 0.9, 0.7)
    course = course_of(run(found), there)
    assert course["size_error"] == pytest.approx(0.2, abs=0.002)
    assert course["size_bias"] == pytest.approx(-0.2, abs=0.002)
    assert 0.5 < course["size_correlation"] < 1
    assert course_of(run(boxes), there)["size_correlation"] == pytest.approx(1.0)


def test_fast_frames_are_the_fifth_in_which_the_target_moves_most():
    boxes = truth().boxes
    fast = np.zeros(N, bool)
    fast[COMES + 1 : LEAVES : 5] = True
    boxes[:, 0] = np.where(np.isnan(boxes[:, 0]), np.nan, np.cumsum(np.where(fast, 30, 2)))
    there = truth(boxes=boxes)
    lost = np.nan_to_num(boxes, nan=1.0)
    lost[fast, 0] += 500
    course = course_of(run(lost), there)
    assert (course["inside_fast"], course["inside_otherwise"]) == (0.0, 1.0)


def test_a_tracker_that_says_nothing_of_modes_has_its_place_and_size_alone():
    silent = run()
    silent.details = {"coefficient": np.ones(N)}
    found = course_of(silent, truth())
    assert found["size_error"] == 0.0
    assert found["inside_partly_hidden"] == 1.0
    known = {name for name, value in found.items() if np.isfinite(value)}
    assert not known & {"recovered", "good_frames", "bridged", "right_at_end"}


def test_lengths_and_losses_count_the_frames_alone_in_which_the_target_is_there():
    boxes = np.ones((12, 4))
    boxes[:3] = boxes[10:] = np.nan
    assert _with_the_target(boxes, 12, 12) == (7, 7)  # never lost
    assert _with_the_target(boxes, 12, 3) == (7, 0)  # lost at once
    assert _with_the_target(boxes, 12, 6) == (7, 3)
    assert _with_the_target(np.ones((5, 4)), 5, 2) == (5, 2)
