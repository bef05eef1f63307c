"""From scores to findings and conclusions, on scores whose outcome is known."""

from itertools import product

import numpy as np
import pandas as pd
import pytest

from bench.claims.conclusion import conclude
from bench.claims.judging import NOT_RUN, judge, judge_all
from bench.claims.ledger import read_claims
from bench.claims.sides import run_key
from bench.papers.multipart.measures import CHECKS

CLAIMS = read_claims("multipart")
LENGTH = 200
METRICS = ("success_frames", "frames_inside", "first_loss")


def run(representation, initial="full", variant=""):
    """Columns of a run that say how the tracker was run."""
    init = "boxes" if initial == "body" else initial
    own = f":{variant}" if variant else ""
    text = f"multipart:init={init}:representation={representation}{own}"
    told = {"tracker": "multipart", "representation": representation, "init": init}
    return {**told, "settled": run_key(text), "failure": ""}


def scores(shares, *, initials=("full",), variants=("",), kept=lambda scene: True, **columns):
    """Runs of eight sequences, twelve scenes: six even, six dappled, two repetitions.

    `shares` is called with representation, sequence number, scene, and the reading's labels,
    and gives the share of the length, of all metrics or by metric.
    """
    rows = []
    for number, scene, initial, variant, representation in product(
        range(1, 9), range(12), initials, variants, ("single", "multi", "adaptive")
    ):
        light = "even" if scene < 6 else "dappled"
        share = shares(representation, number, scene, initial, variant, light)
        share = share if isinstance(share, dict) else dict.fromkeys(METRICS, share)
        known = {"sequence": f"multipart/{number}", "scene": scene, "light": light}
        known |= {"frames": LENGTH, "kept_scene": kept(scene)}
        known |= {name: LENGTH * value for name, value in share.items()}
        told = {**run(representation, initial, variant), **known, **columns}
        rows += [{**told, "repetition": repetition} for repetition in (0, 1)]
    return pd.DataFrame(rows)


def as_claimed(representation, number, scene, initial, variant, light):
    """Multi better on two colours, worse on plain targets; the choice is right."""
    wobble = 0.01 * (scene % 3)
    loses = (representation == "single") == (number in (1, 2, 5, 6))
    return 0.6 + wobble if loses and representation != "adaptive" else 1.0


def concluded(name, frame, **tables):
    return conclude(CLAIMS[name], judge(CLAIMS[name], frame, tables, CHECKS))


@pytest.mark.parametrize(
    "name", ["MP-1", "MP-2", "MP-3", "MP-4", "MP-4a", "MP-5", "MP-6", "MP-12", "MP-14", "MP-18"]
)
def test_an_outcome_as_the_paper_claims_it_makes_its_claims_hold(name):
    assert concluded(name, scores(as_claimed)).verdict == "holds"


def test_a_claim_is_not_judged_where_what_tests_it_was_not_asked_for():
    claims = {name: CLAIMS[name] for name in ("MP-1", "MP-18", "MP-17")}
    tables = {"layout": pd.DataFrame({"single": [0.0], "multi": [0.9]})}
    for asked, verdict in (
        (None, "holds"),
        (["multipart-table-1"], "holds"),
        (["multipart-twin"], "inconclusive"),
    ):
        first, other, needs_none = judge_all(claims, scores(as_claimed), tables, CHECKS, asked)
        assert [first.verdict, other.verdict] == [verdict] * 2
        assert first.reason.startswith(NOT_RUN) == (verdict == "inconclusive")
        assert needs_none.reason.startswith("only 1 of 12 targets")


@pytest.mark.parametrize("name", ["MP-14", "MP-18"])
def test_share_of_the_length_is_that_of_the_typical_scene(name):
    def lost_at(share):
        def tracked(representation, number, *rest):
            claimed = as_claimed(representation, number, *rest)
            return share if (representation, number) == ("adaptive", 7) else claimed

        return tracked

    found = concluded(name, scores(lost_at(337 / 377)))
    assert found.verdict == "holds"
    assert concluded(name, scores(lambda *_: 0.5)).verdict == "does not hold"


def test_lost_targets_are_counted_over_the_scenes_of_all_sequences():
    def of_twelve(lost):
        def tracked(representation, number, scene, *rest):
            often = scene < lost.get(number, 12)
            return 0.5 if representation == "single" and often else 1.0

        return concluded("MP-3", scores(tracked))

    assert of_twelve({1: 6}).found.statistic == 42 / 48
    assert of_twelve({1: 6}).verdict == "holds"
    assert of_twelve({1: 3, 2: 0}).verdict == "inconclusive"
    assert of_twelve({1: 0, 2: 0, 5: 3}).verdict == "does not hold"


@pytest.mark.parametrize("name", ["MP-1", "MP-2", "MP-3", "MP-4", "MP-4a", "MP-5"])
def test_the_opposite_makes_them_fail(name):
    swap = {"single": "multi", "multi": "single", "adaptive": "adaptive"}
    frame = scores(lambda representation, *rest: as_claimed(swap[representation], *rest))
    assert concluded(name, frame).verdict == "does not hold"


def test_a_choice_that_is_wrong_is_not_the_best():
    frame = scores(lambda name, *rest: 0.5 if name == "adaptive" else as_claimed(name, *rest))
    assert concluded("MP-6", frame).verdict == "does not hold"
    assert concluded("MP-14", frame).verdict == "does not hold"


def test_a_cell_is_a_sequence_in_a_scene_averaged_over_repetitions():
    frame = scores(as_claimed)
    found = {f.group: f for f in judge(CLAIMS["MP-1"], frame) if f.light == "both"}
    assert found[""].verdict.cells == 48
    assert found["multipart/5"].verdict.cells == 12
    expected = 1 - np.mean([0.6 + 0.01 * (scene % 3) for scene in range(12)])
    assert found[""].verdict.statistic == pytest.approx(expected)


def test_each_light_is_judged_and_six_scenes_of_one_sequence_decide_nothing():
    found = judge(CLAIMS["MP-4a"], scores(as_claimed))
    by_light = {f.light: f.verdict.verdict for f in found}
    assert by_light == {"both": "holds", "even": "inconclusive", "dappled": "inconclusive"}


def test_scenes_that_the_gate_dropped_count_among_the_drawn_only():
    frame = scores(as_claimed, kept=lambda scene: scene < 2)
    found = concluded("MP-4a", frame)
    assert (found.verdict, found.drawn) == ("inconclusive", "holds")
    assert "only 2 of 12 scenes" in found.reason
    assert concluded("MP-4a", scores(as_claimed, kept=lambda scene: False)).drawn == "holds"


def test_inside_and_loss_must_agree():
    def disagreeing(representation, *rest):
        share = as_claimed(representation, *rest)
        return {"success_frames": share, "frames_inside": share, "first_loss": 0.5}

    found = concluded("MP-1", scores(disagreeing))
    assert found.verdict == "inconclusive"
    assert found.reason.startswith("the metrics do not agree")

    def success_alone_differs(representation, *rest):
        share = as_claimed(representation, *rest)
        return {"success_frames": 0.5, "frames_inside": share, "first_loss": share}

    assert concluded("MP-1", scores(success_alone_differs)).verdict == "holds"


def test_readings_are_counted_and_a_flip_is_fragile():
    def flips(representation, number, scene, initial, variant, light):
        swap = {"single": "multi", "multi": "single"} if initial != "full" else {}
        name = swap.get(representation, representation)
        return as_claimed(name, number, scene, initial, variant, light)

    found = concluded("MP-1", scores(flips, initials=("full", "tight", "body")))
    assert found.verdict == "holds"
    assert found.readings == "1 of 2"  # two rectangles; the third is post hoc
    assert found.post_hoc == "0 of 1"  # the body rectangle was chosen after results
    assert found.fragile
    labels = {(f.reading["initial"], f.post_hoc) for f in found.findings}
    assert labels == {("full", False), ("tight", False), ("body", True)}
    assert not concluded("MP-1", scores(as_claimed)).fragile


def test_a_variant_that_is_no_reading_is_ignored_but_by_the_claim_that_names_it():
    def worse_if_first_order(representation, number, scene, initial, variant, light):
        return 0.5 if variant == "dynamics=first-order" and number < 5 else 1.0

    frame = scores(worse_if_first_order, variants=("", "dynamics=first-order"))
    assert {f.reading["text"] for f in judge(CLAIMS["MP-14"], frame)} == {"as written"}
    found = judge(CLAIMS["MP-10"], frame)
    headline = [f for f in found if f.light == "both" and f.metric == "first_loss"]
    by_group = {f.group: f.verdict.verdict for f in headline if f.scenes == "kept"}
    assert by_group == {
        "": "holds",
        "moving camera": "holds",
        "fixed camera": "does not hold",
    }


def failing(frame, where):
    """Runs of which some failed, without scores."""
    frame.loc[where, "failure"] = "T on multipart/5, repetition 1: frame 3: why"
    frame.loc[where, [*METRICS]] = np.nan
    return frame


def test_failed_run_has_the_worst_score_and_is_named():
    frame = scores(as_claimed)
    is_multi = frame["representation"] == "multi"
    where = is_multi & (frame["scene"] == 3) & (frame["sequence"] == "multipart/5")
    found = concluded("MP-1", failing(frame, where & (frame["repetition"] == 1)))
    assert found.found.cells == 48
    mean = 1 - np.mean([0.6 + 0.01 * (scene % 3) for scene in range(12)])
    assert found.found.statistic == pytest.approx(mean - 0.5 / 48)
    assert (
        "1 of 192 runs failed (worst score): T on multipart/5, repetition 1: frame 3: why"
        in found.reason
    )


def test_tracker_without_a_finished_run_makes_its_claim_inconclusive():
    frame = scores(as_claimed)
    found = concluded("MP-1", failing(frame, frame["representation"] == "multi"))
    assert found.verdict == "inconclusive"
    assert found.reason.endswith("all runs of multipart failed: frame 3: why")


def test_claim_without_runs_is_inconclusive_and_names_the_experiment():
    found = concluded("MP-10", scores(as_claimed))
    assert found.verdict == "inconclusive"
    assert (
        found.reason
        == "not run: experiment multipart-table-1, multipart-dropped, multipart-dynamics"
    )
    assert concluded("MP-8", scores(as_claimed)).verdict == "inconclusive"


def test_a_missing_column_is_named():
    with pytest.raises(ValueError, match="claim MP-1: the scores have no column 'light'"):
        judge(CLAIMS["MP-1"], scores(as_claimed).drop(columns="light"))
    with pytest.raises(ValueError, match="claim MP-16: the scores have no column 'distance'"):
        judge(CLAIMS["MP-16"], scores(as_claimed))
