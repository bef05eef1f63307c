"""Sealing: what gives the same keeps its version, anything else needs a new one."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
from click.testing import CliRunner

from trackmark import trackers
from trackmark.bench.evaluation import version_check as command
from trackmark.bench.evaluation.version_check import SHORT, Sealed, golden_boxes, sealed
from trackmark.datasets.source_digest import library_versions
from trackmark.datasets.versioning import Seal, read_seals, write_seals

GOLDEN = {"suite/one": {"images": "12"}}
OLD = Seal(["abc"], "old tree", GOLDEN, ["numpy"])


@pytest.fixture
def sealing(tmp_path, monkeypatch):
    """Seal a thing that stands so in `golden.json` and gives these digests now."""
    file = tmp_path / "golden.json"

    def seal(stands, images, *arguments, tree="new tree"):
        write_seals(file, {} if stands is None else {"suite/one": stands})
        one = Sealed(
            "suite/one",
            file,
            tree,
            stands,
            ["suite/one"],
            lambda text: {"images": images},
            ["cv2"],
            [],
        )
        monkeypatch.setattr(command, "sealed", lambda: iter([one]))
        answer = CliRunner().invoke(command.main, arguments)
        return answer, read_seals(file).get("suite/one")

    return seal


def test_the_same_digests_keep_the_version_and_seal_the_new_tree(sealing):
    answer, seal = sealing(OLD, "12")
    assert answer.exit_code == 0
    assert seal == replace(OLD, tree="new tree")


def test_other_digests_are_refused(sealing):
    answer, seal = sealing(OLD, "13")
    assert answer.exit_code == 1
    assert "--new suite/one" in answer.output
    assert seal == OLD


def test_unless_a_new_version_is_asked_for(sealing):
    answer, seal = sealing(OLD, "13", "--new", "suite/one")
    assert answer.exit_code == 0
    assert "version 2" in answer.output
    assert seal == Seal([2], "new tree", {"suite/one": {"images": "13"}}, ["cv2"])


def test_the_same_digests_are_no_new_version_though_one_was_allowed(sealing):
    _, seal = sealing(OLD, "12", "--new", "suite/one")
    assert seal == replace(OLD, tree="new tree")


def test_what_is_sealed_is_not_rendered_again(sealing):
    answer, seal = sealing(OLD, "13", tree="old tree")
    assert (answer.exit_code, answer.output, seal) == (0, "", OLD)


def test_what_is_new_begins_with_version_one(sealing):
    _, seal = sealing(None, "12")
    assert seal == Seal([1], "new tree", GOLDEN, ["cv2"])


def test_only_what_is_asked_for_is_sealed(sealing):
    answer, seal = sealing(OLD, "12", "--only", "other/")
    assert (answer.exit_code, seal) == (0, OLD)


@cache
def tracker_seals():
    return read_seals(Path(trackers.__file__).with_name("golden.json"))


def test_every_tracker_has_a_seal():
    assert list(tracker_seals()) == [name for name in trackers.names() if ":" not in name]


def slow(asked):
    """Every day trackers follow the face as they are by default; the rest takes longer."""
    text, _, sequence = asked.partition(" on ")
    # Of the two that are made of one chain of cues the quicker one will do.
    return ":" in text or sequence != SHORT[0][0] or text == "contour-smooth-color"


@pytest.mark.parametrize(
    "asked",
    [
        pytest.param(asked, marks=pytest.mark.slow if slow(asked) else ())
        for seal in tracker_seals().values()
        for asked in seal.golden
    ],
)
def test_boxes_are_the_sealed_ones(asked):
    seal = tracker_seals()[asked.partition(" on ")[0].partition(":")[0]]
    if library_versions(set(seal.libraries)) != library_versions_of_constraints(seal.libraries):
        pytest.skip("other versions of libraries than those that boxes were sealed with")
    assert golden_boxes(asked) == seal.golden[asked]


def library_versions_of_constraints(libraries):
    """What `constraints.txt` says of them."""
    lines = (Path(__file__).parents[3] / "constraints.txt").read_text().splitlines()
    pinned = dict(line.split("==") for line in lines if "==" in line)
    return {name: pinned[name] for name in library_versions(set(libraries))}


def test_every_source_is_the_sealed_one():
    changed = [one.name for one in sealed() if one.seal is None or one.seal.tree != one.tree]
    assert not changed, "their source changed: `make seal` proves that they give the same"
