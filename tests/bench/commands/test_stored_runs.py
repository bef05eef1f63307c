"""Number of times that commands read stored runs."""

from collections import Counter

import pytest

from trackmark.bench.store import index, results


@pytest.mark.parametrize("command", [("report", "--by-attribute"), ("compare", "--results")])
def test_command_reads_each_run_once(trackmark, here, monkeypatch, command):
    stored = here / "results" / "stored"
    where = ("--sequences", "data/Small", "--seeds", 2, "--name", "stored")
    trackmark("run", "--trackers", "static,camshift,knob.py:Knob", *where)
    monkeypatch.setattr(index, "_scorer_version", lambda: "another")
    reads, decode = Counter(), results._run
    monkeypatch.setattr(results, "_run", lambda *of: reads.update([of[1]["id"]]) or decode(*of))
    trackmark(*command, stored, "--metrics", "native,otb", "--folder", "out")
    assert sorted(reads.values()) == [1] * 4
    data = *command, stored, "--metrics", "native,otb,lasot", "--json"
    first = trackmark(*data).stdout
    monkeypatch.setattr(results.KeptRuns, "free", 0)
    reads.clear()
    assert trackmark(*data).stdout == first
    assert min(reads.values()) > 1
