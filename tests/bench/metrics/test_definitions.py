"""Presets against slow definitions that are written frame by frame."""

import json
from itertools import pairwise
from math import hypot, isfinite, isnan, nan, nextafter, sqrt
from pathlib import Path

import numpy as np
import pytest

from tests.bench.metrics import toolkits
from tests.bench.metrics.artificial_runs import SIZE, answer_of, noisy, states_of, truth_of, walk
from trackmark.bench import metrics
from trackmark.bench.metrics.interface import GroundTruthArrays, RunEstimates
from trackmark.bench.metrics.region_overlap import raster_overlap


def scores(name, truth, boxes, **further):
    return metrics.find_metrics(name).score(truth_of(truth), answer_of(boxes, **further)).scores


def iou(a, b):
    """Return the overlap of two boxes; NaN if one of them has a NaN."""
    if any(isnan(value) for value in (*a, *b)):
        return nan
    if min(b[2:]) <= 0 or not all(map(isfinite, b)):
        return 0.0
    across = max(0.0, min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0]))
    down = max(0.0, min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1]))
    union = a[2] * a[3] + b[2] * b[3] - across * down
    return across * down / union if union else nan


def apart(a, b, sized=False):
    """Return the distance between two box centres, relative to the first box's size if `sized`."""
    units = a[2:] if sized else (1, 1)
    if 0 in units:
        return nan
    return hypot(*((b[k] + b[k + 2] / 2 - a[k] - a[k + 2] / 2) / units[k] for k in (0, 1)))


def is_box(box):
    return all(map(isfinite, box)) and min(box[2:]) > 0


def share(hits):
    hits = list(hits)
    return sum(hits) / len(hits)


def slow_otb(truth, boxes):
    rows = list(zip(truth.tolist(), [truth[0].tolist(), *boxes[1:].tolist()], strict=True))
    overlaps = [iou(t, b) for t, b in rows]
    distances = [apart(t, b) if is_box(b) else nan for t, b in rows]
    return {
        "success_auc": share(share(o > k / 20 + 1e-12 for o in overlaps) for k in range(21)),
        "precision": share(round(d, 4) <= 20 for d in distances),
        "success_rate": share(o > 0.5 for o in overlaps),
        "mean_overlap": sum(o for o in overlaps if not isnan(o)) / len(rows),
        "success_published": share(o >= 0.5 for o in overlaps),
    }


def centres_apart(a, b, sized=False):
    """Return the distance as in LaSOT's code: centres are divided by the size, then subtracted."""
    units = a[2:] if sized else (1, 1)
    if 0 in units:
        return nan
    centres = [[(box[k] + (box[k + 2] - 1) / 2) / units[k] for k in (0, 1)] for box in (a, b)]
    return sqrt(sum((q - p) ** 2 for p, q in zip(*centres, strict=True)))


def slow_lasot(truth, boxes):
    """Compute scores as the MATLAB code does: it counts from 1 and replaces malformed results."""
    truth, boxes = truth + [1, 1, 0, 0], boxes + [1, 1, 0, 0]
    n = len(truth)
    results = [truth[0].tolist(), *boxes[1:].tolist()]
    overlaps, distances, sized = [], [], []
    for i in range(n):
        t = truth[i].tolist()
        r = results[i]
        if (any(map(isnan, r)) or min(r[2:]) <= 0) and not any(map(isnan, t)):
            results[i] = results[i - 1]
        if any(map(isnan, t)):
            continue
        valid = all(value > 0 for value in t)
        overlaps.append(iou(t, results[i]) if valid else -1)
        usable = is_box(results[i])
        distances.append((centres_apart(t, results[i]) if usable else nan) if valid else -1)
        sized.append((centres_apart(t, results[i], True) if usable else nan) if valid else -1)
    return {
        "success_auc": sum(sum(o > k / 20 + 1e-12 for o in overlaps) / n for k in range(21)) / 21,
        "precision": sum(d <= 20 for d in distances) / n,
        "normalised_precision": sum(d <= 0.20 for d in sized) / n,
    }


def slow_trackingnet(truth, boxes):
    formed = [True, *map(is_box, boxes[1:].tolist())]
    rows = [
        ([whole(v) for v in t], [whole(v) for v in b])
        for t, b in zip(truth.tolist(), boxes.tolist(), strict=True)
    ]
    rows[0] = rows[0][0], rows[0][0]

    def area(values, hit, most):
        steps = [share(hit(v, k / 20 * most) for v in values) for k in range(21)]
        return sum((a + b) / 40 for a, b in pairwise(steps))

    far = [apart(t, b) if good else nan for good, (t, b) in zip(formed, rows, strict=True)]
    sized = [apart(t, b, True) if good else nan for good, (t, b) in zip(formed, rows, strict=True)]
    overlaps = [iou(t, b) for t, b in rows]
    for frame, (t, _) in enumerate(rows):
        if isnan(overlaps[frame]) and not any(map(isnan, t)):
            overlaps[frame] = 0.0  # malformed
    return {
        "success_auc": area(overlaps, lambda o, k: o >= k - 1e-12, 1),
        "precision_auc": area(far, lambda d, k: d <= k, 50),
        "normalised_precision_auc": area(sized, lambda d, k: d <= k + 1e-12, 0.5),
    }


def whole(value):
    return float(round(value)) if isfinite(value) else value


@pytest.mark.parametrize("name", ["otb", "lasot", "trackingnet"])
def test_preset_equals_slow_definition(name):
    slow = {"otb": slow_otb, "lasot": slow_lasot, "trackingnet": slow_trackingnet}[name]
    random = np.random.default_rng(1)
    for n in np.tile(np.arange(1, 13), 12):
        truth = np.hstack([random.uniform(-60, 120, (n, 2)), random.uniform(0.5, 60, (n, 2))])
        boxes = truth + random.normal(0, 8, (n, 4)) * (random.random((n, 1)) < 0.7)
        bad = np.flatnonzero(random.random(n) < 0.2)
        boxes[bad, random.integers(0, 4, len(bad))] = random.choice([nan, np.inf, -3, 0], len(bad))
        truth[1:][random.random(n - 1) < 0.2] = nan
        assert scores(name, truth, boxes) == pytest.approx(slow(truth, boxes), abs=1e-12)


@pytest.mark.parametrize(("lost", "success"), [(0, 1.0), (4, 0.5125), (7, 0.146875)])
def test_trackingnet_counts_overlaps_at_their_threshold(lost, success):
    """Check the shares of 8 frames: a lost frame counts at threshold 0, as in the devkit."""
    truth = np.array([[10 + i, 12, 20, 16] for i in range(8)], float)
    boxes = truth.copy()
    boxes[8 - lost :] = [120, 70, 20, 16]
    assert scores("trackingnet", truth, boxes)["success_auc"] == pytest.approx(success)


@pytest.mark.parametrize(
    ("target", "estimate", "hit"),
    [  # in numbers from 1, both 0.2 widths apart
        ([31, 7, 61, 13], [43.2, 7, 61, 13], True),
        ([202, 243, 46, 37], [211.2, 243, 46, 37], False),
    ],
)
def test_lasot_divides_centres_before_it_subtracts(target, estimate, hit):
    truth, boxes = (np.array([target, box], float) - [1, 1, 0, 0] for box in (target, estimate))
    ours = scores("lasot", truth, boxes)
    assert ours["normalised_precision"] == (1.0 if hit else 0.5)
    assert ours == pytest.approx(slow_lasot(truth, boxes), abs=1e-12)


@pytest.mark.parametrize(("offset", "hit"), [(nextafter(20.00005, 0), True), (20.00005, False)])
def test_otb_rounds_centre_errors_to_four_decimals(offset, hit):
    truth = np.array([[-4, 50, 8, 40]] * 2, float)  # the sums below are exact
    boxes = truth + [[0, 0, 0, 0], [offset, 0, 0, 0]]
    ours = scores("otb", truth, boxes)
    assert ours["precision"] == (1.0 if hit else 0.5)
    assert ours == pytest.approx(slow_otb(truth, boxes), abs=1e-12)


@pytest.mark.parametrize("column", [0, 3])
def test_lasot_counts_infinite_boxes_as_misses(column):
    truth = walk(50)
    boxes = truth.copy()
    boxes[20:30, column] = np.inf
    ours = scores("lasot", truth, boxes)
    assert ours == pytest.approx(slow_lasot(truth, boxes), abs=1e-12)
    assert ours["precision"] == ours["normalised_precision"] == 0.8


def test_lasot_scores_a_target_that_touches_the_first_pixel():
    """Check that a box at -1 is a miss for success and a hit for precision, as in the toolkit."""
    truth = walk(50)
    boxes = noisy(truth)
    truth[10:20, 0] = boxes[10:20, 0] = -1
    lasot, otb = scores("lasot", truth, boxes), scores("otb", truth, boxes)
    assert lasot == pytest.approx(slow_lasot(truth, boxes), abs=1e-12)
    assert otb == pytest.approx(slow_otb(truth, boxes), abs=1e-12)
    assert lasot["success_auc"] < 0.91 * otb["success_auc"]
    assert lasot["precision"] == 1


def test_success_rates_count_overlaps_above_their_threshold():
    truth = np.tile([0.0, 0, 8, 8], (5, 1))
    boxes = truth.copy()
    boxes[:, 2] = [8, 4, 6, 6.5, 3]  # overlaps 1, 0.5, 0.75, 0.8125 and 0.375
    otb, got10k = scores("otb", truth, boxes), scores("got10k", truth, boxes)
    assert (otb["success_rate"], otb["success_published"]) == (0.6, 0.8)
    assert (got10k["sr50"], got10k["sr75"]) == (0.5, 0.25)  # the first frame does not count


def test_lasot_scores_malformed_ground_truth_as_its_toolkit():
    """Check rows without size that are not flagged as absent, as in LaSOT's tiger-6."""
    raw = walk(8)
    raw[4, 3], raw[6] = -1, [0, 0, 0, 0]
    malformed = np.isin(np.arange(8), (4, 6))
    truth = GroundTruthArrays(np.where(malformed[:, None], nan, raw), malformed=malformed)
    boxes = noisy(walk(8))
    ours = metrics.find_metrics("lasot").score(truth, RunEstimates(boxes)).scores
    assert ours == pytest.approx(slow_lasot(raw, boxes), abs=1e-12)
    perfect = metrics.find_metrics("lasot").score(truth, RunEstimates(walk(8))).scores
    assert perfect["precision"] == perfect["normalised_precision"] == 1.0
    assert perfect["success_auc"] == pytest.approx(6 / 8 * 20 / 21)


@pytest.mark.parametrize(("visible", "ao"), [(1.0, 2 / 3), (nan, 2 / 3), (0.0, 1.0)])
def test_got10k_scores_malformed_ground_truth_as_a_miss(visible, ao):
    boxes = np.tile([5.0, 6, 8, 9], (4, 1))
    malformed = np.arange(4) == 2
    truth = GroundTruthArrays(
        np.where(malformed[:, None], nan, boxes),
        visibility=np.where(malformed, visible, 1.0),
        malformed=malformed,
    )
    assert metrics.find_metrics("got10k").score(truth, RunEstimates(boxes)).scores["ao"] == ao


# Deliberate differences from the toolkits (docs/metrics.md).


def test_malformed_boxes_are_misses_of_which_got10k_counts_some():
    theirs = json.loads((Path(__file__).parent / "recorded_got10k.json").read_text())["malformed"]
    truth = np.array([toolkits.TARGET] * 2, float)
    for box in toolkits.MALFORMED:
        boxes = np.array([toolkits.TARGET, box], float)
        assert scores("otb", truth, boxes)["precision"] == 0.5
        assert scores("otb", truth, boxes)["mean_overlap"] == 0.5
        assert scores("got10k", truth, boxes)["ao"] == 0.0
        assert scores("trackingnet", truth, boxes)["precision_auc"] == pytest.approx(0.5)
    assert [distance <= 20 for distance in theirs["distance"]] == [True, False, True, False]
    overlaps = np.array(theirs["overlap cut"])
    assert np.isnan(overlaps).tolist() == [False, True, False, False]
    assert (overlaps > 0).tolist() == [False, False, False, True]


@pytest.mark.parametrize("cover", [0, 1, 8])
def test_got10k_counts_frames_of_every_cover_level_except_0(cover):
    boxes = np.tile([5.0, 6, 8, 9], (3, 1))
    # Visible shares as the reader of GOT-10k returns them: only level 0 has no visible part.
    visible = (0.0, 0.075, 0.225, 0.375, 0.525, 0.675, 0.825, 0.95, 1.0)[cover]
    visibility = np.array([1, visible, 1])
    estimates = boxes + [[0, 0, 0, 0], [100, 0, 0, 0], [0, 0, 0, 0]]
    judged = metrics.find_metrics("got10k").score(
        GroundTruthArrays(boxes, visibility=visibility), RunEstimates(estimates)
    )
    assert judged.scores["ao"] == (0.5 if cover else 1.0)


@pytest.mark.parametrize(
    ("target", "estimate", "overlap"),
    [
        ([300, 10, 40, 20], [310, 10, 40, 20], 0.5),  # right, cut to widths 20 and 10
        ([10, 220, 20, 40], [10, 230, 20, 40], 0.5),  # below
        ([-10, 5, 20, 20], [0, 5, 20, 20], 1.0),  # left: moved in, not cut
        ([5, -10, 20, 20], [5, 0, 20, 20], 1.0),
    ],
)
def test_got10k_moves_boxes_into_the_image(target, estimate, overlap):
    first = [100, 100, 20, 20]
    truth, boxes = np.array([first, target], float), np.array([first, estimate], float)
    assert scores("got10k", truth, boxes)["ao"] == pytest.approx(overlap)


def test_sequence_without_hits_counts():
    truth = walk(50)
    preset = metrics.find_metrics("lasot")
    runs = [[preset.score(truth_of(truth), answer_of(boxes))] for boxes in (truth, truth + 900)]
    # The first frame, overwritten by the ground truth, is the only hit of the second.
    assert preset.overall(runs).curves["success"][0, 1] == pytest.approx((1 + 1 / 50) / 2)


def test_regions_of_one_column_overlap_by_shared_pixels():
    theirs = json.loads((Path(__file__).parent / "recorded_vot.json").read_text())["thin"]
    a, b = np.array(toolkits.THIN, float).transpose(1, 0, 2)
    np.testing.assert_array_equal(raster_overlap(a, b, SIZE), [0, 0, 1])
    assert theirs == [1, 1, 0]


def test_expected_average_overlap_is_over_the_lengths_that_occur():
    for name, shortest in (("vot-anchor", 115), ("vot-supervised", 100)):
        judged = scores(name, walk(200), walk(200))
        assert (judged["eao"], judged["eao_lengths"]) == (1, 200 - shortest)
        short = scores(name, walk(90), walk(90))
        assert isnan(short["eao"])
        assert short["eao_lengths"] == 0


@pytest.mark.parametrize(("lost", "tracked"), [(9, 40), (10, 20)])
def test_vot_anchor_fails_after_ten_frames_without_overlap(lost, tracked):
    truth = walk(40)
    boxes = truth.copy()
    boxes[20 : 20 + lost] += 900
    judged = scores("vot-anchor", truth, boxes)
    assert judged["robustness"] == tracked / 40
    assert judged["accuracy"] == pytest.approx((19 if tracked == 20 else 39 - lost) / tracked)


def test_first_frame_counts_in_vot_anchor_and_long_term():
    truth = walk(100)
    assert scores("vot-anchor", truth, truth)["accuracy"] == pytest.approx(0.99)
    sure = scores("long-term", truth, truth, confidence=np.full(100, 0.5))
    assert (sure["precision"], sure["recall"]) == (1, pytest.approx(0.99))
    truth[40:80] = nan
    seen = np.isfinite(truth[:, 0])
    oracle = scores("long-term", truth, truth, visible=seen, confidence=seen * 1.0)
    assert oracle["recall"] == pytest.approx(59 / 60)  # never above 1
    everywhere = scores("long-term", truth, np.where(seen[:, None], truth, 50.0))
    assert everywhere["precision"] == pytest.approx(59 / 100)


def test_scores_of_one_frame_are_undefined_or_the_toolkits():
    """Toolkits that count the first frame give it their scores; others have no frame to score."""
    truth = walk(1)
    scored = {name: scores(name, truth, truth) for name in metrics.names()}
    for name in ("got10k", "long-term"):
        assert all(map(isnan, scored[name].values())), name
    shares = ("mean_overlap", "success_rate", "inside_rate", "centre_error")
    assert all(isnan(scored["native"][score]) for score in shares)
    assert scored["otb"]["precision"] == scored["lasot"]["precision"] == 1
    # Toolkit: 0 / 1 and, by a special case, 0.
    assert scored["vot-anchor"]["accuracy"] == scored["vot-supervised"]["accuracy"] == 0


def test_run_of_one_frame_does_not_lower_long_term_means():
    preset, truth = metrics.find_metrics("long-term"), walk(50)
    runs = [[preset.score(truth_of(part), answer_of(part))] for part in (truth, truth[:1])]
    assert preset.overall(runs).scores == preset.overall(runs[:1]).scores
    assert all(map(isnan, preset.overall(runs[1:]).scores.values()))


def test_accuracy_without_tracked_frames_is_that_of_the_toolkit():
    truth = walk(30)
    anchor = metrics.find_metrics("vot-anchor")
    lost = anchor.score(truth_of(truth), answer_of(truth + 900))
    assert lost.scores["accuracy"] == 0  # of one sequence
    assert isnan(anchor.overall([[lost], [lost]]).scores["accuracy"])  # the toolkit divides by 0
    supervised = metrics.find_metrics("vot-supervised")
    states = states_of(30, [5, 15, 25])
    burned = supervised.score(truth_of(truth), RunEstimates(truth, states=states))
    assert burned.scores["accuracy"] == 0


def test_first_confidence_does_not_count_in_long_term():
    truth = walk(100)
    boxes, confidence = noisy(truth), np.linspace(0.1, 0.9, 100)

    def judged(frame, value):
        changed = np.where(np.arange(100) == frame, value, confidence)
        return scores("long-term", truth, boxes, confidence=changed)

    assert all(judged(0, value) == judged(0, 0.0) for value in (0.5, 1.0, nan))
    assert judged(1, 1.0) != judged(0, 0.0)


def test_one_pass_run_without_failure_equals_a_supervised_run():
    truth, preset = walk(150), metrics.find_metrics("vot-supervised")
    boxes = noisy(truth)

    def judged(states):
        return preset.score(truth_of(truth), RunEstimates(boxes, states=states)).scores

    assert judged(None) == judged(states_of(150))
    boxes[70] += 900
    with pytest.raises(ValueError, match="the tracker failed and was not restarted"):
        judged(None)
    failed = judged(states_of(150, [70]))
    assert failed["failures"] == 1
    assert failed["robustness"] == pytest.approx(np.exp(-30 / 150))
    for states in states_of(149), np.full(150, 3):
        with pytest.raises(ValueError, match=r"Expected: .*, with INITIALISED first"):
            judged(states)
