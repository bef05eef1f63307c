"""Intervals and marks of tables, by the shared rules."""

import numpy as np
import pandas as pd
import pytest

from trackmark.bench.comparing.comparison import compare
from trackmark.bench.comparing.tables import files
from trackmark.bench.reporting import tables as reporting
from trackmark.bench.reporting.tables import SUMMARY, score_tables, uncertainty_of
from trackmark.bench.statistics.intervals import mean_interval
from trackmark.reports.renderers import to_html, to_latex, to_markdown, to_text
from trackmark.reports.tables import Measure

HIGHER, LOWER, NEITHER = (Measure("m", "m", direction=one) for one in ("higher", "lower", None))
EASE = np.linspace(0.3, 0.8, 8)


def test_intervals_are_those_of_the_shared_rule():
    (interval,), marks = uncertainty_of(EASE[None], HIGHER)
    assert interval == mean_interval(EASE)
    assert marks == [False]


def test_marks_are_of_trackers_that_are_worse_than_none():
    noise = np.array([0.03, -0.02, 0.01, -0.03, 0.02, -0.01, 0.02, -0.025])
    values = np.array([EASE, EASE + noise, EASE - 0.2])
    assert uncertainty_of(values, HIGHER).marks == [True, True, False]
    assert uncertainty_of(values, LOWER).marks == [False, False, True]
    assert uncertainty_of(values, NEITHER).marks == [False] * 3


def test_few_units_have_neither_intervals_nor_marks():
    values = np.array([EASE[:5], EASE[:5] - 0.2])
    assert uncertainty_of(values, HIGHER) == ([None, None], [False, False])


def test_infinite_values_have_no_interval_and_no_mark():
    values = np.array([[np.inf, *EASE[1:]], EASE, EASE + 0.01])
    intervals, marks = uncertainty_of(values, LOWER)
    assert intervals[0] is None
    assert marks[0] is False


def frame(tracker, overlap, protocol="accuracy", n=2, **more):
    return [
        {
            "tracker": tracker,
            "sequence": f"s{number}",
            "repetition": 0,
            "protocol": protocol,
            "status": "finished",
            "failure": "",
            "frames": 10,
            "seconds": 0.5,
            "update_seconds": 0.002,
            **{measure.name: overlap for measure in SUMMARY},
            **more,
        }
        for number in range(n)
    ]


def test_a_frames_time_is_of_timing_runs_where_all_have_them():
    scored = pd.DataFrame(frame("a", 0.5) + frame("b", 0.6))
    timed = pd.DataFrame(frame("a", 0.5, "timing", cpu_seconds_median=0.007))
    summary, _ = score_tables(scored, timed, "T")
    assert summary.heads[-1] == "~time a frame [ms]"
    assert [row[-1].text for row in summary.rows] == ["2.000", "2.000"]
    both = pd.concat([timed, pd.DataFrame(frame("b", 0.6, "timing", cpu_seconds_median=0.003))])
    summary, _ = score_tables(scored, both, "T")
    assert summary.heads[-1] == "time a frame [ms]"
    assert [row[-1].text for row in summary.rows] == ["7.000", "3.000"]


def test_a_frames_time_is_warm_where_all_were_timed_so():
    scored = pd.DataFrame(frame("a", 0.5) + frame("b", 0.6))
    warm = {"warm_seconds_median": 0.002, "cpu_seconds_median": 0.007}
    timed = frame("a", 0.5, "timing", **warm)
    new = pd.DataFrame(timed + frame("b", 0.6, "timing", **warm))
    old = pd.DataFrame(timed + frame("b", 0.6, "timing", cpu_seconds_median=0.007))
    for runs, shown in ((new, "2.000"), (old, "7.000")):
        summary, _ = score_tables(scored, runs, "T")
        assert [row[-1].text for row in summary.rows] == [shown, shown]


def test_tables_of_some_runs_have_the_times_of_timing_runs_that_were_not_asked_for(
    monkeypatch, tmp_path
):
    scored = pd.DataFrame(frame("a", 0.5))
    timed = pd.DataFrame(frame("a", 0.5, "timing", cpu_seconds_median=0.007))
    stored = pd.concat([scored, timed])
    monkeypatch.setattr(
        reporting, "load_results", lambda folder, cells=None: scored if cells else stored
    )
    summary, _ = reporting.tables(tmp_path, [("a", "s0", 0, "accuracy")], "T")
    assert summary.heads[-1] == "time a frame [ms]"


def compared(n, spread, generator):
    """Runs of four trackers on n sequences, one tracker slightly below another."""
    scores = 0.5 + generator.normal(0, spread, (4, n, 2))
    scores[:, :, 1] += generator.normal(0, 0.02, (4, n))
    scores[3] = scores[2] - 0.004
    rows = [
        frame(name, score, n=1, first_loss=10.0, fingerprint="f")[0]
        | {"sequence": f"s{place}", "repetition": repetition}
        for name, means in zip("abcd", scores, strict=True)
        for place, runs in enumerate(means)
        for repetition, score in enumerate(runs)
    ]
    return pd.DataFrame(rows)


@pytest.mark.parametrize("spread", [0.005, 0.05, 0.15])
@pytest.mark.parametrize("sequences", [5, 6, 12])
def test_summary_marks_as_a_comparison(spread, sequences):
    generator = np.random.default_rng(sequences)
    for _ in range(10):
        runs = compared(sequences, spread, generator)
        summary, _ = score_tables(runs, runs[:0], "T")
        standings, *_ = files(compare(runs, SUMMARY[0]))
        assert [row[1].best for row in summary.rows] == [row[1].best for row in standings.rows]


def test_summary_explains_intervals_and_marks_in_every_format():
    runs = pd.DataFrame(frame("a", 0.9, n=6) + frame("b", 0.2, n=6))
    summary, _ = score_tables(runs, runs[:0], "T")
    assert summary.rows[0][1].text == "0.900 [0.900, 0.900]"
    words = "95 % interval of the mean for new sequences"
    assert words in to_text(summary)
    assert "0.900 [0.900, 0.900]*" in to_text(summary)
    assert "**0.900 [0.900, 0.900]**" in to_markdown(summary)
    assert "<b>0.900 [0.900, 0.900]</b>" in to_html(summary)
    assert r"\textbf{0.900 [0.900, 0.900]}" in to_latex(summary)
    overlap = summary.data[summary.data["measure"] == "mean_overlap"]
    assert overlap["marked"].tolist() == [True, False]


def test_summary_of_few_units_says_that_there_are_too_few():
    runs = pd.DataFrame(frame("a", 0.9, n=5) + frame("b", 0.2, n=5))
    summary, _ = score_tables(runs, runs[:0], "T")
    assert "5 sequences: too few for intervals and marks (6 needed)" in summary.caption
    assert not any(cell.best or "[" in cell.text for row in summary.rows for cell in row)


def test_summary_averages_over_families():
    rows = frame("a", 0.9, n=3)
    for row, name, overlap in zip(
        rows, ("x:scene=1", "x:scene=2", "y"), (0.2, 0.4, 0.9), strict=True
    ):
        row |= {"sequence": name, "mean_overlap": overlap}
    runs = pd.DataFrame(rows)
    summary, _ = score_tables(runs, runs[:0], "T")
    assert summary.rows[0][1].text == "0.600"
    assert "2 families" in summary.caption


def test_intervals_end_at_the_limits_of_scores():
    scores = [0.99, 1.0, 1.0, 1.0, 1.0, 0.7]
    rows = [
        row | {"mean_overlap": score} for row, score in zip(frame("a", 0, n=6), scores, strict=True)
    ]
    runs = pd.DataFrame(rows)
    summary, _ = score_tables(runs, runs[:0], "T")
    assert summary.rows[0][1].text.endswith(", 1.000]")
