"""Sequences that a command's texts, patterns and folders stand for."""

import json
import shutil

import pytest

from trackmark import datasets
from trackmark.bench.commands._options import matching_sequences
from trackmark.bench.execution import plan


@pytest.fixture
def places(workspace, otb, monkeypatch):
    """Create folders with sequences of OTB, of images and of DAVIS, and with another file."""
    monkeypatch.chdir(workspace)
    for number in (10, 2):
        otb(workspace / "data" / f"walk{number}", 2)
        shutil.copytree(
            workspace / "data" / f"walk{number}" / "img", workspace / f"shots/day{number}"
        )
    (workspace / "data" / "notes.txt").write_text("walk2 is the best")
    for kind in ("JPEGImages", "Annotations"):
        shutil.copytree(workspace / "shots" / "day2", workspace / "davis" / kind / "480p" / "bear")
    return workspace


DATA = ["data/Small", "data/walk2", "data/walk10"]
DAYS = ["shots/day2", "shots/day10"]
NAMES = {
    "data/walk2": ["data/walk2"],
    "data": DATA,
    "data/": DATA,
    "data/walk*": DATA[1:],
    "d?ta/walk?": ["data/walk2"],
    "*/day?": ["shots/day2"],
    "shots/day2,s*ts": DAYS,
    ".": [*DATA, "davis/bear", *DAYS],
    "davis": ["davis/bear"],
    "davis/b*": ["davis/bear"],
    "davis/JPEGImages/480p": ["davis/JPEGImages/480p/bear"],
    "plain/*:scene=3": ["plain/target:scene=3"],
    "stress": ["stress/pillar", "stress/twin"],
}


def test_patterns_and_folders_stand_for_their_sequences(places):
    for text, names in NAMES.items():
        assert [source.text for source in matching_sequences(text)] == names, text
    (source,) = matching_sequences(str(places / "*" / "walk2"))
    assert source.text == str(places / "data" / "walk2")
    assert len(datasets.matching("samples")) == 2


def test_sequences_of_a_folder_are_run(trackmark, places):
    run = ("run", "--trackers", "static", "--sequences", "data")
    lines = trackmark(*run, "--json").stdout.splitlines()
    assert {json.loads(line)["sequence"] for line in lines} == {"Small", "walk2", "walk10"}
    formats = "data/Small and 2 more: read as a folder with img/ and groundtruth_rect.txt (OTB)."
    assert formats in trackmark(*run).stderr.splitlines()


def test_pattern_without_match_names_the_nearest_few(trackmark, one_line, places):
    for text in ("multipat/*", "data/*.mp4", "nowhere/*", "data/n*"):
        line = one_line(trackmark("run", "--trackers", "static", "--sequences", text, status=2))
        assert text in line
        assert "trackmark list sequences" in line
        assert len(line) < 320
        assert ("multipart/" in line) == text.startswith("multi")


def test_experiment_may_have_a_hundred_thousand_sequences():
    many = tuple(plan.SequenceSource(f"plain/target:scene={i}") for i in range(100_000))
    assert len(plan.Experiment("many", ("static",), many).sequences) == 100_000
    with pytest.raises(plan.ExperimentError, match="'plain/target:scene=7' is named twice"):
        plan.Experiment("many", ("static",), (*many, many[7]))
