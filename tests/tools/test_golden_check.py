"""Version check: equal output keeps its version, other output needs a new one."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import cv2
import pytest
from click.testing import CliRunner

from tools import golden_check
from tools.golden_check import (
    SHORT,
    GoldenEntry,
    golden_boxes,
    golden_entries,
    instruction_set,
)
from trackmark import trackers
from trackmark.datasets.source_digest import library_versions
from trackmark.datasets.versioning import VersionEntry, read_versions, write_versions

GOLDEN = {"suite/one": {"images": "12"}}
OLD = VersionEntry(["abc"], "old tree", GOLDEN, ["numpy"])


@pytest.fixture
def sealing(tmp_path, monkeypatch):
    """Return a function that seals one scene and returns the output and the new entry."""
    file = tmp_path / "golden.json"

    def seal(present, images, *arguments, tree="new tree"):
        write_versions(file, {} if present is None else {"suite/one": present})
        entry = GoldenEntry(
            "suite/one",
            file,
            tree,
            present,
            ["suite/one"],
            lambda text: {"images": images},
            ["cv2"],
            [],
        )
        monkeypatch.setattr(golden_check, "golden_entries", lambda: iter([entry]))
        answer = CliRunner().invoke(golden_check.main, arguments)
        return answer, read_versions(file).get("suite/one")

    return seal


SAME = replace(OLD, tree="new tree")
NEW = VersionEntry([2], "new tree", {"suite/one": {"images": "13"}}, ["cv2"])
ALLOWED = ["--new", "suite/one"]


@pytest.mark.parametrize(
    ("present", "images", "tree", "arguments", "status", "words", "expected"),
    [
        pytest.param(OLD, "12", "new tree", [], 0, "sealed again", SAME, id="equal"),
        pytest.param(OLD, "13", "new tree", [], 1, "--new suite/one", OLD, id="refused"),
        pytest.param(OLD, "13", "new tree", ALLOWED, 0, "version 2", NEW, id="new version"),
        pytest.param(OLD, "12", "new tree", ALLOWED, 0, "again", SAME, id="no new version"),
        pytest.param(OLD, "13", "old tree", [], 0, "", OLD, id="not rendered again"),
        pytest.param(
            *(None, "12", "new tree", [], 0, "first time"),
            VersionEntry([1], "new tree", GOLDEN, ["cv2"]),
            id="first version",
        ),
        pytest.param(OLD, "12", "new tree", ["--only", "other/"], 0, "", OLD, id="left out"),
    ],
)
def test_version_changes_only_if_digests_do(
    sealing, present, images, tree, arguments, status, words, expected
):
    answer, seal = sealing(present, images, *arguments, tree=tree)
    assert (answer.exit_code, seal) == (status, expected)
    assert words in answer.output
    assert bool(words) == bool(answer.output)


@pytest.mark.parametrize("is_edited", [False, True])
def test_boxes_of_other_processors_are_not_compared(tmp_path, monkeypatch, is_edited):
    """`make seal` adds digests while the source is unchanged, and refuses an edited source."""
    text, file = "static on samples/face", tmp_path / "golden.json"
    entry = VersionEntry(["abc"], "tree", {text: {"another processor": "12"}}, ["numpy"])
    write_versions(file, {"static": entry})
    tree = "new tree" if is_edited else "tree"
    current = {instruction_set(): "13"}
    item = GoldenEntry("static", file, tree, entry, [text], lambda text: current, ["numpy"], [])
    monkeypatch.setattr(golden_check, "golden_entries", lambda: iter([item]))
    answer = CliRunner().invoke(golden_check.main, [])
    golden = read_versions(file)["static"].golden[text]
    if is_edited:
        assert (answer.exit_code, golden) == (1, entry.golden[text])
        assert "Run `make seal` on the unchanged source on this machine first." in answer.output
    else:
        assert (answer.exit_code, golden) == (0, {**entry.golden[text], **current})


@cache
def tracker_seals():
    return read_versions(Path(trackers.__file__).with_name("golden.json"))


def test_every_tracker_has_a_version():
    assert list(tracker_seals()) == [name for name in trackers.names() if ":" not in name]


def slow(key):
    """Return whether a check is slow: all except those of default parameters on `SHORT`."""
    text, _, sequence = key.partition(" on ")
    # Two trackers consist of one chain of cues; the quicker one suffices. nguyen2002 is compared
    # with plain NumPy every day.
    return ":" in text or sequence != SHORT[0][0] or text in ("contour-smooth-color", "nguyen2002")


@pytest.mark.parametrize(
    "key",
    [
        pytest.param(key, marks=pytest.mark.slow if slow(key) else ())
        for seal in tracker_seals().values()
        for key in seal.golden
    ],
)
def test_boxes_equal_golden_digests(key):
    name = key.partition(" on ")[0].partition(":")[0]
    seal = tracker_seals()[name]
    if name == "opencv-csrt" and not hasattr(cv2, "TrackerCSRT"):
        pytest.skip("the installed OpenCV has no CSRT; opencv-contrib-python-headless has")
    if library_versions(set(seal.libraries)) != library_versions_of_constraints(seal.libraries):
        pytest.skip("other versions of libraries than those that boxes were sealed with")
    boxes = golden_boxes(key)
    if not boxes.keys() & seal.golden[key].keys():  # `make seal` on such a processor adds them
        pytest.skip(f"no golden digest of a processor with {instruction_set()}")
    assert boxes.items() <= seal.golden[key].items()


def library_versions_of_constraints(libraries):
    """Return the versions in `constraints.txt`."""
    lines = (Path(__file__).parents[2] / "constraints.txt").read_text().splitlines()
    pinned = dict(line.split("==") for line in lines if "==" in line)
    return {name: pinned[name] for name in library_versions(set(libraries))}


def test_every_source_has_its_golden_digest():
    changed = [
        entry.name
        for entry in golden_entries()
        if entry.recorded is None or entry.recorded.tree != entry.tree
    ]
    assert not changed, "their source changed: run `make seal`"
