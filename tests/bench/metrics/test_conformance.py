"""Conformance of all metrics."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.bench.metrics.artificial_runs import SIZE, answer_of, noisy, truth_of, walk
from trackmark.bench import metrics
from trackmark.bench.metrics.interface import RunEstimates

N = 400
TRUTH = walk(N)
MALFORMED = [
    [np.nan] * 4,
    [50, 50, np.inf, 9],
    [-np.inf, 50, 9, 9],
    [50, 50, 0, 9],
    [50, 50, 9, -3],
]
ROOMS = Path(metrics.__file__).parent

every_metrics = pytest.mark.parametrize("name", metrics.names())


def score_run(name, truth, boxes, **further):
    return metrics.find_metrics(name).score(truth_of(truth), answer_of(boxes, **further))


def shares_of(name, judged):
    """Return the scores with the best value 1."""
    columns = metrics.find_metrics(name).metrics
    return {key: value for key, value in judged.scores.items() if columns[key].best_value == 1.0}


def test_all_metrics_have_a_name_and_aliases():
    files = {path.stem for path in (ROOMS / "sets").glob("*.py")} - {"__init__"}
    assert {name.replace("-", "_") for name in metrics.names()} == files
    assert metrics.find_metrics("vot-eao") is metrics.find_metrics("vot-supervised")
    assert metrics.find_metrics("otb100-auc") is metrics.find_metrics("otb")
    assert (metrics.are_metrics("vot"), metrics.are_metrics("votes")) == (True, False)
    with pytest.raises(ValueError, match=r"'lasott'\. Did you mean 'lasot'\?"):
        metrics.find_metrics("lasott")


def sparse_truth(boxes):
    """Return ground truth of every tenth frame."""
    annotated = np.arange(N) % 10 == 0
    return truth_of(np.where(annotated[:, None], boxes, np.nan), annotated=annotated)


@every_metrics
def test_frames_without_annotation_are_not_scored(name):
    boxes = np.where(np.arange(N)[:, None] % 10 == 0, TRUTH, [300.0, 200.0, 5.0, 5.0])
    definitions = metrics.find_metrics(name)
    sparse = definitions.score(sparse_truth(TRUTH), answer_of(boxes))
    everywhere = definitions.score(truth_of(TRUTH), answer_of(TRUTH))
    assert shares_of(name, sparse) == pytest.approx(shares_of(name, everywhere))
    if "vot" not in name:
        for estimates in (noisy(TRUTH), TRUTH + 1.0):
            sparse = definitions.score(sparse_truth(TRUTH), answer_of(estimates)).scores
            tenth = definitions.score(truth_of(TRUTH[::10]), answer_of(estimates[::10])).scores
            tenth |= {"first_loss": sparse["first_loss"]} if "first_loss" in sparse else {}
            assert sparse == pytest.approx(tenth, nan_ok=True)


@pytest.mark.parametrize("name", ["vot-anchor", "vot-supervised"])
def test_expected_overlap_counts_frames_also_without_annotation(name):
    truth = np.tile([40.0, 40.0, 40.0, 40.0], (N, 1))
    definitions, estimates = metrics.find_metrics(name), answer_of(truth + [10.0, 0.0, 0.0, 0.0])
    dense = definitions.score(truth_of(truth), estimates).scores
    sparse = definitions.score(sparse_truth(truth), estimates).scores
    assert sparse["eao"] == pytest.approx(dense["eao"])
    assert sparse["eao_lengths"] > 200
    if name == "vot-supervised":  # burn-in covers ten frames, not ten annotated frames
        assert sparse["accuracy"] == pytest.approx(dense["accuracy"])


@every_metrics
def test_metrics_has_definition_and_meanings(name):
    definitions = metrics.find_metrics(name)
    summary, _, paragraph = metrics.describe(name).partition("\n\n")
    assert summary.endswith(".")
    assert len(paragraph) > 200
    assert definitions.run_kind in ("one-pass", "supervised", "anchors")
    assert all(column.meaning for column in definitions.metrics.values())


@every_metrics
def test_perfect_result_has_the_best_score(name):
    definitions, judged = metrics.find_metrics(name), score_run(name, TRUTH, TRUTH)
    assert list(judged.scores) == list(definitions.metrics)
    assert set(judged.curves) == set(definitions.curves)
    for key, metric in definitions.metrics.items():
        assert metric.best_value is None or judged.scores[key] == pytest.approx(
            metric.best_value
        ), key
    for boxes in noisy(TRUTH), TRUTH + [500, 0, 0, 0]:
        for key, value in shares_of(name, score_run(name, TRUTH, boxes)).items():
            assert value <= judged.scores[key]


@every_metrics
def test_malformed_boxes_are_no_better_than_distant_ones(name):
    distant = noisy(TRUTH)
    distant[20:60] = [5000, 5000, 9, 9]
    expected = score_run(name, TRUTH, distant)
    for bad in MALFORMED:
        malformed = noisy(TRUTH)
        malformed[20:60] = bad
        judged = score_run(name, TRUTH, malformed)
        if name != "lasot":  # LaSOT repeats the box before a malformed one
            assert shares_of(name, judged) == pytest.approx(shares_of(name, expected), abs=1e-12)
        assert not np.isnan([*judged.scores.values()]).any() or name in ("native", "vot-anchor")
    judged = score_run(name, TRUTH, np.full((N, 4), np.nan))
    assert all(np.isfinite(list(judged.scores.values()))) or name == "native"
    assert all(np.isfinite(curve).all() for curve in judged.curves.values())


@every_metrics
def test_shares_stay_in_range_for_extreme_runs(name):
    absent, beyond = TRUTH.copy(), TRUTH.copy()
    absent[100:150] = np.nan
    beyond[:, :2] -= TRUTH[0, :2] + 10  # half of it outside, left and above
    cases = [(absent, np.where(np.isnan(absent), fill, absent)) for fill in (np.nan, 50.0)]
    for truth, boxes in (*cases, (beyond, beyond), (beyond, noisy(beyond))):
        assert all(
            0 <= value <= 1 for value in shares_of(name, score_run(name, truth, boxes)).values()
        )
    seen = np.isfinite(absent).all(axis=1)
    score_run(name, absent, TRUTH, visible=seen, confidence=seen * 0.5)
    metrics.find_metrics(name).score(truth_of(TRUTH), RunEstimates(TRUTH.tolist()))  # boxes alone


@every_metrics
def test_scores_begin_after_the_first_frame_with_a_target(name):
    boxes = noisy(TRUTH)
    scores = score_run(name, TRUTH, boxes).scores
    other = boxes.copy()
    other[0] = np.nan
    assert score_run(name, TRUTH, other).scores == pytest.approx(scores, nan_ok=True)
    late = np.vstack([np.full((7, 4), np.nan), TRUTH])
    states = np.concatenate([np.zeros(7, int), answer_of(boxes).states])
    later = score_run(name, late, np.vstack([np.zeros((7, 4)), boxes]), states=states).scores
    for key in scores.keys() - {"first_loss"}:  # it counts from the first frame
        assert later[key] == pytest.approx(scores[key], nan_ok=True), key


@every_metrics
def test_missing_rows_and_missing_ground_truth_are_refused(name):
    truth = walk(9)
    for target, boxes, message in (
        (truth, truth[:8], r"shape \(8, 4\). Expected: \(9, 4\)"),
        (truth * np.nan, truth, "no frame with a target"),
        (truth, np.empty((0, 4)), r"shape \(0, 4\)"),
        (np.empty((0, 4)), np.empty((0, 4)), "no frame with a target"),
    ):
        with pytest.raises(ValueError, match=message):
            score_run(name, target, boxes)
    for n in 2, 1:
        assert list(score_run(name, walk(n), walk(n)).scores) == list(
            metrics.find_metrics(name).metrics
        )


@every_metrics
def test_judging_changes_no_argument_and_is_repeatable(name):
    truth, boxes = TRUTH.copy(), noisy(TRUTH)
    first, second = (score_run(name, truth, boxes) for _ in range(2))
    np.testing.assert_array_equal(truth, TRUTH)
    np.testing.assert_array_equal(boxes, noisy(TRUTH))
    assert repr(first.scores) == repr(second.scores)


@every_metrics
@settings(max_examples=10, deadline=None)
@given(st.integers(-40, 40), st.integers(-40, 40), st.sampled_from([2, 4]))
def test_scores_are_invariant_to_moves_and_scale(name, dx, dy, factor):
    """Check scores of boxes in whole pixels, far from the border; scores in pixels are excluded."""
    truth = np.round(walk(120) + [60, 60, 0, 0])
    boxes = np.round(noisy(truth))

    def scores(change):
        target = truth_of(change(truth), image_size=None)
        return metrics.find_metrics(name).score(target, answer_of(change(boxes))).scores

    plain = scores(lambda rows: rows)
    moved = scores(lambda rows: rows + [dx, dy, 0, 0])
    assert moved == pytest.approx(plain, abs=1e-9, nan_ok=True)
    grown = scores(lambda rows: rows * factor)
    in_pixels = ("centre_error", "precision") if name != "long-term" else ("centre_error",)
    for key, value in plain.items():
        if not key.startswith(in_pixels):
            assert grown[key] == pytest.approx(value, abs=1e-9, nan_ok=True), key


@every_metrics
def test_equal_runs_have_their_own_mean_and_missing_ones_none(name):
    definitions, run = metrics.find_metrics(name), score_run(name, TRUTH, noisy(TRUTH))
    together = definitions.overall([[run, run], [run, run]])
    assert together.scores == pytest.approx(run.scores, nan_ok=True)
    assert set(together.curves) == set(definitions.curves)
    for runs in [], [[]], [[run], []]:
        scores = definitions.overall(runs).scores
        assert list(scores) == list(definitions.metrics)
        assert all(np.isnan(value) for value in scores.values())


@every_metrics
@pytest.mark.parametrize("kind", ["polygon", "mask"])
def test_outlines_replace_boxes_in_overlaps_of_regions(name, kind):
    truth = np.round(TRUTH)
    corners = [[0, 0], [1, 0], [1, 1], [0, 1]]
    shapes = [box[:2] + box[2:] * corners for box in truth]
    if kind == "mask":
        shapes = np.zeros((N, *SIZE[::-1]), bool)
        for mask, (x, y, width, height) in zip(shapes, truth.astype(int), strict=True):
            mask[y : y + height, x : x + width] = True
    outlined = truth_of(truth, shapes=list(shapes))
    scores = metrics.find_metrics(name).score(outlined, answer_of(truth)).scores
    plain = score_run(name, truth, truth).scores
    for key, value in scores.items():
        if kind == "mask" or "exact" in key:
            assert value == pytest.approx(plain[key], abs=1e-9, nan_ok=True), key
