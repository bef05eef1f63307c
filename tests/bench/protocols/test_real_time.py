"""Late answers, against a slow simulation of a camera and a tracker; nobody looks at a clock."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.bench.evaluation.walkers import Walker
from trackmark import bench
from trackmark.bench.protocols import Action, parse_protocol
from trackmark.trackers import Estimate


def simulated(n, times):
    """For every frame whose answer stands there, and the frames that were seen.

    Time is counted in frames, from the first one. The tracker takes the newest frame that has
    come, as soon as it is free; `times` are what its answers take, in turn. What stands for a frame
    is what it has said last, of this frame or an earlier one, when the next frame comes.
    """
    said = [(Fraction(0), 0)]  # when, and of which frame
    free, newest, seen = Fraction(0), 0, []
    while True:
        # It is free: it takes the newest frame that has come, or waits for the next one.
        frame = max(newest + 1, int(free))
        if frame >= n:
            break
        free = max(free, Fraction(frame)) + times[len(seen) % len(times)]
        newest = frame
        seen.append(frame)
        said.append((free, frame))
    stands = []
    for k in range(n):
        there = [answer for answer in said if answer[0] <= k + 1 and answer[1] <= k]
        stands.append(max(there)[1])
    return stands, seen


def conducted(n, times, first=0):
    """The same by the protocol, at four frames a second."""
    truth = type("Truth", (), {"boxes": np.zeros((n + first, 4))})
    text = "/".join(str(float(time / 4)) for time in times)
    controller = parse_protocol(f"real-time:fps=4:seconds={text}").controller(truth, first, (9, 9))
    seen = []
    for frame in range(first + 1, first + n):
        if controller.action(frame) is Action.UPDATE:
            seen.append(frame)
            assert controller.on_estimate(frame, np.zeros(6), 7.0) == ""
    return controller.source_frames, seen


quarters = st.integers(0, 24).map(lambda quarter: Fraction(quarter, 8))


@given(st.integers(1, 40), st.lists(quarters, min_size=1, max_size=6), st.integers(0, 3))
def test_answers_are_those_of_a_simulation(n, times, first):
    answered, seen = conducted(n, times, first)
    stands, looked_at = simulated(n, times)
    assert answered[:first].tolist() == [-1] * first
    assert (answered[first:] - first).tolist() == stands
    assert [frame - first for frame in seen] == looked_at


@pytest.mark.parametrize(
    ("time", "stands", "seen"),
    [
        (Fraction(0), [0, 1, 2, 3, 4, 5], [1, 2, 3, 4, 5]),
        (Fraction(1), [0, 1, 2, 3, 4, 5], [1, 2, 3, 4, 5]),
        (Fraction(3, 2), [0, 0, 1, 2, 2, 4], [1, 2, 4, 5]),
        (Fraction(2), [0, 0, 1, 1, 3, 3], [1, 3, 5]),
    ],
)
def test_by_hand(time, stands, seen):
    answered, looked_at = conducted(6, [time])
    assert (answered.tolist(), looked_at) == (stands, seen)


def test_rows_hold_the_boxes_whose_answers_stand_there(make_sequence):
    sequence = make_sequence(n=16, absent=(0,))
    numbers = {sequence[frame].tobytes(): frame for frame in range(16)}

    class Says(Walker):
        def update(self, image):
            frame = numbers[image.tobytes()]
            return Estimate(np.array([frame, 2.0, 8.0, 6.0]), confidence=frame / 16)

    run = bench.evaluate(Says, sequence, protocol="real-time:fps=10:seconds=0.15/0.31")
    assert run.answered[1] == 1
    late = run.answered[2:]
    assert (late <= np.arange(2, 16)).all()
    assert (late < np.arange(2, 16)).any()
    np.testing.assert_array_equal(run.boxes[1], sequence.boxes[1])
    later = run.answered > 1
    np.testing.assert_array_equal(run.boxes[later, 0], run.answered[later])
    np.testing.assert_array_equal(run.confidence[later], run.answered[later] / 16)
    given_box = run.boxes[2:][late == 1]
    np.testing.assert_array_equal(given_box, np.tile(sequence.boxes[1], (len(given_box), 1)))


def test_a_tracker_with_time_enough_has_the_run_in_one_pass(make_sequence):
    sequence = make_sequence(n=12)
    run = bench.evaluate(Walker, sequence, protocol="real-time:seconds=0.04")
    np.testing.assert_array_equal(run.boxes, bench.evaluate(Walker, sequence).boxes)
    assert run.answered.tolist() == list(range(12))


def test_without_given_times_it_goes_by_the_clock_and_nothing_runs_beside(make_sequence):
    one = parse_protocol("real-time:fps=0.001")
    assert one.time_dependent
    assert not parse_protocol("real-time:seconds=0.1").time_dependent
    sequence = make_sequence(n=8)
    run = bench.evaluate(Walker, sequence, protocol=one.text)  # 1000 seconds a frame will do
    np.testing.assert_array_equal(run.boxes, bench.evaluate(Walker, sequence).boxes)


def test_long_term_wants_a_confidence_where_the_target_is_reported(make_sequence):
    sequence = make_sequence(n=8)

    class Leaves(Walker):
        def update(self, image):
            said = super().update(image)
            return Estimate(said.box, visible=len(self.shown) < 4, confidence=self.sure())

        def sure(self):
            return 0.5 if len(self.shown) < 4 else float("nan")

    run = bench.evaluate(Leaves, sequence, protocol="long-term")
    assert run.status == "finished"
    np.testing.assert_array_equal(run.boxes, bench.evaluate(Leaves, sequence).boxes)
    failed = bench.evaluate(Walker, sequence, protocol="long-term")
    assert failed.failure == (
        "frame 1: it gave no confidence, which the protocol long-term judges by; run it by one-pass"
    )
