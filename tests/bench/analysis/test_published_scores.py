"""Published scores that are compared with stored runs."""

import numpy as np
import pytest

from tests.bench.analysis.conftest import compare
from trackmark.bench.analysis.comparable_runs import ComparisonError
from trackmark.bench.analysis.published_scores import with_published
from trackmark.bench.analysis.run_tables import SUMMARY

HEAD = "tracker,sequence,mean_overlap\n"
SCORES = np.linspace(0.2, 0.8, 6)
OVERLAP = SUMMARY[0]


@pytest.fixture
def runs(make_runs):
    """Return one run on each of six sequences."""
    return make_runs({"a": SCORES[:, None]})


@pytest.mark.parametrize("name", ["MEEM", "NA", "None"])
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
