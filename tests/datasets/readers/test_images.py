"""Folders of images."""

import numpy as np
import pytest

from trackmark import datasets
from trackmark.datasets import SequenceError

HEADER = "frame,x,y,width,height"
TRUTH = f"{HEADER}\n0,1,2,3,4\n2,5,6,7,8\n"


@pytest.fixture
def folder(tmp_path, write_images):
    write_images(tmp_path / "walk", ["f1.png", "f2.png", "f10.png", "f11.png"])
    return tmp_path / "walk"


@pytest.fixture
def fingerprint(folder):
    """Return the fingerprint of the folder with a ground truth."""

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
    assert sequence.images_beyond_truth == 1
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
        (TRUTH, f"# by me\n{HEADER}\n0,1.0,2.0,3,4\n1,,,,\n2,5,6.00,7,8\n"),
        (f"{HEADER}\n0,0,2,3,4\n", f"{HEADER}\n0,-0.0,2,3,4\n"),
    ],
)
def test_fingerprint_is_equal_for_equal_values(fingerprint, first, second):
    assert fingerprint(first) == fingerprint(second)


def test_fingerprint_changes_with_ground_truth(fingerprint):
    with_visibility = f"{HEADER},visibility\n0,1,2,3,4,1\n2,5,6,7,8,1\n"
    assert len(set(map(fingerprint, [TRUTH, TRUTH + "3,1,1,1,1\n", with_visibility]))) == 3


def test_fingerprint_changes_with_the_order_of_images(folder, fingerprint):
    before = fingerprint()
    (folder / "f11.png").write_bytes(b"not part of the sequence")
    assert fingerprint() == before
    (folder / "f1.png").rename(folder / "f3.png")
    assert fingerprint() != before


def test_recorded_images_open(recorded):
    sequence = datasets.load(recorded / "vot" / "bag")
    assert len(sequence) == 196
    assert sequence[195].shape == (360, 480, 3)
    assert sequence.frame_name(0) == "00000001.jpg"
