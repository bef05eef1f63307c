"""Intervals and marks of tables."""

import numpy as np
import pandas as pd
import pytest

from tests.bench.analysis.conftest import compare
from trackmark.bench.analysis.comparison_tables import files
from trackmark.bench.analysis.run_tables import SUMMARY, score_tables
from trackmark.bench.analysis.score_tables import intervals_and_marks
from trackmark.bench.statistics.intervals import mean_interval
from trackmark.reports.renderers import to_html, to_latex, to_markdown, to_text
from trackmark.reports.tables import ScoreMeasure

HIGHER, LOWER, NEITHER = (
    ScoreMeasure("m", "m", direction=direction) for direction in ("higher", "lower", None)
)
EASE = np.linspace(0.3, 0.8, 8)


def test_marks_and_intervals_follow_the_shared_rules():
    intervals, marks = intervals_and_marks(EASE[None], HIGHER)
    assert (intervals.tolist(), marks.tolist()) == ([[*mean_interval(EASE)]], [False])
    noise = np.array([0.03, -0.02, 0.01, -0.03, 0.02, -0.01, 0.02, -0.025])
    values = np.array([EASE, EASE + noise, EASE - 0.2])
    expected = {HIGHER: [True, True, False], LOWER: [False, False, True], NEITHER: [False] * 3}
    for measure, marked in expected.items():
        assert intervals_and_marks(values, measure)[1].tolist() == marked
    values[0, 0] = np.inf
    for array, trackers in ((values[:, :5], [0, 1, 2]), (values, [0])):
        intervals, marks = intervals_and_marks(array, LOWER)
        assert np.isnan(intervals[trackers]).all()
        assert not marks[trackers].any()


def frame(tracker, overlap, protocol="one-pass", n=2, **more):
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
            "ms_per_frame": 2.0,
            **{measure.name: overlap for measure in SUMMARY},
            **more,
        }
        for number in range(n)
    ]


@pytest.mark.parametrize(
    ("a", "b", "times", "rates"),
    [
        (7.0, None, ["~2.000", "~2.000"], ["500", "500"]),  # of the runs themselves
        (7.0, 3.0, ["7.000", "3.000"], ["143", "333"]),
    ],
)
def test_times_are_of_timing_runs_if_all_trackers_have_them(a, b, times, rates):
    scored = pd.DataFrame(frame("a", 0.5) + frame("b", 0.6))
    timed = frame("a", 0.5, "timing", ms_per_frame=a)
    timed += frame("b", 0.6, "timing", ms_per_frame=b) if b else []
    summary, _ = score_tables(scored, pd.DataFrame(timed), "T")
    assert summary.headings[-2:] == ["ms/frame", "fps"]
    assert [row[-2].text for row in summary.rows] == times
    assert [row[-1].text for row in summary.rows] == rates
    fps = summary.records[summary.records["measure"] == "fps"]
    assert fps["mean"].tolist() == pytest.approx([1e3 / float(time.lstrip("~")) for time in times])


def compared(n, spread, generator):
    """Return runs of four trackers on n sequences; one tracker is slightly worse than another."""
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


@pytest.mark.parametrize(("sequences", "spread"), [(5, 0.05), (6, 0.15), (12, 0.005)])
def test_summary_has_marks_of_comparison(sequences, spread):
    runs = compared(sequences, spread, np.random.default_rng(sequences))
    summary, _ = score_tables(runs, runs[:0], "T")
    standings, *_ = files(compare(runs, SUMMARY[0]))
    assert [row[1].is_best for row in summary.rows] == [row[1].is_best for row in standings.rows]


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
    overlap = summary.records[summary.records["measure"] == "mean_overlap"]
    assert overlap["marked"].tolist() == [True, False]


def test_summary_of_few_units_has_no_intervals():
    runs = pd.DataFrame(frame("a", 0.9, n=5) + frame("b", 0.2, n=5))
    summary, _ = score_tables(runs, runs[:0], "T")
    assert "5 sequences: too few for intervals and marks (6 needed)" in summary.caption
    assert not any(cell.is_best or "[" in cell.text for row in summary.rows for cell in row)


def test_summary_averages_over_families_within_limits():
    rows = frame("a", 0.9, n=8)
    names = ["x:scene=1", "x:scene=2", *"abcdef"]
    for row, name, overlap in zip(rows, names, [0.2, 0.4, *[1.0] * 6], strict=True):
        row |= {"sequence": name, "mean_overlap": overlap}
    runs = pd.DataFrame(rows)
    summary, _ = score_tables(runs, runs[:0], "T")
    text = summary.rows[0][1].text
    assert text.startswith("0.900 [0.")
    assert text.endswith(", 1.000]")
    assert "means over 8 sequences in 7 units" in summary.caption
