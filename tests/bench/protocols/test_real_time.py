"""Late estimates, compared with a slow simulation of a camera and a tracker; no clock is read."""

from fractions import Fraction
from math import nan

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tests.bench.evaluation.walkers import Walker
from trackmark.bench.evaluation.loop import evaluate_run
from trackmark.bench.protocols import Action, parse_protocol
from trackmark.trackers import Estimate


def simulated(n, times):
    """Return the source frame of each frame's estimate, and the frames that the tracker was shown.

    Times are in frames, from the first one. An idle tracker takes the newest frame or waits for the
    next one. Its updates take the `times`, in turn. The estimate of a frame is the newest one that
    is complete when the next frame arrives; it belongs to this frame or an earlier one.
    """
    estimates = [(Fraction(0), 0)]  # completion time and frame
    free, newest, visited = Fraction(0), 0, []
    while (frame := max(newest + 1, int(free))) < n:
        free = max(free, Fraction(frame)) + times[len(visited) % len(times)]
        newest = frame
        visited.append(frame)
        estimates.append((free, frame))
    sources = [max(e for e in estimates if e[0] <= k + 1 and e[1] <= k)[1] for k in range(n)]
    return sources, visited


def controlled(n, times, first=0):
    """Return the same values as `simulated`, from the protocol at four frames per second."""
    truth = type("Truth", (), {"boxes": np.zeros((n + first, 4))})
    text = "/".join(str(float(time / 4)) for time in times)
    controller = parse_protocol(f"real-time:fps=4:update_seconds={text}").controller(
        truth, first, (9, 9)
    )
    visited = []
    for frame in range(first + 1, first + n):
        if controller.action(frame) is Action.UPDATE:
            visited.append(frame)
            assert controller.check_estimate(frame, np.zeros(6), 7.0) == ""
    return controller.estimate_frames, visited


quarters = st.integers(0, 24).map(lambda quarter: Fraction(quarter, 8))


@given(st.integers(1, 40), st.lists(quarters, min_size=1, max_size=6), st.integers(0, 3))
def test_estimate_frames_equal_slow_simulation(n, times, first):
    estimate_frames, visited = controlled(n, times, first)
    sources, expected = simulated(n, times)
    assert estimate_frames[:first].tolist() == [-1] * first
    assert (estimate_frames[first:] - first).tolist() == sources
    assert [frame - first for frame in visited] == expected


def test_rows_hold_boxes_of_their_estimate_frames(make_sequence):
    sequence = make_sequence(n=16, absent=(0,))
    numbers = {sequence[frame].tobytes(): frame for frame in range(16)}

    class FrameNumbers(Walker):
        def update(self, image):
            frame = numbers[image.tobytes()]
            return Estimate(np.array([frame, 2.0, 8.0, 6.0]), confidence=frame / 16)

    run = evaluate_run(FrameNumbers, sequence, protocol="real-time:fps=10:update_seconds=0.15/0.31")
    assert run.estimate_frames[1] == 1
    late = run.estimate_frames[2:]
    assert (late <= np.arange(2, 16)).all()
    assert (late < np.arange(2, 16)).any()
    np.testing.assert_array_equal(run.boxes[1], sequence.boxes[1])
    later = run.estimate_frames > 1
    np.testing.assert_array_equal(run.boxes[later, 0], run.estimate_frames[later])
    np.testing.assert_array_equal(run.confidence[later], run.estimate_frames[later] / 16)
    init_box_rows = run.boxes[2:][late == 1]
    np.testing.assert_array_equal(
        init_box_rows, np.tile(sequence.boxes[1], (len(init_box_rows), 1))
    )


def test_fast_tracker_has_its_one_pass_run(make_sequence):
    sequence = make_sequence(n=12)
    run = evaluate_run(Walker, sequence, protocol="real-time:update_seconds=0.04")
    np.testing.assert_array_equal(run.boxes, evaluate_run(Walker, sequence).boxes)
    assert run.estimate_frames.tolist() == list(range(12))


def test_measured_times_make_runs_time_dependent(make_sequence):
    protocol = parse_protocol("real-time:fps=0.001")
    assert protocol.time_dependent
    assert not parse_protocol("real-time:update_seconds=0.1").time_dependent
    sequence = make_sequence(n=8)
    run = evaluate_run(Walker, sequence, protocol=protocol.key)  # 1000 s per frame
    np.testing.assert_array_equal(run.boxes, evaluate_run(Walker, sequence).boxes)


def test_long_term_needs_confidence_of_reported_target(make_sequence):
    sequence = make_sequence(n=8)

    class Leaves(Walker):
        def update(self, image):
            estimate = super().update(image)
            visible = len(self.shown) < 4
            return Estimate(estimate.box, visible=visible, confidence=0.5 if visible else nan)

    run = evaluate_run(Leaves, sequence, protocol="long-term")
    assert run.status == "finished"
    np.testing.assert_array_equal(run.boxes, evaluate_run(Leaves, sequence).boxes)
    failed = evaluate_run(Walker, sequence, protocol="long-term")
    assert failed.failure.startswith("frame 1: the estimate has no confidence, which the protocol")
