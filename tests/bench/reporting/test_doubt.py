"""How sure a table's means are, against the intervals and tests that they come from."""

import numpy as np
import pandas as pd
import pytest

from bench.reporting import tables as reporting
from bench.reporting.doubt import over_seeds, over_sequences
from bench.reporting.tables import SUMMARY, score_tables
from bench.statistics.paired import scores_interval

EASE = np.linspace(0.3, 0.8, 8)


def runs_of(means):
    """One repetition a sequence."""
    return [np.array([mean]) for mean in means]


def test_intervals_are_students_over_sequences():
    doubt = over_sequences([runs_of(EASE)], "higher")
    low, high = scores_interval(EASE)
    assert doubt.halves == pytest.approx([(high - low) / 2])
    assert doubt.contenders == [False]  # there is no choice


def test_all_are_marked_that_cannot_be_told_from_the_best():
    noise = np.array([0.03, -0.02, 0.01, -0.03, 0.02, -0.01, 0.02, -0.025])
    values = [runs_of(EASE), runs_of(EASE + noise), runs_of(EASE - 0.2)]
    assert over_sequences(values, "higher").contenders == [True, True, False]
    assert over_sequences(values, "lower").contenders == [False, False, True]
    assert over_sequences(values, None).contenders == [False] * 3


@pytest.mark.slow
def test_equal_trackers_are_rarely_told_from_the_best_of_them():
    generator = np.random.default_rng(0)
    values = generator.normal(0.5, 0.08, (600, 6, 12, 1))
    marks = [
        all(over_sequences(list(map(list, trackers)), "higher").contenders) for trackers in values
    ]
    assert np.mean(marks) >= 0.94


def test_infinite_scores_have_no_interval_and_stand_behind():
    lost = [np.array([np.inf]), *runs_of(EASE[1:])]
    doubt = over_sequences([lost, runs_of(EASE)], "lower")
    assert np.isnan(doubt.halves[0])
    assert doubt.contenders == [False, True]


def test_over_seeds_what_never_draws_differs_for_sure():
    certain = over_seeds([runs_of([0.5, 0.6]), runs_of([0.5, 0.59])], "higher")
    assert certain.contenders == [True, False]
    assert np.isnan(certain.halves).all()
    drawn = [np.array([0.4, 0.6, 0.5]), np.array([0.7, 0.5, 0.6])]
    doubt = over_seeds([drawn, runs_of([0.5, 0.59])], "higher")
    assert doubt.contenders == [True, True]
    assert doubt.halves[0] > 0


@pytest.mark.parametrize("doubts", [over_seeds, over_sequences])
def test_where_nothing_varied_nothing_is_known(doubts):
    doubt = doubts([[np.full(3, 1 / 3), np.full(3, 1 / 3)]], "higher")
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
