"""What every metrics preset must do, whatever its definitions: asked of all that are found."""

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.bench.metrics.made import SIZE, answer_of, noisy, truth_of, walk
from trackmark.bench import metrics
from trackmark.bench.metrics.preset import Answer
from trackmark.bench.store.index import SCORED_BY

N = 400
MALFORMED = [
    [np.nan] * 4,
    [50, 50, np.inf, 9],
    [-np.inf, 50, 9, 9],
    [50, 50, 0, 9],
    [50, 50, 9, -3],
]
ROOMS = Path(metrics.__file__).parent

every_preset = pytest.mark.parametrize("name", metrics.names())


def judge(name, truth, answer):
    return metrics.preset(name).judge(truth, answer)


def best(judged, preset):
    """Scores of which more is better."""
    return [value for key, value in judged.scores.items() if preset.columns[key].perfect == 1.0]


def test_a_preset_is_found_by_its_file_and_its_further_names():
    files = {path.stem for path in (ROOMS / "presets").glob("*.py")} - {"__init__"}
    assert {name.replace("-", "_") for name in metrics.names()} == files
    assert metrics.preset("vot-eao") is metrics.preset("vot-supervised")
    assert metrics.preset("otb100-auc") is metrics.preset("otb")
    with pytest.raises(ValueError, match=r"'lasott'\. Did you mean 'lasot'\? Known: got10k, "):
        metrics.preset("lasott")


def test_an_index_is_made_anew_when_what_defines_its_scores_changes():
    imported = set()
    for module in SCORED_BY:
        imported |= set(
            re.findall(
                r"from trackmark\.bench\.metrics\.(\w+)", (ROOMS / f"{module}.py").read_text()
            )
        )
    assert imported <= set(SCORED_BY)


@every_preset
def test_a_preset_says_what_it_is(name):
    preset = metrics.preset(name)
    summary, _, paragraph = metrics.definition(name).partition("\n\n")
    assert summary.endswith(".")
    assert len(paragraph) > 200
    assert preset.protocol in ("one pass", "supervised", "anchors")
    assert all(column.meaning for column in preset.columns.values())


@every_preset
def test_truth_as_result_gives_the_best_score_that_the_preset_has(name):
    preset, truth = metrics.preset(name), walk(N)
    judged = judge(name, truth_of(truth), answer_of(truth))
    assert list(judged.scores) == list(preset.columns)
    assert set(judged.curves) == set(preset.curves)
    for key, column in preset.columns.items():
        if column.perfect is not None:
            assert judged.scores[key] == pytest.approx(column.perfect, abs=1e-12), key
    for other in noisy(truth), truth + [500, 0, 0, 0]:
        for worse, good in zip(
            best(judge(name, truth_of(truth), answer_of(other)), preset),
            best(judged, preset),
            strict=True,
        ):
            assert worse <= good


@every_preset
@pytest.mark.parametrize("bad", MALFORMED)
def test_a_malformed_box_is_never_better_than_one_far_off(name, bad):
    truth = walk(N)
    far, malformed = noisy(truth), noisy(truth)
    far[20:60] = [5000, 5000, 9, 9]
    malformed[20:60] = bad
    scores = judge(name, truth_of(truth), answer_of(malformed)).scores
    expected = judge(name, truth_of(truth), answer_of(far)).scores
    repeats = name == "lasot"  # the box before stands in for a malformed one
    for key, column in metrics.preset(name).columns.items():
        if column.perfect == 1.0 and not repeats:
            assert scores[key] == pytest.approx(expected[key], abs=1e-12), key
        assert not np.isnan(scores[key]) or np.isnan(expected[key])


@every_preset
def test_only_malformed_boxes_score_nothing_and_no_numbers_are_lost(name):
    truth = walk(N)
    judged = judge(name, truth_of(truth), answer_of(np.full((N, 4), np.nan)))
    assert all(np.isfinite(list(judged.scores.values()))) or name == "native"
    assert all(np.isfinite(curve).all() for curve in judged.curves.values())


@every_preset
def test_absent_frames_are_no_error_whatever_stands_there(name):
    truth = walk(N)
    truth[100:150] = np.nan
    scores = [
        judge(name, truth_of(truth), answer_of(np.where(np.isnan(truth), fill, truth))).scores
        for fill in (np.nan, 50.0)
    ]
    for key, column in metrics.preset(name).columns.items():
        if column.perfect == 1.0:
            assert all(0 <= of[key] <= 1 for of in scores), key
    seen = np.isfinite(truth).all(axis=1)
    judge(name, truth_of(truth), answer_of(truth, visible=seen, confidence=seen * 0.5))


@every_preset
def test_a_sequence_begins_where_the_target_appears(name):
    truth = walk(N)
    boxes = noisy(truth)
    late = np.vstack([np.full((7, 4), np.nan), truth])
    shifted = answer_of(
        np.vstack([np.zeros((7, 4)), boxes]),
        states=np.concatenate([np.zeros(7, int), answer_of(boxes).states]),
    )
    early, later = (
        judge(name, truth_of(truth), answer_of(boxes)),
        judge(name, truth_of(late), shifted),
    )
    for key in metrics.preset(name).columns:
        if key != "first_loss":  # it counts frames from the first
            assert early.scores[key] == pytest.approx(later.scores[key], nan_ok=True), key


@every_preset
def test_what_stands_in_the_given_frame_counts_for_nothing(name):
    truth = walk(N)
    boxes = noisy(truth)
    other = boxes.copy()
    other[0] = np.nan
    one, two = (judge(name, truth_of(truth), answer_of(of)).scores for of in (boxes, other))
    assert one == pytest.approx(two, nan_ok=True)


@every_preset
def test_boxes_at_and_beyond_the_border_are_scored(name):
    truth = walk(N)
    truth[:, :2] -= truth[0, :2] + 10  # half of it outside, left and above
    for boxes in truth, noisy(truth):
        judged = judge(name, truth_of(truth), answer_of(boxes))
        for key, column in metrics.preset(name).columns.items():
            if column.perfect == 1.0:
                assert 0 <= judged.scores[key] <= 1, key


@every_preset
def test_rows_that_lack_and_missing_truth_are_refused(name):
    truth = walk(9)
    with pytest.raises(ValueError, match=r"shape \(8, 4\), the truth \(9, 4\)"):
        judge(name, truth_of(truth), answer_of(truth[:8]))
    with pytest.raises(ValueError, match="no truth"):
        judge(name, truth_of(truth * np.nan), answer_of(truth))
    with pytest.raises(ValueError, match=r"shape \(0, 4\)"):
        judge(name, truth_of(truth), answer_of(np.empty((0, 4))))


@every_preset
def test_two_frames_and_one_are_a_sequence(name):
    for n in 2, 1:
        judged = judge(name, truth_of(walk(n)), answer_of(walk(n)))
        assert list(judged.scores) == list(metrics.preset(name).columns)


@every_preset
def test_judging_changes_no_argument_and_repeats_to_the_bit(name):
    truth, boxes = walk(N), noisy(walk(N))
    before = truth.copy(), boxes.copy()
    first, second = (judge(name, truth_of(truth), answer_of(boxes)) for _ in range(2))
    np.testing.assert_array_equal(truth, before[0])
    np.testing.assert_array_equal(boxes, before[1])
    assert repr(first.scores) == repr(second.scores)


@every_preset
@settings(max_examples=10, deadline=None)
@given(st.integers(-40, 40), st.integers(-40, 40), st.sampled_from([2, 4]))
def test_scores_move_and_grow_with_the_image(name, dx, dy, factor):
    """Whole pixels, which rasters keep, and nothing cut off; but for what counts in pixels."""
    truth = np.round(walk(120) + [60, 60, 0, 0])
    boxes = np.round(noisy(truth))
    move = np.array([dx, dy, 0, 0])

    def scores(change):
        return judge(
            name, truth_of(change(truth), image_size=None), answer_of(change(boxes))
        ).scores

    plain = scores(lambda rows: rows)
    assert scores(lambda rows: rows + move) == pytest.approx(plain, abs=1e-9, nan_ok=True)
    grown = scores(lambda rows: rows * factor)
    in_pixels = ("centre_error", "precision") if name != "long-term" else ("centre_error",)
    for key, value in plain.items():
        if not key.startswith(in_pixels):
            assert grown[key] == pytest.approx(value, abs=1e-9, nan_ok=True), key


@every_preset
def test_repetitions_and_sequences_of_the_same_run_change_no_mean(name):
    preset, truth = metrics.preset(name), walk(N)
    run = judge(name, truth_of(truth), answer_of(noisy(truth)))
    together = preset.overall([[run, run], [run, run]])
    for key, value in run.scores.items():
        assert together.scores[key] == pytest.approx(value, nan_ok=True), key
    assert set(together.curves) == set(preset.curves)


@every_preset
def test_what_is_missing_is_never_averaged_over(name):
    preset, truth = metrics.preset(name), walk(N)
    run = judge(name, truth_of(truth), answer_of(truth))
    for runs in [], [[]], [[run], []]:
        scores = preset.overall(runs).scores
        assert list(scores) == list(preset.columns)
        assert all(np.isnan(value) for value in scores.values())


@every_preset
@pytest.mark.parametrize("kind", ["polygon", "mask"])
def test_outlines_are_taken_where_overlaps_are_of_regions(name, kind):
    truth = np.round(walk(N))
    corners = [[0, 0], [1, 0], [1, 1], [0, 1]]
    polygons = [box[:2] + box[2:] * corners for box in truth]
    masks = [mask_of(box) for box in truth.astype(int)]
    outlined = truth_of(truth, shapes=polygons if kind == "polygon" else masks)
    scores = judge(name, outlined, answer_of(truth)).scores
    plain = judge(name, truth_of(truth), answer_of(truth)).scores
    for key, value in scores.items():
        if kind == "mask" or "exact" in key:
            assert value == pytest.approx(plain[key], abs=1e-9, nan_ok=True), key


def mask_of(box):
    mask = np.zeros(SIZE[::-1], bool)
    x, y, width, height = box
    mask[y : y + height, x : x + width] = True
    return mask


@every_preset
def test_an_answer_may_be_boxes_alone(name):
    truth = walk(N)
    judge(name, truth_of(truth), Answer(truth.tolist()))
