"""Cache of opened recordings: files are read once while they do not change."""

import os
from contextlib import suppress

import numpy as np
import pytest

from trackmark import datasets
from trackmark.datasets import truth_file, video_frames
from trackmark.datasets.readers import otb

OLD_NS = 10**18
"""Modification time of old files [ns]; recent files are not cached."""


def age(folder):
    """Set old modification times for a folder and its content."""
    for path in (folder, *folder.rglob("*")):
        os.utime(path, ns=(OLD_NS, OLD_NS))


@pytest.fixture
def openings(monkeypatch):
    """Record the folders that the OTB reader opens, and the videos that are indexed."""
    opened = []

    def count(owner, name):
        original = getattr(owner, name)
        counted = lambda first, *rest: opened.append(first) or original(first, *rest)  # noqa: E731
        monkeypatch.setattr(owner, name, counted)

    count(otb, "read")
    count(video_frames.VideoFrames, "_index")
    return opened


def test_folder_is_read_once(tmp_path, write_otb, openings):
    folder = write_otb(tmp_path / "Car", "1,1,9,9\n" * 3)
    age(tmp_path)
    first, second = (datasets.load(folder) for _ in range(2))
    assert len(openings) == 1
    assert first is not second
    assert np.array_equal(first[2], second[2])
    assert first.fingerprint == second.fingerprint


def test_video_is_indexed_once_with_separate_positions(tmp_path, write_video, openings):
    file = write_video(tmp_path / "clip.mp4", n=20)
    age(tmp_path)
    first, second = (datasets.load(file) for _ in range(2))
    assert len(openings) == 1
    assert np.array_equal(first[7], second[7])
    images = [(first[k], second[19 - k]) for k in range(20)]
    for k, (image, _) in enumerate(images):
        assert np.array_equal(image, images[19 - k][1])


def change_truth(folder):
    (folder / "groundtruth_rect.txt").write_text("2,2,9,9\n" * 3)


def add_tags(folder):
    (folder / "attrs.txt").write_text("IV")


def remove_image(folder):
    (folder / "img" / "0003.jpg").unlink()


@pytest.mark.parametrize("change", [change_truth, add_tags, remove_image])
def test_changed_files_are_read_again(tmp_path, write_otb, openings, change):
    folder = write_otb(tmp_path / "Car", "1,1,9,9\n" * 3)
    age(tmp_path)
    datasets.load(folder)
    change(folder)
    with suppress(datasets.SequenceError):  # an image is missing
        datasets.load(folder)
    assert len(openings) == 2


def test_recent_files_are_read_again(tmp_path, write_otb, openings):
    folder = write_otb(tmp_path / "Car", "1,1,9,9\n" * 3)
    for _ in range(2):
        datasets.load(folder)
    assert len(openings) == 2


def test_ground_truth_added_later_is_read(tmp_path, write_otb, write_video):
    file = write_video(tmp_path / "clip.mp4", n=3)
    age(tmp_path)
    assert np.isnan(datasets.load(file).boxes).all()
    truth_file.write(file.with_suffix(".csv"), truth_file.GroundTruth(np.full((3, 4), 5.0)))
    assert (datasets.load(file).boxes == 5).all()
