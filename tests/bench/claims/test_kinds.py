"""Kinds of tests beyond the orders of two rows: on tables, with parts, of errors and shares."""

from itertools import product

import numpy as np
import pandas as pd
import pytest

from bench.claims.conclusion import conclude
from bench.claims.judging import judge
from bench.claims.ledger import LedgerError, read_claims

HEAD = """
version = 1

[readings.text]
as-written = { preset = "as-written" }
recommended = { preset = "recommended", post_hoc = true }

[readings.light]
even = { where = { light = "even" } }
dappled = { where = { light = "dappled" } }

[claim.X-1]
source = "Table 1"
quote = "more robust"
says = "A is better."
kind = "check"
experiment = []
falsifier = "A is worse."
"""


@pytest.fixture
def claim(tmp_path):
    """Makes a claim of the text of its test."""

    def make(test):
        path = tmp_path / "trial.toml"
        path.write_text(HEAD + test)
        return read_claims(path)["X-1"]

    return make


def scores(share=lambda **_: 1.0, preset=("as-written",), light=("even",), scenes=12, **columns):
    """Runs of two trackers on scenes of a sequence, two repetitions; a metric of one's own."""
    rows = []
    for tracker, one, shade, scene, repetition in product(
        ("ours", "theirs"), preset, light, range(scenes), (0, 1)
    ):
        told = share(tracker=tracker, preset=one, light=shade, scene=scene)
        where = {"sequence": "s", "scene": scene, "light": shade, "repetition": repetition}
        counts = dict.fromkeys(("success_frames", "frames_inside", "first_loss"), 100 * told)
        known = {"tracker": tracker, "preset": one, "frames": 100, "kept_scene": True}
        rows.append({**known, **where, **counts, "size_error": told, "found": told, **columns})
    return pd.DataFrame(rows)


ORDER = """
[claim.X-1.order]
better = { tracker = "ours" }
worse = { tracker = "theirs" }
on = "s"
"""


def outcome(claim, frame, **tables):
    return conclude(claim, judge(claim, frame, tables))


def test_of_errors_less_is_better_and_the_margin_is_a_share_of_the_worse(claim):
    test = claim(ORDER + 'by = "size_error"\nmargin = 0.05')

    def errors(gain):
        return scores(
            lambda tracker, scene, **_: 0.4 + 0.001 * scene - gain * (tracker == "ours"), scenes=35
        )

    assert outcome(test, errors(0.1)).verdict == "holds"
    assert outcome(test, errors(-0.1)).verdict == "does not hold"
    found = outcome(test, errors(0.01))  # less than 5 % of 0.4
    assert found.verdict == "does not hold"
    assert "too small to matter" in found.reason
    assert outcome(test, errors(0.03)).verdict == "holds"


def test_where_both_sides_are_the_same_there_is_nothing_to_compare(claim):
    def gain(tracker, scene, **_):
        return 0.5 + scene / 1000 + (0.2 if tracker == "ours" else 0.0)

    test = claim(ORDER + "needs = { updates = 0.01 }")
    found = outcome(test, scores(gain, updates=0.5))
    assert found.verdict == "holds"
    assert "updates 50.0 %" in found.reason
    for share in (0.0, 0.009, np.nan):
        found = outcome(test, scores(gain, updates=share))
        assert found.verdict == "inconclusive"
        assert "nothing to compare: updates" in found.reason
    with pytest.raises(ValueError, match="no column 'updates'"):
        judge(test, scores(gain))


@pytest.mark.parametrize("kind", ["no-worse", "equal"])
def test_no_worse_is_judged_on_the_repetitions_of_both(claim, kind):
    test = claim(ORDER.replace(".order]", f".{kind}]") + "margin = 0.05")

    def gain(value):
        return lambda tracker, scene, **_: 0.5 + scene / 1000 + value * (tracker == "ours")

    for value, verdict in (
        (0.2, "holds"),
        (0.0, "holds"),
        (-0.04, "holds"),
        (-0.2, "does not hold"),
    ):
        assert outcome(test, scores(gain(value), scenes=30)).verdict == verdict
    frame = scores(gain(0.0), scenes=30)
    further = frame[(frame["tracker"] == "ours")].assign(repetition=7, frames_inside=0)
    assert outcome(test, pd.concat([frame, further])).verdict == "holds"


def test_what_depends_on_no_reading_belongs_to_every_one(claim):
    frame = scores(
        lambda tracker, preset, scene, **_: (
            0.5 if tracker == "theirs" else (0.9 if preset == "as-written" else 0.4) + scene / 1000
        ),
        preset=("as-written", "recommended"),
    )
    frame.loc[frame["tracker"] == "theirs", "preset"] = "any"
    found = outcome(claim(ORDER), frame)
    assert (found.verdict, found.readings, found.post_hoc) == ("holds", "1 of 1", "0 of 1")
    assert found.fragile


def test_columns_of_readings_are_the_ledgers(claim):
    def by_light(tracker, light, scene, **_):
        return 0.5 + scene / 1000 + (0.2 if (tracker == "ours") == (light == "even") else 0)

    found = outcome(claim(ORDER), scores(by_light, light=("even", "dappled")))
    assert (found.verdict, found.readings) == ("holds", "1 of 2")
    labels = {(f.reading["light"], f.light) for f in found.findings}
    assert labels == {("even", "both"), ("dappled", "both")}
    named = claim(ORDER + 'where = { light = ["dappled"] }')
    assert outcome(named, scores(by_light, light=("even", "dappled"))).verdict == "does not hold"


@pytest.mark.parametrize(
    ("good", "verdict"), [(24, "holds"), (3, "does not hold"), (14, "inconclusive")]
)
def test_share_counts_scenes_with_more_than_half_of_their_trials(claim, good, verdict):
    test = claim('share = { of = {}, by = "found", on = "s" }')
    frame = scores(scenes=24)
    frame["found"] = frame["scene"] < good
    half = frame["scene"].eq(23) & frame["repetition"].eq(0)  # half of a scene is no success
    frame.loc[half, "found"] = True
    found = outcome(test, frame)
    assert found.verdict == verdict
    assert found.found.effect.startswith(f"found: {good / 24:.2f}")
    assert found.found.effect.endswith("] of the scenes, 24 scenes")
    trials = frame.assign(found=frame["found"].where(frame["scene"] < good))
    assert outcome(test, trials).found.cells == good


def test_share_of_trials_in_a_table(claim):
    test = claim(
        'on = "s"\n[claim.X-1.share]\n'
        'table = "t"\nof = {}\nby = "below"\ntrials = "positions"\nlimit = 0.7'
    )
    table = pd.DataFrame({"sequence": "s", "scene": range(12), "below": 0.6, "positions": 1000})
    assert outcome(test, scores(), t=table).verdict == "holds"
    assert outcome(test, scores(), t=table.assign(below=0.4)).verdict == "does not hold"
    assert outcome(test, scores()).reason == "not run"
    with pytest.raises(ValueError, match=r"X-1: the table t has no column 'positions'"):
        judge(test, scores(), {"t": table.drop(columns="positions")})


def test_bound_is_a_share_of_scenes_or_of_rows(claim):
    test = claim('bound = { table = "t", metric = "x", least = 0.5 }')
    scenes = pd.DataFrame(
        {"sequence": "s", "scene": [*range(12)] * 3, "x": [0.9] * 24 + [0.4] * 12}
    )
    found = outcome(test, scores(), t=scenes)
    assert (found.verdict, found.found.cells, found.found.counted) == ("holds", 12, "scene")
    assert outcome(test, scores(), t=scenes.assign(x=0.4)).verdict == "does not hold"
    few = outcome(test, scores(), t=pd.DataFrame({"x": [0.5, 0.9]}))
    assert (few.verdict, few.reason) == ("inconclusive", "only 2 of 12 rows")
    part = claim('bound = { table = "t", metric = "x", most = 1, where = { y = ["a"] } }')
    table = pd.DataFrame({"x": [0.5] * 12 + [9.0] * 12, "y": ["a"] * 12 + ["b"] * 12})
    assert outcome(part, scores(), t=table).verdict == "holds"
    with pytest.raises(LedgerError, match=r"test: give either `least` or `most`"):
        claim('bound = { table = "t", metric = "x" }')


def test_lost_is_a_share_of_scenes(claim):
    test = claim('on = "s"\nlost = { of = { tracker = "ours" } }')
    assert outcome(test, scores(lambda **_: 0.5)).verdict == "holds"
    found = outcome(test, scores())
    assert (found.verdict, found.found.of) == ("does not hold", "lost")


def test_a_ratio_is_of_pairs(claim):
    test = claim('ratio = { table = "t", longer = "a", shorter = "b" }')
    b = np.linspace(1, 2, 10)
    for factor, verdict in ((1.2, "holds"), (0.8, "does not hold")):
        table = pd.DataFrame({"a": factor * b, "b": b})
        assert outcome(test, scores(), t=table).verdict == verdict


INTERACTION = """
[claim.X-1.interaction]
better = { tracker = "ours" }
worse = { tracker = "theirs" }
on = "s"
where = { noise = [16] }
against = { noise = [0] }
"""


@pytest.mark.parametrize(("gain", "verdict"), [(0.2, "holds"), (0.0, "does not hold")])
def test_an_interaction_sets_rows_against_rows_of_the_same_scenes(claim, gain, verdict):
    def noisy(tracker, scene, **_):
        return 0.5 + scene / 1000 + (gain + 0.1 if tracker == "ours" else 0.0)

    def clean(tracker, scene, **_):
        return 0.5 + scene / 500 + (0.1 if tracker == "ours" else 0.0)

    frame = pd.concat([scores(noisy, noise=16.0, scenes=35), scores(clean, noise=0.0, scenes=35)])
    found = outcome(claim(INTERACTION), frame)
    assert found.verdict == verdict
    assert found.found.statistic == pytest.approx(gain, abs=0.02)


def test_interaction_pairs_other_sequences_by_scene(claim):
    test = claim(
        'interaction = { better = { tracker = "ours" }, worse = { tracker = "theirs" }, on = "s", '
        'against = { sequence = ["t"] } }'
    )
    here = scores(lambda tracker, scene, **_: 0.5 + scene / 1000 + 0.3 * (tracker == "ours"))
    other = scores(lambda scene, **_: 0.5 + scene / 500).assign(sequence="t")
    found = outcome(test, pd.concat([here, other]))
    assert (found.verdict, found.found.cells) == ("holds", 12)
    unpaired = other.assign(scene=other["scene"] + 100)
    assert "only 0 of 12 scenes" in outcome(test, pd.concat([here, unpaired])).reason


PARTS = """
[claim.X-1.parts.kept.all]
of = { tracker = "ours" }
on = "s"

[claim.X-1.parts.quick.bound]
table = "t"
metric = "x"
most = 1.0
"""


def test_claim_with_parts_has_the_part_that_decides(claim):
    test = claim(PARTS)
    fine, slow = pd.DataFrame({"x": [0.5] * 12}), pd.DataFrame({"x": [2.0] * 12})
    found = outcome(test, scores(), t=fine)
    assert (found.verdict, found.reason) == ("holds", "all 2 parts hold")
    found = outcome(test, scores(), t=slow)
    assert found.verdict == "does not hold"
    assert found.reason == "part quick: interval below 0.5; interval at 97.5 %"
    assert (found.found.of, found.found.statistic) == ("quick", 0.0)
    assert {f.group for f in found.findings} == {"", "kept", "quick"}
    lost = scores(lambda **_: 0.5)
    assert outcome(test, lost, t=fine).verdict == "does not hold"
    assert outcome(test, scores()).reason == "not run"
    with pytest.raises(LedgerError, match=r"claim X-1: test.parts.quick.most: input should be"):
        claim(PARTS.replace("most = 1.0", 'most = "x"'))


def test_what_nothing_can_show_is_not_testable_and_says_why(claim):
    found = outcome(claim('none = { reason = "no method is given." }'), scores())
    assert (found.verdict, found.reason) == ("not testable", "no method is given.")
    assert found.readings == ""
