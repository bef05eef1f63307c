"""Folders of images, video files, names of images, and the cache of opened recordings."""

import os
from contextlib import suppress

import numpy as np
import pytest

from trackmark import datasets
from trackmark.datasets import SequenceError, truth_file, video_frames
from trackmark.datasets.readers import otb

HEADER = "frame,x,y,width,height"
TRUTH = f"{HEADER}\n0,1,2,3,4\n2,5,6,7,8\n"


@pytest.fixture
def folder(tmp_path, write_images):
    write_images(tmp_path / "walk", ["f1.png", "f2.png", "f10.png", "f11.png"])
    return tmp_path / "walk"


@pytest.fixture
def fingerprint(folder):
    """Function that returns the fingerprint of the folder with a ground truth."""

    def read(text=TRUTH):
        (folder / "truth.csv").write_text(text)
        return datasets.load(folder).fingerprint

    return read


def test_folder_without_ground_truth_opens(folder):
    sequence = datasets.load(folder)
    assert (sequence.name, len(sequence), sequence.fps) == ("walk", 4, None)
    assert np.isnan(sequence.boxes).all()
    assert sequence[3].shape == (32, 48, 3)
    assert sequence.frame_name(2) == "f10.png"
    with pytest.raises(SequenceError, match="walk: there is no ground truth"):
        sequence.check_runnable()


def test_truth_csv_of_the_folder_is_read(folder):
    (folder / "truth.csv").write_text(f"{HEADER},visibility\n0,1,2,3,4,0.25\n2,5,6,7,8,\n")
    sequence = datasets.load(folder)
    assert sequence.present.tolist() == [True, False, True]
    assert sequence.n_unread_images == 1
    assert sequence.visibility[0] == 0.25
    assert np.isnan(sequence.visibility[1:]).all()
    (folder / "truth.csv").write_text(TRUTH + "9,5,6,7,8\n")
    with pytest.raises(
        SequenceError, match=r"truth\.csv: 10 ground-truth rows for 4 images of wal"
    ):
        datasets.load(folder)


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (TRUTH, f"# by me\n{HEADER}\n0,1.0,2.0,3,4\n2,5,6.00,7,8\n"),
        (f"{HEADER}\n0,0,2,3,4\n", f"{HEADER}\n0,-0.0,2,3,4\n"),
    ],
)
def test_fingerprint_is_equal_for_equal_values(fingerprint, first, second):
    assert fingerprint(first) == fingerprint(second)


def test_fingerprint_changes_with_ground_truth(fingerprint):
    with_visibility = f"{HEADER},visibility\n0,1,2,3,4,1\n2,5,6,7,8,1\n"
    assert len(set(map(fingerprint, [TRUTH, TRUTH + "3,1,1,1,1\n", with_visibility]))) == 3


def test_fingerprint_distinguishes_absence_from_no_annotation(fingerprint):
    with_absence = TRUTH.replace("2,5,6,7,8", "1,,,,\n2,5,6,7,8")
    assert fingerprint(TRUTH) != fingerprint(with_absence)


def test_fingerprint_changes_with_the_order_of_images(folder, fingerprint):
    before = fingerprint()
    (folder / "f11.png").write_bytes(b"not part of the sequence")
    assert fingerprint() == before
    (folder / "f1.png").rename(folder / "f3.png")
    assert fingerprint() != before


COPIES = [
    "0003.jpg",
    "3.png",
    "0003.PNG",
    "0003 (1).png",
    "0003(2).png",
    "0003 copy.png",
    "0003 copy 2.png",
    "0003 2.png",
    "0003 - Copy.png",
    "0003 - Copy (2).png",
    "0003 - Kopie.png",
    "0003 (Kopie).png",
    "0003 – копия.png",
    "0003 のコピー.png",
    "0003~.png",
    "0003_1.png",
    "Copy of 0003.png",
    "Kopie von 0003.png",
]

DISTINCT = {
    "unpadded": ["1.png", "2.png", "9.png", "10.png", "11.png"],
    "prefix": ["img00001.jpg", "img00002.jpg", "img00003.jpg"],
    "prefix and padding": ["frame_9.png", "frame_10.png", "frame_100.png"],
    "constant step": ["0000.png", "0005.png", "0010.png", "0015.png"],
    "gaps": ["0001.png", "0002.png", "0007.png"],
    "two suffixes": ["1.png", "2.jpg", "3.bmp"],
    "two clips": ["a_001.png", "a_002.png", "b_001.png", "b_002.png"],
    "camera and frame": ["cam0_001.png", "cam0_002.png", "cam1_001.png", "cam1_002.png"],
    "times": ["1305031102.175304.png", "1305031102.211214.png", "1305031103.175304.png"],
    "frame and time": ["0001_12.png", "0002_12.png", "0003_19.png"],
    "colour and depth": ["color_01.png", "color_02.png", "depth_01.png", "depth_02.png"],
    "depth by another prefix": ["01.png", "02.png", "d01.png", "d02.png"],
    "no numbers": ["a.png", "b.png", "b2.png", "ca.png"],
    "hidden files": ["0001.png", "0002.png", "._0002.png", ".0002 (1).png"],
}


@pytest.mark.parametrize("name", COPIES)
def test_copied_image_is_refused_by_both_names(tmp_path, write_images, name):
    write_images(tmp_path / "walk", [*(f"{i:04}.png" for i in range(1, 6)), name])
    with pytest.raises(SequenceError) as raised:
        datasets.load(tmp_path / "walk")
    message = str(raised.value)
    assert "\n" not in message
    assert "0003.png" in message
    assert name in message
    assert "same frame number" in message
    assert "Remove" in message


@pytest.mark.parametrize("name", ["Copy of img03.png", "IMG03.png", "img03 (1).png", "img03b.png"])
def test_copied_image_with_prefix_is_refused(tmp_path, write_images, name):
    write_images(tmp_path / "walk", ["img01.png", "img02.png", "img03.png", "img04.png", name])
    with pytest.raises(SequenceError, match="same frame number as "):
        datasets.load(tmp_path / "walk")


@pytest.mark.parametrize("case", DISTINCT)
def test_distinct_numbers_are_accepted(tmp_path, write_images, case):
    write_images(tmp_path / "walk", DISTINCT[case])
    for name in (".DS_Store", "Thumbs.db"):
        (tmp_path / "walk" / name).write_text("")
    visible = [name for name in DISTINCT[case] if not name.startswith(".")]
    assert len(datasets.load(tmp_path / "walk")) == len(visible)


@pytest.fixture
def clip(tmp_path, write_video):
    return write_video(tmp_path / "cup.mp4")


def test_video_without_ground_truth_opens(clip):
    clip = clip.rename(clip.with_suffix(".MP4"))
    sequence = datasets.load(clip)
    assert (sequence.name, len(sequence)) == ("cup.MP4", 40)
    assert sequence.fps == pytest.approx(25)
    assert sequence[5].shape == (64, 96, 3)
    assert not sequence.present.any()
    assert sequence.origin.licence == ""
    licence = clip.with_name("LICENSE.txt")
    licence.write_text("free")
    assert datasets.load(clip).origin.licence == f"see {licence}"


def test_ground_truth_of_the_same_name_is_read(clip):
    clip.with_suffix(".csv").write_text(f"{HEADER}\n0,1,2,30,40\n7,5,6,30,40\n")
    sequence = datasets.load(clip)
    assert (len(sequence), sequence.n_unread_images) == (8, 32)
    assert np.flatnonzero(sequence.present).tolist() == [0, 7]
    sequence.check_runnable()
    clip.with_suffix(".csv").write_text(f"{HEADER}\n3,96,2,30,40\n")
    with pytest.raises(SequenceError, match=r"cup\.csv: the first box, of frame 3, lies outside"):
        datasets.load(clip).check_runnable()


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
