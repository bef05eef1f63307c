"""Scores of runs and boxes through the public functions; times of timing runs."""

import gc
from dataclasses import replace

import cv2
import numpy as np
import pytest

import trackmark as tm
from trackmark import bench, datasets
from trackmark.bench.evaluation import loop
from trackmark.bench.evaluation.loop import WARM_UP_FRAMES, run_protocol
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.metrics.times import DISTURBED_RATIO, Times, is_disturbed, time_scores
from trackmark.bench.protocols import TIMING
from trackmark.trackers import Estimate
from trackmark.trackers.base.sharing import SharingTracker


def time_run(tracker, sequence):
    (run,) = run_protocol([(parse_tracker(tracker), 0)], sequence, TIMING).runs
    return run


def times(wall, cpu):
    return Times(np.array(wall, float), np.array(cpu, float), 0.5, 0.25)


def test_boxes_of_any_origin_are_scored():
    face = datasets.load("samples/face")
    scores = tm.score(face.boxes, "samples/face")
    assert scores["success_frames"] == scores["evaluated_frames"] == 119
    shifted = face.boxes + [3, 4, 0, 0]
    assert tm.score(shifted.tolist(), face)["centre_error"] == pytest.approx(5)


def test_unknown_preset_or_trace_is_refused(make_sequence):
    sequence = make_sequence()
    with pytest.raises(ValueError, match=r"'otbx'\. Did you mean 'otb'\?"):
        tm.score(sequence.boxes, sequence, "otbx")
    with pytest.raises(ValueError, match="unknown trace"):
        tm.score(bench.evaluate_run("static", sequence), sequence, trace="later")


def test_run_with_restarts_is_scored_by_supervised_presets_alone(make_sequence):
    sequence = make_sequence(n=4)
    run = bench.evaluate_run("static", sequence)
    restarted = replace(run, states=np.array([1, 0, 2, 1]))
    with pytest.raises(ValueError, match="it has restarts"):
        tm.score(restarted, sequence)


def test_time_scores_are_quantiles_over_updates():
    wall = [np.nan, *np.arange(1, 101) / 1000]
    scores = time_scores(times(wall, wall))
    assert scores["cpu_seconds_median"] == pytest.approx(0.0505)
    assert scores["wall_seconds_p95"] == pytest.approx(np.quantile(wall[1:], 0.95))
    assert scores["cpu_seconds_p99"] == pytest.approx(np.quantile(wall[1:], 0.99))
    assert scores["initialisation_seconds"] == 0.25
    assert scores["disturbed"] == 0.0


def test_disturbed_pass_has_no_speed():
    cpu = [np.nan, 0.01, 0.01]
    assert not is_disturbed(times(np.multiply(cpu, DISTURBED_RATIO * 0.99), cpu))
    disturbed = times(np.multiply(cpu, DISTURBED_RATIO * 1.01), cpu)
    assert is_disturbed(disturbed)
    scores = time_scores(disturbed)
    assert scores.pop("disturbed") == 1.0
    assert all(np.isnan(value) for value in scores.values())


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
    assert [tracker.updates for tracker in Counting.instances] == [WARM_UP_FRAMES - 1, 29, 29]
    assert run.identity.protocol == "timing"
    np.testing.assert_array_equal(run.boxes, bench.evaluate_run(Counting, sequence).boxes)
    assert np.isnan(run.times.cpu[0])
    assert (run.times.cpu[1:] > 0).all()
    assert (run.times.wall[1:] > 0).all()
    assert np.isnan(run.times.warm_cpu[0])
    assert (run.times.warm_cpu[1:] > 0).all()


def test_warm_pass_reads_no_image_and_ends_with_memory(make_sequence, monkeypatch):
    sequence = make_sequence(n=30)
    frames, frames_read = sequence.frames, []

    class Counted:
        def __len__(self):
            return len(frames)

        def __getitem__(self, frame):
            frames_read.append(frame)
            return frames[frame]

    sequence.frames = counted = Counted()
    time_run("static", sequence)
    assert frames_read[-30:] == [*range(30)]
    assert frames_read.count(29) == 1
    assert sequence.frames is counted
    monkeypatch.setattr(loop, "MAX_WARM_BYTES", 12 * frames[0].nbytes)
    times = time_run("static", sequence).times
    assert np.isfinite(times.cpu[1:]).all()
    assert np.isfinite(times.warm_cpu).tolist() == [0 < frame < 12 for frame in range(30)]


def test_warm_times_have_their_own_scores():
    seconds = np.array([np.nan, 1.0, 2.0, 3.0])
    scores = time_scores(Times(seconds, seconds, 0.5, 0.25, seconds / 10, seconds / 10))
    assert scores["warm_seconds_median"] == pytest.approx(0.2)
    assert scores["cpu_seconds_median"] == pytest.approx(2.0)
    assert "warm_seconds_median" not in time_scores(Times(seconds, seconds, 0.5, 0.25))
    disturbed = time_scores(Times(seconds, seconds, 0.5, 0.25, seconds / 5, seconds / 10))
    assert disturbed["disturbed"] == 1.0
    assert np.isnan(disturbed["warm_seconds_median"])


def test_failure_in_a_timing_run_fails_the_run(make_sequence):
    class Failing(Counting):
        def update(self, image):
            raise RuntimeError("no")

    run = time_run(Failing, make_sequence(n=5))
    assert run.failure.startswith("frame 1: RuntimeError: no")


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
    timed = seen[-8:]
    assert timed[::2] == ["plain"] * 4
    assert {(collected, used) for collected, used, _ in timed[1::2]} == {(False, 1)}
    assert cv2.getNumThreads() == threads
    assert gc.isenabled()


def test_run_is_not_scored_on_another_sequence(make_sequence):
    run = bench.evaluate_run("static", make_sequence(n=9))
    with pytest.raises(ValueError, match="another sequence"):
        tm.score(run, make_sequence(n=9, absent=(3,)))
