"""What is timed, and how times become ratios beside the paper's."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bench.claims.judging import judge
from bench.claims.ledger import read_claims
from bench.experiments.contestant import contestant
from bench.papers import Effort
from bench.papers.wang2010 import timing
from bench.papers.wang2010.timing import (
    METHODS,
    PUBLISHED,
    beside_published,
    method_times,
    particle_slopes,
    particle_times,
    time_rows,
)

NAME = "plain/target:length=20"
TABLE_1, SECTION_3_2 = PUBLISHED


@pytest.mark.slow
def test_methods_are_timed_in_turns_in_both_implementations():
    times = method_times([NAME], 2, 6)
    ways = times.groupby(["implementation", "window"])["disturbed"].agg(["size", "sum"])
    assert len(ways) == 4
    quiet = ways["size"] - ways["sum"]
    assert ((quiet == 2) | ((quiet < 2) & (ways["size"] == 4))).all()
    columns = [*METHODS, "motion"]
    assert (times[columns] > 0).all(axis=None)
    medians = times.groupby(["implementation", "window"])[columns].median()
    plain, compiled = medians.loc["plain", "fixed"], medians.loc["compiled", "fixed"]
    assert (plain > compiled).all()
    assert plain["camshift"] < plain["camshift_improved"] < plain["proposed"]
    assert plain["motion"] < plain["camshift_improved"]
    # What has no window is the same in both rows.
    fixed, adaptive = (times[times["window"] == window] for window in ("fixed", "adaptive"))
    assert fixed["proposed"].tolist() == adaptive["proposed"].tolist()
    assert fixed["camshift"].tolist() != adaptive["camshift"].tolist()


@pytest.mark.slow
def test_particles_are_timed_by_their_number(monkeypatch):
    monkeypatch.setattr(timing, "NUMBERS", (15, 60, 240))
    times = particle_times([NAME], 2, 5)
    passes = times.groupby(["implementation", "method", "particles"]).size()
    assert len(passes) == 2 * 2 * 3
    assert passes.between(2, 4).all()
    plain = particle_slopes(times).query("implementation == 'plain'").set_index("method")
    assert plain.loc["proposed", "slope"] > plain.loc["particle_filter", "slope"] > 0
    assert (plain["lower_limit"] < plain["slope"]).all()


class Clocks:
    """CPU time that runs on, and wall time that is `waits` seconds longer a pass."""

    def __init__(self, *waits):
        self.cpu, self.wall, self.waits = 0.0, 0.0, list(waits)

    def turned(self, updates, images):
        self.cpu += 1.0
        self.wall += 1.0 + self.waits.pop(0)
        return pd.DataFrame({"a": [1.0, 3.0, 8.0]})


@pytest.mark.parametrize(
    ("waits", "disturbed"),
    [
        ((0.0, 0.0), [0, 0]),
        ((0.09, 0.2, 0.0), [0, 1, 0]),
        ((1.0, 1.0, 1.0, 0.0), [1, 1, 1, 0]),
        ((1.0, 1.0, 1.0, 1.0), [1, 1, 1, 1]),
    ],
)
def test_a_pass_that_waited_is_marked_and_made_up_for_twice_at_most(monkeypatch, waits, disturbed):
    clocks = Clocks(*waits)
    monkeypatch.setattr(timing, "in_turns", clocks.turned)
    monkeypatch.setattr(timing, "thread_time", lambda: clocks.cpu)
    monkeypatch.setattr(timing, "perf_counter", lambda: clocks.wall)
    found = list(timing._passes(dict, [], 2))
    assert [mark for _, mark in found] == disturbed
    assert [seconds["a"] for seconds, _ in found] == [3.0] * len(disturbed)


def known_times(*_, disturbed=0.0):
    """Times that are known: plain in whole milliseconds, compiled a tenth of it."""
    plain = {"camshift": 1.0, "camshift_improved": 1.5, "proposed": 2.0, "particle_filter": 5.0}
    return pd.DataFrame(
        {"sequence": sequence, "implementation": implementation, "window": window}
        | {method: scale * drift * wide * value for method, value in plain.items()}
        | {"motion": scale * drift * wide * 0.2, "disturbed": disturbed}
        for sequence in PUBLISHED
        for implementation, scale in (("plain", 1e-3), ("compiled", 1e-4))
        for window, wide in (("fixed", 1.0), ("adaptive", 1.2))
        for drift in (0.5, 1.0, 4.0)
    )


def timing_runs():
    """Frames of timing runs, two repetitions of which the methods as written count."""
    runs = {
        "camshift:preset=as-written": (1e-3, 3e-3),
        "camshift:window=adaptive": (5.0,),
        "camshift:window=adaptive:preset=as-written": (5.0,),
        "wang2010:preset=as-written": (7e-3,),
        "wang2010": (5.0,),
        "static": (5.0,),
    }
    return pd.DataFrame(
        {"tracker": contestant(text).label, "sequence": TABLE_1, "frame": frame, "seconds": seconds}
        for text, repetitions in runs.items()
        for seconds in repetitions
        for frame in (1, 2)
    )


def test_times_and_ratios_stand_beside_those_of_the_paper():
    table = beside_published(known_times(), timing_runs())
    rows = table.set_index(["sequence", "method", "window", "timed"]).sort_index()
    fixed = rows.loc[(TABLE_1, "camshift", "fixed")]
    assert fixed.loc["plain", ["paper", "paper_ratio", "seconds", "ratio"]].tolist() == [
        *(0.063, 1.0),
        *(pytest.approx(1e-3), pytest.approx(1.0)),
    ]
    assert fixed.loc["runs", "seconds"] == pytest.approx(2e-3)
    adaptive = rows.loc[(TABLE_1, "camshift", "adaptive")]
    assert adaptive["ratio"].dropna().tolist() == pytest.approx([1.2, 1.2])
    assert np.isnan(adaptive.loc["runs", "seconds"])
    proposed = rows.loc[(TABLE_1, "proposed", "")]
    assert proposed["seconds"].to_dict() == pytest.approx(
        {"plain": 2e-3, "compiled": 2e-4, "runs": 7e-3}
    )
    improved = rows.loc[(SECTION_3_2, "camshift_improved", "fixed", "compiled")]
    assert improved["ratio"] == pytest.approx(1.5)
    assert improved["paper_ratio"] == pytest.approx(0.098 / 0.071)
    both = rows.loc[(TABLE_1, "particle filter over proposed", "")]
    assert both["ratio"].tolist() == pytest.approx([2.5, 2.5])
    assert both["paper_ratio"].tolist() == pytest.approx([0.214 / 0.120] * 2)


def test_scripts_get_quartiles_of_seconds_and_intervals_of_ratios():
    rows = time_rows(known_times())
    assert [row["label"] for row in rows] == [
        *("camshift", "proposed", "proposed", "particle_filter", "particle_filter"),
        *("camshift", "camshift_improved", "camshift_improved"),
    ]
    assert rows[0]["measured"] == pytest.approx(1e-3)
    assert rows[0]["interval"] == pytest.approx([0.75e-3, 2.5e-3])
    assert rows[2]["measured"] == pytest.approx(2.0)
    assert rows[2]["interval"] == pytest.approx([2.0, 2.0])
    assert {row["table"] for row in rows} == {"table-1", "section-3.2"}


def numbers(*_, disturbed=0.0):
    return pd.DataFrame(
        {"method": method, "implementation": implementation, "particles": n, "seconds": 1e-6 * n}
        | {"disturbed": disturbed}
        for method in timing.RADII
        for implementation in timing.IMPLEMENTATIONS
        for n in (15, 60, 100)
        for _ in range(2)
    )


@pytest.fixture
def measured(tmp_path, monkeypatch):
    """All tables, where every pass is disturbed or none; how often was measured."""
    calls = []

    def measured(disturbed=0.0, **effort):
        def of(times):
            def call(names, passes, frames):
                calls.append((times.__name__, passes, frames))
                return times(disturbed=disturbed)

            call.__name__ = times.__name__
            return call

        monkeypatch.setattr(timing, "method_times", of(known_times))
        monkeypatch.setattr(timing, "particle_times", of(numbers))
        monkeypatch.setattr(timing, "frame_times", lambda folder, cells: timing_runs())
        context = SimpleNamespace(
            effort=Effort(**effort),
            folder=tmp_path,
            results=tmp_path,
            asked={},
            description=SimpleNamespace(experiment=str),
        )
        return timing.tables(context), calls

    return measured


def test_all_that_the_ledger_and_the_tables_ask_for_is_measured(measured):
    tables, calls = measured(quick=True)
    assert calls == [("known_times", 2, 8), ("numbers", 1, 8)]
    assert set(tables) == {
        *("method_times", "motion_share", "particle_times", "time_slopes", "times")
    }
    share = tables["motion_share"].set_index(["implementation", "window"])["share"]
    assert share.tolist() == pytest.approx([0.4] * 4)
    slopes = tables["time_slopes"]
    assert len(slopes) == 4
    assert slopes["slope"].tolist() == pytest.approx([1e-6] * 4)


def test_where_every_pass_is_disturbed_nothing_is_told_and_nothing_judged(measured):
    tables, _ = measured(disturbed=1.0)
    for name in ("method_times", "motion_share", "particle_times", "time_slopes"):
        assert tables[name].empty
    told = tables["times"].query("timed != 'runs'")
    assert told[["seconds", "ratio"]].isna().all(axis=None)
    assert time_rows(tables["method_times"]) == []
    claims = read_claims("wang2010")
    for name in ("WA-18", "WA-19", "WA-23"):
        (found,) = judge(claims[name], pd.DataFrame(columns=["sequence"]), tables)
        assert "nothing was run" in found.verdict.reason


def test_times_are_kept_until_what_is_timed_changes_and_disturbed_ones_are_not(
    measured, monkeypatch
):
    measured(quick=True, disturbed=1.0)
    measured(quick=True)
    _, calls = measured(quick=True)
    assert len(calls) == 4
    assert measured()[1][4:] == [("known_times", 10, 60), ("numbers", 5, 60)]  # too few passes
    assert len(measured()[1]) == 8
    monkeypatch.setattr(timing, "source_digest", lambda file, package: ("other", {}))
    assert len(measured(quick=True)[1]) == 10
    monkeypatch.setattr(timing.platform, "node", lambda: "another")
    assert len(measured(quick=True)[1]) == 12
