"""Video files with ground truth."""

import numpy as np
import pytest

from trackmark import datasets
from trackmark.datasets import SequenceError

HEADER = "frame,x,y,width,height"


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
    assert (len(sequence), sequence.images_beyond_truth) == (8, 32)
    assert np.flatnonzero(sequence.present).tolist() == [0, 7]
    sequence.check_runnable()
    clip.with_suffix(".csv").write_text(f"{HEADER}\n3,96,2,30,40\n")
    with pytest.raises(SequenceError, match=r"cup\.csv: the first box, of frame 3, lies outside"):
        datasets.load(clip).check_runnable()


def test_recorded_avi_shows_the_frames_of_its_images(recorded):
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


def test_recorded_avi_of_another_encoder_opens(recorded):
    folder = recorded / "video" / "orange-shirt"
    sequence = datasets.load(folder / "sample_sequence_compressed.avi")
    assert len(sequence) == 53
    assert sequence[52].shape == (360, 640, 3)
