"""What is timed, and how times become ratios beside the paper's."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bench.experiments.contestant import contestant
from bench.papers.timing import ROUNDS
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
def test_methods_take_turns_in_both_implementations():
    times = method_times([NAME], 6)
    ways = times.groupby(["implementation", "window"]).size()
    assert ways.tolist() == [ROUNDS] * 4
    assert (times[[*METHODS, "motion", "reference"]] > 0).all(axis=None)
    # What has no window is the same in both rows.
    fixed, adaptive = (times[times["window"] == window] for window in ("fixed", "adaptive"))
    assert fixed["proposed"].tolist() == adaptive["proposed"].tolist()
    assert fixed["camshift"].tolist() != adaptive["camshift"].tolist()


@pytest.mark.slow
def test_particles_are_timed_by_their_number(monkeypatch):
    monkeypatch.setattr(timing, "NUMBERS", (15, 60, 240))
    times = particle_times([NAME], 4)
    rounds = times.groupby(["implementation", "method", "particles"]).size()
    assert rounds.tolist() == [ROUNDS] * 12
    lines = particle_slopes(times)
    assert len(lines) == 4
    assert (lines["lower_limit"] < lines["slope"]).all()


def known_times(*_, **__):
    """Times that are known: plain in whole milliseconds, compiled a tenth of it."""
    plain = {"camshift": 1.0, "camshift_improved": 1.5, "proposed": 2.0, "particle_filter": 5.0}
    return pd.DataFrame(
        {"sequence": sequence, "implementation": implementation, "window": window}
        | {method: scale * drift * wide * value for method, value in plain.items()}
        | {"motion": scale * drift * wide * 0.2, "reference": drift}
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
        {"tracker": contestant(text).label, "sequence": TABLE_1, "frame": frame, "decoded": seconds}
        | {"disturbed": 0}
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
    assert fixed.loc["as decoded", "seconds"] == pytest.approx(2e-3)
    adaptive = rows.loc[(TABLE_1, "camshift", "adaptive")]
    assert adaptive["ratio"].dropna().tolist() == pytest.approx([1.2, 1.2])
    assert np.isnan(adaptive.loc["as decoded", "seconds"])
    proposed = rows.loc[(TABLE_1, "proposed", "")]
    assert proposed["seconds"].to_dict() == pytest.approx(
        {"plain": 2e-3, "compiled": 2e-4, "as decoded": 7e-3}
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


def numbers(*_, **__):
    return pd.DataFrame(
        {"method": method, "implementation": implementation, "particles": n, "seconds": 1e-6 * n}
        for method in timing.RADII
        for implementation in timing.IMPLEMENTATIONS
        for n in (15, 60, 100)
        for _ in range(2)
    )


def test_all_that_the_ledger_and_the_tables_ask_for_is_measured(monkeypatch):
    made = {timing.method_times: known_times, timing.particle_times: numbers}
    monkeypatch.setattr(timing, "kept_times", lambda _, measure, *__, **___: made[measure]())
    monkeypatch.setattr(timing, "frame_times", lambda *_: timing_runs())
    context = SimpleNamespace(
        results=Path(), asked={"table-1": ()}, description=SimpleNamespace(experiment=str)
    )
    tables = timing.tables(context)
    assert set(tables) == {
        *("method_times", "motion_share", "particle_times", "time_slopes", "times")
    }
    share = tables["motion_share"].set_index(["implementation", "window"])
    assert share["share"].tolist() == pytest.approx([0.4] * 4)
    assert share["low"].tolist() == pytest.approx([0.4] * 4)
    slopes = tables["time_slopes"]
    assert len(slopes) == 4
    assert slopes["slope"].tolist() == pytest.approx([1e-6] * 4)
    context.asked = {}  # as of a quick look
    assert timing.tables(context) == {}
