"""What every format of recorded data keeps to; what is particular to one has tests of its own."""

import os
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest

import datasets
import datasets.readers
from datasets.image_files import ImageFiles
from datasets.video_frames import VideoFrames
from tests.datasets.readers.layouts import LAYOUTS

TRUTH = "frame,x,y,width,height\n0,1,2,3,4\n1,5,6,7,8\n"


def images(folder, write_images, write_video):
    write_images(folder / "walk", ["1.png", "2.png", "10.png"])
    return folder / "walk", folder / "walk" / "truth.csv", folder / "walk" / "2.png"


def otb(folder, write_images, write_video):
    write_images(folder / "walk" / "img", ["0001.png", "0002.png", "0003.png"])
    return folder / "walk", folder / "walk/groundtruth_rect.txt", folder / "walk/img/0002.png"


def davis(folder, write_images, write_video):
    shown, masks = (folder / kind / "480p" / "walk" for kind in ("JPEGImages", "Annotations"))
    write_images(shown, ["00000.jpg", "00001.jpg", "00002.jpg"])
    masks.mkdir(parents=True)
    for i in range(3):
        mask = np.zeros((32, 48), np.uint8)
        mask[10:14, 3 + i : 8 + i] = 255
        assert cv2.imwrite(str(masks / f"{i:05}.png"), mask)
    return shown, masks / "00001.png", shown / "00001.jpg"


def video(folder, write_images, write_video):
    folder.mkdir(parents=True, exist_ok=True)
    file = write_video(folder / "walk.mp4", n=3, b_frames=0)
    return file, folder / "walk.csv", file


MAKERS = [images, otb, davis, video, *LAYOUTS]


def test_every_reader_that_is_found_is_asked():
    found = {file.stem for file in Path(datasets.readers.__file__).parent.glob("[a-z]*.py")}
    assert {make.__name__.partition("_")[0] for make in MAKERS} == found


@pytest.fixture(params=MAKERS, ids=lambda make: make.__name__)
def recording(request, tmp_path, write_images, write_video):
    """A sequence of three frames: its path, its own truth, the file that holds a frame."""
    path, own, frame = request.param(tmp_path / "data", write_images, write_video)
    if own.suffix == ".csv":
        own.write_text(TRUTH)
    elif not own.exists():
        own.write_text("2,3,3,4\n6,7,7,8\n")
    return path, own, frame


def test_its_own_truth_is_taken_and_it_can_be_run(recording):
    sequence = datasets.load(recording[0])
    assert sequence.name.partition(".")[0] == "walk"
    assert len(sequence) + sequence.images_beyond_truth == 3
    assert sequence.present[:2].all()
    assert sequence.origin.format
    sequence.check_runnable()


def test_opening_decodes_no_image(recording, monkeypatch):
    for frames, method in ((ImageFiles, "__getitem__"), (VideoFrames, "_decode")):
        monkeypatch.setattr(frames, method, lambda *args: pytest.fail("an image was read"))
    sequence = datasets.load(recording[0])
    assert len(sequence[1:]) == len(sequence) - 1
    assert sequence.fingerprint


def test_a_given_truth_wins_over_its_own(recording, tmp_path):
    path, own, _ = recording
    own.unlink() if own.suffix == ".png" else own.write_text("broken")
    (tmp_path / "mine.csv").write_text("frame,x,y,width,height\n0,9,8,7,6\n")
    sequence = datasets.load(path, tmp_path / "mine.csv")
    assert sequence.boxes.tolist() == [[9, 8, 7, 6]]
    assert sequence.images_beyond_truth == 2
    assert sequence.mask(0) is None


class TestFingerprint:
    def test_it_is_the_same_wherever_the_data_lie_and_whenever_they_were_touched(
        self, recording, tmp_path
    ):
        path, _, frame = recording
        before = datasets.load(path).fingerprint
        os.utime(frame, (5, 5))
        assert datasets.load(path).fingerprint == before
        shutil.move(tmp_path / "data", tmp_path / "elsewhere")
        moved = tmp_path / "elsewhere" / path.relative_to(tmp_path / "data")
        assert datasets.load(moved).fingerprint == before

    def test_it_changes_with_a_byte_of_a_frame_and_with_the_truth(self, recording, tmp_path):
        path, _, frame = recording
        found = {datasets.load(path).fingerprint}
        frame.write_bytes(frame.read_bytes() + b"\0")
        found.add(datasets.load(path).fingerprint)
        (tmp_path / "mine.csv").write_text(TRUTH.replace("5,6", "5,6.001"))
        found.add(datasets.load(path, tmp_path / "mine.csv").fingerprint)
        assert len(found) == 3
