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
        assert [source.spec for source in matching_sequences(text)] == names, text
    (source,) = matching_sequences(str(places / "*" / "walk2"))
    assert source.spec == str(places / "data" / "walk2")
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
    many = tuple(plan.SequenceSpec(f"plain/target:scene={i}") for i in range(100_000))
    assert len(plan.Experiment("many", ("static",), many).sequences) == 100_000
    with pytest.raises(plan.ExperimentError, match="'plain/target:scene=7' is named twice"):
        plan.Experiment("many", ("static",), (*many, many[7]))


EXCLUDED = {
    "data,!walk2": ["data/Small", "data/walk10"],
    "data,!walk*": ["data/Small"],
    "!data/walk2,data": ["data/Small", "data/walk10"],
    "data/*,!Small,!walk10": ["data/walk2"],
    "data,shots/day2,!day?": DATA,
    "plain/*:scene=3,samples,!samples/face": ["plain/target:scene=3", "samples/bow-tie"],
}


@pytest.mark.usefixtures("places")
def test_names_after_exclamation_marks_are_left_out():
    for text, names in EXCLUDED.items():
        assert [source.spec for source in matching_sequences(text)] == names, text


def test_targets_are_left_out_by_their_names(places):
    file = places / "data" / "walk2" / "groundtruth_rect.txt"
    file.rename(file.with_name("groundtruth_rect.1.txt"))
    (file.with_name("groundtruth_rect.2.txt")).write_text("5,6,10,12\n" * 2)
    (first, *_) = [source.spec for source in matching_sequences("data,!walk2.2,!Small,!walk10")]
    assert first == "data/walk2:target=1"


def test_incomplete_sequences_can_be_left_out(trackmark, places):
    (places / "data" / "walk2" / "groundtruth_rect.txt").unlink()
    run = ("run", "--trackers", "static", "--sequences")
    assert "walk2" in trackmark(*run, "data", status=2).stderr
    lines = trackmark(*run, "data,!walk2", "--json").stdout.splitlines()
    assert {json.loads(line)["sequence"] for line in lines} == {"Small", "walk10"}


@pytest.mark.usefixtures("places")
@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("data,!walk3", r"'!walk3' excludes no sequence\. Did you mean 'walk2'"),
        ("data,!*", "all sequences are excluded"),
    ],
)
def test_exclusions_without_effect_are_refused(text, words):
    with pytest.raises(datasets.SequenceError, match=words):
        matching_sequences(text)
