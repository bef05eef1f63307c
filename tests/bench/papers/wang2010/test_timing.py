"""What is timed, and how times become ratios beside the paper's."""

import numpy as np
import pandas as pd
import pytest

import bench
import datasets
from bench.experiment import Experiment, SequenceSource
from bench.papers.in_turns import beginning
from bench.papers.wang2010 import costs, timing
from bench.papers.wang2010.costs import (
    METHODS,
    make,
    method_times,
    particle_slopes,
    particle_times,
)
from bench.papers.wang2010.timing import PUBLISHED, frame_times, measured_times, time_tables
from bench.store.loading import load_results
from reports.tables import MISSING

NAME = "plain/target:length=20"
TABLE_1, SECTION_3_2 = PUBLISHED


def test_both_implementations_of_a_method_give_the_same_boxes():
    images, box = beginning(NAME, 12)
    for method in METHODS:
        plain, compiled = (make(method, implementation) for implementation in costs.IMPLEMENTATIONS)
        for one in (plain, compiled):
            one.init(images[0], box)
        for image in images[1:]:
            assert compiled.update(image).box == pytest.approx(plain.update(image), abs=1e-9)


def test_methods_are_timed_in_turns_in_both_implementations():
    times = method_times([NAME], 2, 6)
    assert len(times) == 2 * 2 * 2 * 5  # the first update of a pass warms up
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


def test_particles_are_timed_by_their_number(monkeypatch):
    monkeypatch.setattr(costs, "NUMBERS", (15, 60, 240))
    times = particle_times(NAME, 2, 5)
    assert len(times) == 2 * 2 * 2 * 3
    plain = particle_slopes(times).query("implementation == 'plain'").set_index("method")
    assert plain.loc["proposed", "slope"] > plain.loc["particle_filter", "slope"] > 0
    assert (plain["lower_limit"] < plain["slope"]).all()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    names = ("camshift:preset=as-written", "camshift:preset=as-written:window=adaptive", "static")
    experiment = Experiment("t", names, (SequenceSource(NAME),), repetitions=2, timing=True)
    return bench.run(experiment, tmp_path_factory.mktemp("results"), jobs=1)


def test_timing_runs_are_those_of_methods_as_written(folder):
    frames = frame_times(folder)
    clean = load_results(folder).query("disturbed == 0 and tracker.str.contains('camshift')")
    clean = clean[~clean["tracker"].str.contains("adaptive")]
    if len(clean):
        assert set(frames["method"]) == {"camshift"}
        assert frames["frame"].tolist() == list(range(1, len(datasets.load(NAME))))
    else:
        assert frames.empty


def known():
    """Times that are known: plain in whole milliseconds, compiled a tenth of it."""
    plain = {"camshift": 1.0, "camshift_improved": 1.5, "proposed": 2.0, "particle_filter": 5.0}
    times = pd.DataFrame(
        {"sequence": sequence, "implementation": implementation, "window": window}
        | {method: scale * drift * wide * value for method, value in plain.items()}
        | {"motion": scale * drift * wide * 0.2}
        for sequence in PUBLISHED
        for implementation, scale in (("plain", 1e-3), ("compiled", 1e-4))
        for window, wide in (("fixed", 1.0), ("adaptive", 1.2))
        for drift in (0.5, 1.0, 4.0)
    )
    line = {"lower_limit": 1e-6, "upper_limit": 3e-6, "slope": 2e-6, "r_squared": 0.99}
    return {
        "method_times": times,
        "motion_share": timing._motion_share(times),
        "frame_times": pd.DataFrame(
            {"method": "camshift", "sequence": TABLE_1, "frame": [1, 2], "seconds": [1e-3, 3e-3]}
        ),
        "time_slopes": pd.DataFrame(
            [
                line | {"method": "proposed", "implementation": name}
                for name in costs.IMPLEMENTATIONS
            ]
        ),
    }


def test_ratios_stand_beside_those_of_the_paper():
    table, particles = time_tables(known(), ["failed: why"])
    texts = [[cell.text for cell in row] for row in table.rows]
    assert texts[0] == [
        *(TABLE_1, "CamShift, fixed window", "0.063", "1.00"), *("1", "1.00", "0.1", "1.00"), "2",
    ]  # fmt: skip
    assert texts[1][1:6] == ["CamShift, adaptive window", "0.063", "1.00", "1.2", "1.20"]
    assert [row[2:6] for row in texts[2:4]] == [
        ["0.120", "1.90", "2", "2.00"],
        ["0.214", "3.40", "5", "5.00"],
    ]
    assert texts[6][:2] == [SECTION_3_2, "improved CamShift, fixed window"]
    assert texts[6][2:6] == ["0.098", "1.38", "1.5", "1.50"]
    assert {row[-1] for row in texts[1:]} == {MISSING}
    assert table.notes[0] == "particle filter over proposed: paper 1.78, plain 2.50, compiled 2.50"
    assert "40 % in plain NumPy, 40 % compiled" in table.notes[2]
    assert table.notes[-1] == "failed: why"
    assert [cell.text for cell in particles.rows[0]] == [
        "proposed", "2 [1, 3]", "0.99", "2 [1, 3]", "0.99",
    ]  # fmt: skip


def test_all_that_the_ledger_asks_for_is_measured(folder, monkeypatch):
    other = "plain/target:length=21"
    monkeypatch.setattr(timing, "TABLE_1", NAME)
    monkeypatch.setattr(timing, "SECTION_3_2", other)
    published = dict(zip((NAME, other), PUBLISHED.values(), strict=True))
    monkeypatch.setattr(timing, "PUBLISHED", published)
    monkeypatch.setattr(timing, "_QUICK_FRAMES", 4)
    monkeypatch.setattr(costs, "NUMBERS", (15, 60))
    tables = measured_times(folder, quick=True)
    assert list(tables) == [
        *("frame_times", "method_times", "motion_share", "particle_times", "time_slopes")
    ]
    assert len(tables["time_slopes"]) == 4
    assert len(tables["method_times"]) == 2 * 2 * 2 * 2 * 3  # sequences to frames
    share = tables["motion_share"].set_index(["implementation", "window"])["share"]
    assert len(share) == 4
    assert np.isfinite(share).all()
    assert [len(table.rows) for table in time_tables(tables)] == [8, 2]
