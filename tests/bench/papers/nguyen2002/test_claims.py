"""The paper's claims on scores whose outcome is known."""

import numpy as np
import pandas as pd
import pytest

from bench.claims.conclusion import conclude
from bench.claims.evaluation import judge
from bench.claims.kinds import SCORES, NoTest, PartsTest
from bench.claims.ledger import read_claims
from bench.claims.measuring import named_columns
from bench.papers.nguyen2002.measures import CLIPS, set_table
from bench.papers.nguyen2002.reporting import verdicts_table
from bench.papers.nguyen2002.scores import COLOURED, LIGHTS

CLAIMS = read_claims("nguyen2002")
WRITTEN = "nguyen2002:preset=as-written"
FIRST = [f"nguyen2002/clip-{number:02}" for number in range(1, 6)]
ALL = range(1, 21)


def concluded(name, frame, **tables):
    tables |= {"sets": set_table(frame)}
    return conclude(CLAIMS[name], judge(CLAIMS[name], frame, tables))


def verdict(name, frame, **tables):
    return concluded(name, frame, **tables).verdict


def with_features(text, *features):
    return any(f"features={one}" in text for one in features)


def test_table_1_is_printed_and_not_judged(made_scores):
    found = concluded("NG-T1", made_scores(lambda *_: {}, scenes=2))
    assert found.verdict == "not-testable"
    usual = {"trace": "revised", "preset": "as-written", "definition": "ratio", "variant": ""}
    groups = {
        (one.group, one.metric): one.verdict.statistic
        for one in found.findings
        if one.reading == usual
    }
    assert groups["invariants", "tracked"] == 20
    assert groups["invariants", "detected"] == 21


def test_numbers_of_table_1_are_told_by_features(made_scores):
    def fares(text, sequence, scene, trace):
        return {"success": float(sequence != FIRST[0] or not with_features(text, "rgb"))}

    reason = concluded("NG-T1", made_scores(fares, scenes=2)).reason
    told = [
        f"{name} {mean:.3f} ({mean:.3f} to {mean:.3f})"
        for name, mean in (("intensity", 20), ("rgb", 19), ("invariants", 20))
    ]
    assert reason.startswith(f"tracked: {', '.join(told)}: means")
    assert "detected: intensity 21.000" in reason
    assert "prediction interval" in reason


def test_the_recording_is_tracked_throughout_by_the_invariants(made_scores):
    def fares(text, sequence, scene, trace):
        lost = trace == "online" or with_features(text, "arctan")
        return {"first_loss": 60} if lost else {}

    texts = [WRITTEN, f"{WRITTEN}:features=arctan", f"{WRITTEN}:features=rgb"]
    found = concluded("NG-1", made_scores(fares, texts, scenes=20, sequences=(LIGHTS,)))
    assert found.verdict == "holds"
    assert found.fragile
    assert found.under({"trace": "online"})[0] == "does-not-hold"
    assert found.under({"definition": "arctan"})[0] == "does-not-hold"
    lost = made_scores(lambda *_: {"first_loss": 60}, texts, scenes=20, sequences=(LIGHTS,))
    assert verdict("NG-1", lost) == "does-not-hold"


@pytest.mark.parametrize(
    ("lost_with", "white", "coloured"),
    [
        (COLOURED, "holds", "does-not-hold"),
        (LIGHTS, "does-not-hold", "undecided"),  # 10 of 10 leave too much to chance
        ("nothing", "holds", "undecided"),
    ],
)
def test_white_and_coloured_lamps_are_judged_one_by_one(made_scores, lost_with, white, coloured):
    def fares(text, sequence, scene, trace):
        return {"first_loss": 60} if sequence == lost_with else {}

    frame = made_scores(fares, [WRITTEN], scenes=20, sequences=(LIGHTS, COLOURED))
    frame = frame[(frame["sequence"] == LIGHTS) | (frame["scene"] < 10)]
    assert (verdict("NG-1", frame), verdict("NG-1a", frame)) == (white, coloured)
    few = frame[(frame["sequence"] == LIGHTS) | (frame["scene"] < 7)]
    assert verdict("NG-1a", few) == "undecided"


@pytest.mark.parametrize("features", ["intensity", "rgb"])
@pytest.mark.parametrize("moment", ["lost_at_switch", "lost_at_off"])
def test_losses_at_a_change_are_counted_by_features_and_of_the_first_beside(
    made_scores, features, moment
):
    names = {"intensity": ("NG-2", "NG-2a"), "rgb": ("NG-3", "NG-3a")}

    def said(scenes_lost, by):
        def fares(text, sequence, scene, trace):
            return {moment: float(with_features(text, features) == by and scene < scenes_lost)}

        frame = made_scores(fares, scenes=20, sequences=(LIGHTS,))
        return tuple(verdict(name, frame) for name in names[features])

    def expected(outcome):
        whole, first = outcome, "does-not-hold"
        return (whole, first) if moment == "lost_at_switch" else (first, whole)

    assert said(17, by=True) == expected("holds")
    assert said(16, by=True) == expected("undecided")
    assert said(17, by=False) == expected("does-not-hold")


@pytest.mark.parametrize(
    ("name", "metric", "trials"),
    [("NG-4", "detected_share", "occlusions"), ("NG-5", "kept_after_off", "clear_after_off")],
)
def test_occlusions_and_the_lamp_are_judged_by_occlusions_and_frames_of_the_invariants(
    made_scores, name, metric, trials
):
    def judged(share, features="invariants", trace="revised"):
        def fares(text, sequence, scene, which):
            is_meant = with_features(text, features) and which == trace
            return {metric: share(scene)} if is_meant else {}

        return concluded(name, made_scores(fares, scenes=20, sequences=(LIGHTS,)))

    assert judged(lambda _: 1.0).verdict == "holds"
    assert judged(lambda _: 0.5).verdict == "does-not-hold"
    assert judged(lambda _: 0.8).verdict != "holds"
    assert judged(lambda _: 0.5, features="rgb").verdict == "holds"
    online = judged(lambda _: 0.5, trace="online")
    assert (online.verdict, online.under({"trace": "online"})[0]) == ("holds", "does-not-hold")
    # A scene without any counts for nothing, and one with many for many.
    assert judged(lambda scene: 1.0 if scene else np.nan).verdict == "holds"
    frame = made_scores(lambda *_: {}, scenes=20, sequences=(LIGHTS,))
    first = frame["scene"] == 0
    many = frame.assign(**{metric: np.where(first, 0.0, 1.0), trials: np.where(first, 60.0, 3.0)})
    assert verdict(name, many) == "does-not-hold"
    assert concluded(name, many).findings[0].verdict.statistic == pytest.approx(57 / 117)


def clips_fail(features, number, trace=("revised", "online"), metric="success"):
    """Scores in which these features fail in so many clips of each set, more or less one."""

    def fares(text, sequence, scene, which):
        failing = [f"nguyen2002/clip-{clip:02}" for clip in ALL][1 : 1 + number + scene % 2]
        return (
            {metric: 0.0}
            if (with_features(text, *features) and which in trace and sequence in failing)
            else {}
        )

    return fares


@pytest.mark.parametrize(
    ("features", "comparable"),
    [((), "holds"), (("rgb",), "does-not-hold"), (("intensity",), "does-not-hold")],
)
@pytest.mark.parametrize("metric", ["success", "detected"])
def test_intensity_and_rgb_are_compared_by_clips_and_by_occlusions(
    made_scores, features, comparable, metric
):
    frame = made_scores(clips_fail(features, 3, metric=metric))
    assert verdict("NG-6", frame) == comparable
    assert verdict("NG-6", made_scores(clips_fail(("rgb", "intensity"), 3))) == "holds"


@pytest.mark.parametrize(("name", "metric"), [("NG-7", "success"), ("NG-8", "detected")])
def test_the_invariants_are_inferior_only_to_both_and_by_the_trace_that_shows_it(
    made_scores, name, metric
):
    invariants = ("invariants", "arctan")
    for features, trace, expected in (
        (invariants, ("revised", "online"), "holds"),
        (("rgb",), ("revised", "online"), "does-not-hold"),
        (("intensity", *invariants), ("revised", "online"), "does-not-hold"),
        (invariants, ("online",), "does-not-hold"),
    ):
        found = concluded(name, made_scores(clips_fail(features, 3, trace, metric)))
        assert found.verdict == expected, (features, trace)
    assert found.under({"trace": "online"})[0] == "holds"
    assert found.fragile
    few = made_scores(clips_fail(invariants, 3, metric=metric), scenes=4)
    assert verdict(name, few) == "undecided"


def reasons(margin=0.5, false_alarms=0.2, correlation=0.4):
    """Tables of ten sets: what RGB has more of the margin, less of false alarms, and ranks."""
    labels = [{"sequence": "nguyen2002/clips", "scene": scene} for scene in range(10)]
    wobble = [0.01 * (scene % 3) for scene in range(10)]
    return {
        "ng-9": pd.DataFrame(
            one
            | {
                "features": features,
                "margin": 1 + more * margin + w,
                "false_alarms": 0.3 - more * false_alarms + w * more,
            }
            for one, w in zip(labels, wobble, strict=True)
            for features, more in (("rgb", 1), ("invariants", 0))
        ),
        "ng-9-failures": pd.DataFrame(
            one | {"trace": trace, "preset": "as-written", "pairs": pairs, "correlation": value}
            for one, w in zip(labels, wobble, strict=True)
            for trace, sign in (("revised", 1), ("online", -1))
            for pairs, value in (("of a clip", sign * (correlation + w)), ("by chance", 0.0))
        ),
    }


def test_the_reason_needs_a_smaller_margin_false_alarms_and_failures_where_it_is_smaller(
    made_scores,
):
    frame = made_scores(lambda *_: {}, scenes=1)
    found = concluded("NG-9", frame, **reasons())
    assert found.verdict == "holds"
    assert found.under({"trace": "online"})[0] == "does-not-hold"
    for part in ("margin", "false_alarms", "correlation"):
        assert verdict("NG-9", frame, **reasons(**{part: -0.3})) == "does-not-hold", part
    tables = reasons()
    assert verdict("NG-9", frame, **{"ng-9": tables["ng-9"]}) == "undecided"
    # Correlations that scatter about 0 from set to set decide nothing, nor do those of few sets.
    failures = tables["ng-9-failures"]
    scattered = failures.assign(
        correlation=np.where(failures["scene"] % 2, -0.8, 1.0) * (failures["pairs"] == "of a clip")
    )
    assert verdict("NG-9", frame, **tables | {"ng-9-failures": scattered}) == "undecided"
    few = failures[failures["scene"] < 7]
    assert verdict("NG-9", frame, **tables | {"ng-9-failures": few}) == "undecided"


def test_the_ranking_turns_with_the_illumination(made_scores):
    def fares(turns):
        def known(text, sequence, scene, trace):
            gains = (sequence == LIGHTS) == turns and with_features(text, "invariants", "arctan")
            return {"on_target": 0.6 + 0.01 * (scene % 3) + 0.3 * gains}

        return known

    for turns, expected in ((True, "holds"), (False, "does-not-hold")):
        assert verdict("NG-9a", made_scores(fares(turns), scenes=12)) == expected


def test_full_covariances_are_compared_by_the_variant_of_both_features(made_scores):
    texts = [
        f"{WRITTEN}:features={features}{more}"
        for features in ("rgb", "invariants")
        for more in ("", ":covariance=diagonal")
    ]

    def fares(text, sequence, scene, trace):
        worse = "diagonal" in text and sequence in FIRST[: 2 + scene % 2]
        return {"success": 0.0, "detected": 0.0, "mean_overlap": 0.1} if worse else {}

    found = concluded("NG-18", made_scores(fares, texts))
    assert found.verdict == "holds"
    assert {one.group for one in found.findings} == {"", "rgb", "invariants"}
    assert verdict("NG-18", made_scores(lambda *_: {}, texts)) == "does-not-hold"
    assert verdict("NG-18", made_scores(fares, texts[::2])) == "undecided"


def test_smoothing_must_steady_and_cost_no_overlap(made_scores):
    texts = [f"{WRITTEN}:features=rgb", f"{WRITTEN}:features=rgb:report=raw"]

    def fares(shaken, cost):
        return lambda text, sequence, scene, trace: {
            "jitter": 0.5 + 0.01 * (scene % 3) + shaken * ("raw" in text),
            "mean_overlap": 0.9 - cost * ("raw" in text),
        }

    for shaken, cost, expected in (
        (0.3, 0.0, "holds"),
        (0.0, 0.0, "does-not-hold"),
        (0.3, 0.1, "does-not-hold"),
    ):
        assert verdict("NG-20", made_scores(fares(shaken, cost), texts)) == expected


def measured(metric, of, values, features=("intensity", "rgb", "invariants"), **more):
    """A table of ten sets, with a metric by the values of a column."""
    return pd.DataFrame(
        {"sequence": "nguyen2002/clips", "scene": scene, "features": one, of: value, **more}
        | {metric: number + 0.001 * (scene % 3)}
        for scene in range(10)
        for one in features
        for value, number in values.items()
    )


@pytest.mark.parametrize(
    ("name", "metric", "of", "values"),
    [
        ("NG-12", "flagged", "part", {"corners": 0.9, "three times inside": 0.3}),
        ("NG-13", "flagged", "rebootstrap", {"off": 0.9, "on": 0.1}),
        ("NG-19", "centre_error", "norm", {"huber": 1.0, "quadratic": 3.0}),
    ],
)
def test_what_was_measured_decides_by_the_side_that_should_be_greater(
    made_scores, name, metric, of, values
):
    frame = made_scores(lambda *_: {}, scenes=1)
    table = name.lower()
    assert verdict(name, frame, **{table: measured(metric, of, values)}) == "holds"
    turned = dict(zip(values, reversed(values.values()), strict=True))
    assert verdict(name, frame, **{table: measured(metric, of, turned)}) == "does-not-hold"
    assert verdict(name, frame) == "undecided"


def test_the_gate_must_serve_the_template_and_the_overlap(made_scores):
    frame = made_scores(lambda *_: {}, scenes=1)
    for error, overlap, expected in (
        (0.5, 0.1, "holds"),
        (0.0, 0.1, "does-not-hold"),
        (0.5, 0.0, "does-not-hold"),
    ):
        table = measured("template_error", "gate", {"on": 0.2, "off": 0.2 + error})
        table["overlap"] = np.where(table["gate"] == "on", 0.8 + overlap, 0.8)
        table["overlap"] += 0.001 * (table["scene"] % 3)
        assert verdict("NG-11", frame, **{"ng-11": table}) == expected


def test_no_way_of_tracking_may_take_longer_than_a_frame_lasts(made_scores):
    frame = made_scores(lambda *_: {}, scenes=1)
    times = pd.DataFrame({"milliseconds": [2.0, 39.0], "preset": "as-written"})
    assert verdict("NG-10", frame, **{"ng-10": times}) == "holds"
    slow = times.assign(milliseconds=[2.0, 41.0])
    assert verdict("NG-10", frame, **{"ng-10": slow}) == "does-not-hold"


@pytest.mark.parametrize(
    ("metric", "values"),
    [
        ("mean_overlap", (0.9, 0.87)),
        ("mean_overlap", (0.87, 0.9)),
        ("false_occlusions", (0.1, 0.8)),
    ],
)
def test_noise_may_change_neither_overlap_nor_false_occlusions_by_any_features(
    made_scores, metric, values
):
    frame = made_scores(lambda *_: {}, scenes=1)
    least, most = values
    for changed, expected in (((), "holds"), (("invariants",), "does-not-hold")):
        tables = [
            measured(metric, "noise", {1.0: least, 8.0: most if one in changed else least}, [one])
            for one in ("intensity", "rgb", "invariants")
        ]
        other = {"mean_overlap": 0.9, "false_occlusions": 0.1}
        other.pop(metric)
        table = pd.concat(tables).assign(**other, trace="revised")
        assert verdict("NG-22", frame, **{"ng-22-lines": table}) == expected


def test_verdicts_stand_by_trace_definition_and_preset(made_scores):
    texts = [WRITTEN, "nguyen2002", f"{WRITTEN}:longest_occlusion=67"]

    def fares(text, sequence, scene, trace):
        return {"first_loss": 60} if trace == "online" and "67" in text else {}

    frame = made_scores(fares, texts, scenes=20, sequences=(LIGHTS,))
    (row,) = verdicts_table([concluded("NG-1", frame)]).data.to_dict("records")
    assert row["as written, revised boxes"] == "holds"
    assert row["recommended (post hoc), online"] == "holds"
    assert (row["L = 67, revised"], row["L = 67, online"]) == ("holds", "does not hold")
    assert row["arctan, revised"] == "—"


def test_readings_that_were_not_run_or_change_nothing_have_no_verdict(made_scores):
    def row(name, **tables):
        frame = made_scores(lambda *_: {}, [WRITTEN], scenes=1)
        (row,) = verdicts_table([concluded(name, frame, **tables)]).data.to_dict("records")
        return list(row.values())[1:]

    times = pd.DataFrame({"preset": ["as-written", "recommended"], "milliseconds": 1.0})
    written, post_hoc = ["holds", *["—"] * 4], ["holds", *["—"] * 3]
    assert row("NG-10", **{"ng-10": times}) == written + post_hoc
    sliding = pd.DataFrame({"features": ["rgb"], "declared": 1.0, "contaminated": 0.0})
    assert row("NG-16", **{"ng-16": sliding}) == ["holds", *["—"] * 8]
    assert row("NG-18") == ["--all"] * 9


def test_features_that_were_not_measured_are_told_so(made_scores):
    frame = made_scores(lambda *_: {}, [WRITTEN], scenes=1)
    table = pd.concat(
        pd.DataFrame(
            {
                "sequence": CLIPS,
                "scene": range(20),
                "features": features,
                "hidden": hidden,
                "exceeds": hidden,
                "stays_below": 1 - hidden,
            }
        )
        for features in ("rgb", "invariants")
        for hidden in (0.0, 1.0)
    )
    reason = concluded("NG-15", frame, **{"ng-15": table}).reason
    assert "not measured for intensity; holds for rgb" in reason
    assert "undecided for intensity" not in reason


def test_every_column_of_scores_and_sets_that_a_claim_names_is_there(made_scores):
    frame = made_scores(lambda *_: {}, scenes=1)
    known = {SCORES: set(frame), "sets": set(set_table(frame)) | {"repetition", "frames"}}
    for claim in CLAIMS.values():
        tests = claim.test.parts.values() if isinstance(claim.test, PartsTest) else [claim.test]
        for test in tests:
            assert not isinstance(test, NoTest)
            if test.table in known:
                assert set(named_columns(test)) <= known[test.table], claim.id
