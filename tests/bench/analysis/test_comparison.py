"""Comparisons: answers, refusals, failed runs, and the same numbers in every format."""

import json
from dataclasses import replace
from math import nan

import numpy as np
import pandas as pd
import pytest

from tests.bench.analysis.conftest import compare
from trackmark.bench.analysis.comparison import subsets_of
from trackmark.bench.analysis.comparison_figures import write_differences
from trackmark.bench.analysis.comparison_tables import as_data, files, paragraph, screen_lines
from trackmark.bench.analysis.decisions import answer_of
from trackmark.bench.analysis.families import Families, read_families
from trackmark.bench.analysis.run_checks import (
    AllFailedError,
    ComparisonError,
    compared_measure,
)
from trackmark.bench.analysis.run_tables import SUMMARY
from trackmark.bench.statistics.intervals import mean_interval
from trackmark.bench.statistics.rules import decide, p_value
from trackmark.reports.renderers import to_csv

OVERLAP = SUMMARY[0]
ERROR = next(measure for measure in SUMMARY if measure.name == "centre_error")


def around(means, spread=0.01, repetitions=4, seed=0):
    """Return random scores, shape (n_sequences, repetitions), around a mean per sequence."""
    generator = np.random.default_rng(seed)
    return np.asarray(means)[:, None] + generator.normal(0, spread, (len(means), repetitions))


HARDNESS = np.linspace(0.3, 0.8, 10)


def ladder(names="abc", step=0.1, n=10):
    """Return scores of trackers, each better than the one before."""
    return {name: around(HARDNESS[:n] + step * k, seed=k) for k, name in enumerate(names)}


def test_compare_pairs_by_sequence_after_averaging_repetitions(make_runs):
    scores = {"a": around(HARDNESS + 0.05), "b": around(HARDNESS, seed=1, repetitions=2)}
    comparison = compare(make_runs(scores), OVERLAP)
    (pair,) = comparison.pairs
    differences = scores["a"].mean(axis=1) - scores["b"].mean(axis=1)
    assert pair.differences == pytest.approx(differences)
    assert pair.interval == pytest.approx(mean_interval(differences))
    assert (pair.decision.label, pair.wins) == ("better", 10)
    assert [standing.is_unbeaten for standing in comparison.standings] == [True, False]
    first = comparison.standings[0]
    assert first.interval == pytest.approx(mean_interval(scores["a"].mean(axis=1)))
    assert (first.ms_per_frame, first.fps) == (pytest.approx(2.0), pytest.approx(500))


def test_compare_takes_times_of_one_kind_for_all_trackers(make_runs):
    runs = make_runs({"a": around(HARDNESS[:2]), "b": around(HARDNESS[:2], seed=1)})
    timed = runs.drop_duplicates(["tracker", "sequence"]).assign(
        protocol="timing", ms_per_frame=1.0
    )

    def times(timings):
        standings = compare(pd.concat([runs, timings]), OVERLAP).standings
        return [round(entry.ms_per_frame, 3) for entry in standings]

    assert times(timed) == [1.0, 1.0]
    assert times(timed.iloc[:-1]) == [2.0, 2.0]


def test_compare_takes_lower_as_better_if_the_measure_does(make_runs):
    scores = {"a": around(HARDNESS + 0.05), "b": around(HARDNESS, seed=1)}
    (pair,) = compare(make_runs(scores), replace(ERROR, margin=0.01)).pairs
    assert (pair.decision.label, pair.wins) == ("better", 10)
    assert pair.difference == pytest.approx(-0.5, abs=0.1)
    assert pair.interval.low < pair.difference < pair.interval.high < 0
    equal = compare(make_runs({name: around(HARDNESS) for name in "ab"}), ERROR)
    assert "+0.00  [+0.00, +0.00]" in "\n".join(screen_lines(equal))  # no -0.00


def test_compare_corrects_for_all_pairs_or_those_of_one(make_runs):
    runs = make_runs(ladder("abcd"))
    pairs = compare(runs, OVERLAP).pairs
    against = compare(runs, OVERLAP, against="b")
    assert len(pairs) == 6
    assert [(pair.first, pair.second) for pair in against.pairs] == [
        ("b", "a"),
        ("b", "c"),
        ("b", "d"),
    ]
    for corrected, m in ((pairs, 6), (against.pairs, 3)):
        for pair in corrected:
            assert pair.interval == pytest.approx(mean_interval(pair.differences, 1 - 0.05 / m))
            expected = decide(pair.differences, 0.01, m)
            assert pair.decision.label == expected.label
    rows = as_data(against)["pairs"]
    assert [row["p_value"] for row in rows] == [p_value(pair.by_unit, 3) for pair in against.pairs]


@pytest.mark.parametrize("against", [None, "b"])
def test_stars_follow_from_the_printed_answers(make_runs, against):
    """With the intervals of 3 pairs `b` is better than `a`, but not with those of 6 pairs."""
    spread = np.array([-0.1, 0.1, -0.05, 0.05, 0, 0, 0.08, -0.08, 0.12, -0.12])
    gains = {"a": 0 * spread, "b": 0.085 + spread, "c": 0.085 - spread, "d": -0.2 + spread}
    scores = {name: (HARDNESS + gain)[:, None] for name, gain in gains.items()}
    comparison = compare(make_runs(scores), OVERLAP, against=against)
    losers = {
        pair.second if pair.decision.label == "better" else pair.first
        for pair in comparison.pairs
        if pair.decision.label in ("better", "worse")
    }
    stars = {standing.tracker for standing in comparison.standings if standing.is_unbeaten}
    assert losers == ({"a", "d"} if against else {"d"})
    assert stars == {"a", "b", "c", "d"} - losers
    note = "*: no other tracker is better" + (", in the pairs with b" if against else "")
    assert note in screen_lines(comparison)


def test_equivalent_needs_89_sequences_and_reason_is_printed(make_runs):
    def pair_of(n):
        easy = np.linspace(0.3, 0.8, n)
        scores = {"a": around(easy, 0.001), "b": around(easy + 0.002, 0.001, seed=1)}
        return compare(make_runs(scores), OVERLAP)

    few, many = pair_of(10), pair_of(89)
    reason = "inside ±0.01; a difference on 1 sequence in 20 would be missed in 60 %"
    assert many.pairs[0].decision.label == "equivalent"
    assert "a was equivalent to b" in paragraph(many)
    assert few.pairs[0].decision.reason == reason
    assert f"    {reason}" in screen_lines(few)
    advice = "Fix the number of sequences before you look at new scores."
    assert advice in screen_lines(few)
    assert files(few)[1].notes == [advice]
    assert advice not in screen_lines(many)
    assert f"inconclusive: {reason}" in paragraph(few)
    assert "an interval inside ±0.01 and 89 sequences" in paragraph(few)
    assert as_data(few)["pairs"][0]["units_needed_from"] == 89
    exact = paragraph(compare(make_runs(ladder("ab")), replace(OVERLAP, margin=0.0)))
    assert "equivalence needs a margin above 0" in exact


def test_fewer_than_6_sequences_have_differences_only(make_runs):
    comparison = compare(make_runs(ladder("ab", n=5)), OVERLAP)
    lines = screen_lines(comparison)
    assert "5 sequences: too few for intervals (6 needed)" in lines
    assert not any("*" in line for line in lines)
    assert [line.split()[0] for line in lines[-6:]] == ["s0", "s1", "s2", "s3", "s4", "mean"]
    assert lines[-6].endswith(f"{comparison.pairs[0].differences[0]:+.3f}")
    assert comparison.pairs[0].decision.reason == "only 5 of 6 sequences"
    assert as_data(comparison)["pairs"][0]["interval"] is None
    assert compare(make_runs(ladder("ab", n=1)), OVERLAP).pairs[0].difference < 0


def test_families_are_units_unless_scenes_are_forced(make_runs):
    names = [f"{family}:scene={scene}" for family in ("walk", "run") for scene in range(5)]
    runs = make_runs(ladder("ab"), names=names)
    by_family, by_scene = (compare(runs, OVERLAP, by_scene=forced) for forced in (0, 1))
    differences = by_scene.pairs[0].differences
    assert by_family.pairs[0].by_unit == pytest.approx(differences.reshape(2, 5).mean(axis=1))
    remedy = "use --unit scene for conclusions about new scenes of these sequences"
    assert remedy in " ".join(screen_lines(by_family))
    reason = f"only 2 of 6 families; {remedy}"
    assert as_data(by_family)["pairs"][0]["reason"] == reason
    assert files(by_family)[1].records["reason"][0] == reason
    assert files(by_family)[1].rows[0][-1].text == f"inconclusive: {reason}"
    assert by_scene.pairs[0].interval == pytest.approx(mean_interval(differences))
    assert "for new scenes of these sequences only" in " ".join(screen_lines(by_scene))
    assert "for new scenes of these sequences only" in paragraph(by_scene)


CLIPS = [f"clip{n}" for n in range(10)]
VIDEOS = {name: f"video{n // 2}" for n, name in enumerate(CLIPS)}


def test_declared_families_are_units(make_runs):
    runs = make_runs(ladder("ab"), names=CLIPS)
    comparison = compare(runs, OVERLAP, families=Families(VIDEOS, "families"))
    (pair,) = comparison.pairs
    assert pair.by_unit == pytest.approx(pair.differences.reshape(5, 2).mean(axis=1))
    assert pair.decision.reason == "only 5 of 6 families"  # no advice on scenes
    data = as_data(comparison)
    assert (data["unit"], data["units"]) == ("family", [f"video{n}" for n in range(5)])
    assert "10 sequences (5 families)" in paragraph(comparison)
    alone = compare(runs, OVERLAP, families=Families({name: name for name in CLIPS}, "families"))
    assert as_data(alone) == as_data(compare(runs, OVERLAP))


def test_sequence_without_declared_family_is_refused(make_runs):
    runs = make_runs(ladder("ab"), names=CLIPS)
    message = r"f.csv: the sequence 'clip3' has no family \(1 of 10 sequences have none\)"
    for family in (None, np.nan, " "):
        with pytest.raises(ComparisonError, match=message):
            compare(runs, OVERLAP, families=Families(VIDEOS | {"clip3": family}, "f.csv"))


def test_families_are_read_from_a_file(tmp_path):
    file = tmp_path / "families.csv"
    file.write_text("\ufefffamily,note,sequence\nvideo 1,x,clip1\n\nvideo 1,,clip2\n", "utf-8")
    assert read_families(file).by_sequence == {"clip1": "video 1", "clip2": "video 1"}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("sequence;family\na;b\n", r"first line is 'sequence;family'\)\. Expected: columns"),
        ("sequence,family\na,\n", "line 2: 'a', ''. Give sequence and family"),
        ("sequence,family\na,b\na,c\n", "line 3: 'a' is on an earlier line"),
        (b"\xff\xfe", "not a CSV file"),
        (None, "No such file"),
    ],
)
def test_families_file_of_wrong_content_is_an_error(tmp_path, text, message):
    file = tmp_path / "families.csv"
    if text is not None:
        file.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(ComparisonError, match=message):
        read_families(file)


def test_sequence_without_any_score_is_left_out_and_named(make_runs):
    runs = make_runs(ladder())
    runs = changed(runs, runs.index[runs["sequence"] == "s3"], mean_overlap=np.nan)
    comparison = compare(runs, OVERLAP)
    expected = compare(runs[runs["sequence"] != "s3"], OVERLAP)
    assert [pair.interval for pair in comparison.pairs] == [
        pair.interval for pair in expected.pairs
    ]
    assert comparison.standings == expected.standings
    note = "s3 left out: mean overlap is undefined for all trackers."
    assert note in " ".join(screen_lines(comparison))
    assert note in paragraph(comparison)
    assert as_data(comparison)["undefined"] == ["s3"]


def test_paragraph_states_methods_and_answers(make_runs):
    text = paragraph(compare(make_runs(ladder()), OVERLAP))
    assert "on 10 sequences, 4 runs each; the unit is the sequence" in text
    assert "is the wider one of Student's t interval and of Hall's skewness-corrected" in text
    assert "interval, at 98.33 % each (Bonferroni over 3 comparisons, together 95 %)" in text
    assert "together 95 %), for new sequences of the same kind as these" in text
    assert "a was worse than c (difference -0.2" in text


def test_hidden_reasons_are_announced_without_advice(make_runs):
    comparison = compare(make_runs({name: around(HARDNESS, 0.05) for name in "abcdefg"}), OVERLAP)
    lines = screen_lines(comparison)
    assert not any("would be missed" in line for line in lines)
    assert lines[-2:] == ["reasons: --verbose", "15 more pairs: --verbose"]
    complete = "\n".join(screen_lines(comparison, verbose=True))
    assert "would be missed" in complete
    assert "Fix the number of sequences" in complete


def test_many_trackers_are_summarised_for_the_best_one(make_runs):
    comparison = compare(make_runs(ladder("abcdefg", step=0.03)), OVERLAP)
    lines = screen_lines(comparison)
    assert sum(" - g " in line for line in lines) == 6
    assert lines[-1] == "15 more pairs: --verbose"
    assert sum(" - " in line for line in screen_lines(comparison, verbose=True)) == 21
    assert screen_lines(comparison, quiet=True) == [answer_of(comparison).heading]
    text = paragraph(comparison)
    assert "a was worse than g (difference -0.1" in text
    assert text.endswith("The other 15 pairs are in the table of pairs.")


def test_failed_runs_count_and_are_named(make_runs):
    runs = make_runs(ladder("ab"))
    failure = "frame 3: ValueError: empty box\ntraceback"
    runs = changed(runs, [3], status="failed", failure=failure, mean_overlap=0.0, first_loss=1.0)
    comparison = compare(runs, OVERLAP)
    note = "1 of 40 runs failed (counted as 0): sequence s0, ValueError: empty box"
    assert comparison.scores["a"][0][3] == 0.0
    assert screen_lines(comparison)[0] == f"a: {note}"
    assert as_data(comparison)["trackers"][0]["failures"] == note
    assert f"a: {note}." in paragraph(comparison)


def test_tracker_without_finished_runs_is_left_out(make_runs):
    runs = make_runs(ladder())
    failed = changed(runs, runs.index[runs["tracker"] == "a"], status="failed", failure="no")
    comparison = compare(failed, OVERLAP)
    assert comparison.left_out == ["a"]
    assert [(pair.first, pair.second) for pair in comparison.pairs] == [("b", "c")]
    assert screen_lines(comparison)[0].startswith("a: 40 of 40 runs failed (left out)")
    against = compare(failed, OVERLAP, against="a")
    assert (against.left_out, against.pairs) == (["a"], [])
    assert "b was" not in paragraph(against)
    alone = compare(failed, OVERLAP, ["a", "b"])
    assert not any(line.startswith("Differences") for line in screen_lines(alone))
    assert "1 tracker was compared" in paragraph(alone)
    with pytest.raises(AllFailedError, match="a: 40 of 40 runs failed"):
        compare(runs.assign(status="failed", failure="no"), OVERLAP)


def test_same_boxes_and_trackers_not_repeatable_are_named(make_runs):
    evidence = {"same_boxes": {("b", "a"): 4}, "not_repeatable": {"b", "other"}}
    comparison = compare(make_runs(ladder("ab")), OVERLAP, **evidence)
    lines = screen_lines(comparison)
    assert any(line.startswith("b (not repeatable) ") for line in lines)
    assert "same boxes on 4 of 10 sequences" in lines[-1]
    data = as_data(comparison)
    assert data["pairs"][0]["same_boxes"] == 4
    assert [tracker["repeatable"] for tracker in data["trackers"]] == [True, False]
    assert "same boxes on 4 of 10 sequences" in data["paragraph"]


def test_parts_are_parameters_of_scenes_averaged_by_unit(make_runs):
    names = [f"walk:scene={n}:light={light}" for light in ("dim", "full") for n in range(4)]
    scores = {"a": around([0.5] * 8), "b": around([0.5] * 4 + [0.3] * 4, seed=1)}
    comparison = compare(make_runs(scores, names=names), OVERLAP)
    table = files(comparison)[-1]
    dim, full = table.records.to_dict("records")
    assert (table.name, dim["parameter"], dim["value"]) == ("comparison-subsets", "light", "dim")
    assert (full["value"], full["sequences"], len(comparison.units)) == ("full", 4, 4)
    assert full["difference"] == pytest.approx(comparison.pairs[0].differences[4:].mean())


def test_parts_of_have_defaults_and_order_numbers_by_size():
    names = ["a/b", "a/b:noise=30", "a/b:noise=5", "a/b:noise=10:scene=2", "c/d", "c/d:scene=1"]
    parts = subsets_of(names)
    assert list(parts) == [("noise", value) for value in ("default", "5", "10", "30")]
    assert parts["noise", "default"].tolist() == [True, *[False] * 5]
    assert subsets_of(["a/b:noise=30", "c/d"]) == {}


def test_parts_include_attributes_of_some_sequences(make_runs):
    names = [f"clip{n}" for n in range(8)]
    scores = {"a": around([0.5] * 8), "b": around([0.5] * 4 + [0.3] * 4, seed=1)}
    having = {name: {"whole", *({"blur"} if n >= 4 else ())} for n, name in enumerate(names)}
    comparison = compare(make_runs(scores, names=names), OVERLAP, attributes=having)
    (part,) = as_data(comparison)["subsets"]  # all sequences have `whole`
    assert (part["parameter"], part["value"], part["sequences"]) == ("attribute", "blur", 4)
    assert part["difference"] == pytest.approx(0.2, abs=0.02)


def changed(runs, rows, **values):
    for name, value in values.items():
        runs.loc[rows, name] = value
    return runs


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda runs: changed(runs, [3], status="missing"),
            "tracker a, sequence s0, repetition 3: the run is missing \\(1 of 80",
        ),
        (lambda runs: changed(runs, [3], status="stale"), "the run is stale"),
        (lambda runs: changed(runs, [3], mean_overlap=np.nan), "a, sequence s0: mean overlap is"),
        (lambda runs: runs.drop(index=range(4)), "tracker a, sequence s0: the run is missing"),
        (lambda runs: runs.drop(columns="mean_overlap"), "no score 'mean_overlap'"),
        (lambda runs: changed(runs, [3], fingerprint="edited"), "s0: its images or its ground"),
    ],
)
def test_runs_that_cannot_be_compared_are_named(make_runs, change, message):
    runs = make_runs({"a": around(HARDNESS), "b": around(HARDNESS, seed=1)})
    with pytest.raises(ComparisonError, match=message):
        compare(change(runs), OVERLAP)


def test_unknown_and_equal_labels_are_refused(make_runs):
    runs = make_runs({"a": around(HARDNESS), "b": around(HARDNESS, seed=1)})
    for options in ({"trackers": ["a", "z"]}, {"against": "z"}):
        with pytest.raises(ComparisonError, match=r"'z': no stored runs .* Stored are a, b"):
            compare(runs, OVERLAP, **options)
    with pytest.raises(ComparisonError, match="named twice"):
        compare(runs, OVERLAP, ["a", "a"])


def test_numbers_are_the_same_in_every_format(make_runs):
    comparison = compare(make_runs(ladder()), OVERLAP)
    data = json.loads(json.dumps(as_data(comparison), allow_nan=False))
    standings, pairs = files(comparison)[:2]
    assert 0 < pairs.records["p_value"].max() < 0.05
    assert pairs.records["p_value"].tolist() == [row["p_value"] for row in data["pairs"]]
    assert standings.records["mean"].tolist() == [row["mean"] for row in data["trackers"]]
    assert pairs.records["low"].tolist() == [row["interval"][0] for row in data["pairs"]]
    assert "c" in to_csv(standings)
    assert data["answer"] == answer_of(comparison).heading
    assert data["answer"].startswith(f"{comparison.main} is better than ")
    assert f": {max(row['mean'] for row in data['trackers']):.2f} against " in data["answer"]
    assert max(map(len, screen_lines(comparison))) <= 80
    assert len(screen_lines(comparison)) <= 20


@pytest.mark.parametrize("n", [5, 10])
def test_pairs_of_long_names_fit_a_terminal(make_runs, n):
    names = [f"multipart:particles={k}:features=colour,edges:model=adaptive" for k in (25, 200)]
    lines = screen_lines(compare(make_runs(ladder(names, n=n)), OVERLAP))
    assert max(map(len, lines)) <= 100
    assert names[1] in " ".join(lines)


def test_differences_are_drawn_if_there_are_pairs(make_runs, tmp_path):
    runs = make_runs(ladder())
    (path,) = write_differences(compare(runs, OVERLAP), tmp_path)
    assert path.name == "differences.png"
    runs.loc[runs["tracker"] != "a", "status"] = "failed"
    assert write_differences(compare(runs, OVERLAP), tmp_path) == []


@pytest.mark.parametrize("margin", [nan, -0.01, "x"])
def test_invalid_margin_is_refused(margin):
    with pytest.raises(ComparisonError, match=r"margin: .*Expected: a finite number of 0 or more"):
        compared_measure("native", margin=margin)
