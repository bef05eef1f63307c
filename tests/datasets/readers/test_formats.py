"""What every format of recorded data keeps to; what is particular to one has tests of its own."""

import os
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.datasets.readers.layouts import LAYOUTS
from trackmark import datasets
from trackmark.datasets import SequenceError, readers
from trackmark.datasets.image_files import ImageFiles
from trackmark.datasets.video_frames import VideoFrames

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
    found = {file.stem for file in Path(readers.__file__).parent.glob("[a-z]*.py")}
    assert {make.__name__.partition("_")[0] for make in MAKERS} == found


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty working folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(params=MAKERS, ids=lambda make: make.__name__)
def recording(request, tmp_path, write_images, write_video):
    """A sequence of three frames: its path, its own truth, the file that holds a frame."""
    path, own, frame = request.param(tmp_path / "data", write_images, write_video)
    if own.suffix == ".csv":
        own.write_text(TRUTH)
    elif not own.exists():
        own.write_text("2,3,3,4\n6,7,7,8\n6,7,7,8\n")
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


def check_all(folder):
    for name in datasets.matching(str(folder)):
        datasets.load(name).check_runnable()


class TestFolderOfSequences:
    """A folder stands for what is in it, and nothing that isn't whole is left out in silence."""

    @pytest.mark.parametrize("missing", ["truth", "images", "their folder"])
    def test_a_sequence_that_lacks_something_is_refused_by_name(self, recording, tmp_path, missing):
        path, own, frame = recording
        if path.is_file() or (missing == "their folder" and frame.parent == own.parent):
            pytest.skip("it would be gone as a whole")
        if missing == "truth":
            own.unlink()
        elif missing == "images":
            for file in frame.parent.glob(f"*{frame.suffix}"):
                file.unlink()
        else:
            shutil.rmtree(frame.parent)
        with pytest.raises(SequenceError, match="walk"):
            check_all(tmp_path / "data")

    @pytest.mark.parametrize("kind", ["images", "truth", "misnamed"])
    @pytest.mark.parametrize("text", ["ds", "ds/*", "ds/Football1"])
    def test_of_otb_it_is_told_what_was_looked_for(self, here, write_otb, kind, text):
        for name in ("Couple", "Crossing", "Football1"):
            write_otb(here / "ds" / name, "1,1,5,5\n" * 3)
        truth = here / "ds/Football1/groundtruth_rect.txt"
        if kind == "images":
            shutil.rmtree(here / "ds/Football1/img")
        elif kind == "truth":
            truth.unlink()
        else:
            truth.rename(truth.with_name("groundtruth.rect.txt"))
        with pytest.raises(SequenceError, match=r"ds/Football1: this is no whole .*\(OTB\)"):
            datasets.matching(text)
        assert datasets.matching("ds/C*") == ["ds/Couple", "ds/Crossing"]

    def test_sequences_beside_folders_of_others_are_all_there(self, here, write_otb, write_video):
        write_otb(here / "ds/Couple", "1,1,5,5\n" * 3)
        write_otb(here / "ds/more/deep/Crossing", "1,1,5,5\n" * 3)
        write_video(here / "ds/more/walk.avi", n=3, b_frames=0)
        found = ["ds/Couple", "ds/more/deep/Crossing", "ds/more/walk.avi"]
        assert datasets.matching("ds") == found

    def test_what_is_hidden_is_none(self, here, write_images):
        write_images(here / "ds/.git/walk", ["1.png"])
        write_images(here / "ds/run", ["1.png"])
        assert datasets.matching("ds") == datasets.matching("ds/*") == ["ds/run"]

    @pytest.mark.parametrize("text", ["ds", "ds/*", "ds/*/*"])
    def test_masks_of_davis_are_none(self, here, write_images, text):
        davis(here / "ds", write_images, None)
        (found,) = datasets.matching(text)
        assert datasets.load(found).name == "walk"
        assert datasets.load(found).present.all()

    def test_only_what_a_list_names_belongs(self, here, write_images):
        for name in ("bag", "ball", "book"):
            LAYOUTS[0](here / "ds", write_images, None)[0].rename(here / "ds" / name)
        (here / "ds/list.txt").write_text("book\nbag\n\n")
        assert datasets.matching("ds") == ["ds/bag", "ds/book"]
        assert len(datasets.matching("ds/*")) == 3
        (here / "ds/list.txt").write_text("bag\ngone\n")
        with pytest.raises(SequenceError, match=r"ds/list\.txt: line 2: 'gone' is not in this"):
            datasets.matching("ds")
