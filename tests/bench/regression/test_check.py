"""Checks against a baseline: labels of changes, printed lines, JSON and JUnit test cases."""

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from trackmark.bench.experiments.experiment import SequenceSpec
from trackmark.bench.regression.baseline import Baseline, BaselineScore
from trackmark.bench.regression.check import (
    changed_sequences,
    check,
    check_json,
    check_junit,
    table,
)
from trackmark.bench.statistics.intervals import mean_interval
from trackmark.reports.renderers import to_markdown, to_text

N_REPETITIONS = 20
ENVIRONMENT = {"platform": "Linux x86_64", "numpy": "2.1"}
GENERATOR = np.random.default_rng(0)
NOISE = GENERATOR.normal(0, 0.05, (3, N_REPETITIONS)).round(5)


def entry(overlap, version="0", same=(), failures=()):
    """Return an entry whose boxes depend on the version, except for the repetitions in `same`."""
    boxes = [
        f"{repetition:06x}{'00' if repetition in same else version:>02}"
        for repetition in range(len(overlap))
    ]
    for repetition in failures:
        boxes[repetition] = ""
    reasons = dict.fromkeys(failures, "IndexError: index 64 is out of bounds")
    numbers = tuple(float(value) for value in np.round(overlap, 5))
    return BaselineScore(SequenceSpec("s"), "9f31c2aa", numbers, tuple(boxes), reasons)


def baseline(entries):
    texts = {label: label for label in entries}
    return Baseline(entries, texts, N_REPETITIONS, 0.05, ENVIRONMENT)


def labels(result):
    return {(row.tracker, row.sequence): row.change.label for row in result.changes}


BEFORE = {
    "mine": {f"s{i}": entry(0.6 + NOISE[i]) for i in range(3)},
    "static": {"s0": entry([0.4]), "s1": entry([0.5])},
}


def test_equal_digests_are_identical_with_any_libraries():
    result = check(baseline(BEFORE), BEFORE, {**ENVIRONMENT, "numpy": "2.2"})
    assert set(labels(result).values()) == {"identical"}
    assert result.verdict == "pass"
    assert table(result).notes == ["identical  mine  3 sequences; static  2 sequences"]


def test_drop_in_some_repetitions_is_found_in_the_mean():
    """Six of twenty runs lose .3 on one sequence; the other runs keep their boxes."""
    lost = np.where(np.arange(N_REPETITIONS) < 6, 0.3, 0.0)
    changed = entry(0.6 + NOISE[0] - lost, "1", same=range(6, N_REPETITIONS))
    now = {**BEFORE, "mine": {**BEFORE["mine"], "s0": changed}}
    result = check(baseline(BEFORE), now, ENVIRONMENT)
    assert labels(result)["mine", "s0"] == "worse"
    assert labels(result)["mine", "mean of 3 sequences"] == "worse"
    assert labels(result)["mine", "s1"] == "identical"
    text = to_text(table(result))
    assert "-0.090 [-" in text
    assert "14 of 20 runs" in text
    assert "REGRESSION: mine is worse on s0 and in the mean." in text
    assert "identical  mine  2 sequences; static  2 sequences" in text
    assert check_json(result)["verdict"] == "regression"


def test_family_counts_once_in_the_mean():
    shift = 0.1 + NOISE[1]
    old = BEFORE["mine"]
    changed = {name: entry(np.array(old[name].overlap) - shift, "1") for name in ("s0", "s1")}
    now = {**BEFORE, "mine": {**old, **changed}}
    families = {"s0": "video", "s1": "video", "s2": "other"}
    (mean,) = check(baseline(BEFORE), now, ENVIRONMENT, families=families).means
    assert mean.sequence == "mean of 2 families"
    assert mean.change.interval == pytest.approx(mean_interval(-shift / 2), abs=1e-5)
    assert mean.change.mean == pytest.approx(mean.now - mean.before, abs=1e-5)
    by_sequence = {name: np.mean(old[name].overlap) for name in families}
    expected = ((by_sequence["s0"] + by_sequence["s1"]) / 2 + by_sequence["s2"]) / 2
    assert mean.before == pytest.approx(expected)


def test_intervals_are_corrected_for_changed_random_trackers():
    """Three changed sequences of two random trackers: levels 1 - .05/3, and 1 - .05/2 for means."""
    before = {**BEFORE, "other": BEFORE["mine"]}
    shifts = {("mine", "s0"): NOISE[1], ("mine", "s1"): NOISE[2], ("other", "s2"): NOISE[0]}
    now = {tracker: dict(row) for tracker, row in before.items()}
    now["static"]["s0"] = entry([0.35], "1")
    for (tracker, name), shift in shifts.items():
        now[tracker][name] = entry(np.array(before[tracker][name].overlap) + shift, "1")
    result = check(baseline(before), now, ENVIRONMENT)
    rows = {(row["tracker"], row["sequence"]): row for row in check_json(result)["scores"]}
    rows |= {(row["tracker"], "mean"): row for row in check_json(result)["means"]}
    assert rows["other", "s0"]["decision"] == "identical"
    expected = {key: mean_interval(shift, 1 - 0.05 / 3) for key, shift in shifts.items()}
    for tracker in ("mine", "other"):  # a sequence with equal boxes counts as 0
        by_repetition = sum(shift for key, shift in shifts.items() if key[0] == tracker) / 3
        expected[tracker, "mean"] = mean_interval(by_repetition, 1 - 0.05 / 2)
    text = to_text(table(result))
    for key, interval in expected.items():
        assert (rows[key]["low"], rows[key]["high"]) == pytest.approx(interval, abs=1e-9), key
        assert "[{:+.3f}, {:+.3f}]".format(*interval) in text


@pytest.mark.parametrize(
    ("score", "numpy", "label"),
    [
        (0.389, "2.1", "worse"),
        (0.39, "2.1", "not worse"),
        (0.411, "2.1", "better"),
        (0.36, "2.2", "not worse"),
        (0.349, "2.2", "worse"),
    ],
)
def test_deterministic_margin_is_larger_with_other_libraries(score, numpy, label):
    now = {**BEFORE, "static": {**BEFORE["static"], "s0": entry([score], "1")}}
    result = check(baseline(BEFORE), now, {**ENVIRONMENT, "numpy": numpy})
    assert labels(result)["static", "s0"] == label
    notes = "\n".join(table(result).notes)
    assert ("note: numpy 2.1 -> 2.2 since the baseline" in notes) == (numpy == "2.2")


def test_unrepeatable_deterministic_score_is_inconclusive():
    now = {**BEFORE, "static": {**BEFORE["static"], "s0": entry([0.1], "1")}}
    assert changed_sequences(BEFORE, now) == {"static": ["s0"]}
    result = check(baseline(BEFORE), now, ENVIRONMENT, [("static", "s0")])
    assert result.verdict == "inconclusive"
    assert "inconclusive: static, s0: not repeatable." in table(result).notes


def test_tracker_with_new_randomness_uses_all_repetitions():
    """The single run of the baseline counts for all repetitions, because its boxes were equal."""
    now = {**BEFORE, "static": {"s0": entry(0.4 + NOISE[0], "1"), "s1": entry(0.5 + NOISE[1], "1")}}
    result = check(baseline(BEFORE), now, ENVIRONMENT)
    row = next(row for row in result.sequences if (row.tracker, row.sequence) == ("static", "s0"))
    assert row.change.label == "not worse"
    assert row.change.mean == pytest.approx(NOISE[0].mean())
    assert (len(row.old), len(row.new)) == (1, N_REPETITIONS)
    assert changed_sequences(BEFORE, now) == {}


def test_failed_run_is_a_regression_with_any_score():
    scores = 0.6 + NOISE[0]
    scores[17] = 0.0
    changed = entry(scores, same=set(range(N_REPETITIONS)) - {17}, failures=[17])
    now = {**BEFORE, "mine": {**BEFORE["mine"], "s0": changed}}
    result = check(baseline(BEFORE), now, ENVIRONMENT)
    assert labels(result)["mine", "s0"] != "worse"
    assert result.verdict == "regression"
    assert (
        "REGRESSION: mine failed in 1 of 60 runs; the baseline has no failures. s0, repetition 17: "
        "IndexError: index 64 is out of bounds"
    ) in table(result).notes
    suite = ElementTree.fromstring(check_junit(result))
    failures = [case.get("name") for case in suite if case.find("failure") is not None]
    assert failures == ["s0"]
    assert "repetition 17 failed: IndexError" in check_junit(result)
    (row,) = (row for row in check_json(result)["scores"] if row["failed"])
    assert row["failure"].startswith("IndexError")


def test_inconclusive_change_is_explained_and_skipped_in_junit():
    noisy = {"mine": {"s0": entry(np.linspace(0.4, 0.7, N_REPETITIONS))}}
    now = {"mine": {"s0": entry(np.linspace(0.7, 0.4, N_REPETITIONS), "1")}}
    result = check(baseline(noisy), now, ENVIRONMENT)
    assert result.verdict == "inconclusive"
    fewest, most = check_json(result)["scores"][0]["repetitions_needed"]
    assert N_REPETITIONS < fewest < most
    notes = [note for note in table(result).notes if note.startswith("inconclusive: mine, s0: ")]
    assert re.search(r": \d+ to \d+ repetitions needed", notes[0])
    suite = ElementTree.fromstring(check_junit(result))
    assert (suite.get("failures"), suite.get("skipped")) == ("0", "2")


def test_rows_start_with_the_worst_in_every_format():
    now = {
        "mine": {
            **BEFORE["mine"],
            "s1": entry(0.3 + NOISE[1], "1"),
            "s2": entry(0.9 + NOISE[2], "1"),
        },
        "static": {**BEFORE["static"], "s0": entry([0.399], "1")},
    }
    result = check(baseline(BEFORE), now, ENVIRONMENT)
    states = [row["decision"] for row in check_json(result)["scores"]]
    assert states == ["worse", "better", "not worse", "identical", "identical"]
    assert len(table(result).rows) == 4
    assert len(table(result, with_identical=True).rows) == 6
    assert "| worse | mine | s1 |" in to_markdown(table(result))
    suite = ElementTree.fromstring(check_junit(result))
    assert (suite.get("tests"), suite.get("failures")) == ("6", "1")


def test_first_repetitions_of_a_baseline_are_compared():
    before = baseline(BEFORE).with_repetitions(6)
    assert {len(c.overlap) for c in before.scores["mine"].values()} == {6}
    assert len(before.scores["static"]["s0"].box_digests) == 1
    now = {**before.scores, "mine": {**before.scores["mine"], "s0": entry([0.1] * 6, "1")}}
    result = check(before, now, ENVIRONMENT)
    assert labels(result)["mine", "s0"] == "worse"
    assert "0 of 6 runs" in to_text(table(result))
    assert replace(before, n_repetitions=6) == before
