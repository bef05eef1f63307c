"""`trackmark check --time`, as a user types it; times are made up, however busy the machine is."""

import json
import re
import subprocess
import tomllib
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from bench.statistics import speed

BASELINE = ("baseline", "own", "--trackers", "static,knob.py:as=mine")
SEQUENCES = ("--sequences", "data/Small", "--seeds", 2, "--budget", "0s")

SLOW = "\n# slow\n"

SCORES = "mean_overlap = [0.5, 0], success_share = [0.5, 0], centre_error = [1, 0]"
CELL = f'"data/Small" = {{ runs = 1, {SCORES}, boxes = "0", sequence = "0" }}'
WRITTEN = f"""
format = 1
detect = 0.05
[made_with]
[trackers.mine]
tracker = "knob.py:as=mine"
{CELL}
[trackers.static]
{CELL}
[speeds]
mine = {{ ratio = 0.1, spread = 0.01, sessions = 6, processor = "Other" }}
"""


@pytest.fixture
def git(here):
    def call(*arguments):
        who = ("-c", "user.name=a", "-c", "user.email=a@b")
        subprocess.run(["git", *who, *map(str, arguments)], cwd=here, check=True, timeout=300)

    return call


@pytest.fixture
def clocked(monkeypatch):
    """Setups that were clocked, by times that their files say; see `SLOW`."""
    seen, generator = [], np.random.default_rng(0)

    def ratio(setup):
        file = Path(setup.home, "trackers", f"{setup.name}.py") if setup.home else Path(setup.name)
        return 1.1 if file.is_file() and SLOW in file.read_text() else 1.0

    def in_turns(setups, clips):
        assert [clip.frames for clip in clips] == [4]
        seen.append(setups)
        ratios = np.array([ratio(setup) for setup in setups])
        return ratios[:, None, None] * generator.normal(1, 0.01, (2, 5, 4))

    monkeypatch.setattr("bench.comparing.clocking.in_turns", in_turns)
    return seen


@pytest.fixture
def kept(trackmark, here, clocked):
    trackmark(*BASELINE, *SEQUENCES, "--time")
    return here / "baselines" / "own.toml"


@pytest.fixture
def written(here):
    """A baseline of which nothing is run."""
    path = here / "baselines" / "own.toml"
    path.parent.mkdir()
    path.write_text(WRITTEN)
    return path


def slowed(file):
    file.write_text(file.read_text() + SLOW)


def test_a_baseline_has_speeds_where_they_are_asked_for(trackmark, kept):
    told = tomllib.loads(kept.read_text())["speeds"]["mine"]
    assert told["ratio"] == pytest.approx(1, rel=0.05)
    assert told["sessions"] >= speed.FEWEST_SESSIONS
    trackmark(*BASELINE, *SEQUENCES, "--force")
    assert "speeds" not in tomllib.loads(kept.read_text())


def test_a_slower_tracker_is_found_told_and_accepted(trackmark, here, kept):
    assert trackmark("check", "own", "--time").stdout.count("as fast") == 2
    slowed(here / "knob.py")
    files = ("--markdown", "pull.md", "--junit", "check.xml")
    said = trackmark("check", "own", "--time", *files, status=1)
    line = next(line for line in said.stdout.splitlines() if "slower" in line)
    assert "mine" in line
    assert "identical" in said.stdout  # the boxes are
    assert "slower" in (here / "pull.md").read_text()
    failed = ElementTree.parse(here / "check.xml").find("testcase/failure/..")
    assert failed.attrib == {"classname": "mine", "name": "time"}
    told = json.loads(trackmark("check", "own", "--time", "--json", status=1).stdout)
    assert told["verdict"] == "regression"
    first = told["times"][0]
    assert (first["tracker"], first["state"]) == ("mine", "slower")
    assert first["low"] < first["change"] < first["high"]
    trackmark("check", "own", "--time", "--accept", "mine", "--because", "looks twice")
    assert trackmark("check", "own", "--time").stdout.count("as fast") == 2


def test_a_baselines_speed_that_says_nothing_is_told(trackmark, kept):
    kept.write_text(re.sub("spread = 0[.0-9]+", "spread = 0.5", kept.read_text()))
    assert "too few" in trackmark("check", "own", "--time", "--strict", status=3).stdout
    kept.write_text(kept.read_text().replace('processor = "', 'processor = "Other ', 1))
    said = trackmark("check", "own", "--time").stdout
    assert "another processor (Other" in said
    assert "--against" in said
    told = trackmark("check", "own", "--time", "--strict", "--json", status=3).stdout
    assert json.loads(told)["verdict"] == "cannot tell"


@pytest.mark.parametrize("damage", ["ratio = 0", "ratio = -1", 'ratio = "x"', "spread = nan"])
def test_damaged_speeds_are_a_line(trackmark, written, damage):
    key = damage.partition(" ")[0]
    text = written.read_text()
    written.write_text(text.replace(f"{key} = ", f"{damage}, old_{key} = "))
    assert "no whole baseline" in trackmark("check", "own", "--time", status=2).stderr


def test_beside_a_revision(trackmark, here, kept, git, monkeypatch, clocked):
    own = here / "trackers"
    own.mkdir()
    (own / "static.py").write_text("# as it was\n")
    monkeypatch.setattr("bench.comparing.revisions._PACKAGE", own)
    git("init", "--quiet")
    git("add", "knob.py", "trackers")
    git("commit", "--quiet", "--message", "before")
    slowed(here / "knob.py")
    slowed(own / "static.py")
    clocked.clear()
    told = trackmark("check", "own", "--time", "--against", "HEAD", "--json", status=1).stdout
    states = {entry["tracker"]: entry["state"] for entry in json.loads(told)["times"]}
    assert states == {"mine": "slower", "static": "as fast"}  # today's is not from that folder
    assert [old.home != "" for old, _ in clocked[:: speed.FEWEST_SESSIONS]] == [True, False]
    assert all((old.options, now.home) == (now.options, "") for old, now in clocked)
    git("commit", "--quiet", "--all", "--message", "after")
    assert "slower" not in trackmark("check", "own", "--time", "--against", "HEAD").stdout
    git("mv", "knob.py", "other.py")
    git("commit", "--quiet", "--message", "moved")
    (here / "knob.py").write_text((here / "other.py").read_text())
    said = trackmark("check", "own", "--time", "--against", "HEAD", status=2).stderr
    assert "HEAD has no knob.py" in said


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--time",), "no speed of static"),
        (("--against", "HEAD"), "goes with --time"),
        (("--time", "--against", "HEAD"), "not a git repository"),
        (("--time", "--against", "nowhere"), "there is no revision 'nowhere'"),
        (("--time", "--against", "--all"), "there is no revision '--all'"),
    ],
)
def test_what_it_cannot_do_is_a_line(trackmark, here, written, git, arguments, words):
    if arguments[-1] not in ("HEAD", "--time"):
        git("init", "--quiet")
    said = trackmark("check", "own", *arguments, status=2).stderr
    assert words in said
    assert len(said.strip().splitlines()) <= 4


def test_without_git_it_says_so(trackmark, written, monkeypatch):
    monkeypatch.setenv("PATH", "")
    said = trackmark("check", "own", "--trackers", "mine", "--time", "--against", "v1", status=2)
    assert "needs git" in said.stderr
