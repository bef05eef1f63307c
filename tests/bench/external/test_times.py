"""Times of trackers in this process, in files, with `python=` and by TraX."""

import sys

import pytest

import trackmark as tm
from trackmark import bench
from trackmark.bench.analysis.run_summary import summarise, summarise_times
from trackmark.bench.analysis.run_tables import tables
from trackmark.bench.pages.report import Commands, write_report_page
from trackmark.bench.store.results import Results

WAITING = """
import time

class Waiting:
    device = "Accelerator 9"

    def init(self, image, box):
        time.sleep(0.03)
        self.box, self.n = box, 0

    def update(self, image):
        self.n += 1
        time.sleep(0.05 if self.n == 1 else 0.01)
        return self.box

    def synchronise(self):
        time.sleep(0.005)
"""

TRAX = """
import sys, time
hello = '"trax.version=3" "trax.name=w" "trax.image=path" "trax.region=rectangle"'
print("@@TRAX:hello " + hello, flush=True)
for line in sys.stdin:
    if line.startswith("@@TRAX:quit"):
        break
    if line.startswith("@@TRAX:initialize"):
        region = line.split('"')[3]
    time.sleep(0.015)
    print(f'@@TRAX:state "{region}"', flush=True)
"""


@pytest.fixture
def waiting(folder):
    """Return specifications of a tracker that waits, for each way to connect it."""
    (folder / "waiting.py").write_text(WAITING)
    (folder / "trax_waiting.py").write_text(TRAX)
    return {
        "file": "waiting.py",
        "python": f"waiting.py:python={sys.executable}:as=other",
        "trax": f"trax:command={sys.executable} trax_waiting.py:as=w",
    }


@pytest.mark.parametrize("way", ["class", "file", "python", "trax"])
def test_waiting_is_time_in_all_ways_in(waiting, folder, way):
    if way == "class":
        namespace = {}
        exec(WAITING, namespace)
        (run,) = tm.evaluate([namespace["Waiting"]], "Noise").runs.values()
    else:
        run = bench.evaluate_run(waiting[way], "Noise")
    facts = run.circumstances
    assert not run.failure
    # Waiting ends when the thread may run again; the delay until it runs is not part of the time.
    # Run delay of a TraX tracker after its answer is subtracted, too.
    assert facts["ms_per_frame"] >= (14 if way == "trax" else 15)
    assert facts["fps"] == pytest.approx(1e3 / facts["ms_per_frame"])
    assert facts["cpu_ms_per_frame"] < 5
    assert facts["time_note"] == "waits"
    if way == "trax":
        assert facts["clock"] == "wall time minus run delay, with reading of images"
        return
    assert facts["clock"] == "wall time minus run delay"
    # First call and initialisation are apart from the other calls.
    assert facts["ms_first_update"] >= 55 > facts["ms_per_frame_median"]
    assert facts["ms_init"] >= 35
    assert facts["machine"].endswith("Accelerator 9")


def test_clocks_and_notes_are_shown_with_times(waiting, folder, run_trial):
    trial = ["static", *waiting.values()]
    results = run_trial(folder / "results", trial, ["Noise"])
    note = "wall time minus run delay, with reading of images: w"
    assert note in summarise(results).lines()
    assert any(line.startswith("waits: ") for line in summarise(results).lines())
    assert note in str(tm.compare(tm.load_results(results))).splitlines()
    page = folder / "page.html"
    write_report_page(results, page, [], "", Commands(), lambda *_: None)
    assert note in page.read_text()


def test_timing_runs_have_all_columns_of_times(waiting, folder, run_trial):
    results = run_trial(folder / "timed", ["static", waiting["file"]], ["Noise"], timing=True)
    (table,) = [table for table in tables(results) if table.name == "times"]
    assert table.heads[2:6] == ["ms/frame", "fps", "median [ms]", "95th percentile [ms]"]
    lines = summarise_times(results, Results(results).list_keys())
    assert lines[0].startswith("static is the fastest: ")
