"""`trackmark check --timing` with invented times, which do not depend on the load."""

import json
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from tests.bench.commands.conftest import SMALL
from trackmark.bench.evaluation.interleaved_timing import TurnError
from trackmark.bench.statistics import speed

SLOW = "\n# slow\n"

CELL = '"data/Small" = { fingerprint = "00000000", overlap = [0.5], box_digests = ["00000000"] }'
WRITTEN = f"""
format = 1
repetitions = 6
detectable_drop = 0.05
[environment]
[specifications]
mine = "knob.py:as=mine"
[trackers.mine]
{CELL}
[trackers.static]
{CELL}
"""
AGAINST = ("--timing", "--revision", "HEAD")


@pytest.fixture
def git(workspace):
    def call(*arguments):
        author = ("-c", "user.name=a", "-c", "user.email=a@b")
        subprocess.run(
            ["git", *author, *map(str, arguments)], cwd=workspace, check=True, timeout=300
        )

    return call


@pytest.fixture
def timed_setups(monkeypatch):
    """Invent times, longer for files that contain `SLOW`; return the timed setups."""
    setups_seen, generator = [], np.random.default_rng(0)

    def ratio(setup):
        file = Path(setup.home, "trackers", f"{setup.name}.py") if setup.home else Path(setup.name)
        return 1.1 if file.is_file() and SLOW in file.read_text() else 1.0

    def time_interleaved(setups, clips):
        assert [clip.n_frames for clip in clips] == [4]
        setups_seen.append(setups)
        ratios = np.array([ratio(setup) for setup in setups])
        return ratios[:, None, None] * generator.normal(1, 0.01, (2, 5, 4))

    monkeypatch.setattr("trackmark.bench.regression.speed.time_interleaved", time_interleaved)
    return setups_seen


@pytest.fixture
def committed_baseline(trackmark, workspace, timed_setups, git, monkeypatch):
    """Create a baseline of two trackers and commit their files."""
    package = workspace / "trackers"
    package.mkdir()
    (package / "static.py").write_text("# as it was\n")
    monkeypatch.setattr("trackmark.bench.regression.speed._PACKAGE", package)
    git("init", "--quiet")
    git("add", "knob.py", "trackers")
    git("commit", "--quiet", "--message", "before")
    trackers = ("--trackers", "static,knob.py:as=mine")
    trackmark("baseline", "own", *trackers, *SMALL, "--repetitions", 6)
    return workspace / "baselines" / "own.toml"


@pytest.fixture
def baseline_without_runs(workspace):
    """Write a baseline whose trackers need not run."""
    path = workspace / "baselines" / "own.toml"
    path.parent.mkdir()
    path.write_text(WRITTEN)
    return path


def slow_down(file):
    file.write_text(file.read_text() + SLOW)


def test_slower_tracker_is_reported(trackmark, workspace, committed_baseline):
    unchanged = trackmark("check", "own", *AGAINST)
    assert unchanged.stdout.count("not 5 % slower") == 2
    assert "Comparing times with HEAD: at most 10 min." in unchanged.stderr
    slow_down(workspace / "knob.py")
    files = ("--markdown", "pull.md", "--junit", "check.xml")
    done = trackmark("check", "own", *AGAINST, *files, status=1)
    assert "--accept" not in done.stderr  # it replaces scores, and these are unchanged
    printed = done.stdout
    assert printed.startswith("FAIL  2 of 2 scores unchanged; 1 tracker slower")
    assert "mine" in next(line for line in printed.splitlines() if line.startswith("slower"))
    assert "identical  " in printed  # the boxes are
    assert "slower" in (workspace / "pull.md").read_text()
    failed = ElementTree.parse(workspace / "check.xml").find("testcase/failure/..")
    assert failed.attrib == {"classname": "mine", "name": "time"}
    data = json.loads(trackmark("check", "own", *AGAINST, "--json", status=1).stdout)
    assert data["verdict"] == "regression"
    first = data["times"][0]
    assert (first["tracker"], first["decision"]) == ("mine", "slower")
    assert first["low"] < first["change"] < first["high"]


@pytest.mark.slow
def test_old_trackers_come_from_the_revision(
    trackmark, workspace, committed_baseline, git, timed_setups
):
    slow_down(workspace / "knob.py")
    slow_down(workspace / "trackers" / "static.py")
    timed_setups.clear()
    printed = trackmark("check", "own", *AGAINST, "--json", status=1).stdout
    states = {entry["tracker"]: entry["decision"] for entry in json.loads(printed)["times"]}
    # The current file of `static` is not from the folder of the revision.
    assert states == {"mine": "slower", "static": "not 5 % slower"}
    assert [old.home != "" for old, _ in timed_setups[:: speed.MIN_SESSIONS]] == [True, False]
    assert all((old.options, now.home) == (now.options, "") for old, now in timed_setups)
    git("commit", "--quiet", "--all", "--message", "after")
    assert "\nslower" not in trackmark("check", "own", *AGAINST).stdout
    git("mv", "knob.py", "other.py")
    git("commit", "--quiet", "--message", "moved")
    (workspace / "knob.py").write_text((workspace / "other.py").read_text())
    message = trackmark("check", "own", *AGAINST, status=2).stderr
    assert "HEAD has no knob.py" in message
    assert "git add knob.py" in message


@pytest.mark.slow
def test_tracker_that_cannot_be_timed_is_inconclusive(trackmark, committed_baseline, monkeypatch):
    def time_interleaved(setups, clips):
        raise TurnError("its process ended")

    monkeypatch.setattr("trackmark.bench.regression.speed.time_interleaved", time_interleaved)
    printed = trackmark("check", "own", *AGAINST, "--strict", status=3).stdout
    assert "static: the tracker cannot be timed: its process ended." in printed
    printed = trackmark("check", "own", *AGAINST, "--strict", "--json", status=3).stdout
    assert json.loads(printed)["verdict"] == "inconclusive"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--timing",), "--timing requires --revision REVISION"),
        (("--revision", "HEAD"), "--timing requires --revision REVISION"),
        (AGAINST, "not a git repository"),
        (("--timing", "--revision", "nowhere"), "unknown revision 'nowhere'"),
        (("--timing", "--revision", "--all"), "unknown revision '--all'"),
        ((*AGAINST, "--accept", "mine", "--reason", "x"), "cannot be combined with --timing"),
    ],
)
def test_wrong_usage_of_time_exits_with_2(trackmark, baseline_without_runs, git, arguments, words):
    if arguments[-1] in ("nowhere", "--all"):
        git("init", "--quiet")
    message = trackmark("check", "own", *arguments, status=2).stderr
    assert words in message
    assert len(message.strip().splitlines()) <= 4


def test_missing_git_is_reported(trackmark, baseline_without_runs, monkeypatch):
    monkeypatch.setenv("PATH", "")
    message = trackmark("check", "own", "--trackers", "mine", *AGAINST, status=2).stderr
    assert "cannot run git" in message


@pytest.mark.slow
def test_budget_is_refused_with_the_least_possible_one(trackmark, committed_baseline, monkeypatch):
    """A session takes 10 s on a simulated clock: two trackers need six sessions each."""
    clock = iter(range(0, 100_000, 10))
    monkeypatch.setattr("trackmark.bench.regression.speed.monotonic", lambda: next(clock))
    options = ("--timing", "--revision", "HEAD", "--budget")
    result = trackmark("check", committed_baseline, *options, "90s", status=2)
    assert "6 sessions of 2 trackers take about 120 s. Use --budget 144s" in result.stderr
