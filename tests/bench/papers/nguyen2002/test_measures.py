"""Tracked clips, detected occlusions and losses at a switch, of runs with known boxes."""

from types import SimpleNamespace

import pytest

from tests.bench.papers.nguyen2002.runs import build_run, build_truth
from trackmark.bench.papers.measures import MeasuredRun, find_measure
from trackmark.bench.papers.nguyen2002.figures import shown_frames
from trackmark.bench.papers.paper import read_paper

RULES = read_paper("nguyen2002").frame_rules


def value(text, run, truth):
    return find_measure(text, "nguyen2002")(MeasuredRun(run, truth, RULES))


def test_kept_counts_clear_frames_and_the_last_five():
    truth = build_truth((40, 60), visible=0.89)
    clear = 120 - 1 - 21
    few = range(1, 1 + int(0.1 * clear))
    for lost_frames, expected in (
        ((), 1.0),
        (range(40, 61), 1.0),  # the target is covered in these frames
        (few, 1.0),
        ((*few, 10), 0.0),
        ((115,), 0.0),
        ((114,), 1.0),
        ((0,), 1.0),  # the frame of the init box does not count
    ):
        assert value("kept_in_clip", build_run(off_target=lost_frames), truth) == expected, (
            lost_frames
        )


def test_tracked_frames_are_a_share_of_the_clear_frames():
    truth = build_truth((40, 60), visible=0.89)  # 98 clear frames after the first
    lost = build_run(off_target=range(50, 75))  # 14 of them are clear
    assert value("tracked_frames", lost, truth) == pytest.approx(1 - 14 / 98)
    assert find_measure("tracked_frames", "nguyen2002").averaged


def test_occlusion_is_detected_if_declared_and_the_target_found():
    truth = build_truth((30, 45))
    for run, n_detected in (
        (build_run((31, 50, 66)), 1),
        (build_run((31, 36, 66)), 0),  # not in view at the end
        (build_run((31, 50, 66), off_target=(50,)), 0),
        (build_run((28, 47, 63), (70, 75, 105)), 1),
        (build_run((27, 46, 62)), 0),
        (build_run(), 0),
        # The last of several declared occlusions decides.
        (build_run((30, 35, 65), (40, 59, 75)), 1),
    ):
        assert value("detected", run, truth) == n_detected
        assert value("most_detected", run, truth) == n_detected


def test_occlusion_open_at_the_end_is_detected_by_its_candidate():
    run, truth = build_run((100, 111, None)), build_truth((99, 108))
    assert value("detected", run, truth) == 1
    never = build_run((117, None, None)), build_truth((116, 119))
    assert value("detected", *never) == 0


@pytest.mark.parametrize(
    ("loss", "at_switch"), [(50, 1), (47, 1), (53, 1), (54, 0), (88, 1), (96, 0)]
)
def test_loss_within_three_frames_of_a_switch_counts(loss, at_switch):
    run = build_run(off_target=range(loss, 120))
    assert value("lost_at_switch", run, build_truth(off=(50, 90))) == at_switch


def test_loss_within_a_declared_occlusion_began_with_it():
    run = build_run((51, 62, 86), off_target=range(58, 120))
    assert value("lost_at_switch", run, build_truth(off=(50, 90))) == 1


def test_box_stays_if_most_clear_frames_after_the_switch_overlap():
    truth = build_truth((60, 64), visible=0.5, off=(50, 90))
    assert value("stays_at_switch", build_run(off_target=(49, 55, 62, 70)), truth) == 1
    assert value("stays_at_switch", build_run(off_target=(55, 69)), truth) == 0


def test_failed_run_tracks_and_detects_nothing():
    run = SimpleNamespace(**{**vars(build_run((31, 50, 66))), "failure": "frame 3: no"})
    run.boxes_in = lambda trajectory: run.boxes
    truth = build_truth((30, 45))
    assert value("kept_in_clip", run, truth) == value("detected", run, truth) == 0


def test_figure_shows_an_occlusion_and_the_switches():
    frames = shown_frames(build_truth((30, 40), off=(60, 80)))
    assert frames == {
        27: "a) before",
        35: "b) hidden",
        50: "c) after",
        70: "d) lamp off",
        90: "lamp on again",
    }
