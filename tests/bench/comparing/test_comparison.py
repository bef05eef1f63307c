"""Comparisons: what is answered, what is refused, and what the numbers are."""

import json

import numpy as np
import pytest

from bench.comparing.comparison import ComparisonError, compare, parts_of
from bench.comparing.figures import write_figures
from bench.comparing.published import with_published
from bench.comparing.tables import as_data, files, screen
from bench.comparing.words import paragraph, spoken_of
from bench.reporting.tables import SUMMARY
from bench.statistics.intervals import mean_interval
from bench.statistics.paired import signed_rank
from reports.comparison import (
    Breaks,
    Point,
    breaking_plot,
    difference_plot,
    rank_plot,
    speed_accuracy_plot,
)
from reports.palette import colour
from reports.renderers import to_csv, to_text

OVERLAP = SUMMARY[0]
ERROR = next(measure for measure in SUMMARY if measure.name == "centre_error")


def around(means, spread=0.01, repetitions=4, seed=0):
    """Scores (sequences, repetitions) about a mean a sequence."""
    generator = np.random.default_rng(seed)
    return np.asarray(means)[:, None] + generator.normal(0, spread, (len(means), repetitions))


HARDNESS = np.linspace(0.3, 0.8, 10)


def test_a_pair_is_paired_by_sequence_after_averaging_over_repetitions(make_runs):
    scores = {"a": around(HARDNESS + 0.05), "b": around(HARDNESS, seed=1, repetitions=2)}
    found = compare(make_runs(scores), OVERLAP, 0.01)
    (pair,) = found.pairs
    differences = scores["a"].mean(axis=1) - scores["b"].mean(axis=1)
    assert pair.differences == pytest.approx(differences)
    assert pair.interval == pytest.approx(mean_interval(differences))
    assert pair.p == pair.adjusted == pytest.approx(signed_rank(differences))
    assert pair.answer == "better"
    assert [standing.contender for standing in found.standings] == [True, False]
    assert found.standings[0].milliseconds == pytest.approx(2.0)
    assert not found.standings[0].timed


def test_less_is_better_where_the_measure_says_so(make_runs):
    scores = {"a": around(HARDNESS + 0.05), "b": around(HARDNESS, seed=1)}
    (pair,) = compare(make_runs(scores), ERROR, 0.01).pairs
    assert pair.answer == "better"
    assert pair.difference == pytest.approx(-0.5, abs=0.1)
    assert pair.probability == 1.0


def test_equal_is_a_finding_and_doubt_says_what_would_end_it(make_runs):
    generator = np.random.default_rng(2)
    scores = {
        "a": around(HARDNESS, 0.001),
        "b": around(HARDNESS + 0.002, 0.001, seed=1),
        "c": around(HARDNESS + generator.normal(0.02, 0.08, 10), 0.001),
    }
    pairs = {
        (pair.first, pair.second): pair for pair in compare(make_runs(scores), OVERLAP, 0.01).pairs
    }
    assert pairs["a", "b"].answer == "practically equal"
    assert np.isnan(pairs["a", "b"].needed)
    assert "practically equal (within ±0.01) to" in paragraph(
        compare(make_runs(scores), OVERLAP, 0.01)
    )
    assert pairs["a", "c"].answer == "cannot tell"
    assert pairs["a", "c"].needed > 10


def test_few_sequences_tell_of_new_seeds_alone(make_runs):
    scores = {"a": around([0.5, 0.6]), "b": around([0.4, 0.5], seed=1)}
    found = compare(make_runs(scores), OVERLAP, 0.01)
    assert found.question == "new seeds"
    assert found.pairs[0].answer == "better"
    (_, pairs) = screen(found)
    assert "Other sequences" in pairs.notes[-1]
    asked = compare(make_runs(scores), OVERLAP, 0.01, question="new sequences")
    assert asked.pairs[0].answer == "cannot tell"
    once = {"a": [[0.5], [0.6]], "b": [[0.4], [0.5]]}
    (pair,) = compare(make_runs(once), OVERLAP, 0.01).pairs
    assert (pair.answer, pair.interval) == ("cannot tell", None)
    assert paragraph(compare(make_runs(once), OVERLAP, 0.01)).endswith("(difference +0.100).")


def test_a_pair_that_never_draws_has_no_p_beside_one_that_does(make_runs):
    scores = {"a": around([0.5, 0.6]), "b": [[0.4], [0.5]], "c": [[0.3], [0.4]]}
    found = compare(make_runs(scores), OVERLAP, 0.01)
    shown = screen(found)[1]
    by_pair = {row[0].text: row[5].text for row in shown.rows}
    assert by_pair["B - C"] == "—"
    assert by_pair["A - B"] != "—"
    assert shown.notes[0].startswith("—: neither was repeated")
    assert [pair["p"] is None for pair in as_data(found)["pairs"]] == [False, False, True]


def test_five_sequences_can_show_nothing_and_it_says_how_many_could(make_runs):
    scores = {"a": around(HARDNESS[:5] + 0.2), "b": around(HARDNESS[:5], seed=1)}
    found = compare(make_runs(scores), OVERLAP, 0.01)
    assert found.pairs[0].answer == "cannot tell"
    assert found.pairs[0].needed >= 6
    assert "6 or more can" in screen(found)[1].notes[-1]
    assert "no difference could be shown" in paragraph(found)


def test_holm_is_over_all_pairs(make_runs):
    scores = {name: around(HARDNESS[:6] + 0.1 * n, seed=n) for n, name in enumerate("abc")}
    found = compare(make_runs(scores), OVERLAP, 0.01)
    assert {pair.p for pair in found.pairs} == {0.03125}
    assert [pair.adjusted for pair in found.pairs] == pytest.approx([3 * 0.03125] * 3)
    assert {pair.answer for pair in found.pairs} == {"cannot tell"}


def test_time_to_failure_differs_where_means_do_not(make_runs):
    same = around(HARDNESS, 0.001)
    runs = make_runs({"a": same, "b": same}, lost_at={"a": 20, "b": 100})
    found = compare(runs, OVERLAP, 0.01)
    assert found.pairs[0].answer == "practically equal"
    assert found.pairs[0].loss_p < 0.001
    assert screen(found)[1].notes == [
        "p of losses is over runs: of these sequences, with new seeds."
    ]
    assert [standing.kept for standing in found.standings] == [0.0, 1.0]


def test_knobs_of_the_scenes_are_set_apart(make_runs):
    names = [f"walk:scene={n}:light={light}" for light in ("dim", "full") for n in range(4)]
    scores = {"a": around([0.5] * 8), "b": around([0.5] * 4 + [0.3] * 4, seed=1)}
    found = compare(make_runs(scores, names=names), OVERLAP, 0.01)
    parts = found.by_part(found.pairs[0])
    assert list(parts) == [("light", "dim"), ("light", "full")]
    assert parts["light", "full"].mean() == pytest.approx(0.2, abs=0.02)
    assert [table.name for table in files(found)][-1] == "comparison-parts"


def test_what_a_name_does_not_say_is_a_value_too_and_numbers_stand_by_their_size():
    names = ["a/b", "a/b:noise=30", "a/b:noise=5", "a/b:noise=10:scene=2", "c/d", "c/d:scene=1"]
    parts = parts_of(names)
    assert list(parts) == [("noise", value) for value in ("default", "5", "10", "30")]
    assert parts["noise", "default"].tolist() == [True, *[False] * 5]
    assert parts_of(["a/b:noise=30", "c/d"]) == {}


def test_sequences_with_an_attribute_are_set_apart_from_those_without(make_runs):
    names = [f"clip{n}" for n in range(8)]
    scores = {"a": around([0.5] * 8), "b": around([0.5] * 4 + [0.3] * 4, seed=1)}
    having = {name: {"whole", *({"blur"} if n >= 4 else ())} for n, name in enumerate(names)}
    found = compare(make_runs(scores, names=names), OVERLAP, 0.01, attributes=having)
    (part,) = as_data(found)["parts"]  # `whole` tells nothing apart
    assert (part["knob"], part["value"], part["sequences"]) == ("attribute", "blur", 4)
    assert part["difference"] == pytest.approx(0.2, abs=0.02)


def changed(runs, rows, **values):
    for name, value in values.items():
        runs.loc[rows, name] = value
    return runs


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda runs: runs[runs["tracker"] == "a"], "two or more are needed"),
        (lambda runs: runs[runs["sequence"] == "s0"], "One sequence says nothing"),
        (lambda runs: changed(runs, [3], status="failed"), "1 of 80 runs are failed, .* a on s0"),
        (lambda runs: changed(runs, [3], status="stale"), "stale"),
        (lambda runs: changed(runs, [3], mean_overlap=np.nan), "mean overlap of a on s0 is nan"),
        (lambda runs: runs.drop(index=range(4)), "a was not run on s0"),
        (lambda runs: runs.drop(columns="mean_overlap"), "no score 'mean_overlap'"),
        (lambda runs: changed(runs, [3], fingerprint="edited"), "s0 changed between runs"),
    ],
)
def test_what_cannot_be_compared_is_named(make_runs, change, words):
    runs = make_runs({"a": around(HARDNESS), "b": around(HARDNESS, seed=1)})
    with pytest.raises(ComparisonError, match=words):
        compare(change(runs), OVERLAP, 0.01)


def test_unknown_and_equal_labels_are_refused(make_runs):
    runs = make_runs({"a": around(HARDNESS), "b": around(HARDNESS, seed=1)})
    with pytest.raises(ComparisonError, match="no runs of 'z'; there are a, b"):
        compare(runs, OVERLAP, 0.01, ["a", "z"])
    with pytest.raises(ComparisonError, match="named twice"):
        compare(runs, OVERLAP, 0.01, ["a", "a"])


def test_numbers_are_the_same_in_every_format(make_runs):
    scores = {name: around(HARDNESS + 0.1 * n, seed=n) for n, name in enumerate("abc")}
    found = compare(make_runs(scores), OVERLAP, 0.01)
    told = json.loads(json.dumps(as_data(found), allow_nan=False))
    standings, pairs = screen(found)
    assert standings.data["mean"].tolist() == [row["mean"] for row in told["trackers"]]
    by_pair = {(row["first"], row["second"]): row for row in told["pairs"]}
    for row in pairs.data.to_dict("records"):
        there = by_pair.get((row["first"], row["second"]))
        if there is not None:
            assert row["low"] == there["interval"][0]
    assert "c" in to_csv(standings)
    text = to_text(standings)
    assert max(map(len, text.splitlines())) <= 100
    assert max(map(len, to_text(pairs).splitlines())) <= 100
    assert [pair.first for pair in spoken_of(found)] == ["c", "c", "b"]
    assert "c was better than a (difference +0.2" in told["paragraph"]


def test_many_trackers_are_told_of_beside_the_best(make_runs):
    scores = {f"t{n}": around(HARDNESS + 0.03 * n, seed=n) for n in range(7)}
    found = compare(make_runs(scores), OVERLAP, 0.01)
    _, pairs = screen(found)
    assert len(pairs.rows) == 6
    assert pairs.notes[0].startswith("15 other pairs")
    assert paragraph(found).count("t6") == 1
    assert found.critical_difference > 0


def test_figures_are_drawn_where_the_numbers_allow_them(make_runs, tmp_path):
    scores = {name: around(HARDNESS + 0.1 * n, seed=n) for n, name in enumerate("abc")}
    found = compare(make_runs(scores), OVERLAP, 0.01)
    drawn = {path.stem for path in write_figures(found, tmp_path)}
    assert drawn == {"differences", "profiles", "ranks", "survival", "speed-accuracy"}
    two = compare(make_runs({"a": around(HARDNESS[:6]), "b": around(HARDNESS[:6])}), OVERLAP, 0.01)
    assert "ranks" not in {path.stem for path in write_figures(two, tmp_path)}


def test_a_tracker_has_one_colour_in_every_figure():
    ranks = rank_plot({"a": 2.4, "b": 1.0}, 0.5, "").axes[0]
    dots = {
        float(line.get_xdata()[0]): line.get_color()
        for line in ranks.lines
        if "o" in line.get_marker()
    }
    points = {
        name: Point(milliseconds, 0.5, 0.4, 0.6) for name, milliseconds in (("a", 1), ("b", 2))
    }
    speed = {
        line.get_label(): line.get_color()
        for line in speed_accuracy_plot(points, "", "").axes[0].lines
    }
    assert speed == {"a": dots[2.4], "b": dots[1.0]}
    assert ranks.get_xticks().tolist() == [1, 2, 3]


@pytest.mark.parametrize(("sequences", "named"), [(12, True), (250, False)])
def test_differences_name_what_there_is_room_for(sequences, named):
    pair = " - ".join(f"a$tracker:{'parameter=12345:' * 4}" for _ in range(2))
    names = [f"s{n}" for n in range(sequences)]
    figure = difference_plot({pair: np.arange(sequences)}, names, "", 0.01, "")
    figure.draw_without_rendering()
    (axes,) = figure.axes
    assert (len(axes.get_yticks()) > 0) == named
    assert max(map(len, axes.get_title("left").splitlines())) <= 70


@pytest.mark.slow
def test_equal_trackers_with_different_seeds_are_called_different_rarely(make_runs):
    called = 0
    for seed in range(400):
        generator = np.random.default_rng(seed)
        means = generator.uniform(0.2, 0.8, 12)
        # What a scene does to each differs as much as what its seeds do.
        scores = {
            name: generator.normal(means, 0.05)[:, None] + generator.normal(0, 0.05, (12, 3))
            for name in "ab"
        }
        (pair,) = compare(make_runs(scores), OVERLAP, 0.0).pairs
        called += pair.answer in ("better", "worse")
    assert called / 400 <= 0.06


def test_published_scores_stand_beside_ours(make_runs, tmp_path):
    file = tmp_path / "published.csv"
    rows = [f"MEEM,s{n},{score:.3f}" for n, score in enumerate(HARDNESS + 0.05)]
    file.write_text("\n".join(["tracker,sequence,mean_overlap", *rows, "MEEM,elsewhere,0.5"]))
    runs, others = with_published(make_runs({"a": around(HARDNESS)}), file, OVERLAP)
    assert others == ["MEEM (published)"]
    found = compare(runs, OVERLAP, 0.01)
    assert found.pairs[0].answer == "worse"
    assert np.isnan(found.standings[1].milliseconds)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("tracker,score\nMEEM,1\n", "no column sequence, mean_overlap"),
        ("tracker,sequence,mean_overlap\nMEEM,s0,good\n", "line 2: 'good' is no number"),
        ("tracker,sequence,mean_overlap\nMEEM,s0,True\n", "line 2: 'True' is no number"),
        ("tracker,sequence,mean_overlap\n\nM,s0,.5\nM,s1,False\n", "line 4: 'False' is no number"),
        ("tracker,sequence,mean_overlap\nMEEM,s0,inf\n", "line 2: 'inf' is no number"),
        ("tracker,sequence,mean_overlap\nMEEM,s0,.5\nMEEM,s0,.6\n", "line 3 comes twice"),
        ("tracker,sequence,mean_overlap\nMEEM,elsewhere,.5\n", "none of the sequences"),
        ("tracker,sequence,mean_overlap\nMEEM,s0,62.5\n", "line 2: 62.5 is no mean_overlap"),
        ("tracker,sequence,mean_overlap\nMEEM,s0,.5\n", "no score of MEEM on s1"),
        ("", "is no CSV"),
    ],
)
def test_a_published_file_that_does_not_fit_is_refused(make_runs, tmp_path, text, words):
    file = tmp_path / "published.csv"
    file.write_text(text)
    with pytest.raises(ComparisonError, match=words):
        with_published(make_runs({"a": around(HARDNESS)}), file, OVERLAP)


def test_what_new_seeds_need_is_repetitions(make_runs):
    few = {"a": around(HARDNESS + 0.03, 0.2, 6, seed=0), "b": around(HARDNESS, 0.2, 6, seed=1)}
    (pair,) = compare(make_runs(few), OVERLAP, 0.01, question="new seeds").pairs
    assert pair.answer == "cannot tell"
    assert pair.needed > 6
    found = 0
    for seed in range(0, 80, 2):
        runs = {
            "a": around(HARDNESS + pair.difference, 0.2, int(pair.needed), seed),
            "b": around(HARDNESS, 0.2, int(pair.needed), seed + 1),
        }
        (again,) = compare(make_runs(runs), OVERLAP, 0.01, question="new seeds").pairs
        found += again.answer == "better"
    assert 24 <= found <= 39  # of 40; four in five are meant
    (other,) = compare(make_runs(few), OVERLAP, 0.0, question="new sequences").pairs
    assert np.isnan(other.needed) or other.needed > len(HARDNESS)


def test_bins_of_what_is_measured_stand_beside_knobs_and_tags(make_runs):
    names = [f"street:pace={1 + number % 2}:scene={number}" for number in range(10)]
    runs = make_runs({"a": around(HARDNESS), "b": around(HARDNESS[::-1])}, names=names)
    tags = {name: {"occlusion"} for name in names[:4]}
    blurs = np.arange(10.0)
    found = compare(
        runs, OVERLAP, 0.01, attributes=tags, measured=lambda asked: {"blur": blurs[: len(asked)]}
    )
    (pair,) = found.pairs
    parts = found.by_part(pair)
    assert set(parts) == {
        ("pace", "1"),
        ("pace", "2"),
        ("attribute", "occlusion"),
        ("blur", "0 to 4"),
        ("blur", "5 to 9"),
    }
    assert parts["blur", "5 to 9"].tolist() == pair.differences[5:].tolist()
    assert [table.name for table in screen(found)][-1] == "comparison-attribute-differences"
    (rising,) = found.curves_of([pair])
    assert rising.correlation == pytest.approx(1.0)
    assert rising.adjusted < 0.01


@pytest.mark.parametrize(("n", "panels"), [(7, 1), (8, 8)])
def test_breaking_points_of_more_than_seven_trackers_have_a_panel_each(n, panels):
    levels = np.array([1.0, 10.0])
    curves = {
        f"t{k}": Breaks(levels, np.array([1.0, k / n]), levels, levels / 10, levels, 2.0, 3.0)
        for k in range(n)
    }
    figure = breaking_plot(curves, "noise", "T", logarithmic=True)
    shown = [axes for axes in figure.axes if axes.get_visible()]
    assert len(shown) == panels
    for number, axes in enumerate(shown if panels > 1 else ()):
        assert axes.get_title() == f"t{number}"
        coloured = [line for line in axes.get_lines() if line.get_color() == colour(number)]
        assert coloured[0].get_ydata()[-1] == number / n
        assert len(coloured) == 2  # the curve, and where it crosses one half
        assert len(axes.collections) == 1
        assert axes.get_xscale() == "log"
    figure.draw_without_rendering()
