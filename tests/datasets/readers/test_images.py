"""A folder of images."""

import os

import numpy as np
import pytest

import datasets
from datasets import SequenceError
from datasets.image_files import ImageFiles

TRUTH = "frame,x,y,width,height\n0,1,2,3,4\n2,5,6,7,8\n"


@pytest.fixture
def folder(tmp_path, write_images):
    write_images(tmp_path / "walk", ["f1.png", "f2.png", "f10.png", "f11.png"])
    return tmp_path / "walk"


def test_without_truth_it_opens_and_shows(folder):
    sequence = datasets.load(folder)
    assert (sequence.name, len(sequence), sequence.fps) == ("walk", 4, None)
    assert np.isnan(sequence.boxes).all()
    assert sequence[3].shape == (32, 48, 3)
    assert sequence.frame_name(2) == "f10.png"
    with pytest.raises(SequenceError, match="walk: there is no truth"):
        sequence.check_runnable()


def test_its_own_truth_is_taken(folder):
    (folder / "truth.csv").write_text(TRUTH)
    sequence = datasets.load(folder)
    assert sequence.present.tolist() == [True, False, True]
    assert sequence.images_beyond_truth == 1


def test_a_given_truth_wins_over_its_own(folder, tmp_path):
    (folder / "truth.csv").write_text("broken")
    (tmp_path / "mine.csv").write_text(TRUTH)
    assert datasets.load(folder, tmp_path / "mine.csv").boxes[2].tolist() == [5, 6, 7, 8]


def test_more_truth_than_images_names_the_truth_file(folder):
    (folder / "truth.csv").write_text(TRUTH + "9,5,6,7,8\n")
    with pytest.raises(SequenceError, match=r"truth\.csv: 10 truth rows for 4 images of walk"):
        datasets.load(folder)


def test_visibility_of_the_truth_file_arrives(folder):
    (folder / "truth.csv").write_text(
        "frame,x,y,width,height,visibility\n0,1,2,3,4,0.25\n1,1,2,3,4,\n"
    )
    sequence = datasets.load(folder)
    assert sequence.visibility[0] == 0.25
    assert np.isnan(sequence.visibility[1])


def test_opening_reads_no_image(folder, monkeypatch):
    monkeypatch.setattr(ImageFiles, "_read", lambda *args: pytest.fail("an image was read"))
    assert len(datasets.load(folder)[::2]) == 2


class TestFingerprint:
    @pytest.fixture(autouse=True)
    def own_truth(self, folder):
        (folder / "truth.csv").write_text(TRUTH)

    def test_it_is_the_same_for_the_same_data_wherever_they_lie(self, folder, tmp_path):
        before = datasets.load(folder).fingerprint
        moved = folder.rename(tmp_path / "run")
        assert datasets.load(moved).fingerprint == before

    def test_touching_a_file_leaves_it(self, folder):
        before = datasets.load(folder).fingerprint
        os.utime(folder / "f2.png", (5, 5))
        assert datasets.load(folder).fingerprint == before

    def test_another_way_to_write_the_same_truth_leaves_it(self, folder):
        before = datasets.load(folder).fingerprint
        (folder / "truth.csv").write_text(
            "# by me\nframe,x,y,width,height\n0,1.0,2.0,3,4\n1,,,,\n2,5,6.00,7,8\n"
        )
        assert datasets.load(folder).fingerprint == before

    @pytest.mark.parametrize(
        "truth",
        [
            TRUTH.replace("5,6", "5,6.001"),
            TRUTH + "3,1,1,1,1\n",
            "frame,x,y,width,height,visibility\n0,1,2,3,4,1\n2,5,6,7,8,1\n",
        ],
    )
    def test_another_truth_changes_it(self, folder, truth):
        before = datasets.load(folder).fingerprint
        (folder / "truth.csv").write_text(truth)
        assert datasets.load(folder).fingerprint != before

    def test_a_zero_has_no_sign(self, folder):
        (folder / "truth.csv").write_text("frame,x,y,width,height\n0,0,2,3,4\n")
        before = datasets.load(folder).fingerprint
        (folder / "truth.csv").write_text("frame,x,y,width,height\n0,-0.0,2,3,4\n")
        assert datasets.load(folder).fingerprint == before

    def test_one_changed_byte_changes_it(self, folder):
        before = datasets.load(folder).fingerprint
        data = bytearray((folder / "f2.png").read_bytes())
        data[-1] ^= 1
        (folder / "f2.png").write_bytes(data)
        assert datasets.load(folder).fingerprint != before

    def test_another_order_of_the_images_changes_it(self, folder):
        before = datasets.load(folder).fingerprint
        (folder / "f1.png").rename(folder / "f3.png")
        assert datasets.load(folder).fingerprint != before

    def test_images_beyond_the_truth_do_not_count(self, folder):
        before = datasets.load(folder).fingerprint
        (folder / "f11.png").write_bytes(b"anything")
        assert datasets.load(folder).fingerprint == before


def test_real_images_open(recorded):
    sequence = datasets.load(recorded / "vot" / "bag")
    assert len(sequence) == 196
    assert sequence[195].shape == (360, 480, 3)
    assert sequence.frame_name(0) == "00000001.jpg"
