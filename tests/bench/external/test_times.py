"""Times that trackers in other processes report."""

import numpy as np

from trackmark import bench
from trackmark.bench.comparing.run_summary import summarise_times
from trackmark.bench.reporting.tables import tables
from trackmark.bench.store.results import Results

CLOCKED = '''
from trackmark.bench.external.plugin import ExternalPlugin
from trackmark.trackers import Estimate


class Clocked(ExternalPlugin):
    """Tracker with fixed times."""

    name = "clocked"
    call_times = (2.0, 2.0)

    def init(self, image, box, mask=None):
        self.box = box

    def update(self, image):
        return Estimate(self.box)

    def close(self):
        pass


class Unclocked(Clocked):
    """Tracker without times of its own."""

    name = "unclocked"
    call_times = None
'''


def test_reported_times_replace_measured_times(tmp_path, otb, run_trial):
    """Tables have a note on times that include the transfer."""
    sequence = str(otb(tmp_path / "Noise", 5))
    file = tmp_path / "clocked.py"
    file.write_text(CLOCKED)
    folders = [
        run_trial(
            tmp_path / f"results-{timing}",
            ["static", f"{file}:Clocked", f"{file}:Unclocked"],
            [sequence],
            timing=timing,
        )
        for timing in (False, True)
    ]
    runs, timing_runs = map(bench.load_runs, folders)
    clocked = runs[runs["tracker"] == "clocked"].iloc[0]
    assert clocked["update_seconds"] == 2.0
    assert clocked["seconds"] >= 8.0
    timed = timing_runs[timing_runs["tracker"] == "clocked"].iloc[0]
    for score in ("warm_seconds_p99", "wall_seconds_median", "initialisation_seconds"):
        assert timed[score] == 2.0
    notes = {table.name: table.notes for folder in folders for table in tables(folder)}
    assert notes
    assert all("times of unclocked: wall time with transfer" in lines for lines in notes.values())
    assert (
        summarise_times(folders[1], Results(folders[1]).list_keys())[-1]
        == "times of unclocked: wall time with transfer"
    )
    assert np.isfinite(runs["update_seconds"]).all()
