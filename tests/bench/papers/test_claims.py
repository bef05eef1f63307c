"""Claims: reading of files, verdicts from values by scene, notes and table rows."""

from dataclasses import replace
from math import isnan

import numpy as np
import pandas as pd
import pytest

from tests.bench.papers.claim_entries import NAMES, TEXTS, claim
from trackmark.bench.experiments.experiment import ExperimentError
from trackmark.bench.papers.claim_tests import Evidence, judge, notes, scene_differences
from trackmark.bench.papers.claims import Claim
from trackmark.bench.papers.toml_table import validated
from trackmark.bench.papers.verdicts import (
    count_verdicts,
    effect_text,
    judge_row,
    verdict_table,
)
from trackmark.bench.statistics.intervals import share_interval
from trackmark.bench.statistics.verdict_rules import no_worse, order, share

SIDES = {"better": "A", "worse": "B"}


def test_names_may_be_one_text_or_a_list():
    entry = claim(better="A", worse=["B", "C"], test="order", margin=0.02, scenes=12)
    assert [tracker.name for tracker in entry.all_trackers] == ["A", "B", "C"]
    assert [sequence.name for sequence in entry.sequences] == ["ball"]
    assert entry.n_scenes == 12


@pytest.mark.parametrize(
    ("fields", "scenes"),
    [
        ({"trackers": "A", "test": "share"}, 24),
        ({**SIDES, "test": "order", "margin": 0.02}, 32),
        ({**SIDES, "test": "no-worse", "margin": 0.02}, 36),
        ({"trackers": "A", "test": "number"}, 24),
    ],
)
def test_scenes_follow_from_the_kind_of_test(fields, scenes):
    assert claim(**fields).n_scenes == scenes


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"better": "A", "test": "order", "margin": 0.02}, "`better` and `worse` together"),
        ({**SIDES, "test": "order"}, "needs a `margin`"),
        ({**SIDES, "test": "share"}, "takes `trackers`"),
        ({"trackers": "A", "test": "share", "colour": 3}, "colour: Extra inputs"),
        ({"trackers": "A", "test": "sharing"}, "test: Input should be"),
        (
            {"trackers": "A", "test": "share", "margin": -1},
            "margin: Input should be greater than 0",
        ),
    ],
)
def test_wrong_field_of_a_claim_is_an_error(fields, message):
    with pytest.raises(ExperimentError, match=message):
        validated(Claim, {"name": "AB-1", **TEXTS, **fields}, "claims.toml: claim AB-1", NAMES)


def table(values, sequence="ball"):
    """Return values by tracker in the form of `Evidence.first`."""
    return pd.concat(
        [
            pd.DataFrame(
                {"sequence": sequence, "rank": range(len(by_scene)), "tracker": tracker}
            ).assign(value=np.asarray(by_scene, float))
            for tracker, by_scene in values.items()
        ],
        ignore_index=True,
    )


ORDER = claim(better="A", worse="B", test="order", margin=0.02)
GENERATOR = np.random.default_rng(0)
NOISE = GENERATOR.normal(0, 0.01, 36)


def test_order_is_judged_from_paired_differences():
    a, b = 0.5 + NOISE, 0.3 + NOISE[::-1]
    verdict = judge(ORDER, Evidence(table({"A": a}), table({"B": b}), largest=1.0))
    assert verdict == replace(order(a - b, 0.02, limit=1.0), counted="scene")
    assert verdict.verdict == "holds"


def test_smaller_errors_are_better():
    evidence = Evidence(
        table({"A": 2 + NOISE}), table({"B": 5 + NOISE[::-1]}), lower_is_better=True, unit="px"
    )
    verdict = judge(ORDER, evidence)
    assert verdict.verdict == "holds"
    assert verdict.statistic == pytest.approx(3, abs=0.01)
    assert verdict.effect.startswith("3.0")
    assert "px" in verdict.effect


def test_hardest_tracker_is_chosen_for_each_sequence():
    both = claim(better="A", worse=["B", "C"], sequences=["x", "y"], test="order", margin=0.02)
    first = pd.concat([table({"A": [0.5] * 3}, "x"), table({"A": [0.5] * 3}, "y")])
    second = pd.concat(
        [
            table({"B": [0.9, 0.1, 0.2], "C": [0.3, 0.3, 0.3]}, "x"),  # B: mean 0.4
            table({"B": [0.1, 0.1, 0.1], "C": [0.2, 0.2, 0.2]}, "y"),  # C: mean 0.2
        ]
    )
    differences = scene_differences(both, Evidence(first, second))
    assert differences.to_numpy() == pytest.approx([-0.4, 0.4, 0.3, 0.3, 0.3, 0.3])
    # The largest of several errors.
    both = claim(better=["A", "B"], worse="C", test="order", margin=0.02)
    first = table({"A": [1.0, 1.0], "B": [2.0, 2.0]})
    evidence = Evidence(first, table({"C": [5.0, 5.0]}), lower_is_better=True)
    assert scene_differences(both, evidence).to_list() == [3.0, 3.0]


def test_measure_that_is_a_difference_needs_no_trackers():
    verdict = judge(claim(test="order", margin=0.02), Evidence(table({"": 0.2 + NOISE})))
    assert verdict.verdict == "holds"
    assert verdict.statistic == pytest.approx(0.2, abs=0.01)


def test_share_counts_scenes_in_which_all_sequences_succeed():
    share_claim = claim(trackers="A", sequences=["x", "y"], test="share")
    x = [1.0] * 24
    y = [1.0] * 20 + [1 / 3] * 4  # a third of the repetitions is no success
    verdict = judge(share_claim, Evidence(pd.concat([table({"A": x}, "x"), table({"A": y}, "y")])))
    expected = share([True] * 20 + [False] * 4)
    assert (verdict.verdict, verdict.interval) == (expected.verdict, expected.interval)
    assert verdict.statistic == 20 / 24


def test_scene_with_half_of_its_runs_is_half_a_success():
    won, even, lost = [0.75] * 8, [0.5] * 3, [0.25]
    share_claim = claim(trackers="A", test="share")
    verdict = judge(share_claim, Evidence(table({"A": won + even + lost})))
    assert verdict.statistic == 9.5 / 12
    assert verdict.interval == share_interval(9.5, 12)
    assert effect_text(share_claim, verdict).startswith("9.5 of 12 scenes, 0.79 [")


def test_share_of_failures_mirrors_the_share_of_successes():
    """With an even number of runs, a claim and its opposite have shares that add up to 1."""
    shares = GENERATOR.integers(0, 5, 30) / 4
    share_claim = claim(trackers="A", test="share")
    first, second = (judge(share_claim, Evidence(table({"A": x}))) for x in (shares, 1 - shares))
    assert first.statistic + second.statistic == pytest.approx(1)
    assert first.interval == pytest.approx((1 - second.interval.high, 1 - second.interval.low))


def test_no_worse_holds_only_if_the_reference_is_kept():
    equal = claim(better="A", worse="B", test="no-worse", margin=0.1)
    tables = table({"A": 0.5 + NOISE}), table({"B": 0.5 + NOISE})
    evidence = Evidence(*tables, largest=1.0, reference_kept=0.9)
    assert judge(equal, evidence).verdict == no_worse(np.zeros(36), 0.1, limit=1.0).verdict
    assert judge(equal, evidence).verdict == "holds"
    clips = judge(equal, replace(evidence, largest=20.0))  # numbers of clips need 44 scenes
    assert (clips.verdict, clips.reason[:12]) == ("inconclusive", "inside ±0.1;")
    assert ", margin 0.1, 36 scenes" in effect_text(equal, judge(equal, evidence))
    floor = replace(evidence, reference_kept=0.4)
    assert judge(equal, floor).verdict == "inconclusive"
    assert "the reference keeps the target in 40 % of the scenes" in notes(floor)


def test_no_worse_both_ways_fails_if_either_is_worse():
    equal = claim(better="A", worse="B", test="no-worse both ways", margin=0.1)
    for a, b in ((0.5, 0.8), (0.8, 0.5)):
        evidence = Evidence(table({"A": a + NOISE}), table({"B": b + NOISE}), reference_kept=1.0)
        assert judge(equal, evidence).verdict == "does not hold"
    tables = table({"A": NOISE}), table({"B": NOISE[::-1]})
    same = Evidence(*tables, largest=1.0, reference_kept=1.0)
    assert judge(equal, same).verdict == "holds"


def test_time_takes_the_pair_with_the_smallest_ratio():
    slow, fast = np.full(12, 2.0) + NOISE[:12], np.full(12, 1.0) + NOISE[12:24]
    timed = claim(measure="timing.hand_ratio", test="time")
    holds = judge(timed, Evidence(times=[(slow, fast)]))
    assert (holds.verdict, round(holds.statistic)) == ("holds", 2)
    fails = judge(timed, Evidence(times=[(slow, fast), (fast, slow)]))
    assert fails.verdict == "does not hold"


def test_time_with_a_limit_holds_below_it():
    milliseconds = 10 + NOISE[:12]
    for limit, expected in ((40, "holds"), (5, "does not hold")):
        timed = claim(measure="timing.hand_ratio", test="time", limit=limit)
        verdict = judge(timed, Evidence(times=[(milliseconds, milliseconds)], unit="ms"))
        assert verdict.verdict == expected
        assert verdict.statistic == pytest.approx(10, abs=0.1)
        assert verdict.interval.low < 10 < verdict.interval.high
        assert f"{limit} ms" in verdict.reason


def test_numbers_are_printed_and_not_judged():
    verdict = judge(claim(trackers="A", test="number"), Evidence(table({"A": 0.5 + NOISE})))
    assert verdict.verdict == "not testable"
    assert verdict.statistic == pytest.approx(0.5, abs=0.01)


def test_claim_without_runs_is_inconclusive():
    for test, sides in (("order", {"better": "A", "worse": "B"}), ("share", {"trackers": "A"})):
        verdict = judge(claim(test=test, margin=0.1, **sides), Evidence())
        assert verdict.verdict == "inconclusive"
        assert isnan(verdict.statistic)


def test_notes_name_lost_targets_and_failed_runs():
    assert notes(Evidence(lost_before=0.4)) == []
    remarks = notes(Evidence(lost_before=0.6, failed="1 of 72 runs failed"))
    assert remarks == ["lost before the event in 60 % of the scenes", "1 of 72 runs failed"]


def test_row_shows_both_settings_with_reason_and_notes():
    good = Evidence(table({"A": 0.5 + NOISE}), table({"B": 0.3 + NOISE}))
    few = Evidence(table({"A": [0.5] * 3}), table({"B": [0.3] * 3}), failed="1 of 9 runs failed")
    row = judge_row(ORDER, {"as-written": few, "recommended": good})
    assert count_verdicts([row], "recommended") == "1 holds"
    assert count_verdicts([row, row], "as-written") == "2 inconclusive"
    texts = [cell.text for cell in verdict_table([row]).rows[0]]
    assert texts[:3] == ["AB-1", "it tracks", "1 of 1"]
    assert "only 3 of 12 scenes" in texts[4]
    assert "1 of 9 runs failed" in texts[4]
    assert texts[6] == "holds"
    settings = row.for_json()["settings"]
    assert settings["as-written"]["interval"] == [None, None]
    assert settings["recommended"]["verdict"] == "holds"


def test_verdict_table_has_unrounded_data_of_both_settings():
    good = Evidence(table({"A": 0.5 + NOISE}), table({"B": 0.3 + NOISE}))
    row = judge_row(ORDER, {"as-written": Evidence(), "recommended": good})
    data = verdict_table([row]).data.set_index("setting")
    assert list(data.index) == ["as-written", "recommended"]
    assert (data["claim"] == "AB-1").all()
    verdict = row.verdicts["recommended"]
    assert data.loc["recommended", "verdict"] == "holds"
    numbers = data.loc["recommended", ["estimate", "low", "high", "n"]].to_list()
    assert numbers == [verdict.statistic, *verdict.interval, 36]
    assert isnan(data.loc["as-written", "estimate"])
    assert data.loc["as-written", "reason"] == "no runs"
