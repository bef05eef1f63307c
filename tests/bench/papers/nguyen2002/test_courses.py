"""Success, occlusions detected and losses of runs with known boxes."""

import numpy as np
import pytest

from bench.papers.nguyen2002.measures import course_of


def courses(run, truth, loss=120):
    return {trace: course_of(run, truth, trace, loss) for trace in ("revised", "online")}


def test_a_run_succeeds_on_nine_tenths_of_the_clear_frames_and_on_the_last_five(
    made_run, made_truth
):
    truth = made_truth((40, 60), shown=0.89)
    clear = 120 - 1 - 21
    few = range(1, 1 + int(0.1 * clear))
    for beside, share, success in (
        ((), 1.0, 1.0),
        (range(40, 61), 1.0, 1.0),  # these are not clear
        (few, 1 - len(few) / clear, 1.0),
        ((*few, 10), 1 - (len(few) + 1) / clear, 0.0),
        ((115,), 1 - 1 / clear, 0.0),
        ((114,), 1 - 1 / clear, 1.0),
    ):
        found = course_of(made_run(beside=beside), truth, "online", 120)
        assert found["on_target"] == pytest.approx(share)
        assert found["success"] == success, beside


def test_the_given_first_frame_does_not_count(made_run, made_truth):
    truth = made_truth((1, 110), shown=0.5)
    found = course_of(made_run(beside=(111,)), truth, "online", 120)
    assert found["on_target"] == pytest.approx(8 / 9)


def test_an_occlusion_is_detected_where_it_was_declared_and_the_target_is_found_again(
    made_run, made_truth
):
    truth = made_truth((30, 40))
    told = ("occlusions", "declared", "detected", "detected_share", "false_occlusions")
    for run, revised, online in (
        (made_run((31, 50, 66)), (1, 1, 1, 1, 0), (1, 1, 1, 1, 0)),
        (made_run((31, 36, 66)), (1, 1, 0, 0, 0), (1, 1, 1, 1, 0)),  # not in view at the end
        (made_run((31, 50, 66), beside=(50,)), (1, 1, 0, 0, 0), (1, 1, 1, 1, 0)),
        (made_run((31, 50, 66), beside=(66,)), (1, 1, 1, 1, 0), (1, 1, 0, 0, 0)),
        (made_run((28, 47, 63), (70, 75, 105)), (1, 1, 1, 1, 1), (1, 1, 1, 1, 1)),
        (made_run((27, 46, 62)), (1, 0, 0, 0, 1), (1, 0, 0, 0, 1)),
        (made_run(), (1, 0, 0, 0, 0), (1, 0, 0, 0, 0)),
    ):
        found = courses(run, truth)
        assert tuple(found["revised"][name] for name in told) == revised
        assert tuple(found["online"][name] for name in told) == online


def test_of_several_events_in_an_occlusion_the_last_one_decides(made_run, made_truth):
    truth = made_truth((30, 45))
    found = courses(made_run((30, 35, 65), (40, 59, 75)), truth)["revised"]
    assert (found["declared"], found["detected"], found["false_occlusions"]) == (1, 1, 0)


def test_what_the_sequences_end_leaves_open_is_declared_and_not_detected_online(
    made_run, made_truth
):
    found = courses(made_run((100, 111, None)), made_truth((99, 108)))
    assert (found["revised"]["detected"], found["online"]["detected"]) == (1, 0)
    never = courses(made_run((117, None, None)), made_truth((116, 119)))["revised"]
    assert (never["declared"], never["detected"]) == (1, 0)


def test_without_an_occlusion_there_is_no_share_of_them(made_run, made_truth):
    found = course_of(made_run((50, 55, 85)), made_truth(), "revised", 120)
    assert np.isnan(found["detected_share"])
    assert (found["occlusions"], found["false_occlusions"]) == (0, 1)
    assert found["outliers"] == 0.125


def test_a_loss_at_the_moment_of_a_change_is_told_from_others(made_run, made_truth):
    truth = made_truth(off=(50, 90))
    run = made_run()
    for loss, at_switch, at_off in (
        (50, 1, 1),
        (47, 1, 1),
        (53, 1, 1),
        (54, 0, 0),
        (88, 1, 0),
        (96, 0, 0),
        (120, 0, 0),
    ):
        found = course_of(run, truth, "online", loss)
        assert (found["lost_at_switch"], found["lost_at_off"]) == (at_switch, at_off), loss


def test_a_loss_in_what_was_declared_an_occlusion_is_one_from_its_beginning(made_run, made_truth):
    truth, run = made_truth(off=(50, 90)), made_run((51, 62, 86))
    found = courses(run, truth, loss=70)
    assert (found["revised"]["lost_at_off"], found["online"]["lost_at_off"]) == (0, 1)
    assert course_of(run, truth, "revised", 60)["lost_at_off"] == 1


def test_frames_after_a_lamp_goes_off_count_where_they_are_clear(made_run, made_truth):
    truth = made_truth((60, 64), shown=0.5, off=(50, 90))
    found = course_of(made_run(beside=(49, 55, 62, 69, 70)), truth, "online", 120)
    assert found["clear_after_off"] == 15
    assert found["kept_after_off"] == pytest.approx(13 / 15)
    assert "kept_after_off" not in course_of(made_run(), made_truth(), "online", 120)


def test_what_is_said_to_be_hidden_in_sight_is_a_share_of_the_clear_frames(made_run, made_truth):
    truth = made_truth((40, 60), shown=0.89)
    run = made_run((30, 35, 65))
    for found in courses(run, truth).values():
        assert found["said_hidden"] == pytest.approx((10 + 4) / (119 - 21))
    assert courses(made_run(), truth)["online"]["said_hidden"] == 0


def test_jitter_is_what_the_estimate_adds_to_the_targets_own_way(made_run, made_truth):
    assert course_of(made_run(), made_truth(), "online", 120)["jitter"] == pytest.approx(0)
    shaken = made_run()
    shaken.boxes[1::2, 1] += 3
    assert course_of(shaken, made_truth(), "online", 120)["jitter"] == pytest.approx(6)
    hidden = course_of(shaken, made_truth((2, 118), shown=0.5), "online", 120)
    assert np.isnan(hidden["jitter"])
