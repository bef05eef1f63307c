"""How sure a table's means are, against the intervals and tests that they come from."""

import numpy as np
import pandas as pd
import pytest

from bench.comparing.comparison import compare
from bench.comparing.tables import files
from bench.reporting import tables as reporting
from bench.reporting.doubt import over_seeds, over_sequences
from bench.reporting.tables import SUMMARY, score_tables
from bench.statistics.paired import scores_interval
from reports.tables import Measure

HIGHER, LOWER, NEITHER = (Measure("m", "m", direction=one) for one in ("higher", "lower", None))
EASE = np.linspace(0.3, 0.8, 8)


def runs_of(means):
    """One repetition a sequence."""
    return [np.array([mean]) for mean in means]


def test_intervals_are_students_over_sequences():
    doubt = over_sequences([runs_of(EASE)], HIGHER)
    low, high = scores_interval(EASE)
    assert doubt.halves == pytest.approx([(high - low) / 2])
    assert doubt.contenders == [False]  # there is no choice


def test_all_are_marked_that_cannot_be_told_from_the_best():
    noise = np.array([0.03, -0.02, 0.01, -0.03, 0.02, -0.01, 0.02, -0.025])
    values = [runs_of(EASE), runs_of(EASE + noise), runs_of(EASE - 0.2)]
    assert over_sequences(values, HIGHER).contenders == [True, True, False]
    assert over_sequences(values, LOWER).contenders == [False, False, True]
    assert over_sequences(values, NEITHER).contenders == [False] * 3


@pytest.mark.slow
def test_equal_trackers_are_rarely_told_from_the_best_of_them():
    generator = np.random.default_rng(0)
    values = generator.normal(0.5, 0.08, (600, 6, 12, 1))
    marks = [
        all(over_sequences(list(map(list, trackers)), HIGHER).contenders) for trackers in values
    ]
    assert np.mean(marks) >= 0.94


def test_infinite_scores_have_no_interval_and_stand_behind():
    lost = [np.array([np.inf]), *runs_of(EASE[1:])]
    doubt = over_sequences([lost, runs_of(EASE)], LOWER)
    assert np.isnan(doubt.halves[0])
    assert doubt.contenders == [False, True]


def test_over_seeds_what_never_draws_differs_for_sure():
    certain = over_seeds([runs_of([0.5, 0.6]), runs_of([0.5, 0.59])], HIGHER)
    assert certain.contenders == [True, False]
    assert np.isnan(certain.halves).all()
    drawn = [np.array([0.4, 0.6, 0.5]), np.array([0.7, 0.5, 0.6])]
    doubt = over_seeds([drawn, runs_of([0.5, 0.59])], HIGHER)
    assert doubt.contenders == [True, True]
    assert doubt.halves[0] > 0


@pytest.mark.parametrize("doubts", [over_seeds, over_sequences])
def test_where_nothing_varied_nothing_is_known(doubts):
    doubt = doubts([[np.full(3, 1 / 3), np.full(3, 1 / 3)]], HIGHER)
    assert np.isnan(doubt.halves[0])


def frame(tracker, overlap, protocol="accuracy", **more):
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
        for number in range(2)
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


@pytest.mark.parametrize("spread", [0.005, 0.05, 0.15])
@pytest.mark.parametrize("sequences", [3, 7, 12])
def test_a_summary_marks_whom_a_comparison_marks(spread, sequences):
    generator = np.random.default_rng(sequences)
    for _ in range(30):
        scores = 0.5 + generator.normal(0, spread, (4, sequences, 2))
        scores[:, :, 1] += generator.normal(0, 0.02, (4, sequences))
        scores[3] = scores[2] - 0.004  # practically equal
        rows = [
            row
            | {
                "sequence": f"s{place}",
                "repetition": repetition,
                "first_loss": 10.0,
                "fingerprint": "f",
            }
            for name, means in zip("abcd", scores, strict=True)
            for place, runs in enumerate(means)
            for repetition, score in enumerate(runs)
            for row in frame(name, score)[:1]
        ]
        runs = pd.DataFrame(rows)
        summary, _ = score_tables(runs, runs[:0], "T")
        found = compare(runs, SUMMARY[0], SUMMARY[0].margin)
        standings, *_ = files(found)
        assert [row[1].best for row in summary.rows] == [row[2].best for row in standings.rows]


def test_where_nothing_was_repeated_the_best_mean_is_marked_and_that_is_said():
    rows = [
        row | {"first_loss": 10.0, "fingerprint": "f"}
        for name, mean in (("a", 0.5), ("b", 0.495))
        for row in frame(name, mean)
    ]
    runs = pd.DataFrame(rows)
    summary, _ = score_tables(runs, runs[:0], "T")
    standings, *_ = files(compare(runs, SUMMARY[0], SUMMARY[0].margin))
    assert [row[1].best for row in summary.rows] == [True, False]
    assert [row[2].best for row in standings.rows] == [True, False]
    assert "the best mean is marked" in summary.caption
    assert "Marked: the best mean" in standings.notes[0]


def test_intervals_end_where_scores_do():
    rows = [
        row
        | {"repetition": repetition, "first_loss": 10.0, "fingerprint": "f", "mean_overlap": score}
        for name, scores in (("a", (0.2, 0.4)), ("b", (0.1, 0.9)))
        for repetition, score in enumerate(scores)
        for row in frame(name, 0.5)
    ]
    runs = pd.DataFrame(rows)
    summary, _ = score_tables(runs, runs[:0], "T")
    assert [row[1].text for row in summary.rows] == ["0.300 [0.000, 0.604]", "0.500 [0.000, 1.000]"]
    assert "the score's range" in summary.caption
    overlaps = summary.data[summary.data["measure"] == "mean_overlap"]
    assert overlaps[["low", "high"]].to_numpy().tolist() == [
        pytest.approx([0.0, 0.604], abs=1e-3),
        [0.0, 1.0],
    ]
    standings, pairs, *_ = files(compare(runs, SUMMARY[0], SUMMARY[0].margin))
    assert [row[3].text for row in standings.rows] == ["[0.000, 0.604]", "[0.000, 1.000]"]
    (row,) = pairs.rows
    assert row[0].text == "b - a" or row[0].text == "a - b"
    assert row[3].text == "[-1.000, +0.930]"
    assert row[4].text in ("on 2 of 2", "on 0 of 2")  # no share of all sequences that there may be
