"""Runs that are begun again, against what is worked out by hand, and against VOT's own loop."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.bench.conftest import Noise, straight_line
from tests.bench.evaluation.walkers import Walker
from trackmark import bench, datasets
from trackmark.bench.evaluation.scoring import judge
from trackmark.bench.metrics.preset import FrameState
from trackmark.trackers import Estimate

S, I, F, T = (int(state) for state in FrameState)  # noqa: E741  # skipped, initialised, failed, tracked


def scripted(sequence, lost):
    """Makes trackers that are on the target, and beside it in the frames that are `lost`."""
    numbers = {sequence[frame].tobytes(): frame for frame in range(len(sequence))}
    made = []

    class Scripted:
        def __init__(self, seed):
            made.append(seed)

        def init(self, image, box, mask=None):
            frame = numbers[image.tobytes()]
            np.testing.assert_array_equal(box, sequence.boxes[frame])
            self.box = box

        def update(self, image):
            frame = numbers[image.tobytes()]
            if np.isfinite(sequence.boxes[frame]).all():
                self.box = sequence.boxes[frame]
            return Estimate(self.box + [20.0 * (frame in lost), 0, 0, 0])

    return Scripted, made


def test_a_failure_is_followed_by_a_pause_and_a_new_tracker(make_sequence):
    sequence = make_sequence(n=24, absent=(0, 16, 17))
    maker, made = scripted(sequence, lost={5, 7, 12, 23})
    run = bench.evaluate(maker, sequence, protocol="supervised")
    assert run.states.tolist() == [S, I, T, T, T, F, S, S, S, S, I, T, F, S, S, S, S, S, I] + [
        *[T] * 4,
        F,
    ]
    keys = [seed.spawn_key for seed in made]
    assert keys == [keys[0], (*keys[0], 1), (*keys[0], 2)]
    there = np.isin(run.states, (I, T))
    np.testing.assert_array_equal(run.boxes[there], sequence.boxes[there])
    assert np.isnan(run.boxes[run.states == S]).all()
    judged = judge(run, sequence, "vot-supervised")
    assert judged.scores["failures"] == 3
    assert judged.scores["robustness"] == pytest.approx(np.exp(-30 * 3 / 23))


@pytest.mark.parametrize(
    ("frame", "state"), [(3, F), (3, S), (3, I), (3, 9), (5, T), (6, T), (6, F), (11, S)]
)
def test_a_forged_state_is_not_scored(make_sequence, frame, state):
    sequence = make_sequence(n=24)
    maker, _ = scripted(sequence, lost={5})
    run = bench.evaluate(maker, sequence, protocol="supervised")
    assert run.states[:12].tolist() == [I, T, T, T, T, F, S, S, S, S, I, T]
    run.states[frame] = state
    with pytest.raises(ValueError, match=r"Supervised run, \d+ frames after its first: state"):
        judge(run, sequence, "vot-supervised")


def test_accuracy_and_eao_by_hand():
    """130 frames, a failure in frame 20, begun again in 25; burnt in are 10 frames after each."""
    sequence = datasets.Sequence("line", Noise(130, 24, 100), straight_line(130), fingerprint="x")
    maker, _ = scripted(sequence, lost={20})
    run = bench.evaluate(maker, sequence, protocol="supervised")
    scores = judge(run, sequence, "vot-supervised").scores
    assert scores["accuracy"] == 1.0
    # Two pieces: frames 0 to 19, zero after their failure, and 25 to 129, in which no more than 104
    # come after the first.
    expected = [(19 / n + 1) / 2 for n in range(100, 105)]
    assert scores["eao"] == pytest.approx(np.mean(expected))
    assert scores["eao_lengths"] == 5


def test_a_tracker_that_never_fails_has_the_run_in_one_pass(make_sequence):
    sequence = make_sequence(n=12)
    maker, made = scripted(sequence, lost=())
    run = bench.evaluate(maker, sequence, protocol="supervised")
    once = bench.evaluate(maker, sequence)
    np.testing.assert_array_equal(run.boxes, once.boxes)
    assert run.states.tolist() == [I] + [T] * 11
    assert len(made) == 2
    scores = [judge(one, sequence, "vot-supervised").scores for one in (run, once)]
    assert scores[0] == pytest.approx(scores[1], nan_ok=True)


def test_knobs_say_when_it_failed_and_how_long_it_pauses(make_sequence):
    sequence = make_sequence(n=14)

    class Half(Walker):
        """Its overlap is a third."""

        def update(self, image):
            return Estimate(self.box + [4.0, 0, 0, 0])

    run = bench.evaluate(Half, sequence, protocol="supervised:threshold=0.5:skip=1")
    assert set(run.states.tolist()) == {I, F}
    run = bench.evaluate(Half, sequence, protocol="supervised:threshold=0.5:skip=3")
    assert run.states[:6].tolist() == [I, F, S, S, I, F]


def vot_loop(present, lost, skip):
    """VOT's own, `SupervisedExperiment` of its toolkit, where the target may be absent, too."""
    n, frame = len(present), 0
    states = [S] * n
    frame = present.index(True)
    while frame < n:
        while frame < n and not present[frame]:
            frame += 1
        if frame == n:
            break
        states[frame] = I
        frame += 1
        while frame < n:
            if present[frame] and frame in lost:
                states[frame] = F
                frame += skip
                break
            states[frame] = T
            frame += 1
    return states


@given(
    st.lists(st.booleans(), min_size=2, max_size=30).filter(any),
    st.sets(st.integers(0, 29)),
    st.integers(1, 7),
)
def test_states_are_those_of_vots_loop(present, lost, skip):
    n = len(present)
    boxes = straight_line(n, [i for i in range(n) if not present[i]])
    sequence = datasets.Sequence("line", Noise(n), boxes, fingerprint="x", image_size=(32, 24))
    maker, _ = scripted(sequence, lost)
    run = bench.evaluate(maker, sequence, protocol=f"supervised:skip={skip}")
    assert run.states.tolist() == vot_loop(present, lost, skip)


def test_a_tracker_that_cannot_be_begun_again_has_failed(make_sequence):
    sequence = make_sequence(n=20)
    maker, made = scripted(sequence, lost={4})

    class Once(maker):
        def init(self, image, box, mask=None):
            if len(made) == 2:
                raise RuntimeError("once is enough")
            super().init(image, box, mask)

    run = bench.evaluate(Once, sequence, protocol="supervised")
    assert run.failure.startswith("frame 9: RuntimeError: once is enough")
