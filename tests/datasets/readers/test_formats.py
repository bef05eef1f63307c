"""Rules for all formats of recorded data, and published recordings."""

import os
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.datasets.readers import layouts
from trackmark import datasets
from trackmark.datasets import SequenceError, readers
from trackmark.datasets.image_files import ImageFiles
from trackmark.datasets.layouts import layouts as table
from trackmark.datasets.video_frames import VideoFrames


def test_every_reader_belongs_to_a_layout():
    stems = {file.stem for file in Path(readers.__file__).parent.glob("[a-z]*.py")}
    assert {layout.reader or "rows" for layout in table().values()} == stems


@pytest.fixture
def workdir(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(params=layouts.LAYOUTS, ids=lambda layout: layout.__name__)
def recording(request, tmp_path, write_images, write_video):
    """Paths of a recording of one format."""
    return request.param(tmp_path / "data", write_images, write_video)


def test_recording_opens_lazily_with_its_own_ground_truth(recording, monkeypatch):
    for frames, method in ((ImageFiles, "__getitem__"), (VideoFrames, "_decode")):
        monkeypatch.setattr(frames, method, lambda *args: pytest.fail("an image was read"))
    sequence = datasets.load(recording.path)
    assert sequence.name.partition(".")[0] == "walk"
    assert sequence.present[:2].all()
    assert sequence.origin.format
    assert len(sequence[1:]) == len(sequence) - 1 == 2
    assert sequence.fingerprint
    monkeypatch.undo()
    sequence.check_runnable()


def test_given_ground_truth_replaces_recorded_one(recording, tmp_path):
    path, truth, _ = recording
    truth.unlink() if truth.suffix == ".png" else truth.write_text("broken")
    (tmp_path / "mine.csv").write_text("frame,x,y,width,height\n0,9,8,7,6\n1,9,8,7,6\n")
    sequence = datasets.load(path, tmp_path / "mine.csv")
    assert sequence.boxes.tolist() == [[9, 8, 7, 6]] * 2
    assert sequence.n_unread_images >= 1
    assert sequence.mask(0) is None


def test_truth_with_one_row_has_all_images(recording):
    path, truth, _ = recording
    n_images = len(datasets.load(path).frames)
    if truth.suffix == ".png":  # DAVIS: masks
        for mask in sorted(truth.parent.iterdir())[1:]:
            mask.unlink()
    else:
        header = truth.suffix == ".csv"
        truth.write_text("".join(truth.read_text().splitlines(keepends=True)[: 1 + header]))
    sequence = datasets.load(path)
    assert len(sequence) == n_images > 2
    assert sequence.annotated.tolist() == [True] + [False] * (n_images - 1)
    assert sequence.present.tolist() == sequence.annotated.tolist()
    assert sequence.mask(1) is None
    sequence.check_runnable()


def test_fingerprint_ignores_folder_and_modification_time(recording, tmp_path):
    path, _, frame = recording
    before = datasets.load(path).fingerprint
    os.utime(frame, (5, 5))
    assert datasets.load(path).fingerprint == before
    shutil.move(tmp_path / "data", tmp_path / "elsewhere")
    moved = tmp_path / "elsewhere" / path.relative_to(tmp_path / "data")
    assert datasets.load(moved).fingerprint == before


def test_fingerprint_changes_with_image_and_ground_truth(recording, tmp_path):
    path, _, frame = recording
    fingerprints = {datasets.load(path).fingerprint}
    frame.write_bytes(frame.read_bytes() + b"\0")
    fingerprints.add(datasets.load(path).fingerprint)
    (tmp_path / "mine.csv").write_text("frame,x,y,width,height\n0,1,2,3,4\n1,5,6.001,7,8\n")
    fingerprints.add(datasets.load(path, tmp_path / "mine.csv").fingerprint)
    assert len(fingerprints) == 3


class TestFolderOfSequences:
    @pytest.mark.parametrize("kind", ["images", "truth", "misnamed"])
    @pytest.mark.parametrize("text", ["ds", "ds/*", "ds/Football1"])
    def test_incomplete_folder_names_the_expected_layout(self, workdir, write_otb, kind, text):
        for name in ("Couple", "Crossing", "Football1"):
            write_otb(workdir / "ds" / name, "1,1,5,5\n" * 3)
        truth = workdir / "ds/Football1/groundtruth_rect.txt"
        if kind == "images":
            shutil.rmtree(workdir / "ds/Football1/img")
        elif kind == "truth":
            truth.unlink()
        else:
            truth.rename(truth.with_name("groundtruth.rect.txt"))
        with pytest.raises(SequenceError, match=r"ds/Football1: this is an incomplete .*\(OTB\)"):
            datasets.matching(text)
        assert datasets.matching("ds/C*") == ["ds/Couple", "ds/Crossing"]

    def test_folder_selects_visible_sequences_of_all_levels(self, workdir, write_otb, write_video):
        write_otb(workdir / "ds/Couple", "1,1,5,5\n" * 3)
        write_otb(workdir / "ds/more/deep/Crossing", "1,1,5,5\n" * 3)
        write_otb(workdir / "ds/.git/Dog", "1,1,5,5\n" * 3)
        write_video(workdir / "ds/more/walk.avi", n=3, b_frames=0)
        expected = ["ds/Couple", "ds/more/deep/Crossing", "ds/more/walk.avi"]
        assert datasets.matching("ds") == datasets.matching("ds/*") == expected

    def test_folder_and_pattern_select_all_targets(self, workdir, write_images):
        for name in ("davis", "mot"):
            recording = getattr(layouts, name)(workdir / name, write_images, None)
            if name == "davis":
                mask = np.full(layouts.SIZE[::-1], 7, np.uint8)
                mask[4:9, 3:8] = 1
                cv2.imwrite(str(recording.truth), mask)
            key, others = {"davis": ("object", "17"), "mot": ("target", "79")}[name]
            expected = [f"{name}/walk:{key}={number}" for number in others]
            assert datasets.matching(name) == expected
            pattern = {"davis": "davis/JPEGImages/480p/*", "mot": "mot/*"}[name]
            listed = [path.rpartition("/")[2] for path in datasets.matching(pattern)]
            assert listed == [path.rpartition("/")[2] for path in expected]
            assert len({datasets.load(path).name for path in expected}) == 2
        assert datasets.matching("mot/walk") == ["mot/walk"]

    def test_all_incomplete_sequences_are_named(self, workdir, write_otb):
        for name in ("Dog", "Couple", "Man"):
            write_otb(workdir / "ds" / name, "1,1,5,5\n" * 3)
        (workdir / "ds/Dog/groundtruth_rect.txt").unlink()
        (workdir / "ds/Man/groundtruth_rect.txt").unlink()
        write_otb(workdir / "ds/Boy", "1,1,0,5\n" * 3)  # complete, but the first box has no size
        for text in ("ds", "ds/*", "d?/[A-Z]*"):
            with pytest.raises(SequenceError) as caught:
                datasets.matching(text)
            first, *problems, remedy = str(caught.value).splitlines()
            assert first == "3 of 4 sequences cannot be used."
            assert {problem.partition(":")[0].split("/")[1] for problem in problems} == {
                *("Dog", "Man", "Boy")
            }
            assert "!Dog,!Man,!Boy" in remedy
        assert datasets.matching("ds", ["Dog", "Man"]) == ["ds/Boy", "ds/Couple"]

    @pytest.mark.parametrize("text", ["ds", "ds/*", "ds/*/*"])
    def test_masks_of_davis_are_not_sequences(self, workdir, write_images, text):
        layouts.davis(workdir / "ds", write_images, None)
        (path,) = datasets.matching(text)
        assert datasets.load(path).name == "walk"

    def test_list_txt_selects_the_sequences_of_a_folder(self, workdir, write_images):
        for name in ("bag", "ball", "book"):
            layouts.vot_classic(workdir / "ds", write_images, None).path.rename(
                workdir / "ds" / name
            )
        (workdir / "ds/list.txt").write_text("book\nbag\n\n")
        assert datasets.matching("ds") == ["ds/bag", "ds/book"]
        assert len(datasets.matching("ds/*")) == 3
        (workdir / "ds/list.txt").write_text("bag\ngone\n")
        with pytest.raises(SequenceError, match=r"ds/list\.txt: line 2: 'gone' is not in this"):
            datasets.matching("ds")


# Path: number of frames with and without ground truth, shape of an image, init box.
SEQUENCES = {
    "otb/Couple": (140, 0, (240, 320), [50, 46, 25, 62]),
    "otb/Crossing": (120, 0, (240, 360), [204, 150, 17, 50]),
    "otb/Football1": (74, 7, (288, 352), [152, 104, 26, 43]),
    "davis/libby": (49, 0, (480, 854), None),
    "davis/blackswan": (50, 0, (480, 854), None),
    "davis/drift-straight": (50, 0, (480, 854), None),
    "vot/bag": (196, 0, (360, 480), [292.23, 128.36, 145.96, 132.47]),
    "vot/ball": (601, 1, None, None),
    "video/bag.avi": (196, 0, (360, 480), None),
    "video/orange-shirt/sample_sequence_compressed.avi": (53, 0, (360, 640), None),
}


@pytest.mark.parametrize("path", SEQUENCES)
def test_recorded_sequence_opens_as_published(recorded, path):
    frames, beyond, shape, box = SEQUENCES[path]
    sequence = datasets.load(recorded / path)
    assert (len(sequence), sequence.n_unread_images) == (frames, beyond)
    for image in (sequence[0], sequence[-1]):
        assert shape is None or image.shape == (*shape, 3)
    if box is not None:
        assert sequence.boxes[0].round(2).tolist() == box
    if not path.endswith(".avi"):
        assert sequence.present.all()
        sequence.check_runnable()
    if path.startswith("otb/"):
        assert "OPR" in sequence.attributes
    if path == "vot/ball":
        assert sequence.attributes["camera_motion"].all()


@pytest.mark.parametrize("name", ["libby", "blackswan", "drift-straight"])
def test_recorded_davis_boxes_enclose_the_masks(recorded, name):
    sequence = datasets.load(recorded / "davis" / name)
    for frame in (0, len(sequence) // 2, len(sequence) - 1):
        file = recorded / "davis/Annotations/480p" / name / f"{frame:05}.png"
        mask = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
        np.testing.assert_array_equal(sequence.mask(frame), mask == 255)
        assert sequence.boxes[frame].tolist() == list(cv2.boundingRect(mask))


def test_recorded_avi_shows_the_frames_of_its_images(recorded):
    video = datasets.load(recorded / "video" / "bag.avi")
    images = datasets.load(recorded / "vot" / "bag")
    for i in (3, 40, 97, 192):
        differences = [np.abs(video[i].astype(int) - images[k]).mean() for k in (i - 3, i, i + 3)]
        assert min(differences) == differences[1] < 8
