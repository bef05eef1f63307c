"""Restarted runs, compared with hand-computed values and with the loop of VOT's toolkit."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.bench.conftest import Noise, straight_line
from tests.bench.evaluation.walkers import Walker
from trackmark import datasets
from trackmark.bench.evaluation.loop import evaluate_run
from trackmark.bench.evaluation.scoring import score_run
from trackmark.bench.metrics.interface import FrameState
from trackmark.trackers import Estimate

S, I, F, T = (int(state) for state in FrameState)  # noqa: E741  # skipped, initialised, failed, tracked


def scripted(sequence, lost):
    """Return a tracker that is off the target in the frames `lost`, and the list of its seeds."""
    numbers = {sequence[frame].tobytes(): frame for frame in range(len(sequence))}
    seeds = []

    class Scripted:
        def __init__(self, seed):
            seeds.append(seed)

        def init(self, image, box, mask=None):
            frame = numbers[image.tobytes()]
            np.testing.assert_array_equal(box, sequence.boxes[frame])
            self.box = box

        def update(self, image):
            frame = numbers[image.tobytes()]
            if np.isfinite(sequence.boxes[frame]).all():
                self.box = sequence.boxes[frame]
            return Estimate(self.box + [20.0 * (frame in lost), 0, 0, 0])

    return Scripted, seeds


def test_failure_is_followed_by_pause_and_restart(make_sequence):
    sequence = make_sequence(n=24, absent=(0, 16, 17))
    maker, seeds = scripted(sequence, lost={5, 7, 12, 23})
    run = evaluate_run(maker, sequence, protocol="supervised")
    assert run.states.tolist() == [S, I, T, T, T, F, S, S, S, S, I, T, F, S, S, S, S, S, I] + [
        *[T] * 4,
        F,
    ]
    keys = [seed.spawn_key for seed in seeds]
    assert keys == [keys[0], (*keys[0], 1), (*keys[0], 2)]
    on_target = np.isin(run.states, (I, T))
    np.testing.assert_array_equal(run.boxes[on_target], sequence.boxes[on_target])
    assert np.isnan(run.boxes[run.states == S]).all()
    judged = score_run(run, sequence, "vot-supervised")
    assert judged.scores["failures"] == 3
    assert judged.scores["robustness"] == pytest.approx(np.exp(-30 * 3 / 23))


def test_frames_without_annotation_never_fail_nor_restart(make_sequence):
    annotated = np.isin(np.arange(20), (0, 3, 6, 13, 19))
    sequence = make_sequence(n=20, annotated=annotated)
    maker, _ = scripted(sequence, lost={2, 6})
    run = evaluate_run(maker, sequence, protocol="supervised")
    assert run.states.tolist() == [I, *[T] * 5, F, *[S] * 6, I, *[T] * 6]
    scored = score_run(run, sequence, "vot-supervised").scores
    assert scored["failures"] == 1
    assert scored["robustness"] == pytest.approx(np.exp(-30 / 20))


@pytest.mark.parametrize(("frame", "state"), [(3, F), (3, S), (3, I), (3, 9), (5, T), (6, F)])
def test_forged_state_is_not_scored(make_sequence, frame, state):
    sequence = make_sequence(n=24)
    maker, _ = scripted(sequence, lost={5})
    run = evaluate_run(maker, sequence, protocol="supervised")
    assert run.states[:12].tolist() == [I, T, T, T, T, F, S, S, S, S, I, T]
    run.states[frame] = state
    with pytest.raises(
        ValueError, match=r"Supervised run, frame \d+ after the first initialisation: state"
    ):
        score_run(run, sequence, "vot-supervised")


def test_accuracy_and_eao_equal_hand_computed_values():
    """Use a failure in frame 20 of 130, a restart in frame 25 and a burn-in of ten frames."""
    sequence = datasets.Sequence("line", Noise(130, 24, 100), straight_line(130), fingerprint="x")
    maker, _ = scripted(sequence, lost={20})
    run = evaluate_run(maker, sequence, protocol="supervised")
    scores = score_run(run, sequence, "vot-supervised").scores
    assert scores["accuracy"] == 1.0
    # Two parts: frames 0 to 19 (overlap 0 after the failure), and frames 25 to 129, of which 104
    # follow the initialisation.
    expected = [(19 / n + 1) / 2 for n in range(100, 105)]
    assert scores["eao"] == pytest.approx(np.mean(expected))
    assert scores["eao_lengths"] == 5


def test_tracker_without_failure_has_its_one_pass_run(make_sequence):
    sequence = make_sequence(n=12)
    maker, seeds = scripted(sequence, lost=())
    run = evaluate_run(maker, sequence, protocol="supervised")
    one_pass = evaluate_run(maker, sequence)
    np.testing.assert_array_equal(run.boxes, one_pass.boxes)
    assert run.states.tolist() == [I] + [T] * 11
    assert len(seeds) == 2
    scores = [score_run(each, sequence, "vot-supervised").scores for each in (run, one_pass)]
    assert scores[0] == pytest.approx(scores[1], nan_ok=True)


def test_parameters_set_failure_threshold_and_pause(make_sequence):
    sequence = make_sequence(n=14)

    class Half(Walker):
        """Tracker with an overlap of one third."""

        def update(self, image):
            return Estimate(self.box + [4.0, 0, 0, 0])

    run = evaluate_run(Half, sequence, protocol="supervised:threshold=0.5:skip_frames=1")
    assert set(run.states.tolist()) == {I, F}
    run = evaluate_run(Half, sequence, protocol="supervised:threshold=0.5:skip_frames=3")
    assert run.states[:6].tolist() == [I, F, S, S, I, F]


def vot_loop(present, lost, skip):
    """Return states by the loop of VOT's `SupervisedExperiment`, extended to absent targets."""
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
def test_states_equal_those_of_vot_toolkit_loop(present, lost, skip):
    n = len(present)
    boxes = straight_line(n, [i for i in range(n) if not present[i]])
    sequence = datasets.Sequence("line", Noise(n), boxes, fingerprint="x", image_size=(32, 24))
    maker, _ = scripted(sequence, lost)
    run = evaluate_run(maker, sequence, protocol=f"supervised:skip_frames={skip}")
    assert run.states.tolist() == vot_loop(present, lost, skip)


def test_tracker_that_cannot_be_restarted_fails(make_sequence):
    sequence = make_sequence(n=20)
    maker, seeds = scripted(sequence, lost={4})

    class Once(maker):
        def init(self, image, box, mask=None):
            if len(seeds) == 2:
                raise RuntimeError("once is enough")
            super().init(image, box, mask)

    run = evaluate_run(Once, sequence, protocol="supervised")
    assert run.failure.startswith("frame 9: RuntimeError: once is enough")
