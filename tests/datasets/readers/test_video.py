"""A video file with its truth."""

import numpy as np
import pytest

from trackmark import datasets
from trackmark.datasets import SequenceError

TRUTH = "frame,x,y,width,height\n0,1,2,30,40\n7,5,6,30,40\n"


@pytest.fixture
def clip(tmp_path, write_video):
    return write_video(tmp_path / "cup.mp4")


def test_without_truth_it_opens_and_shows(clip):
    sequence = datasets.load(clip)
    assert (sequence.name, len(sequence)) == ("cup.mp4", 40)
    assert sequence.fps == pytest.approx(25)
    assert sequence[5].shape == (64, 96, 3)
    assert not sequence.present.any()


def test_the_truth_beside_it_is_taken(clip):
    clip.with_suffix(".csv").write_text(TRUTH)
    sequence = datasets.load(clip)
    assert (len(sequence), sequence.images_beyond_truth) == (8, 32)
    assert np.flatnonzero(sequence.present).tolist() == [0, 7]
    sequence.check_runnable()


def test_a_first_box_outside_the_picture_names_the_truth_file(clip):
    clip.with_suffix(".csv").write_text("frame,x,y,width,height\n3,96,2,30,40\n")
    with pytest.raises(SequenceError, match=r"cup\.csv: the first box, of frame 3, lies outside"):
        datasets.load(clip).check_runnable()


def test_the_suffix_may_be_in_capitals(clip):
    assert len(datasets.load(clip.rename(clip.with_suffix(".MP4")))) == 40


def test_a_real_avi_is_frame_for_frame_the_footage_of_its_images(recorded):
    video = datasets.load(recorded / "video" / "bag.avi")
    images = datasets.load(recorded / "vot" / "bag")
    assert len(video) == len(images) == 196
    for i in (0, 97, 195, 40):
        difference = [
            np.abs(video[i].astype(int) - images[k].astype(int)).mean()
            for k in (i - 3, i, i + 3)
            if 0 <= k < 196
        ]
        assert min(difference) == difference[1 if i >= 3 else 0] < 8


def test_a_real_avi_of_another_make_opens(recorded):
    folder = recorded / "video" / "orange-shirt"
    sequence = datasets.load(folder / "sample_sequence_compressed.avi")
    assert len(sequence) == 53
    assert sequence[52].shape == (360, 640, 3)


def test_a_licence_beside_a_video_is_named(tmp_path, write_video):
    file = write_video(tmp_path / "walk.avi", n=3, b_frames=0)
    assert datasets.load(file).origin.licence == ""
    (tmp_path / "LICENSE.txt").write_text("free")
    assert datasets.load(file).origin.licence == f"see {tmp_path / 'LICENSE.txt'}"
