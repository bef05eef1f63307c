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


def scores(share=lambda **_: 1.0, preset=("as-written",), light=("even",), scenes=10, **columns):
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
    assert outcome(test, errors(-0.1)).verdict == "does-not-hold"
    found = outcome(test, errors(0.01))  # less than five per cent of 0.4
    assert found.verdict == "does-not-hold"
    assert "too small to matter" in found.reason
    assert outcome(test, errors(0.03)).verdict == "holds"


def test_where_both_sides_are_the_same_there_is_nothing_to_compare(claim):
    def gain(tracker, scene, **_):
        return 0.5 + scene / 1000 + (0.2 if tracker == "ours" else 0.0)

    test = claim(ORDER + "needs = { updates = 0.01 }")
    found = outcome(test, scores(gain, updates=0.5))
    assert found.verdict == "holds"
    assert "updates 50.0 %." in found.reason
    for share in (0.0, 0.009, np.nan):
        found = outcome(test, scores(gain, updates=share))
        assert found.verdict == "undecided"
        assert "nothing to compare: updates" in found.reason
    with pytest.raises(ValueError, match="no column 'updates'"):
        judge(test, scores(gain))


def test_no_worse_is_equal_or_better_on_the_repetitions_of_both(claim):
    test = claim(ORDER.replace(".order]", ".no-worse]") + "margin = 0.05")

    def gain(value):
        return lambda tracker, scene, **_: 0.5 + scene / 1000 + value * (tracker == "ours")

    for value, verdict in (
        (0.2, "holds"),
        (0.0, "holds"),
        (-0.04, "holds"),
        (-0.2, "does-not-hold"),
    ):
        assert outcome(test, scores(gain(value), scenes=35)).verdict == verdict
    frame = scores(gain(0.0), scenes=35)
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
    assert outcome(named, scores(by_light, light=("even", "dappled"))).verdict == "does-not-hold"


@pytest.mark.parametrize(
    ("share", "verdict"), [(0.97, "holds"), (0.5, "does-not-hold"), (0.85, "undecided")]
)
def test_a_share_is_of_the_rows_that_were_trials(claim, share, verdict):
    test = claim('share = { of = {}, by = "found", on = "s" }')
    generator = np.random.default_rng(0)
    frame = scores(scenes=24)
    frame["found"] = generator.random(len(frame)) < share
    assert outcome(test, frame).verdict == verdict
    silent = frame.assign(found=frame["found"].astype(float))
    silent.loc[~frame["found"], "found"] = np.nan
    assert outcome(test, silent).verdict == "holds"
    assert f"{int(frame['found'].sum())} of {int(frame['found'].sum())}" in (
        outcome(test, silent).reason
    )


TABLE = """
[claim.X-1.share]
table = "background"
of = {}
by = "below"
trials = "positions"
least = 0.95
lower = 0.95
on = "s"
"""


def test_rows_of_a_table_may_stand_for_many_trials(claim):
    def table(share):
        return pd.DataFrame(
            {"sequence": "s", "scene": range(10), "below": share, "positions": 1000}
        )

    assert outcome(claim(TABLE), scores(), background=table(0.97)).verdict == "holds"
    assert outcome(claim(TABLE), scores(), background=table(0.93)).verdict == "does-not-hold"
    assert outcome(claim(TABLE), scores()).verdict == "undecided"
    with pytest.raises(ValueError, match=r"X-1: the table background has no column 'positions'"):
        judge(claim(TABLE), scores(), {"background": table(1.0).drop(columns="positions")})


def test_no_row_lies_beyond_a_bound(claim):
    test = claim('bound = { table = "t", metric = "x", least = 0.5 }')
    assert outcome(test, scores(), t=pd.DataFrame({"x": [0.5, 0.9]})).verdict == "holds"
    found = outcome(test, scores(), t=pd.DataFrame({"x": [0.4, 0.9]}))
    assert (found.verdict, found.readings) == ("does-not-hold", "0 of 1")
    assert "the least x is 0.4" in found.reason
    part = claim('bound = { table = "t", metric = "x", most = 1, where = { y = ["a"] } }')
    table = pd.DataFrame({"x": [0.5, 9.0], "y": ["a", "b"]})
    assert outcome(part, scores(), t=table).verdict == "holds"
    with pytest.raises(LedgerError, match=r"test: give either `least` or `most`"):
        claim('bound = { table = "t", metric = "x" }')


@pytest.mark.parametrize(
    ("limit", "low", "high", "verdict"),
    [
        ("least = 0.5", [0.6, 0.7], [0.8, 0.9], "holds"),
        ("least = 0.5", [0.4, 0.7], [0.6, 0.9], "undecided"),
        ("least = 0.5", [0.4, 0.7], [0.45, 0.9], "does-not-hold"),
        ("most = 0.5", [0.2, 0.3], [0.3, 0.45], "holds"),
        ("most = 0.5", [0.2, 0.3], [0.3, 0.6], "undecided"),
        ("most = 0.5", [0.2, 0.6], [0.3, 0.7], "does-not-hold"),
    ],
)
def test_where_rows_have_intervals_none_may_surely_lie_beyond(claim, limit, low, high, verdict):
    test = claim(f'bound = {{ table = "t", metric = "x", interval = ["low", "high"], {limit} }}')
    table = pd.DataFrame({"x": np.add(low, high) / 2, "low": low, "high": high, "degrees": 20})
    found = outcome(test, scores(), t=table)
    assert found.verdict == verdict
    assert "of the row that decides, of 2, is" in found.reason
    low_end, high_end = found.findings[0].verdict.interval
    assert low_end <= found.findings[0].verdict.statistic <= high_end


@pytest.mark.parametrize(
    ("high", "degrees", "verdict"),
    [(0.45, 1000, "undecided"), (0.4, 1000, "does-not-hold"), (0.4, 2, "undecided")],
)
def test_how_surely_one_row_of_two_fails_depends_on_its_degrees_of_freedom(
    claim, high, degrees, verdict
):
    test = claim('bound = { table = "t", metric = "x", interval = ["low", "high"], least = 0.5 }')
    table = pd.DataFrame({"x": [0.0, 0.9], "low": [-high, 0.8], "high": [high, 1.0]})
    found = outcome(test, scores(), t=table.assign(degrees=degrees))
    assert found.verdict == verdict
    told = (found.reason.endswith("Among 2 tests none fails surely enough."), found.found.tests)
    assert told == ((True, 2) if verdict == "undecided" else (False, 0))


def test_what_is_of_the_runs_is_a_yes_or_no_of_each(claim):
    test = claim('on = "s"\nshare = { of = { tracker = "ours" }, by = "there" }')
    for value, unit in ((1.0, "of the runs"), (0.9, "")):
        assert outcome(test, scores().assign(there=value)).found.unit == unit


def test_a_ratio_is_of_pairs(claim):
    test = claim('ratio = { table = "t", longer = "a", shorter = "b" }')
    b = np.linspace(1, 2, 10)
    for factor, verdict in ((1.2, "holds"), (0.8, "does-not-hold")):
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


@pytest.mark.parametrize(("gain", "verdict"), [(0.2, "holds"), (0.0, "does-not-hold")])
def test_an_interaction_sets_rows_against_rows_of_the_same_scenes(claim, gain, verdict):
    def noisy(tracker, scene, **_):
        return 0.5 + scene / 1000 + (gain + 0.1 if tracker == "ours" else 0.0)

    def clean(tracker, scene, **_):
        return 0.5 + scene / 500 + (0.1 if tracker == "ours" else 0.0)

    frame = pd.concat([scores(noisy, noise=16.0, scenes=35), scores(clean, noise=0.0, scenes=35)])
    found = outcome(claim(INTERACTION), frame)
    assert found.verdict == verdict
    assert f"means {gain + 0.1:+.3f} and +0.100" in found.reason


PARTS = """
[claim.X-1.parts.kept.all]
of = { tracker = "ours" }
on = "s"

[claim.X-1.parts.quick.bound]
table = "t"
metric = "x"
most = 1.0
"""


def test_a_claim_with_parts_holds_where_all_do_and_says_which_does_not(claim):
    test = claim(PARTS)
    fine, slow = pd.DataFrame({"x": [0.5]}), pd.DataFrame({"x": [2.0]})
    assert outcome(test, scores(scenes=12), t=fine).verdict == "holds"
    found = outcome(test, scores(scenes=12), t=slow)
    assert found.verdict == "does-not-hold"
    assert (
        "kept: holds, never lost: 1.00 [0.78, 1.00] of the runs, 12 scenes; 24 of 24"
        in found.reason
    )
    assert "quick: does not hold, x: 2, 1 row; the greatest x is 2" in found.reason
    assert (found.found.of, found.found.statistic) == ("quick", 2.0)
    assert {f.group for f in found.findings} == {"", "kept", "quick"}
    lost = scores(lambda **_: 0.5)
    assert outcome(test, lost, t=fine).verdict == "does-not-hold"
    assert outcome(test, scores()).verdict == "undecided"
    with pytest.raises(LedgerError, match=r"claim X-1: test.parts.quick.most: input should be"):
        claim(PARTS.replace("most = 1.0", 'most = "x"'))


def test_what_nothing_can_show_is_not_testable_and_says_why(claim):
    found = outcome(claim('none = { reason = "no method is given." }'), scores())
    assert (found.verdict, found.reason) == ("not-testable", "no method is given.")
    assert found.readings == ""
