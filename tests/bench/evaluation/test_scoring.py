"""Scores of runs and boxes through the public functions; times of timing runs."""

import gc
from dataclasses import replace

import cv2
import numpy as np
import pytest

import trackmark as tm
from trackmark import datasets
from trackmark.bench.evaluation import loop
from trackmark.bench.evaluation.loop import WARM_UP_FRAMES, evaluate_run, run_protocol
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.protocols import TIMING
from trackmark.trackers import Estimate
from trackmark.trackers.base.call_clock import CallTime
from trackmark.trackers.base.sharing import SharingTracker


def time_run(tracker, sequence):
    (run,) = run_protocol([(parse_tracker(tracker), 0)], sequence, TIMING).runs
    return run


def test_boxes_of_any_origin_are_scored():
    face = datasets.load("samples/face")
    scores = tm.score(face.boxes, "samples/face")
    assert scores["success_frames"] == scores["evaluated_frames"] == 119
    shifted = face.boxes + [3, 4, 0, 0]
    assert tm.score(shifted.tolist(), face)["centre_error"] == pytest.approx(5)


def test_unknown_preset_or_trajectory_is_refused(make_sequence):
    sequence = make_sequence()
    with pytest.raises(ValueError, match=r"'otbx'\. Did you mean 'otb'\?"):
        tm.score(sequence.boxes, sequence, "otbx")
    with pytest.raises(ValueError, match="unknown trajectory"):
        tm.score(evaluate_run("static", sequence), sequence, trajectory="later")


def test_run_with_restarts_is_scored_by_supervised_presets_alone(make_sequence):
    sequence = make_sequence(n=4)
    run = evaluate_run("static", sequence)
    restarted = replace(run, states=np.array([1, 0, 2, 1]))
    with pytest.raises(ValueError, match="it has restarts"):
        tm.score(restarted, sequence)


class Counting:
    """Tracker that counts its updates and records its instances."""

    instances: list["Counting"] = []  # noqa: RUF012  # the test reads all of them

    def __init__(self, seed):
        self.updates = 0
        self.random = np.random.default_rng(seed)
        Counting.instances.append(self)

    def init(self, image, box, mask=None):
        self.box = box

    def update(self, image):
        self.updates += 1
        return Estimate(self.box + [self.random.random(), 0, 0, 0])


def test_timing_run_warms_up_and_gives_the_same_boxes(make_sequence):
    sequence = make_sequence(n=30)
    Counting.instances.clear()
    run = time_run(Counting, sequence)
    warm_up, *passes = [tracker.updates for tracker in Counting.instances]
    assert warm_up == WARM_UP_FRAMES - 1
    assert set(passes) == {29}  # other load can cause more than one pass
    assert run.identity.protocol == "timing"
    np.testing.assert_array_equal(run.boxes, evaluate_run(Counting, sequence).boxes)
    assert run.times.seconds.shape == (29,)
    assert (run.times.seconds > 0).all()
    assert run.times.is_first.tolist() == [True] + [False] * 28
    assert run.metadata["ms_per_frame"] == pytest.approx(1e3 * run.times.seconds[1:].mean())


def test_failure_in_a_timing_run_fails_the_run(make_sequence):
    class Failing(Counting):
        def update(self, image):
            raise RuntimeError("no")

    run = time_run(Failing, make_sequence(n=5))
    assert run.failure.startswith("frame 1: RuntimeError: no")


def test_disturbed_pass_is_repeated_and_the_quietest_is_kept(make_sequence, monkeypatch):
    """The run delay of each pass is simulated: 0.9, 0.5 and 0.7 of the wall time."""
    shares = iter([0.0, 0.9, 0.5, 0.7])

    class Clock:
        has_run_delay = True

        def __init__(self):
            self.share = next(shares)

        def start(self):
            pass

        def stop(self):
            return CallTime(1 - self.share, self.share, 1 - self.share, 0.0)

    monkeypatch.setattr(loop, "CallClock", Clock)
    Counting.instances.clear()
    run = time_run(Counting, make_sequence(n=30))
    assert len(Counting.instances) == 1 + loop.MAX_TIMED_PASSES
    assert run.metadata["run_delay_share"] == pytest.approx(0.5)
    assert run.times.is_disturbed


def test_timing_run_has_one_thread_and_shares_nothing(make_sequence):
    seen = []

    class Sharing(SharingTracker):
        def init_shared(self, frame, box, mask=None):
            self.box = box

        def update_shared(self, frame):
            seen.append((gc.isenabled(), cv2.getNumThreads(), id(frame)))
            return Estimate(self.box)

        def update(self, image):
            seen.append("plain")
            return super().update(image)

    threads = cv2.getNumThreads()
    time_run(lambda seed: Sharing(Sharing.Parameters(), seed), make_sequence(n=5))
    timed = seen[-8:]  # of the last pass
    assert timed[::2] == ["plain"] * 4
    assert {(collected, used) for collected, used, _ in timed[1::2]} == {(False, 1)}
    assert cv2.getNumThreads() == threads
    assert gc.isenabled()


def test_run_is_not_scored_on_another_sequence(make_sequence):
    run = evaluate_run("static", make_sequence(n=9))
    with pytest.raises(ValueError, match="another sequence"):
        tm.score(run, make_sequence(n=9, absent=(3,)))
