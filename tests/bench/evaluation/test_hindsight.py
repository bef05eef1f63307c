"""Frames before the target appears, revised boxes, and final corrections."""

import numpy as np
import pytest

import trackmark as tm
from tests.bench.evaluation.walkers import Walker, misbehaving
from trackmark.bench.evaluation.loop import evaluate_run, run_protocol
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.trackers import Estimate


def test_revised_boxes_are_kept_apart(make_sequence):
    def revise(image, tracker):
        return Estimate(tracker.box, revised={1: tracker.box, 2: tracker.box + [1, 0, 0, 0]})

    sequence = make_sequence(n=6)
    run = evaluate_run(misbehaving(revise), sequence)
    plain = evaluate_run(misbehaving(lambda i, t: Estimate(t.box)), sequence)
    np.testing.assert_array_equal(run.boxes, plain.boxes)
    np.testing.assert_array_equal(run.revised[1], run.boxes[3])
    np.testing.assert_array_equal(run.revised[3:], run.boxes[3:])
    online = tm.score(run, sequence)
    assert online == tm.score(run.boxes, sequence) | {
        "absence_reported": online["absence_reported"]
    }
    assert tm.score(run, sequence, trajectory="revised")["centre_error"] != online["centre_error"]


def test_revised_frames_count_the_shown_ones(make_sequence):
    def revise(image, tracker):
        return Estimate(tracker.box, revised={np.int64(0): tracker.box, 3: tracker.box})

    run = evaluate_run(misbehaving(revise), make_sequence(n=8, absent=(0, 1)))
    assert np.isnan(run.revised[:2]).all(), "frames before the target"
    np.testing.assert_array_equal(run.revised[[2, 5]], run.boxes[[5, 5]])


def finishing(final_boxes, call_number=99, act=None):
    """Return a tracker class whose final corrections are `final_boxes(tracker)`."""

    class Finishing(misbehaving(act, call_number)):
        def finish(self):
            return final_boxes(self)

    return Finishing


def test_final_corrections_are_revised_boxes(make_sequence):
    sequence = make_sequence(n=6)
    frame_counts = []

    def final_boxes(tracker):
        frame_counts.append(len(tracker.shown))
        return {2: tracker.box, 5: tracker.box + [1, 0, 0, 0]}

    maker = finishing(final_boxes)
    maker.__qualname__ = Walker.__qualname__  # for the same random numbers
    run = evaluate_run(maker, sequence)
    assert frame_counts == [6]  # once, when all frames were shown
    np.testing.assert_array_equal(run.boxes, evaluate_run(Walker, sequence).boxes)
    np.testing.assert_array_equal(run.revised[2], run.boxes[5])
    np.testing.assert_array_equal(run.revised[5], run.boxes[5] + [1, 0, 0, 0])
    np.testing.assert_array_equal(run.revised[[0, 1, 3, 4]], run.boxes[[0, 1, 3, 4]])


@pytest.mark.parametrize(
    ("final_boxes", "reason"),
    [
        (lambda tracker: 1 / 0, "ZeroDivisionError"),
        (
            lambda tracker: {6: tracker.box},
            "revised frame 6 is not one of the processed frames 0 to 5",
        ),
        (lambda tracker: {3: tracker.box * np.nan}, "box"),
    ],
)
def test_malformed_final_correction_fails_its_run(make_sequence, final_boxes, reason):
    entries = [(parse_tracker(finishing(final_boxes)), 0), (parse_tracker("static"), 0)]
    bad, other = run_protocol(entries, make_sequence(n=6)).runs
    assert bad.failure.startswith("frame 5: ")
    assert reason in bad.failure
    assert other.failure == ""


def test_failed_tracker_is_not_asked_for_corrections(make_sequence):
    finished_trackers = []
    maker = finishing(
        lambda tracker: finished_trackers.append(tracker) or {},
        call_number=2,
        act=lambda i, t: 1 / 0,
    )
    assert evaluate_run(maker, make_sequence()).failure.startswith("frame 2: ZeroDivisionError")
    assert finished_trackers == []
    assert evaluate_run(finishing(lambda tracker: {}), make_sequence()).revised is None


class Watching(Walker):
    """Walker that records the frames it was shown before initialisation."""

    seen = None

    def __init__(self, seed):
        super().__init__(seed)
        self.before = []

    def watch(self, image):
        self.before.append(int(image.sum()))

    def init(self, image, box, mask=None):
        super().init(image, box, mask)
        type(self).seen = self.before


@pytest.fixture
def late(make_sequence):
    """Return a sequence whose target appears in frame 3."""
    return make_sequence(8, absent=(0, 1, 2))


def test_watcher_is_shown_frames_before_the_target(late):
    evaluate_run(Walker, late)
    assert set(late.frames.requested) == set(range(3, 8)), "no tracker watches"
    run = evaluate_run(lambda seed: Watching(seed), late)
    assert not run.failure
    assert Watching.seen == [int(late[frame].sum()) for frame in range(3)]
    assert np.isnan(run.boxes[:3]).all()
    assert np.isfinite(run.boxes[3:]).all()


def test_error_of_a_watcher_fails_its_run(late):
    class Raising(Watching):
        def watch(self, image):
            raise RuntimeError("too dark")

    failed, fine = run_protocol(
        [(parse_tracker(Raising), 0), (parse_tracker(Walker), 0)], late
    ).runs
    assert "frame 0" in failed.failure
    assert "too dark" in failed.failure
    assert not fine.failure
