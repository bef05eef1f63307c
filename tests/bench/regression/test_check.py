"""Checks against a baseline: labels of changes, printed lines, JSON and JUnit test cases."""

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from trackmark.bench.experiments.experiment import SequenceSource
from trackmark.bench.regression.baseline import Baseline, BaselineEntry
from trackmark.bench.regression.check import (
    as_data,
    as_junit,
    changed_facts,
    check,
    table,
)
from trackmark.bench.statistics.intervals import mean_interval
from trackmark.reports.renderers import to_markdown, to_text

SEEDS = 20
MADE_WITH = {"platform": "Linux x86_64", "numpy": "2.1"}
GENERATOR = np.random.default_rng(0)
NOISE = GENERATOR.normal(0, 0.05, (3, SEEDS)).round(5)


def entry(overlap, version="0", same=(), failures=()):
    """Return an entry whose boxes depend on the version, except for the seeds in `same`."""
    boxes = [f"{seed:06x}{'00' if seed in same else version:>02}" for seed in range(len(overlap))]
    for seed in failures:
        boxes[seed] = ""
    reasons = dict.fromkeys(failures, "IndexError: index 64 is out of bounds")
    numbers = tuple(float(value) for value in np.round(overlap, 5))
    return BaselineEntry(SequenceSource("s"), "9f31c2aa", numbers, tuple(boxes), reasons)


def baseline(entries):
    texts = {label: label for label in entries}
    return Baseline(entries, texts, SEEDS, 0.05, MADE_WITH)


def labels(result):
    return {(row.tracker, row.sequence): row.change.label for row in result.changes}


BEFORE = {
    "mine": {f"s{i}": entry(0.6 + NOISE[i]) for i in range(3)},
    "static": {"s0": entry([0.4]), "s1": entry([0.5])},
}


def test_equal_digests_are_identical_with_any_libraries():
    result = check(baseline(BEFORE), BEFORE, {**MADE_WITH, "numpy": "2.2"})
    assert set(labels(result).values()) == {"identical"}
    assert result.verdict == "pass"
    assert table(result).notes == ["identical  mine  3 sequences; static  2 sequences"]


def test_drop_in_a_part_of_the_seeds_is_found_in_the_mean():
    """Six of twenty runs lose .3 on one sequence; the other runs keep their boxes."""
    lost = np.where(np.arange(SEEDS) < 6, 0.3, 0.0)
    changed = entry(0.6 + NOISE[0] - lost, "1", same=range(6, SEEDS))
    now = {**BEFORE, "mine": {**BEFORE["mine"], "s0": changed}}
    result = check(baseline(BEFORE), now, MADE_WITH)
    assert labels(result)["mine", "s0"] == "worse"
    assert labels(result)["mine", "mean of 3 sequences"] == "worse"
    assert labels(result)["mine", "s1"] == "identical"
    text = to_text(table(result))
    assert "-0.090 [-" in text
    assert "14 of 20 runs" in text
    assert "REGRESSION: mine is worse on s0 and in the mean." in text
    assert "identical  mine  2 sequences; static  2 sequences" in text
    assert as_data(result)["verdict"] == "regression"


def test_family_counts_once_in_the_mean():
    shift = 0.1 + NOISE[1]
    old = BEFORE["mine"]
    changed = {name: entry(np.array(old[name].overlap) - shift, "1") for name in ("s0", "s1")}
    now = {**BEFORE, "mine": {**old, **changed}}
    families = {"s0": "video", "s1": "video", "s2": "other"}
    (mean,) = check(baseline(BEFORE), now, MADE_WITH, families=families).means
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
    result = check(baseline(before), now, MADE_WITH)
    rows = {(row["tracker"], row["sequence"]): row for row in as_data(result)["cells"]}
    rows |= {(row["tracker"], "mean"): row for row in as_data(result)["means"]}
    assert rows["other", "s0"]["state"] == "identical"
    expected = {key: mean_interval(shift, 1 - 0.05 / 3) for key, shift in shifts.items()}
    for tracker in ("mine", "other"):  # a sequence with equal boxes counts as 0
        by_seed = sum(shift for key, shift in shifts.items() if key[0] == tracker) / 3
        expected[tracker, "mean"] = mean_interval(by_seed, 1 - 0.05 / 2)
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
    result = check(baseline(BEFORE), now, {**MADE_WITH, "numpy": numpy})
    assert labels(result)["static", "s0"] == label
    notes = "\n".join(table(result).notes)
    assert ("note: numpy 2.1 -> 2.2 since the baseline" in notes) == (numpy == "2.2")


def test_unrepeatable_deterministic_score_is_inconclusive():
    now = {**BEFORE, "static": {**BEFORE["static"], "s0": entry([0.1], "1")}}
    assert changed_facts(BEFORE, now) == {"static": ["s0"]}
    result = check(baseline(BEFORE), now, MADE_WITH, [("static", "s0")])
    assert result.verdict == "inconclusive"
    assert "inconclusive: static, s0: not repeatable." in table(result).notes


def test_tracker_with_new_randomness_is_judged_over_all_seeds():
    """The single run of the baseline counts for all seeds: its boxes did not depend on them."""
    now = {**BEFORE, "static": {"s0": entry(0.4 + NOISE[0], "1"), "s1": entry(0.5 + NOISE[1], "1")}}
    result = check(baseline(BEFORE), now, MADE_WITH)
    row = next(row for row in result.sequences if (row.tracker, row.sequence) == ("static", "s0"))
    assert row.change.label == "not worse"
    assert row.change.mean == pytest.approx(NOISE[0].mean())
    assert (len(row.old), len(row.new)) == (1, SEEDS)
    assert changed_facts(BEFORE, now) == {}


def test_failed_run_is_a_regression_with_any_score():
    scores = 0.6 + NOISE[0]
    scores[17] = 0.0
    changed = entry(scores, same=set(range(SEEDS)) - {17}, failures=[17])
    now = {**BEFORE, "mine": {**BEFORE["mine"], "s0": changed}}
    result = check(baseline(BEFORE), now, MADE_WITH)
    assert labels(result)["mine", "s0"] != "worse"
    assert result.verdict == "regression"
    assert (
        "REGRESSION: mine failed in 1 of 60 runs; the baseline has no failures. s0, seed 17: "
        "IndexError: index 64 is out of bounds"
    ) in table(result).notes
    suite = ElementTree.fromstring(as_junit(result))
    failures = [case.get("name") for case in suite if case.find("failure") is not None]
    assert failures == ["s0"]
    assert "seed 17 failed: IndexError" in as_junit(result)
    (row,) = (row for row in as_data(result)["cells"] if row["failed"])
    assert row["failure"].startswith("IndexError")


def test_inconclusive_change_names_seeds_and_is_skipped_in_junit():
    noisy = {"mine": {"s0": entry(np.linspace(0.4, 0.7, SEEDS))}}
    now = {"mine": {"s0": entry(np.linspace(0.7, 0.4, SEEDS), "1")}}
    result = check(baseline(noisy), now, MADE_WITH)
    assert result.verdict == "inconclusive"
    fewest, most = as_data(result)["cells"][0]["seeds_needed"]
    assert SEEDS < fewest < most
    notes = [note for note in table(result).notes if note.startswith("inconclusive: mine, s0: ")]
    assert re.search(r": \d+ to \d+ seeds needed", notes[0])
    suite = ElementTree.fromstring(as_junit(result))
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
    result = check(baseline(BEFORE), now, MADE_WITH)
    states = [row["state"] for row in as_data(result)["cells"]]
    assert states == ["worse", "better", "not worse", "identical", "identical"]
    assert len(table(result).rows) == 4
    assert len(table(result, whole=True).rows) == 6
    assert "| worse | mine | s1 |" in to_markdown(table(result))
    suite = ElementTree.fromstring(as_junit(result))
    assert (suite.get("tests"), suite.get("failures")) == ("6", "1")


def test_first_seeds_of_a_baseline_are_compared():
    before = baseline(BEFORE).with_seeds(6)
    assert {len(c.overlap) for c in before.entries["mine"].values()} == {6}
    assert len(before.entries["static"]["s0"].boxes) == 1
    now = {**before.entries, "mine": {**before.entries["mine"], "s0": entry([0.1] * 6, "1")}}
    result = check(before, now, MADE_WITH)
    assert labels(result)["mine", "s0"] == "worse"
    assert "0 of 6 runs" in to_text(table(result))
    assert replace(before, seeds=6) == before
