"""Ground truth with a missing row: refused, because all later rows would be one frame early."""

import pytest

from tests.datasets.readers import layouts
from trackmark import datasets
from trackmark.datasets import SequenceError
from trackmark.datasets.readers.otb import SPANS

BY_FRAME = (layouts.mot, layouts.nfs, layouts.tlp)
"""Layouts whose rows contain frame numbers."""

BY_LINE = [layout for layout in layouts.LAYOUTS if layout not in BY_FRAME]

PARTIAL = {name: span for name, span in SPANS.items() if span[1] is not None}


def remove_labels(path):
    """Remove the files that would reveal the missing row by their own length."""
    for pattern in ("*.label", "full_occlusion.txt", "out_of_view.txt"):
        for file in path.glob(pattern):
            if file.stem != "absence":
                file.unlink()


def otb(folder, write_images, n_images, n_rows, first=1):
    """Write a folder of OTB with numbers of images and rows; all images are one file."""
    image = folder / "img" / f"{first:04}.jpg"
    write_images(image.parent, [image.name], (16, 12))
    for number in range(first + 1, first + n_images):
        image.with_stem(f"{number:04}").hardlink_to(image)
    (folder / "groundtruth_rect.txt").write_text("1,1,5,5\n" * n_rows)
    return folder


@pytest.mark.parametrize("layout", BY_LINE, ids=lambda layout: layout.__name__)
def test_truth_with_fewer_rows_than_images_is_refused(tmp_path, write_images, layout):
    path, truth, _ = layout(tmp_path, write_images, None)
    remove_labels(path)
    (path / "absence.label").unlink(missing_ok=True)
    lines = truth.read_text().splitlines(keepends=True)
    truth.write_text("".join(lines[:1] + lines[2:]))
    with pytest.raises(SequenceError, match=rf"{truth.name}: 2 rows for .*3 images") as raised:
        datasets.load(path)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    "layout", [layouts.vot_classic, layouts.uav123, layouts.lasot], ids=lambda make: make.__name__
)
def test_message_on_missing_rows_states_the_remedies(tmp_path, write_images, layout):
    path, truth, _ = layout(tmp_path, write_images, None)
    remove_labels(path)
    truth.write_text("".join(truth.read_text().splitlines(keepends=True)[:-1]))
    with pytest.raises(SequenceError, match=r"Add the missing row.* nan,nan,nan,nan") as raised:
        datasets.load(path)
    assert "0002.jpg" in str(raised.value)


@pytest.mark.parametrize("layout", layouts.LAYOUTS, ids=lambda layout: layout.__name__)
def test_empty_line_inside_a_truth_is_refused_by_number(tmp_path, write_images, layout):
    path, truth, _ = layout(tmp_path, write_images, None)
    lines = truth.read_text().splitlines(keepends=True)
    truth.write_text("".join([lines[0], "\n", *lines[2:]]))
    with pytest.raises(SequenceError, match=rf"{truth.name}: line 2 is empty\. .*Add the row"):
        datasets.load(path)


def test_empty_line_inside_a_vot_tag_is_refused(tmp_path, write_images):
    path, _, _ = layouts.vot_classic(tmp_path, write_images, None)
    (path / "occlusion.label").write_text("0\n\n1\n")
    with pytest.raises(SequenceError, match=r"occlusion\.label: line 2 is empty"):
        datasets.load(path)


class TestOtb:
    @pytest.mark.parametrize("name", PARTIAL)
    def test_published_part_of_a_sequence_is_read(self, tmp_path, write_images, name):
        first, last = SPANS[name]
        n_rows = last - first + 1
        folder = otb(tmp_path / name.capitalize(), write_images, last + 5, n_rows)
        sequence = datasets.load(folder)
        assert (len(sequence), sequence.frame_name(0)) == (n_rows, f"{first:04}.jpg")
        assert sequence.images_beyond_truth == 5

    @pytest.mark.parametrize("name", ["Football1", "David"])
    def test_published_part_without_one_row_is_refused(self, tmp_path, write_images, name):
        first, last = SPANS[name.lower()]
        folder = otb(tmp_path / name, write_images, last + 5, last - first)
        with pytest.raises(SequenceError, match=rf"{last - first} rows for .* images"):
            datasets.load(folder)

    @pytest.mark.parametrize("name", ["BlurCar1", "BlurCar3", "BlurCar4"])
    def test_truth_of_images_from_a_later_number_is_read(self, tmp_path, write_images, name):
        first, _ = SPANS[name.lower()]
        folder = otb(tmp_path / name, write_images, 4, 4, first=first)
        assert datasets.load(folder).frame_name(0) == f"{first:04}.jpg"


class TestVot:
    def test_truth_of_one_row_is_read(self, tmp_path, write_images):
        path, truth, _ = layouts.vot_current(tmp_path, write_images, None)
        truth.write_text("2,3,8,9\n")
        assert len(datasets.load(path)) == 1

    def test_published_ball_lacks_the_last_row(self, tmp_path, write_images):
        write_images(tmp_path / "ball", [f"{i:08}.jpg" for i in range(1, 603)], (16, 12))
        (tmp_path / "ball/groundtruth.txt").write_text("1,1,5,5\n" * 601)
        assert len(datasets.load(tmp_path / "ball")) == 601
        (tmp_path / "ball/groundtruth.txt").write_text("1,1,5,5\n" * 600)
        with pytest.raises(SequenceError, match="600 rows for 602 images"):
            datasets.load(tmp_path / "ball")


class TestNfs:
    @pytest.mark.parametrize("step", [1, 8])
    def test_gap_in_frame_numbers_is_refused(self, tmp_path, write_images, step):
        path, truth, frame = layouts.nfs(tmp_path, write_images, None)
        write_images(frame.parent, [f"{i:05}.jpg" for i in range(1, 6)])
        rows = [f"0 1 2 9 11 {step * i} 0 0 0 x\n" for i in range(5)]
        truth.write_text("".join(rows))
        assert len(datasets.load(path)) == 5
        truth.write_text("".join(rows[:2] + rows[3:]))
        match = rf"line 3: frame {step * 3} follows frame {step}.* {step} apart"
        with pytest.raises(SequenceError, match=match):
            datasets.load(path)

    def test_missing_first_row_is_refused(self, tmp_path, write_images):
        path, truth, _ = layouts.nfs(tmp_path, write_images, None)
        truth.write_text("".join(truth.read_text().splitlines(keepends=True)[1:]))
        with pytest.raises(SequenceError, match=r"walk\.txt: line 1: .* first frame is 8"):
            datasets.load(path)

    def test_missing_last_row_shifts_nothing_and_is_read(self, tmp_path, write_images):
        path, truth, _ = layouts.nfs(tmp_path, write_images, None)
        truth.write_text("".join(truth.read_text().splitlines(keepends=True)[:-1]))
        assert len(datasets.load(path)) == 2
