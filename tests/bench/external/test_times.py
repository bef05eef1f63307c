"""Times that trackers in other processes report."""

import numpy as np

import trackmark as tm
from trackmark import bench
from trackmark.bench.comparing.run_summary import summarise, summarise_times
from trackmark.bench.comparing.tables import files
from trackmark.bench.pages.report import Commands, write_report_page
from trackmark.bench.reporting.tables import tables
from trackmark.bench.store.results import Results

CLOCKED = '''
from trackmark.bench.external.plugin import ExternalPlugin
from trackmark.trackers import Estimate


class Clocked(ExternalPlugin):
    """Tracker with fixed times."""

    name = "clocked"
    call_times = (2.0, 2.0)
    includes_transfer = True

    def init(self, image, box, mask=None):
        self.box = box

    def update(self, image):
        return Estimate(self.box)

    def close(self):
        pass
'''


def test_reported_times_replace_measured_times(tmp_path, otb, run_trial):
    """Texts with times name the times that include the transfer, and do not compare them."""
    sequences = [str(otb(tmp_path / name, 5)) for name in ("Noise", "Other")]
    file = tmp_path / "clocked.py"
    file.write_text(CLOCKED)
    folders = [
        run_trial(tmp_path / f"results-{timing}", ["static", str(file)], sequences, timing=timing)
        for timing in (False, True)
    ]
    runs, timing_runs = map(bench.load_runs, folders)
    clocked = runs[runs["tracker"] == "clocked"].iloc[0]
    assert clocked["update_seconds"] == 2.0
    assert clocked["seconds"] >= 8.0
    timed = timing_runs[timing_runs["tracker"] == "clocked"].iloc[0]
    for score in ("warm_seconds_p99", "wall_seconds_median", "initialisation_seconds"):
        assert timed[score] == 2.0
    assert np.isfinite(runs["update_seconds"]).all()
    note = "times of clocked: wall time with transfer"
    notes = {table.name: table.notes for folder in folders for table in tables(folder)}
    assert {name for name in notes if note in notes[name]} == {"summary", "times"}
    lines = summarise_times(folders[1], Results(folders[1]).list_keys())
    assert lines[0].startswith("static was timed: ")
    assert lines[-1] == note
    page = tmp_path / "page.html"
    write_report_page(folders[0], page, [], "", Commands(), lambda *_: None)
    assert page.read_text().count(note) >= 2  # leaderboard, and plot of speed and accuracy
    comparison = tm.compare(tm.load_results(folders[0]))
    for text in ("\n".join(summarise(folders[0]).lines()), str(comparison)):
        assert note in text
        assert "times faster" not in text
    assert note in files(comparison)[0].notes
