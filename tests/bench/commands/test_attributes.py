"""Attributes of sequences in `describe`, `list` and `report --by-attribute`."""

import json
import shutil

import pytest

from trackmark import bench
from trackmark.datasets import attributes


@pytest.fixture
def twelve(trackmark, here, otb):
    """Results on twelve sequences, each with a target that moves a little faster."""
    for speed in range(12):
        folder = otb(here / "twelve" / f"s{speed}", 4)
        rows = [f"{5 + speed * frame},6,10,12\n" for frame in range(4)]
        (folder / "groundtruth_rect.txt").write_text("".join(rows))
    trackmark("run", "--trackers", "static,camshift", "--sequences", "twelve", "--name", "twelve")
    return here / "cache" / "attributes"


def test_a_sequence_is_described_with_what_is_measured_of_it(trackmark):
    said = trackmark("describe", "samples/bow-tie", "--attributes").stdout
    for name in attributes.names():
        assert f"\n  {name} " in said
    told = json.loads(trackmark("describe", "samples/bow-tie", "--attributes", "--json").stdout)
    motion = told["measured"]["motion"]
    assert len(motion["frames"]) == 120
    assert motion["frames"][0] is None
    assert motion["value"] > 0
    assert told["measured"]["visibility"]["value"] is None
    assert "measured" not in json.loads(trackmark("describe", "samples/bow-tie", "--json").stdout)


def test_an_attribute_is_listed_and_described(trackmark):
    assert "clutter" in trackmark("list", "attributes").stdout
    said = trackmark("describe", "clutter").stdout
    assert "Bhattacharyya" in said
    assert "0 to 1" in said


def test_what_can_not_be_measured_is_a_line(trackmark, here):
    folder = here / "images"
    folder.mkdir()
    import cv2
    import numpy as np

    cv2.imwrite(str(folder / "0.png"), np.zeros((20, 20, 3), np.uint8))
    said = trackmark("describe", folder, "--attributes", status=2)
    assert "there is no truth" in said.stderr


def test_a_report_shows_scores_against_attributes_once_measured_without_the_sequences(
    trackmark, here, twelve
):
    asked = ("report", "results/twelve", "--by-attribute", "--metrics", "native,otb")
    first = trackmark(*asked, "--folder", "paper").stdout
    assert first.count("against attributes of the sequences") == 2
    assert (here / "paper" / "attributes.png").is_file()
    assert (here / "paper" / "attributes-otb.md").is_file()
    kept = sorted(file.stat().st_mtime_ns for file in twelve.iterdir())
    assert len(kept) == 12
    assert trackmark(*asked).stdout == first
    assert sorted(file.stat().st_mtime_ns for file in twelve.iterdir()) == kept
    frame = bench.by_attribute(here / "results" / "twelve")
    assert set(frame["tracker"]) == {"static", "camshift"}
    assert set(frame["bin_sequences"].dropna()) == {6}


def test_a_sequence_that_is_gone_has_none_and_that_is_told(trackmark, here, otb):
    folders = [otb(here / name, frames) for name, frames in (("one", 4), ("two", 5))]
    trackmark("run", "--trackers", "static", "--sequences", "one,two", "--name", "gone")
    shutil.rmtree(folders[1])
    said = trackmark("report", "results/gone", "--by-attribute")
    assert "its attributes are not known" in said.stderr
