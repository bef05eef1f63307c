"""Two workers do the work of almost two: neither waits for the command, the disk or the other."""

from dataclasses import replace

import pytest

from trackmark import bench
from trackmark.bench.store.log import read_logs


@pytest.mark.slow
def test_two_workers_are_at_work_1_8_times_as_long_as_it_takes(tmp_path, record_property):
    """Start-up and the last unit included; other load on the machine changes it little."""
    chosen = bench.read_experiment("multipart-table-1")
    chosen = replace(chosen, sequences=chosen.sequences[::8], repetitions=4, repeated={})
    (events,) = read_logs(bench.run(chosen, tmp_path, jobs=2)).values()
    worked = sum(event["seconds"] for event in events if event["event"] == "unit")
    record_property("workers_busy", worked / events[-1]["seconds"])
    assert worked / events[-1]["seconds"] >= 1.8
