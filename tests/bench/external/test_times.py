"""Times that trackers in other processes report."""

import shutil

import pandas as pd

import trackmark as tm
from trackmark import bench
from trackmark.bench.comparing.run_summary import summarise, summarise_times
from trackmark.bench.pages.report import Commands, write_report_page
from trackmark.bench.reporting.tables import clock_notes, clocks, tables
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
    """Tracker that does not measure itself."""

    name = "unclocked"
    call_times = None
'''


def test_reported_times_replace_measured_times(folder, run_trial):
    """Tables with times have a note on times that include the transfer."""
    (folder / "clocked.py").write_text(CLOCKED)
    shutil.copytree(folder / "Noise", folder / "Other")
    names = ["static", "clocked.py:Clocked", "clocked.py:Unclocked"]
    note = "times of unclocked: wall time with transfer"
    for timing in (False, True):
        results = run_trial(folder / f"results-{timing}", names, ["Noise", "Other"], timing=timing)
        runs = bench.load_runs(results).set_index(["tracker", "sequence"])
        assert runs["update_seconds"].notna().all()
        for score in ("warm_seconds_p99", "wall_seconds_median", "initialisation_seconds"):
            assert not timing or runs.loc[("clocked", "Noise"), score] == 2.0
        assert timing or runs.loc[("clocked", "Noise"), "update_seconds"] == 2.0
        noted = [table.name for table in tables(results) if note in table.notes]
        assert noted == ["times" if timing else "summary"]
    lines = summarise_times(results, Results(results).list_keys())
    assert lines[0].startswith("static is the fastest: ")
    assert lines[-1] == note


def test_clock_of_missing_runs_is_unknown():
    runs = pd.DataFrame({"tracker": ["a", "a", "b"], "clock": ["wall", None, None]})
    assert clocks(runs) == {"a": "wall"}
    assert clock_notes({"a": "wall", "b": "wall"}) == ["times of a, b: wall"]


def test_times_with_transfer_are_marked(folder, run_trial):
    (folder / "clocked.py").write_text(CLOCKED)
    results = run_trial(folder / "results", ["static", "clocked.py:Unclocked"], ["Noise"])
    note = "times of unclocked: wall time with transfer"
    assert note in summarise(results).lines()
    assert note in str(tm.compare(tm.load_results(results))).splitlines()
    page = folder / "page.html"
    write_report_page(results, page, [], "", Commands(), lambda *_: None)
    in_leaderboard, in_plot = (f"1 sequence; {note}", f"sequences needed; {note}")
    assert in_leaderboard in page.read_text()
    assert in_plot in page.read_text()
