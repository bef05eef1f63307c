"""Rows of numbers that are not boxes in pixels, in ground truth and in results."""

import cv2
import numpy as np
import pytest

from trackmark import datasets
from trackmark.datasets.box_unit import find_other_unit, resemble_corners

SIZE = (384, 288)
MOVING = np.array([[20 + 6 * i, 30 + 3 * i, 16, 32] for i in range(8)], float)
FAR = MOVING + [250, 180, 0, 0]


def corners(boxes):
    return np.column_stack([boxes[:, :2], boxes[:, :2] + boxes[:, 2:]])


@pytest.mark.parametrize("boxes", [MOVING, FAR, FAR[:1], FAR[[0] * 8]])
def test_corners_in_the_image_are_noticed(boxes):
    assert find_other_unit(boxes, SIZE) is None
    unit = find_other_unit(corners(boxes), SIZE)
    assert unit is not None
    assert unit.name.startswith("corners")


@pytest.mark.parametrize("boxes", [MOVING, MOVING[:1]])
def test_shares_of_the_image_are_noticed(boxes):
    unit = find_other_unit(boxes / [*SIZE, *SIZE], SIZE)
    assert unit is not None
    assert unit.name == "shares of the image size"


@pytest.mark.parametrize(
    "boxes",
    [
        [[20, 30, 200, 150]] * 8,  # large and at rest near the corner of the image
        [[20 + i, 30 + i, 200 + 3 * i, 150 + 2 * i] for i in range(8)],  # large and approaching
        [[300 + i, 250, 120, 90] for i in range(8)],  # cut off by the image border
        [[20 + i, 30, 20 + i, 31] for i in range(8)],  # both move by chance, but not far
        [[np.nan] * 4] * 3,
        [[5, 5, 1, 1]] * 3,
        [[0, 0, 1, 1]] * 3,
    ],
)
def test_boxes_are_not_taken_for_another_unit(boxes):
    assert find_other_unit(np.array(boxes, float), SIZE) is None
    assert not resemble_corners(np.array(boxes, float), SIZE)


SWAYING = np.array([[60 + 20 * np.sin(i / 4), 50, 30 + i % 9, 40] for i in range(60)])


@pytest.mark.parametrize(
    "boxes",
    [
        SWAYING,  # the size changes in every frame
        [
            [150 + i, 120 + i, 60 + i, 60 - i] for i in range(50)
        ],  # the image cuts rows read as boxes
    ],
)
def test_rows_that_resemble_corners_are_remarked(boxes, tmp_path):
    right, wrong = np.array(boxes, float), corners(np.array(boxes, float))
    assert not resemble_corners(right, SIZE)
    assert find_other_unit(wrong, SIZE) is None
    sequence = write_otb(tmp_path, wrong)
    sequence.check_runnable()
    assert any("can be corners x1, y1, x2, y2" in remark for remark in sequence.remarks)


def write_otb(folder, rows):
    (folder / "img").mkdir(parents=True)
    for number in range(len(rows)):
        cv2.imwrite(str(folder / f"img/{number + 1:04}.jpg"), np.zeros((*SIZE[::-1], 3), np.uint8))
    text = "".join(",".join(f"{value:g}" for value in row) + "\n" for row in rows)
    (folder / "groundtruth_rect.txt").write_text(text)
    return datasets.load(folder)


def test_ground_truth_in_another_unit_is_refused(tmp_path):
    write_otb(tmp_path / "boxes", FAR).check_runnable()
    sequence = write_otb(tmp_path / "corners", corners(FAR))
    with pytest.raises(datasets.SequenceError, match=r"looks like corners.*subtract x1") as error:
        sequence.check_runnable()
    assert str(error.value).startswith(str(tmp_path / "corners/groundtruth_rect.txt"))
    assert any("looks like corners" in remark for remark in sequence.remarks)


def test_shares_in_a_format_that_counts_from_1_are_refused(tmp_path):
    shares = MOVING / [*SIZE, *SIZE]
    with pytest.raises(datasets.SequenceError, match="looks like shares of the image size"):
        write_otb(tmp_path, shares).check_runnable()


def test_boxes_for_larger_images_are_remarked(tmp_path):
    sequence = write_otb(tmp_path, FAR * [3, 3, 0.5, 0.5])
    assert sequence[0].shape == (*SIZE[::-1], 3)
    assert any("most boxes lie outside the images" in remark for remark in sequence.remarks)
