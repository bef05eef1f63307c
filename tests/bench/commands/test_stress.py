"""Tests of the command `trackmark stress`."""

import json

import numpy as np
import pytest

from tests.bench.commands.conftest import assert_tables_have_rows
from trackmark.bench.stress import breaking_points

SMALL = "plain/target:length=20:width=64:height=64"
STRESS = ("--sequences", SMALL, "--runs", "20", "--jobs", "1", "--difficulty")  # no processes

pytestmark = pytest.mark.usefixtures("blank_figures")


@pytest.mark.slow
def test_breaking_points_are_found_and_no_run_is_repeated(trackmark, workspace, monkeypatch):
    monkeypatch.setattr(breaking_points, "POSITIONS", np.linspace(0, 1, 11))  # coarse curves
    command = ("stress", "static", "--against", "camshift", *STRESS, "noise")
    text = trackmark(*command, "--output", "out").stdout
    assert text.startswith("noise [grey levels], 0 to 160: ")
    assert "ten consecutive visible" in " ".join(text.split())
    assert max(map(len, text.splitlines())) <= 80
    assert_tables_have_rows(workspace / "out")
    for name in ("breaking-points.tex", "runs.csv", "curve-noise.png"):
        assert (workspace / "out" / name).is_file()
    pool = "trackmark.bench.execution.pool.Pool.run_tasks"
    monkeypatch.setattr(pool, lambda *_: pytest.fail("a run is repeated"))
    data = json.loads(trackmark(*command, "--json").stdout)
    assert [series["tracker"] for series in data["stress_tests"]] == ["static", "camshift"]
    assert all(len(series["runs"]) == 20 for series in data["stress_tests"])
    assert data["against"] == "camshift"


@pytest.mark.slow
def test_failing_tracker_breaks_at_once(trackmark, workspace, break_tracker):
    break_tracker("raise ValueError('too fragile')")
    command = ("stress", "knob.py", "--against", "static", *STRESS, "noise=0..9")
    text = " ".join(trackmark(*command).stdout.split())
    assert "at once" in text
    assert "knob.py:Knob: 20 of 20 runs failed (counted as lost): sequence " in text
    assert "too fragile" in text
