"""What is timed, and how times stand beside the paper's."""

import numpy as np
import pandas as pd
import pytest

import bench
import datasets
from bench.experiments.experiment import Experiment, SequenceSource
from bench.papers.nguyen2002 import timing
from bench.papers.nguyen2002.timing import (
    FEATURES,
    Followed,
    course_times,
    frame_times,
    measured_times,
    time_tables,
)
from bench.papers.timed import timed_runs
from bench.store.loading import load_results
from reports.tables import MISSING

pytestmark = pytest.mark.slow

# The target is hidden about frame 20 for some frames.
NAME = "plain/target:length=60:occlusion=1"


@pytest.fixture(scope="module")
def courses():
    return course_times(NAME, 3, 40, 2)


def test_every_way_of_tracking_is_timed_on_the_same_frames(courses):
    ways = courses.groupby(["preset", "features"]).size()
    assert len(ways) == 2 * len(FEATURES)
    assert (ways == ways.iloc[0]).all()
    assert (courses["seconds"] > 0).all()


def test_an_occlusions_end_takes_longest(courses):
    medians = courses.groupby(["preset", "kind"])["seconds"].median()
    for preset in timing.PRESETS:
        assert medians[preset, "burst"] > medians[preset, "usual"] > medians[preset, "hidden"]


def test_a_time_stands_beside_what_had_to_be_done(courses):
    sequence = datasets.load(NAME)
    first = int(np.flatnonzero(sequence.visibility < timing.HIDDEN)[0])
    part = sequence[first - 3 : first + 40]
    followed = Followed("rgb", "as-written", part[0], part.boxes[0])
    for image in list(part)[1:]:
        followed(image)
    rows = courses[courses["preset"].eq("as-written") & courses["features"].eq("rgb")]
    assert rows["kind"].tolist() == 2 * followed.kinds[1:]


def test_a_frame_is_usual_hidden_or_one_in_which_an_occlusion_ends():
    sequence = datasets.load(NAME)
    followed = Followed("rgb", "as-written", sequence[0], sequence.boxes[0])
    for frame in range(1, 60):
        followed(sequence[frame])
    kinds = "".join(kind[0] for kind in followed.kinds)
    assert kinds.startswith("uuu")
    assert "h" * 10 in kinds
    assert "b" in kinds


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    names = ("nguyen2002:features=rgb", "nguyen2002:features=rgb:gamma=0.4", "static")
    sources = (SequenceSource("plain/target:length=20"),)
    experiment = Experiment("t", names, sources, repetitions=2, timing=True)
    return bench.run(experiment, tmp_path_factory.mktemp("results"), jobs=1)


@pytest.mark.parametrize("disturbed", [(0, 0), (0, 1), (1, 1)])
def test_timing_runs_are_those_of_the_presets_that_no_load_disturbed(
    folder, monkeypatch, disturbed
):
    """Whatever load there was: which of both repetitions were disturbed is given."""

    def known(*asked):
        runs = load_results(*asked)
        return runs.assign(disturbed=[disturbed[number] for number in runs["repetition"]])

    monkeypatch.setattr("bench.papers.timed.load_results", known)
    frames = frame_times(folder)
    if disturbed == (1, 1):
        assert frames.empty
        return
    assert set(zip(frames["features"], frames["preset"], strict=True)) == {("rgb", "recommended")}
    assert frames["frame"].tolist() == list(range(1, 20))
    kept = [run for run in timed_runs(folder) if run.identity.tracker == "nguyen2002:features=rgb"]
    assert len(kept) == disturbed.count(0)
    seconds = np.median([run.times.cpu[1:] for run in kept], axis=0)
    np.testing.assert_allclose(frames["seconds"], seconds)


def test_passes_that_other_load_disturbed_are_left_out_where_there_are_others(folder, monkeypatch):
    keys = {"preset": "as-written", "features": "rgb"}
    passes = pd.DataFrame(
        {"kind": "usual", "seconds": [1e-3, 1e-3, 5e-3, 5e-3], "disturbed": [0.0, 0.0, 1.0, 1.0]}
    ).assign(**keys)
    for rows, milliseconds, disturbed in ((passes, 1.0, 0.0), (passes[2:], 5.0, 1.0)):
        monkeypatch.setattr(timing, "course_times", lambda *_, rows=rows: rows)
        (found,) = measured_times(folder)["ng-10"].to_dict("records")
        assert found["usual"] == found["milliseconds"] == pytest.approx(milliseconds)
        assert found["disturbed"] == disturbed


def test_a_pass_is_disturbed_where_it_took_longer_than_the_processor_worked(monkeypatch):
    for wall, disturbed in ((1.05, 0.0), (1.15, 1.0)):
        clocks = {"thread_time": iter([0.0, 1.0] * 2), "perf_counter": iter([0.0, wall] * 2)}
        for name, readings in clocks.items():
            monkeypatch.setattr(timing, name, lambda readings=readings: next(readings))
        found = course_times("plain/target:length=10", 1, 2, 1)
        assert (found["disturbed"] == disturbed).all()


def test_all_that_the_ledger_asks_for_is_measured(folder, monkeypatch):
    monkeypatch.setattr(timing, "CLIP", "plain/target:length=12")
    tables = measured_times(folder, quick=True)
    assert list(tables) == ["frame_times", "course_times", "ng-10"]
    rows = tables["ng-10"]
    assert len(rows) == 2 * len(FEATURES)
    assert (rows["milliseconds"] > 0).all()
    assert rows["burst"].isna().all()


def test_times_stand_beside_the_papers_and_those_of_timing_runs():
    row = {
        "preset": "as-written",
        "features": "rgb",
        "milliseconds": 1.5,
        "usual": 0.75,
        "burst": np.nan,
        "disturbed": 0.0,
    }
    tables = {
        "ng-10": pd.DataFrame(
            [
                row,
                row | {"preset": "recommended", "disturbed": 1.0},
                row | {"features": "arctan", "usual": 25.0, "burst": 100.0},
            ]
        ),
        "frame_times": pd.DataFrame(
            {
                "features": "rgb",
                "preset": ["as-written"] * 2 + ["recommended"],
                "sequence": NAME,
                "frame": [1, 2, 1],
                "seconds": [1e-3, 3e-3, 9.0],
            }
        ),
    }
    (table,) = time_tables(tables, ["failed: why"])
    assert [[cell.text for cell in row][2:] for row in table.rows] == [
        ["1.5", "0.75", MISSING, "2"],
        ["1.5 (disturbed by other load)", "0.75", MISSING, "9e+03"],
        ["1.5", "25", "100 (4.0×)", MISSING],
    ]
    assert "0.005 s" in table.caption
    assert table.notes[-1] == "failed: why"
