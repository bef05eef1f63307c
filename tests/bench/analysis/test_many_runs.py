"""Reports, comparisons and tables of many trackers or sequences."""

import sqlite3

import pytest

import trackmark as tm


def report_all(trackmark, folder, n_sequences, n_trackers, forms):
    """Read results by every command and function that groups runs by tracker or sequence."""
    for form in forms:
        printed = trackmark("report", folder, "--format", form).stdout
        assert f"sequence-{n_sequences - 1}" in printed
        assert f"tracker-{n_trackers - 1}" in printed
    against = ["--against", "tracker-0"] if n_trackers > 2 else []
    trackmark("compare", "--results", folder, *against)
    results = tm.load_runs(folder)
    assert len(results.means()) == n_trackers
    assert len(results.means(per="sequence")) == n_trackers * n_sequences


@pytest.mark.slow
@pytest.mark.parametrize(("n_sequences", "n_trackers"), [(130, 2), (2, 130)])
def test_report_of_130_trackers_or_sequences(
    n_sequences, n_trackers, store_many, trackmark, workspace
):
    store_many(workspace / "many", n_sequences, n_trackers)
    report_all(trackmark, workspace / "many", n_sequences, n_trackers, ["csv"])


@pytest.mark.slow
def test_report_of_1000_sequences(store_many, trackmark, workspace, blank_figures):
    store_many(workspace / "many", 1000, 2)
    report_all(trackmark, workspace / "many", 1000, 2, ["text", "markdown", "csv", "latex"])
    trackmark("report", "many", "--output", "report", "--metrics", "native,otb")


@pytest.mark.slow
def test_report_of_1000_trackers(store_many, trackmark, workspace):
    """Without the answer, which compares all pairs of trackers and takes two minutes."""
    store_many(workspace / "many", 2, 1000)
    report_all(trackmark, workspace / "many", 2, 1000, ["csv"])


@pytest.mark.slow
def test_report_and_comparison_open_the_file_once(
    trackmark, workspace, otb, monkeypatch, blank_figures
):
    opened = []

    def connect(*args, **options):
        opened.append(args)
        return plain(*args, **options)

    plain = sqlite3.connect
    monkeypatch.setattr(sqlite3, "connect", connect)
    run = ("run", "--trackers", "static,camshift", "--name", "many", "--sequences")
    counts = []
    for name in ("First", "Second"):
        otb(workspace / "data" / name, 3)
        trackmark(*run, f"data/{name}")
        for command in ("report results/many --output report", "compare --results results/many"):
            opened.clear()
            trackmark(*command.split())
            counts.append(len(opened))
    assert counts == [1] * 4
