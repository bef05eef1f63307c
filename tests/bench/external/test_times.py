"""Times that trackers in other processes report."""

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
    """Tracker that does not measure itself."""

    name = "unclocked"
    call_times = None
'''


def test_reported_times_replace_measured_times(folder, run_trial):
    """Tables have a note on times that include the transfer."""
    (folder / "clocked.py").write_text(CLOCKED)
    names = ["static", "clocked.py:Clocked", "clocked.py:Unclocked"]
    note = "times of unclocked: wall time with transfer"
    for timing in (False, True):
        results = run_trial(folder / f"results-{timing}", names, ["Noise"], timing=timing)
        runs = bench.load_runs(results).set_index("tracker")
        assert runs["update_seconds"].notna().all()
        for score in ("warm_seconds_p99", "wall_seconds_median", "initialisation_seconds"):
            assert not timing or runs.loc["clocked", score] == 2.0
        assert timing or runs.loc["clocked", "update_seconds"] == 2.0
        assert all(note in table.notes for table in tables(results))
        assert summarise_times(results, Results(results).list_keys())[-1] == note
