"""Claims: reading of files, labels from values by scene, and table rows."""

import re
from dataclasses import replace
from math import isnan

import numpy as np
import pandas as pd
import pytest

from tests.bench.papers.claim_entries import NAMES, TEXTS, claim
from trackmark.bench.experiments.experiment import ExperimentError
from trackmark.bench.papers import SETTING_LABELS, SETTINGS
from trackmark.bench.papers.claim_tests import Evidence, judge, scene_differences
from trackmark.bench.papers.claims import Claim
from trackmark.bench.papers.toml_table import validated
from trackmark.bench.papers.verdicts import (
    estimate_text,
    judge_row,
    setting_counts,
    sum_line,
    unit_text,
    verdict_table,
)
from trackmark.bench.statistics.verdict_rules import no_worse, order, share

SIDES = {"better": "A", "worse": "B"}


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"better": "A", "test": "order", "margin": 0.02}, "`better` and `worse` together"),
        ({**SIDES, "test": "order"}, "needs a `margin`"),
        ({**SIDES, "test": "share"}, "takes `trackers`"),
        ({"trackers": "A", "test": "share", "colour": 3}, "colour: Extra inputs"),
        ({"trackers": "A", "test": "time"}, "test: Input should be"),
        ({"trackers": "A", "test": "share", "falsified_if": ""}, "falsified_if: String should"),
        (
            {
                **SIDES,
                "better": ["A", "C"],
                "test": "order",
                "margin": 1,
                "side_rule": "by sequence",
            },
            "one tracker per sequence",
        ),
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


def test_share_counts_scenes_in_which_all_sequences_succeed():
    share_claim = claim(trackers="A", sequences=["x", "y"], test="share")
    x = [1.0] * 24
    y = [1.0] * 20 + [0.0] * 4
    verdict = judge(share_claim, Evidence(pd.concat([table({"A": x}, "x"), table({"A": y}, "y")])))
    expected = share([True] * 20 + [False] * 4)
    assert (verdict.verdict, verdict.interval) == (expected.verdict, expected.interval)
    assert verdict.statistic == 20 / 24


def test_no_worse_follows_the_rule_and_prints_its_margin():
    equal = claim(better="A", worse="B", test="no-worse", margin=0.1)
    tables = table({"A": 0.5 + NOISE}), table({"B": 0.5 + NOISE})
    evidence = Evidence(*tables, largest=1.0)
    assert judge(equal, evidence).verdict == no_worse(np.zeros(36), 0.1, limit=1.0).verdict
    assert judge(equal, evidence).verdict == "holds"
    clips = judge(equal, replace(evidence, largest=20.0))  # numbers of clips need 44 scenes
    assert (clips.verdict, clips.reason[:12]) == ("inconclusive", "inside ±0.1;")
    verdict = judge(equal, evidence)
    assert estimate_text(equal, verdict) == verdict.estimate
    assert unit_text(equal, verdict) == "36 scenes, margin 0.1"


def test_no_worse_both_ways_fails_if_either_is_worse():
    equal = claim(better="A", worse="B", test="no-worse both ways", margin=0.1)
    for a, b in ((0.5, 0.8), (0.8, 0.5)):
        evidence = Evidence(table({"A": a + NOISE}), table({"B": b + NOISE}))
        assert judge(equal, evidence).verdict == "does not hold"
    tables = table({"A": NOISE}), table({"B": NOISE[::-1]})
    same = Evidence(*tables, largest=1.0)
    assert judge(equal, same).verdict == "holds"


def kept_tables(first, second, n=24):
    """Return tables with the numbers of scenes, of n, in which each of two trackers is kept."""
    return {
        f"kept_{side}": table({tracker: [1.0] * number + [0.0] * (n - number)})
        for side, tracker, number in (("first", "A", first), ("second", "B", second))
    }


BETTER = Evidence(table({"A": 0.6 + NOISE}), table({"B": 0.5 + NOISE[::-1]}), unit="share")
"""Evidence of a claim that holds by its rule."""


@pytest.mark.parametrize(
    ("numbers", "label", "reason"),
    [
        ((24, 24), "not testable here", "ceiling: both sides keep"),
        ((0, 0), "not testable here", "floor: all keep"),
        ((24, 23), "holds", ""),
        ((24, 0), "holds", ""),
        ((1, 0), "holds", ""),
    ],
)
def test_order_needs_room_between_floor_and_ceiling(numbers, label, reason):
    verdict = judge(ORDER, replace(BETTER, **kept_tables(*numbers)))
    assert verdict.verdict == label
    assert verdict.reason.startswith(reason)


@pytest.mark.parametrize(
    ("numbers", "label"),
    [
        ((24, 24), "not testable here"),
        ((0, 0), "not testable here"),
        ((24, 0), "not testable here"),  # the reference is at the floor
        ((0, 24), "holds"),
    ],
)
def test_no_worse_needs_a_reference_above_the_floor(numbers, label):
    equal = claim(better="A", worse="B", test="no-worse", margin=0.1)
    assert judge(equal, replace(BETTER, **kept_tables(*numbers))).verdict == label


def test_accuracy_has_a_floor_and_no_ceiling():
    for unit, number, label in (
        ("overlap", 24, "holds"),
        ("overlap", 0, "not testable here"),
        ("px", 24, "holds"),
        ("px", 0, "holds"),
    ):
        evidence = replace(BETTER, unit=unit, **kept_tables(number, number))
        assert judge(ORDER, evidence).verdict == label, (unit, number)


def test_members_of_sets_decide_floor_and_ceiling():
    shares = np.tile([0.9, 0.95], 12)
    sets = {"kept_first": table({"A": shares}), "kept_second": table({"B": shares})}
    verdict = judge(ORDER, replace(BETTER, unit_noun="set", **sets))
    assert verdict.reason.endswith("both sides keep more than 80 %")
    sets["kept_second"] = table({"B": np.tile([0.6, 0.95], 12)})
    assert judge(ORDER, replace(BETTER, unit_noun="set", **sets)).verdict == "holds"


def test_loss_before_the_event_needs_a_majority_beyond_chance():
    share_claim = claim(trackers="A", test="share")
    evidence = Evidence(table({"A": [1.0] * 24}))
    for n_lost, label in ((18, "not testable here"), (17, "holds")):  # lower ends: 0.533, 0.489
        lost = np.array([1.0] * n_lost + [0.0] * (24 - n_lost))
        verdict = judge(share_claim, replace(evidence, lost_before=lost))
        assert verdict.verdict == label
    few = replace(evidence, lost_before=np.ones(11))
    assert judge(share_claim, few).verdict == "holds"


def test_equal_runs_do_not_pose_the_problem_of_an_order():
    for share_of_equal, label in ((0.6, "not testable here"), (0.5, "holds")):
        verdict = judge(ORDER, replace(BETTER, equal_runs=share_of_equal))
        assert verdict.verdict == label
    equal = claim(better="A", worse="B", test="no-worse", margin=0.1)
    assert judge(equal, replace(BETTER, equal_runs=1.0)).verdict == "holds"


def test_only_claims_that_hold_are_by_construction():
    assert judge(ORDER, replace(BETTER, favoured=True)).verdict == "by construction"
    worse = Evidence(BETTER.second, BETTER.first, unit="share", favoured=True)
    worse = replace(
        worse,
        first=worse.first.assign(tracker="A"),
        second=worse.second.assign(tracker="B"),
    )
    assert judge(ORDER, worse).verdict == "does not hold"


def test_first_obstacle_is_the_reason():
    everything = replace(
        BETTER,
        not_posed="3 of the first 40 scenes of ball meet the criteria of difficulty",
        equal_runs=0.72,
        lost_before=np.ones(24),
        favoured=True,
        **kept_tables(0, 0),
    )
    obstacles = [
        ({}, "problem not posed: 3 of the first 40"),
        ({"not_posed": ""}, "equal boxes in 72 % of the scenes"),
        ({"equal_runs": 0.5}, "floor"),
        ({"kept_first": pd.DataFrame()}, "lost before the event in 24 of 24 scenes"),
        ({"lost_before": np.zeros(0)}, "a criterion of the scenes uses this result"),
    ]
    for change, reason in obstacles:
        everything = replace(everything, **change)
        assert judge(ORDER, everything).reason.startswith(reason)


def test_claim_without_runs_is_inconclusive():
    for test, sides in (("order", {"better": "A", "worse": "B"}), ("share", {"trackers": "A"})):
        verdict = judge(claim(test=test, margin=0.1, **sides), Evidence())
        assert verdict.verdict == "inconclusive"
        assert isnan(verdict.statistic)


def test_row_shows_the_unit_of_the_claim_once():
    with_unit = ORDER.model_copy(update={"unit": "share of visible frames"})
    row = judge_row(with_unit, dict.fromkeys(SETTINGS, BETTER))
    texts = [cell.text for cell in verdict_table([row], SETTING_LABELS).rows[0]]
    assert texts[2] == "share of visible frames, 36 scenes"
    assert re.fullmatch(r"0\.\d+ \[0\.\d+, 0\.\d+\]", texts[4])
    share_claim = claim(trackers="A", test="share")
    row = judge_row(share_claim, dict.fromkeys(SETTINGS, Evidence(table({"A": [1.0] * 24}))))
    texts = [cell.text for cell in verdict_table([row], SETTING_LABELS).rows[0]]
    assert texts[2:5] == ["scenes", "1 of 1", "24 of 24, 1.000 [0.858, 1.000]"]


def test_verdict_table_has_the_columns_of_the_given_settings():
    worse = Evidence(table({"A": NOISE}), table({"B": 0.5 + NOISE}), unit="share")
    row = judge_row(ORDER, {"as-written": worse, "recommended": BETTER})
    merged = verdict_table([row], {"recommended": "both settings"})
    assert merged.headings == ["claim", "", "unit", "paper", "both settings", "verdict"]
    assert [cell.text for cell in merged.rows[0]][-1] == "holds"
    assert list(merged.records["setting"]) == [*SETTINGS]


def test_by_construction_is_a_label_without_a_reason():
    row = judge_row(ORDER, dict.fromkeys(SETTINGS, replace(BETTER, favoured=True)))
    cells = verdict_table([row], SETTING_LABELS).rows[0]
    assert cells[-1].text == "by construction"


def test_row_shows_both_settings_with_reason_and_notes():
    good = Evidence(table({"A": 0.5 + NOISE}), table({"B": 0.3 + NOISE}))
    few = Evidence(table({"A": [0.5] * 3}), table({"B": [0.3] * 3}), failed="1 of 9 runs failed")
    row = judge_row(ORDER, {"as-written": few, "recommended": good})
    texts = [cell.text for cell in verdict_table([row], SETTING_LABELS).rows[0]]
    assert texts[:4] == ["AB-1", "it tracks", "3 scenes / 36 scenes", "1 of 1"]
    assert "only 3 of 12 scenes" in texts[5]
    assert "1 of 9 runs failed" in texts[5]
    assert texts[7] == "holds"
    settings = row.for_json()["settings"]
    assert settings["as-written"]["interval"] == [None, None]
    assert settings["recommended"]["verdict"] == "holds"


def test_sum_line_equals_a_recount_of_the_table():
    favoured = replace(BETTER, favoured=True)
    rows = [
        judge_row(ORDER, {"as-written": written, "recommended": recommended})
        for written, recommended in (
            (Evidence(), BETTER),
            (BETTER, favoured),
            (favoured, replace(BETTER, not_posed="none of 40 scenes is difficult")),
            (replace(BETTER, **kept_tables(24, 24)), replace(BETTER, **kept_tables(0, 0))),
        )
    ]
    lines = {
        "as-written": "Main results reproduced: 1 of 2 (1 by construction, 1 not testable here)",
        "recommended": "Main results reproduced: 1 of 1 (1 by construction, 2 not testable here)",
    }
    data = verdict_table(rows, SETTING_LABELS).records
    for setting, line in lines.items():
        labels = data.loc[data["setting"] == setting, "verdict"].to_list()
        counted = [x for x in labels if x in {"holds", "does not hold", "inconclusive"}]
        others = f"{labels.count('by construction')} by construction"
        others += f", {labels.count('not testable here')} not testable here"
        expected = f"{labels.count('holds')} of {len(counted)} ({others})"
        assert sum_line(rows, setting) == line == f"Main results reproduced: {expected}"
    assert setting_counts(rows) == [f"{setting}: {line}" for setting, line in lines.items()]
    assert setting_counts([]) == []


def test_verdict_table_has_unrounded_data_of_both_settings():
    good = Evidence(table({"A": 0.5 + NOISE}), table({"B": 0.3 + NOISE}))
    row = judge_row(ORDER, {"as-written": Evidence(), "recommended": good})
    data = verdict_table([row], SETTING_LABELS).records.set_index("setting")
    assert list(data.index) == ["as-written", "recommended"]
    assert (data["claim"] == "AB-1").all()
    verdict = row.verdicts["recommended"]
    assert data.loc["recommended", "verdict"] == "holds"
    numbers = data.loc["recommended", ["estimate", "low", "high", "n"]].to_list()
    assert numbers == [verdict.statistic, *verdict.interval, 36]
    assert isnan(data.loc["as-written", "estimate"])
    assert data.loc["as-written", "reason"] == "no runs"
