"""Number of times that commands read stored runs."""

from collections import Counter

import pytest

from bench.store import results

STORED = "results/stored"


@pytest.fixture
def reads(trackmark, here, monkeypatch):
    """Counter of the runs that were read, by file, of an experiment without index."""
    options = ("--sequences", "data/Small", "--seeds", 2, "--name", "stored")
    trackmark("run", "--trackers", "static,camshift,knob.py:Knob", *options)
    (here / STORED / "index.arrow").unlink()
    counter, decode = Counter(), results._run

    def count(path, *content):
        counter[path] += 1
        return decode(path, *content)

    monkeypatch.setattr(results, "_run", count)
    return counter


@pytest.mark.parametrize("command", [("report", "--by-attribute"), ("compare", "--results")])
def test_command_reads_each_run_once(trackmark, reads, command):
    trackmark(*command, STORED, "--metrics", "native,otb", "--folder", "out")
    assert sorted(reads.values()) == [1] * 4


def test_command_reads_runs_again_if_they_do_not_fit_in_memory(trackmark, reads, monkeypatch):
    command = ("compare", "--results", STORED, "--metrics", "otb,lasot", "--json")
    first = trackmark(*command).stdout
    monkeypatch.setattr(results, "MAX_KEPT_BYTES", 0)
    reads.clear()
    assert trackmark(*command).stdout == first
    assert min(reads.values()) > 1
