"""`trackmark stress`, as a user types it."""

import json

import pytest

SMALL = "plain/target:length=20:width=64:height=64"
STRESS = ("stress", "static", "--against", "camshift", "--sequences", SMALL, "--runs", "20")


def test_it_finds_breaking_points_and_runs_nothing_twice(trackmark, here):
    said = trackmark(*STRESS, "--knob", "noise", "--folder", "out").stdout
    assert "Breaking points" in said
    assert "ten visible frames" in said
    assert max(map(len, said.splitlines())) <= 100
    for name in ("breaking-points.tex", "severity.csv", "runs.csv", "curve-noise.png"):
        assert (here / "out" / name).is_file()
    logs = list((here / "results/stress/_log").iterdir())
    again = trackmark(*STRESS, "--knob", "noise", "--json").stdout
    assert list((here / "results/stress/_log").iterdir()) == logs
    told = json.loads(again)
    assert [one["tracker"] for one in told["series"]] == ["static", "camshift"]
    assert all(len(one["runs"]) == 20 for one in told["series"])
    assert told["baseline"] == "camshift"


@pytest.mark.slow
def test_a_tracker_that_fails_breaks_and_recorded_scores_are_correlated(trackmark, here):
    (here / "fragile.py").write_text(
        "from trackmark import trackers\n\n\nclass Fragile(trackers.TrackerPlugin):\n"
        '    """Fails."""\n\n'
        "    def init(self, image, box, mask=None):\n        self.box = box\n\n"
        "    def update(self, image):\n        raise ValueError('too fragile')\n"
    )
    stress = ("stress", "fragile.py", "--against", "static", "--sequences", SMALL, "--runs", "20")
    said = trackmark(*stress, "--knob", "noise=0..9", "--recorded", f"{SMALL}:scene=1").stdout
    said = " ".join(said.split())
    assert "at once" in said
    assert "fragile.py:Fragile: 20 of 20 runs failed (counted as lost): sequence " in said
    assert "too fragile" in said
    assert "Rank correlation over 2 trackers" in said
    assert "-1.00 to 1.00" in said
