"""Tests of the command `trackmark reproduce`."""

import json

import pytest

from trackmark.bench.papers import ReproductionOptions, paper_names
from trackmark.bench.papers.development import read_sensitivity
from trackmark.bench.papers.paper import read_paper
from trackmark.bench.papers.plan import experiments


@pytest.mark.parametrize("paper", paper_names())
def test_quick_runs_are_part_of_all_runs(paper):
    content = read_paper(paper)
    whole, quick, everything = (
        {experiment.name: experiment for experiment in experiments(content, options)}
        for options in (
            ReproductionOptions(),
            ReproductionOptions(quick=True),
            ReproductionOptions(with_sensitivity=True),
        )
    )
    has_rows = bool(read_sensitivity(content).rows)
    assert quick.keys() <= whole.keys() <= everything.keys()
    assert has_rows == (whole.keys() < everything.keys())
    for name, experiment in quick.items():
        assert set(experiment.sequences) <= set(whole[name].sequences)
        assert set(experiment.trackers) <= set(whole[name].trackers)


@pytest.mark.slow
def test_quick_report_is_the_same_the_second_time(trackmark, workspace):
    arguments = ["reproduce", "wang2010", "--quick", "--json"]
    report = json.loads(trackmark(*arguments).stdout)
    assert report["paper"] == "wang2010"
    assert report["claims"] == []
    row = report["main"][0]["rows"][0]
    assert row["tracker"] == "proposed, N = 60"
    assert {"paper", "as written", "recommended"} <= row.keys()
    folder = workspace / "results" / "wang2010"
    for name in ("report.html", "report.md", "report.json", "main.csv", "figure-1.png"):
        assert (folder / name).stat().st_size > 0, name
    trackmark("results", "remove", "results/wang2010-hand", "--tracker", "camshift*", "--yes")
    assert json.loads(trackmark(*arguments).stdout)["main"] == report["main"]
    text = trackmark("reproduce", "wang2010", "--quick").stdout
    assert "Report  results/wang2010/report.html" in text
    assert "not run" not in text
    assert "holds" not in text
