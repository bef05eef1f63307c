"""Published scores that are compared with stored runs."""

import numpy as np
import pandas as pd
import pytest

from tests.bench.analysis.conftest import compare
from trackmark.bench.analysis.decisions import answer_of
from trackmark.bench.analysis.published_scores import with_published
from trackmark.bench.analysis.published_sets import SETS
from trackmark.bench.analysis.run_checks import ComparisonError, compared_measure
from trackmark.bench.analysis.run_tables import SUMMARY
from trackmark.datasets.layouts import layouts

HEAD = "tracker,sequence,mean_overlap\n"
SCORES = np.linspace(0.2, 0.8, 6)
OVERLAP = SUMMARY[0]


@pytest.fixture
def runs(make_runs):
    """Return one run on each of six sequences."""
    return make_runs({"a": SCORES[:, None]})


@pytest.mark.parametrize("name", ["MEEM", "NA"])
def test_published_scores_are_compared_with_stored_ones(runs, tmp_path, name):
    file = tmp_path / "published.csv"
    rows = [f"{name},s{n},{score + 0.05:.3f}" for n, score in enumerate(SCORES)]
    file.write_text(HEAD + "\n".join([*rows, "", f"{name},elsewhere,0.5"]))
    whole, labels = with_published(runs, file, OVERLAP)
    assert labels == [f"{name} (published)"]
    comparison = compare(whole, OVERLAP)
    assert comparison.pairs[0].difference == pytest.approx(-0.05)
    assert np.isnan(comparison.standings[1].ms_per_frame)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("tracker,score\nMEEM,1\n", "missing columns sequence, mean_overlap"),
        (f"{HEAD}\nM,s0,.5\nM,s1,False\n", r"line 4: mean_overlap is not .* 1 \(M,s1,False\)"),
        (f"{HEAD}M,s0,1_0\n", "line 2: mean_overlap is not a number from 0 to 1"),
        (f"{HEAD}M,s0,inf\n", "line 2: mean_overlap is not a number from 0 to 1"),
        (f"{HEAD}M,s0,62.5\n", "line 2: mean_overlap is not a number from 0 to 1"),
        (f"{HEAD}M,s0,.5\nM,s0,.6\n", "line 3: an earlier line"),
        (f"{HEAD},s0,.5\n", "line 2: the tracker has no name"),
        (f"{HEAD}M,s0,.5\nM, ,.5\n", "line 3: the sequence has no name"),
        (f"{HEAD}M,elsewhere,.5\n", "no row has a sequence"),
        (f"{HEAD}M,s0,.5\n", "tracker M has no score on s1"),
        ("", "not a CSV file"),
    ],
)
def test_published_file_of_wrong_content_is_an_error(runs, tmp_path, text, words):
    file = tmp_path / "published.csv"
    file.write_text(text)
    with pytest.raises(ComparisonError, match=words):
        with_published(runs, file, OVERLAP)


OTB100 = SETS["otb100"]


def test_published_sets_are_complete():
    scores = pd.read_csv(OTB100.file)
    assert scores.groupby("tracker")["sequence"].nunique().to_dict() == dict.fromkeys(
        scores["tracker"], 100
    )
    assert scores["tracker"].nunique() == 34
    assert OTB100.file.stat().st_size < 120_000
    assert {*OTB100.aliases} <= {*scores["sequence"]}
    (official,) = [entry for entry in layouts()["otb"].sets if entry.name == "OTB-100"]
    names = {alias for aliases in OTB100.aliases.values() for alias in aliases}
    assert official.sequence_names() <= {*scores["sequence"]} | names


@pytest.mark.parametrize("jogging", ["Jogging-1", "Jogging.1", "Jogging_1"])
def test_sequences_of_a_published_set_are_found(make_runs, jogging):
    names = ["Basketball", "Human4", jogging, "Skating2.2", "Boy", "Woman"]
    runs = make_runs({"a": SCORES[:, None]})
    runs["sequence"] = runs["sequence"].map(
        dict(zip(runs["sequence"].unique(), names, strict=True))
    )
    measure = compared_measure("otb", "mean_overlap")
    whole, labels = with_published(runs, OTB100, measure)
    expected = pd.read_csv(OTB100.file).pivot_table("mean_overlap", "tracker", "sequence")
    expected = expected[["BasketBall", "Human4-2", "Jogging-1", "Skating2-2", "Boy", "Woman"]]
    assert labels[0] == f"{expected.mean(axis=1).idxmax()} (published)"
    comparison = compare(whole, measure, published=labels)
    means = {standing.tracker: standing.mean for standing in comparison.standings}
    for tracker, mean in expected.mean(axis=1).items():
        assert means[f"{tracker} (published)"] == pytest.approx(mean, abs=1e-12)
    assert len(comparison.pairs) == 34
    rank = 1 + sum(mean > means["a"] for mean in means.values())
    heading = f"a has rank {rank} of 35 by mean overlap (otb) on 6 sequences: 0.50."
    assert answer_of(comparison).heading == heading
    assert not any(standing.is_unbeaten for standing in comparison.standings[1:])


def test_published_set_has_one_score(runs):
    with pytest.raises(ComparisonError, match=r"score mean_overlap of the metrics otb, not prec"):
        with_published(runs, OTB100, compared_measure("otb", "precision"))
