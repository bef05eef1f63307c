"""Sequences of the Object Tracking Benchmark."""

import numpy as np
import pytest

from trackmark import datasets
from trackmark.datasets import SequenceError

ROWS = [[11, 21, 30, 40], [12.5, 22, 30, 41], [13, 23, 31, 42]]
FROM_ZERO = [[10, 20, 30, 40], [11.5, 21, 30, 41], [12, 22, 31, 42]]


def rows(separator, end="\n"):
    return "".join(separator.join(str(value) for value in row) + end for row in ROWS)


@pytest.mark.parametrize(
    "text",
    [
        rows(","),
        rows("\t"),
        rows(" "),
        rows(", "),
        rows(" \t", "  \r\n"),
        "\ufeff" + rows(",", "\r\n") + "\r\n\r\n",
        rows(",").rstrip(),
        "11,21\t30 40\n12.5 22,30,41\n  13.0\t23.0 31.0,42.0\n",
    ],
)
def test_boxes_are_read_however_they_are_separated_and_count_from_zero(write_otb, tmp_path, text):
    sequence = datasets.load(write_otb(tmp_path / "Dog", text))
    assert sequence.name == "Dog"
    assert sequence.boxes.tolist() == FROM_ZERO


@pytest.mark.parametrize("absent", ["NaN,NaN,NaN,NaN", "nan nan nan nan", "0,0,0,0", "5,5,0,9"])
def test_rows_of_nan_or_without_size_are_absent(write_otb, tmp_path, absent):
    sequence = datasets.load(write_otb(tmp_path / "Dog", f"1,1,5,5\n{absent}\n2,2,5,5\n"))
    assert sequence.present.tolist() == [True, False, True]
    assert np.isnan(sequence.boxes[1]).all()


def test_a_first_row_of_nan_is_absent(write_otb, tmp_path):
    sequence = datasets.load(write_otb(tmp_path / "Dog", "NaN NaN NaN NaN\n2,2,5,5\n3,3,5,5"))
    assert sequence.first_frame == 1


@pytest.mark.parametrize("first", ["5,5,0,9", "0,0,0,0", "5,5,-3,9"])
def test_a_first_row_without_size_is_refused_when_run_and_not_taken_for_absence(
    write_otb, tmp_path, first
):
    sequence = datasets.load(write_otb(tmp_path / "Dog", f"{first}\n2,2,5,5\n3,3,5,5\n"))
    assert sequence.first_frame == 0
    with pytest.raises(SequenceError, match=r"groundtruth_rect\.txt: the first box, of 0001\.jpg"):
        sequence.check_runnable()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1,2,3,4\n1,2,3\n", "line 2: '1,2,3' is not a box"),
        ("1,2,3,4,5,6,7,8\n", "line 1: .* is not a box"),
        ("1,2,3,4\n\n1,2,3,4\n", "line 2 is empty"),
        ("x,y,w,h\n1,2,3,4\n", "line 1: 'x,y,w,h' is not a box"),
        ("1,2,inf,4\n", "line 1: .* is not a box"),
        ("1,2,3,4\n1,2,-3,4\n", "line 2: the box has a negative size"),
        ("1,2,3,4\n5,5,0,0\n1,2,3,-4\n", "line 3: the box has a negative size"),
        ("", "there are no rows"),
        ("1,2,3,4\n" * 4, "4 ground-truth rows for 3 images of Dog"),
    ],
)
def test_a_mistake_is_told_with_file_and_line(write_otb, tmp_path, text, message):
    folder = write_otb(tmp_path / "Dog", text)
    with pytest.raises(SequenceError, match=rf"groundtruth_rect\.txt: {message}"):
        datasets.load(folder)


def test_images_after_a_published_part_are_not_read(write_otb, tmp_path):
    folder = write_otb(tmp_path / "Football1", "1,1,5,5\n" * 74, n=76)
    sequence = datasets.load(folder)
    assert (len(sequence), sequence.images_beyond_truth) == (74, 2)
    (folder / "img" / "0075.jpg").write_bytes(b"no image")
    again = datasets.load(folder)
    assert again.fingerprint == sequence.fingerprint
    assert len(list(again)) == 74


def test_attributes_hold_for_every_frame(write_otb, tmp_path):
    sequence = datasets.load(write_otb(tmp_path / "Dog", rows(","), attrs="SV, DEF,IPR\n"))
    assert list(sequence.attributes) == ["SV", "DEF", "IPR"]
    assert all(flags.tolist() == [True] * 3 for flags in sequence.attributes.values())


def test_attributes_belong_to_the_fingerprint(write_otb, tmp_path):
    before = datasets.load(write_otb(tmp_path / "Dog", rows(","), attrs="SV")).fingerprint
    (tmp_path / "Dog" / "attrs.txt").write_text("SV, FM")
    assert datasets.load(tmp_path / "Dog").fingerprint != before


def test_frames_are_known_by_their_files(write_otb, tmp_path):
    assert datasets.load(write_otb(tmp_path / "Dog", rows(","))).frame_name(2) == "0003.jpg"


def test_the_truth_of_david_begins_with_its_300th_image(write_otb, tmp_path):
    sequence = datasets.load(write_otb(tmp_path / "David", rows(","), n=302))
    assert [sequence.frame_name(i) for i in range(3)] == ["0300.jpg", "0301.jpg", "0302.jpg"]
    cut = datasets.load(write_otb(tmp_path / "cut" / "David", rows(","), n=3))
    assert cut.frame_name(0) == "0001.jpg"


@pytest.mark.parametrize(
    ("name", "first", "named"),
    [("Dog", 0, None), ("Dog", 2, "0001"), ("BlurCar3", 3, None), ("BlurCar3", 4, "0003")],
)
def test_truth_begins_with_the_first_image_that_the_benchmark_has(
    write_otb, write_images, tmp_path, name, first, named
):
    folder = write_otb(tmp_path / name, rows(","), n=0)
    write_images(folder / "img", [f"{first + i:04}.jpg" for i in range(3)])
    if named is None:
        assert datasets.load(folder).frame_name(0) == f"{first:04}.jpg"
    else:
        with pytest.raises(SequenceError, match=rf"{named}\.jpg: there is no such image; the fir"):
            datasets.load(folder)


def test_an_image_0_too_many_does_not_begin_the_truth(write_otb, write_images, tmp_path):
    folder = write_otb(tmp_path / "Dog", rows(","))
    write_images(folder / "img", ["0000.jpg"])
    with pytest.raises(
        SequenceError, match=r"0000\.jpg: 3 ground-truth rows for 4 images of Dog leave open"
    ):
        datasets.load(folder)


def test_an_image_missing_between_others_is_told(write_otb, tmp_path):
    folder = write_otb(tmp_path / "Dog", rows(","), n=5)
    (folder / "img" / "0002.jpg").unlink()
    with pytest.raises(SequenceError, match=r"0002\.jpg: there is no such image between 0001\.jpg"):
        datasets.load(folder)


def test_a_folder_with_several_truths_is_several_sequences(write_otb, tmp_path):
    folder = write_otb(tmp_path / "Jogging", rows(","))
    (folder / "groundtruth_rect.txt").rename(folder / "groundtruth_rect.1.txt")
    (folder / "groundtruth_rect.2.txt").write_text("7,8,9,10\n" * 3)
    write_otb(tmp_path / "Dog", rows(","))
    found = datasets.matching(str(tmp_path))
    assert [datasets.load(path).name for path in found] == ["Dog", "Jogging.1", "Jogging.2"]
    assert datasets.load(found[2]).boxes.tolist() == [[6, 7, 9, 10]] * 3
    assert datasets.matching(str(tmp_path / "J*")) == found[1:] == datasets.matching(str(folder))
    assert datasets.load(folder).name == "Jogging.1"
    assert datasets.options(str(folder)) == [
        {"name": "target", "default": 1, "meaning": "which target of 1, 2"}
    ]
    assert datasets.options(str(tmp_path / "Dog")) == []
    with pytest.raises(SequenceError, match=r"no target '3'\. There are: 1, 2\."):
        datasets.load(f"{folder}:target=3")
    (folder / "groundtruth_rect.1.txt").write_text("")  # as of Human4
    assert datasets.matching(str(folder)) == [str(folder)]
    only = datasets.load(folder)
    assert (only.name, only.boxes.tolist()) == ("Jogging.2", [[6, 7, 9, 10]] * 3)


@pytest.mark.parametrize(
    ("name", "frames", "beyond", "size", "first"),
    [
        ("Couple", 140, 0, (240, 320), [50, 46, 25, 62]),
        ("Crossing", 120, 0, (240, 360), [204, 150, 17, 50]),
        ("Football1", 74, 7, (288, 352), [152, 104, 26, 43]),
    ],
)
def test_real_sequences_open_as_published(recorded, name, frames, beyond, size, first):
    sequence = datasets.load(recorded / "otb" / name)
    assert (sequence.name, len(sequence), sequence.images_beyond_truth) == (name, frames, beyond)
    assert sequence[0].shape[:2] == sequence[-1].shape[:2] == size
    assert sequence.boxes[0].tolist() == first
    assert sequence.present.all()
    assert "OPR" in sequence.attributes
    sequence.check_runnable()


def test_a_pattern_takes_no_options(tmp_path, write_otb):
    write_otb(tmp_path / "Couple", "1,1,5,5\n" * 3)
    with pytest.raises(SequenceError, match="a pattern of paths takes no options"):
        datasets.matching(f"{tmp_path}/C*:target=1")
