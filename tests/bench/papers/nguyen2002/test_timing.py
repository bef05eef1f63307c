"""What is said of times, and how they stand beside the paper's."""

import numpy as np
import pandas as pd
import pytest

import bench
from bench.experiments.experiment import Experiment, SequenceSource
from bench.papers.nguyen2002 import timing
from bench.papers.nguyen2002.timing import run_times, time_table
from bench.store.loading import load_results
from bench.store.results import Results
from reports.tables import MISSING

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two repetitions of each; the target is hidden about frame 20 for some frames."""
    names = ("nguyen2002:preset=as-written:features=rgb", "nguyen2002:features=intensity")
    sources = (SequenceSource("plain/target:length=60:occlusion=1"),)
    experiment = Experiment("t", names, sources, repetitions=2, timing=True)
    return bench.run(experiment, tmp_path_factory.mktemp("results"), jobs=1)


@pytest.mark.parametrize("disturbed", [(0, 0), (0, 1), (1, 1)])
def test_times_are_of_runs_that_no_load_disturbed_where_there_are_any(
    folder, monkeypatch, disturbed
):
    """Whatever load there was: which of both repetitions were disturbed is given."""

    def known(*asked):
        runs = load_results(*asked)
        return runs.assign(disturbed=[disturbed[number] for number in runs["repetition"]])

    monkeypatch.setattr(timing, "load_results", known)
    rows = run_times(folder).set_index(["preset", "features"])
    assert list(rows.index) == [("as-written", "rgb"), ("recommended", "intensity")]
    assert set(rows["disturbed"]) == {min(disturbed)}
    runs = [Results(folder).read(path) for path in Results(folder).files()]
    kept = [
        run.times.cpu[1:]
        for run in runs
        if run.identity.tracker.endswith("rgb")
        and disturbed[run.identity.repetition] == min(disturbed)
    ]
    assert len(kept) == max(1, disturbed.count(0)) + (disturbed == (1, 1))
    mean = rows.loc[("as-written", "rgb"), "milliseconds"]
    assert mean == pytest.approx(1e3 * np.mean(kept))


def test_an_occlusions_end_takes_longest(folder):
    assert (run_times(folder)["burst"] > 2 * run_times(folder)["usual"]).all()


def test_times_stand_beside_the_papers():
    row = {"milliseconds": 1.5, "usual": 0.75, "features": "rgb"}
    times = pd.DataFrame(
        [
            row | {"preset": "as-written", "burst": np.nan, "disturbed": 0.0},
            row | {"preset": "recommended", "burst": 3.0, "disturbed": 1.0},
        ]
    )
    table = time_table(times, ["failed: why"])
    assert [[cell.text for cell in row] for row in table.rows] == [
        ["as written", "rgb", "1.50", "0.75", MISSING, MISSING, "no"],
        ["recommended", "rgb", "1.50", "0.75", "3.0", "4.0", "yes"],
    ]
    assert "0.005 s" in table.caption
    assert table.notes == ["failed: why"]
