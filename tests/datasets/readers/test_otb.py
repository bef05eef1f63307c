"""Sequences of the Object Tracking Benchmark (OTB)."""

import numpy as np
import pytest

from trackmark import datasets
from trackmark.datasets import SequenceError
from trackmark.datasets.readers.otb import SPANS

ROWS = "11,21,30,40\n12.5,22,30,41\n13,23,31,42\n"
BOXES = [[10, 20, 30, 40], [11.5, 21, 30, 41], [12, 22, 31, 42]]
PARTIAL = {name: span for name, span in SPANS.items() if span[1] is not None}


@pytest.fixture
def write_numbered(tmp_path, write_images):
    """Write an OTB folder with some images and rows; all images are hard links of one file."""

    def write(name, n_images, n_rows, first=1):
        folder = tmp_path / name
        image = folder / "img" / f"{first:04}.jpg"
        write_images(image.parent, [image.name], (16, 12))
        for number in range(first + 1, first + n_images):
            image.with_stem(f"{number:04}").hardlink_to(image)
        (folder / "groundtruth_rect.txt").write_text("1,1,5,5\n" * n_rows)
        return folder

    return write


@pytest.mark.parametrize(
    "text",
    [
        ROWS,
        ROWS.replace(",", "\t"),
        ROWS.replace(",", ", "),
        ROWS.replace(",", " \t").replace("\n", "  \r\n"),
        "\ufeff" + ROWS.replace("\n", "\r\n") + "\r\n\r\n",
        ROWS.rstrip(),
        "11,21\t30 40\n12.5 22,30,41\n  13.0\t23.0 31.0,42.0\n",
    ],
)
def test_boxes_are_read_with_any_separator(write_otb, tmp_path, text):
    sequence = datasets.load(write_otb(tmp_path / "Dog", text))
    assert sequence.name == "Dog"
    assert sequence.frame_name(2) == "0003.jpg"
    assert sequence.boxes.tolist() == BOXES


@pytest.mark.parametrize("absent", ["NaN,NaN,NaN,NaN", "nan nan nan nan", "0,0,0,0", "5,5,0,9"])
def test_rows_of_nan_or_without_size_mean_absence(write_otb, tmp_path, absent):
    sequence = datasets.load(write_otb(tmp_path / "Dog", f"1,1,5,5\n{absent}\n2,2,5,5\n"))
    assert sequence.present.tolist() == [True, False, True]
    assert np.isnan(sequence.boxes[1]).all()


def test_first_row_of_nan_means_absence(write_otb, tmp_path):
    sequence = datasets.load(write_otb(tmp_path / "Dog", "NaN NaN NaN NaN\n2,2,5,5\n3,3,5,5"))
    assert sequence.first_frame == 1


@pytest.mark.parametrize("first", ["5,5,0,9", "0,0,0,0", "5,5,-3,9"])
def test_first_row_without_size_is_not_runnable(write_otb, tmp_path, first):
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
        ("1,2,3,4\n" * 2, "2 rows for 3 images"),
        ("1,2,3,4\n" * 4, "4 ground-truth rows for 3 images of Dog"),
    ],
)
def test_mistake_in_ground_truth_is_refused_with_its_line(write_otb, tmp_path, text, message):
    folder = write_otb(tmp_path / "Dog", text)
    with pytest.raises(SequenceError, match=rf"groundtruth_rect\.txt: {message}"):
        datasets.load(folder)


def test_tags_are_attributes_of_all_frames(write_otb, tmp_path):
    sequence = datasets.load(write_otb(tmp_path / "Dog", ROWS, attrs="SV, DEF,IPR\n"))
    assert list(sequence.attributes) == ["SV", "DEF", "IPR"]
    assert all(flags.tolist() == [True] * 3 for flags in sequence.attributes.values())
    before = sequence.fingerprint
    (tmp_path / "Dog" / "attrs.txt").write_text("SV, FM")
    assert datasets.load(tmp_path / "Dog").fingerprint != before


class TestPublishedParts:
    @pytest.mark.parametrize("name", PARTIAL)
    def test_annotated_part_of_the_images_is_read(self, write_numbered, name):
        first, last = SPANS[name]
        n_rows = last - first + 1
        folder = write_numbered(name.capitalize(), last + 5, n_rows)
        sequence = datasets.load(folder)
        assert (len(sequence), sequence.frame_name(0)) == (n_rows, f"{first:04}.jpg")
        assert sequence.images_beyond_truth == 5
        before = sequence.fingerprint
        last_image = folder / "img" / f"{last + 5:04}.jpg"
        last_image.unlink()
        last_image.write_bytes(b"not an image")
        assert datasets.load(folder).fingerprint == before

    @pytest.mark.parametrize("name", ["Football1", "David"])
    def test_part_without_one_row_is_refused(self, write_numbered, name):
        first, last = SPANS[name.lower()]
        folder = write_numbered(name, last + 5, last - first)
        with pytest.raises(SequenceError, match=rf"{last - first} rows for .* images"):
            datasets.load(folder)

    @pytest.mark.parametrize(
        ("name", "first", "missing"),
        [
            ("Dog", 0, None),
            ("David", 1, None),  # a renumbered part
            ("BlurCar1", 247, None),
            ("BlurCar3", 3, None),
            ("BlurCar4", 18, None),
            ("Dog", 2, "0001"),
            ("BlurCar3", 4, "0003"),
        ],
    )
    def test_first_image_has_the_published_number(self, write_numbered, name, first, missing):
        folder = write_numbered(name, 3, 3, first)
        if missing is None:
            assert datasets.load(folder).frame_name(0) == f"{first:04}.jpg"
        else:
            with pytest.raises(SequenceError, match=rf"{missing}\.jpg: this image is missing; the"):
                datasets.load(folder)

    def test_additional_image_0_is_refused(self, write_numbered):
        folder = write_numbered("Dog", 4, 3, first=0)
        match = r"0000\.jpg: 3 ground-truth rows for 4 images of Dog"
        with pytest.raises(SequenceError, match=match):
            datasets.load(folder)

    def test_missing_image_between_others_is_refused(self, write_numbered):
        folder = write_numbered("Dog", 5, 4)
        (folder / "img" / "0002.jpg").unlink()
        with pytest.raises(SequenceError, match=r"0002\.jpg: this image is missing between 0001\."):
            datasets.load(folder)


def test_each_target_of_a_folder_is_a_sequence(write_otb, tmp_path):
    folder = write_otb(tmp_path / "Jogging", ROWS)
    (folder / "groundtruth_rect.txt").rename(folder / "groundtruth_rect.1.txt")
    (folder / "groundtruth_rect.2.txt").write_text("7,8,9,10\n" * 3)
    write_otb(tmp_path / "Dog", ROWS)
    paths = datasets.matching(str(tmp_path))
    assert [datasets.load(path).name for path in paths] == ["Dog", "Jogging.1", "Jogging.2"]
    assert datasets.load(paths[2]).boxes.tolist() == [[6, 7, 9, 10]] * 3
    assert datasets.matching(str(tmp_path / "J*")) == paths[1:] == datasets.matching(str(folder))
    assert datasets.load(folder).name == "Jogging.1"
    assert datasets.options(str(folder)) == [
        {"name": "target", "default": 1, "meaning": "which target of 1, 2"}
    ]
    assert datasets.options(str(tmp_path / "Dog")) == []
    with pytest.raises(SequenceError, match=r"Dog: unknown option 'object'. Options: none"):
        datasets.load(f"{tmp_path / 'Dog'}:object=2")
    with pytest.raises(SequenceError, match=r"no target '3'\. Values: 1, 2\."):
        datasets.load(f"{folder}:target=3")
    with pytest.raises(SequenceError, match="a pattern of paths takes no options"):
        datasets.matching(f"{tmp_path}/J*:target=1")
    (folder / "groundtruth_rect.1.txt").write_text("")  # as in Human4
    assert datasets.matching(str(folder)) == [str(folder)]
    sequence = datasets.load(folder)
    assert (sequence.name, sequence.boxes.tolist()) == ("Jogging.2", [[6, 7, 9, 10]] * 3)
