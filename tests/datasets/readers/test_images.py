"""A folder of images."""

import numpy as np
import pytest

from trackmark import datasets
from trackmark.datasets import SequenceError

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
    with pytest.raises(SequenceError, match="walk: there is no ground truth"):
        sequence.check_runnable()


def test_its_own_truth_is_taken(folder):
    (folder / "truth.csv").write_text(TRUTH)
    sequence = datasets.load(folder)
    assert sequence.present.tolist() == [True, False, True]
    assert sequence.images_beyond_truth == 1


def test_more_truth_than_images_names_the_truth_file(folder):
    (folder / "truth.csv").write_text(TRUTH + "9,5,6,7,8\n")
    with pytest.raises(
        SequenceError, match=r"truth\.csv: 10 ground-truth rows for 4 images of walk"
    ):
        datasets.load(folder)


def test_visibility_of_the_truth_file_arrives(folder):
    (folder / "truth.csv").write_text(
        "frame,x,y,width,height,visibility\n0,1,2,3,4,0.25\n1,1,2,3,4,\n"
    )
    sequence = datasets.load(folder)
    assert sequence.visibility[0] == 0.25
    assert np.isnan(sequence.visibility[1])


class TestFingerprint:
    @pytest.fixture(autouse=True)
    def own_truth(self, folder):
        (folder / "truth.csv").write_text(TRUTH)

    def test_another_way_to_write_the_same_truth_leaves_it(self, folder):
        before = datasets.load(folder).fingerprint
        (folder / "truth.csv").write_text(
            "# by me\nframe,x,y,width,height\n0,1.0,2.0,3,4\n1,,,,\n2,5,6.00,7,8\n"
        )
        assert datasets.load(folder).fingerprint == before

    @pytest.mark.parametrize(
        "truth",
        [
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
