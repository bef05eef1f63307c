"""Times of trackers in this process, in files, with `python=` and by TraX."""

import sys

import pytest

import trackmark as tm
from trackmark.bench.analysis.run_summary import summarise, summarise_times
from trackmark.bench.analysis.run_tables import tables
from trackmark.bench.evaluation.loop import evaluate_run
from trackmark.bench.pages.report import ReportPage
from trackmark.bench.store.runs import Runs

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
        (run,) = tm.evaluate([namespace["Waiting"]], "Noise").values()
    else:
        run = evaluate_run(waiting[way], "Noise")
    facts = run.metadata
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


@pytest.mark.slow
def test_clocks_and_notes_are_shown_with_times(waiting, folder, run_trial):
    trial = ["static", *waiting.values()]
    results = run_trial(folder / "results", trial, ["Noise"])
    runs = Runs.open(results)
    note = "wall time minus run delay, with reading of images: w"
    assert note in summarise(runs).lines()
    assert any(line.startswith("waits: ") for line in summarise(runs).lines())
    assert note in str(tm.compare(tm.load_runs(results))).splitlines()
    page = folder / "page.html"
    ReportPage(runs, []).write(page, "", lambda *_: None)
    assert note in page.read_text()


def test_timing_runs_have_all_columns_of_times(waiting, folder, run_trial):
    trackers = ["static", waiting["file"]]
    runs = Runs.open(run_trial(folder / "timed", trackers, ["Noise"], is_timing=True))
    (table,) = [table for table in tables(runs) if table.name == "times"]
    assert table.headings[2:6] == ["ms/frame", "fps", "median [ms]", "95th percentile [ms]"]
    lines = summarise_times(runs)
    assert lines[0].startswith("static is the fastest: ")
