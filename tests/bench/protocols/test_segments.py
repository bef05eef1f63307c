"""Segments of protocols: start frames, init boxes and scores."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.bench.conftest import straight_line
from tests.bench.evaluation.walkers import Walker
from trackmark.bench import metrics
from trackmark.bench.evaluation.loop import evaluate_run
from trackmark.bench.evaluation.scoring import score_run
from trackmark.bench.metrics.interface import GroundTruthArrays, RunEstimates
from trackmark.bench.protocols import Segment, parse_protocol
from trackmark.trackers import Estimate

presences = st.lists(st.booleans(), min_size=1, max_size=120).filter(any).map(np.array)


def starts_of(text, present, **values):
    return [(part.start, part.step) for part in parse_protocol(text).segments(present, values)]


def test_tre_spaces_starts_evenly_up_to_last_possible_frame():
    starts = [start for start, _ in starts_of("tre", np.ones(210, bool))]
    assert starts == list(range(0, 191, 10))
    assert starts_of("tre:starts=1", np.ones(50, bool)) == [(0, 1)]
    short = [start for start, _ in starts_of("tre:starts=4:min_frames=5", np.ones(7, bool))]
    assert short == [0, 1, 2]
    absent = np.ones(12, bool)
    absent[[0, 5, 6]] = False
    assert starts_of("tre:starts=3:min_frames=4", absent) == [(0, 1), (3, 1), (8, 1)]


@given(presences, st.integers(1, 30), st.integers(2, 40))
def test_tre_starts_are_distinct_frames_with_target(present, n, least):
    segments = parse_protocol(f"tre:starts={n}:min_frames={least}").segments(present, {})
    assert segments[0] == Segment()
    starts = [segment.start for segment in segments[1:]]
    assert starts == sorted(set(starts))
    room = [f for f in np.flatnonzero(present)[1:] if len(present) - f >= least]
    assert set(starts) <= set(room)
    assert len(segments) == min(n, len(room) + 1)
    assert n == 1 or not room or starts[-1] == room[-1]


def test_first_segment_of_tre_is_the_one_pass_run(make_sequence):
    sequence = make_sequence(n=60, absent=(0, 1))
    whole = evaluate_run(Walker, sequence)
    run = evaluate_run(Walker, sequence, protocol="tre:starts=3")
    np.testing.assert_array_equal(run.boxes[:60], whole.boxes)
    np.testing.assert_array_equal(run.details["brightness"][:60], whole.details["brightness"])
    assert [frames[0] for frames in run.segments] == [0, 21, 40]
    means = [float(sequence[int(frame)].mean()) for frame in run.segments[2][1:]]
    np.testing.assert_allclose(run.details["brightness"][-19:], means)


def test_segments_have_independent_random_numbers(make_sequence):
    run = evaluate_run(Walker, make_sequence(), protocol="sre")
    steps = [np.diff(rows, axis=0)[:, :2] for rows in run.boxes.reshape(12, 20, 4)]
    assert len({step.tobytes() for step in steps}) == 12


def test_sre_perturbs_init_box_in_twelve_ways():
    truth = np.array([100.0, 50.0, 40.0, 20.0])  # right side at 140, lower one at 70
    segments = parse_protocol("sre").segments(np.ones(3, bool), {})
    boxes = np.array([segment.perturbed_box(truth) for segment in segments])
    expected = [
        [96, 50, 40, 20],  # left
        [104, 50, 40, 20],  # right
        [100, 48, 40, 20],  # up
        [100, 52, 40, 20],  # down; unlike in another toolkit, the size stays
        [96, 48, 44, 22],  # a corner moves outwards, the opposite one stays
        [100, 48, 44, 22],
        [96, 50, 44, 22],
        [100, 50, 44, 22],
        [104, 52, 32, 16],  # scaled about the centre
        [102, 51, 36, 18],
        [98, 49, 44, 22],
        [96, 48, 48, 24],
    ]
    np.testing.assert_allclose(boxes, expected, atol=1e-12)
    assert {(segment.start, segment.step) for segment in segments} == {(0, 1)}


def test_sre_perturbs_the_selected_region(make_sequence):
    boxes = make_sequence(n=6).boxes
    sequence = make_sequence(n=6, regions={"wide": boxes + [0, 0, 12, 0]})
    run = evaluate_run("static:init=wide", sequence, protocol="sre")
    np.testing.assert_allclose(run.boxes[0], boxes[0] + [-2, 0, 12, 0])
    np.testing.assert_array_equal(run.boxes[:6], np.tile(run.boxes[0], (6, 1)))


@given(presences, st.integers(1, 60))
def test_anchors_have_target_and_run_to_the_further_end(present, spacing):
    n, frames = len(present), np.flatnonzero(present)
    segments = starts_of(f"anchors:spacing={spacing}", present)
    anchors = [frames[0] if start == 0 and step == 1 else start for start, step in segments]
    assert anchors == sorted(set(anchors))
    assert (anchors[0], anchors[-1]) == (frames[0], frames[-1])
    for anchor, (_, step) in zip(anchors, segments, strict=True):
        assert present[anchor]
        assert (step == 1) == (n - 1 - anchor >= anchor)
    if present.all():
        assert np.diff(anchors).max(initial=0) <= 1.5 * spacing + 1


def test_anchors_of_the_data_are_used_unchanged():
    value = np.array([1, 0, np.nan, -1, 1, 0, -1.0])
    present = np.array([True, True, True, True, True, True, False])
    assert starts_of("anchors", present, anchor=value) == [(0, 1), (3, -1), (4, 1)]
    assert starts_of("anchors:spacing=3", present, anchor=0 * value) == [(0, 1), (2, 1), (5, -1)]


def test_backward_segment_shows_frames_in_reverse(make_sequence):
    sequence = make_sequence(n=30)
    run = evaluate_run(Walker, sequence, protocol="anchors:spacing=15")
    assert [frames.tolist() for frames in run.segments] == [
        list(range(30)),
        list(range(14, 30)),
        list(range(29, -1, -1)),
    ]
    means = [float(sequence[frame].mean()) for frame in range(28, -1, -1)]
    np.testing.assert_allclose(run.details["brightness"][-29:], means)
    np.testing.assert_array_equal(run.boxes[-30], sequence.boxes[29])


@pytest.mark.parametrize("preset", ["native", "otb", "got10k"])
def test_score_of_run_is_mean_over_segments(make_sequence, preset):
    sequence = make_sequence(n=40)
    run = evaluate_run(Walker, sequence, protocol="tre:starts=4:min_frames=10")
    key = {"native": "mean_overlap", "otb": "success_auc", "got10k": "ao"}[preset]
    values, end = [], 0
    for frames in run.segments:
        rows, end = slice(end, end + len(frames)), end + len(frames)
        visible = sequence.visibility[frames]
        truth = GroundTruthArrays(sequence.boxes[frames], {}, visible, sequence.image_size)
        alone = metrics.find_metrics(preset).score(
            truth, RunEstimates(run.boxes[rows], run.visible[rows])
        )
        values.append(alone.scores[key])
    weights = [len(frames) - 1 for frames in run.segments]  # in GOT-10k every frame counts once
    expected = np.average(values, weights=weights if preset == "got10k" else None)
    assert score_run(run, sequence, preset).scores[key] == pytest.approx(expected)


def pixels_of(box):
    x, y, width, height = np.round(box).astype(int)
    mask = np.zeros((24, 32), bool)
    mask[max(y, 0) : max(y + height, 0), max(x, 0) : max(x + width, 0)] = True
    return mask


def test_anchor_scores_equal_slow_definition(make_sequence):
    sequence = make_sequence(n=30, image_size=(32, 24))
    run = evaluate_run("static", sequence, protocol="anchors:spacing=29")
    masks = [pixels_of(box) for box in sequence.boxes]
    progress, summed = [], 0.0
    for frames in run.segments:
        pairs = [(masks[frames[0]], masks[frame]) for frame in frames]
        overlaps = [0.0] + [(a & b).sum() / (a | b).sum() for a, b in pairs[1:]]
        low = [value <= 0.1 for value in overlaps]
        failed = [i for i in range(len(low) - 9) if all(low[i : i + 10])]
        progress.append(failed[0] if failed else len(low))
        summed += sum(overlaps[: progress[-1]])
    judged = score_run(run, sequence, "vot-anchor").scores
    assert min(progress) < 30
    assert judged["robustness"] == pytest.approx(sum(progress) / 60)
    assert judged["accuracy"] == pytest.approx(summed / sum(progress))


@pytest.mark.parametrize(
    "protocol",
    [
        "one-pass",
        "tre:starts=3:min_frames=2",
        "anchors:spacing=7",
        "real-time:update_seconds=0",
        "supervised",
    ],
)
def test_protocol_starts_and_scores_at_annotated_frames(make_sequence, protocol):
    sequence = make_sequence(n=24, annotated=np.arange(24) % 4 == 1)
    starts = []

    class Perfect:
        def __init__(self, seed):
            pass

        def init(self, image, box, mask=None):
            assert np.isfinite(box).all()
            starts.append(box[0])

        def update(self, image):
            frame = next(i for i in range(24) if np.array_equal(sequence[i], image))
            return Estimate(straight_line(24)[frame])

    run = evaluate_run(Perfect, sequence, protocol=protocol)
    assert run.status == "finished", run.failure
    assert len(starts) == max(1, len(run.segments))
    preset = {"anchors": "vot-anchor", "supervised": "vot-supervised"}.get(
        protocol.partition(":")[0], "native"
    )
    score = {"vot-anchor": "robustness", "vot-supervised": "accuracy"}.get(preset, "mean_overlap")
    assert score_run(run, sequence, preset).scores[score] == 1.0


def test_segment_may_have_a_single_frame(make_sequence):
    sequence = make_sequence(n=5)
    run = evaluate_run("static", sequence, protocol="anchors:spacing=4")
    for frame in (0, 4):
        frames = (np.array([frame], np.int32),)
        single = replace(run, segments=frames, boxes=sequence.boxes[[frame]])
        assert len(score_run(single, sequence, "vot-anchor").segment_results) == 1
