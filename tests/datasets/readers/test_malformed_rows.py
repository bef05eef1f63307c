"""Rows of official data without a positive size: read as their toolkits do, and counted."""

import numpy as np
import pytest

from tests.datasets.readers import layouts
from trackmark import datasets

LAYOUTS = (layouts.otb, layouts.lasot, layouts.got10k, layouts.trackingnet, layouts.uav123)


def read_with_row(layout, row, tmp_path, write_images):
    """Return the sequence of a layout in whose second row is replaced."""
    recording = layout(tmp_path, write_images, None)
    lines = recording.truth.read_text().splitlines()
    recording.truth.write_text("\n".join([lines[0], row, *lines[2:]]) + "\n")
    return datasets.load(recording.path)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_row_with_negative_size_is_counted(layout, tmp_path, write_images):
    sequence = read_with_row(layout, "3,3,8,-1", tmp_path, write_images)
    assert sequence.malformed.tolist() == [False, True, False]
    assert np.isnan(sequence.boxes[1]).all()
    assert any("1 row of the ground truth without a positive" in text for text in sequence.remarks)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_row_of_size_0_is_malformed_if_absence_has_flags(layout, tmp_path, write_images):
    sequence = read_with_row(layout, "1,1,0,0", tmp_path, write_images)
    assert sequence.malformed.any() == (layout in (layouts.lasot, layouts.got10k))
    assert np.isnan(sequence.boxes[1]).all()


@pytest.mark.parametrize(("row", "is_malformed"), [("2,2,8,-1", True), ("2,2,0,0", False)])
def test_sizeless_box_of_vot_does_not_refuse_the_set(row, is_malformed, tmp_path, write_images):
    sequence = read_with_row(layouts.vot_current, row, tmp_path, write_images)
    assert sequence.malformed.tolist() == [False, is_malformed, False]
    assert np.isnan(sequence.boxes[1]).all()


@pytest.mark.parametrize("size", ["8,-1", "0,0"])
def test_sizeless_row_of_mot_does_not_refuse_the_set(size, tmp_path, write_images):
    recording = layouts.mot(tmp_path, write_images, None)
    recording.truth.write_text(f"1,1,2,3,8,9,1,1,1\n2,1,3,3,{size},1,1,1\n3,1,3,3,8,9,1,1,1\n")
    assert datasets.load(recording.path).malformed.tolist() == [False, True, False]


@pytest.mark.parametrize("layout", [layouts.otb, layouts.vot_current, layouts.got10k])
def test_negative_size_can_stand_for_many_absent_frames(layout, tmp_path, write_images):
    recording = layout(tmp_path, write_images, None)
    image = recording.frame.read_bytes()
    for number in range(4, 11):
        digits = str(number).zfill(len(recording.frame.stem))
        recording.frame.with_name(f"{digits}.jpg").write_bytes(image)
    for label in recording.truth.parent.glob("*.[lv]a*"):
        label.unlink()
    recording.truth.write_text("2,3,8,9\n" * 6 + "-1,-1,-1,-1\n" * 4)
    assert datasets.load(recording.path).malformed.sum() == 4


def test_flagged_rows_are_not_malformed(tmp_path, write_images):
    recording = layouts.lasot(tmp_path, write_images, None)
    recording.truth.write_text("2,3,8,9\n3,3,8,9\n0,0,0,0\n")
    assert not datasets.load(recording.path).malformed.any()


def test_malformed_rows_are_part_of_the_fingerprint(tmp_path, write_images):
    prints = {
        read_with_row(layouts.lasot, row, tmp_path / name, write_images).fingerprint
        for name, row in (("a", "1,1,0,0"), ("b", "nan,nan,nan,nan"))
    }
    assert len(prints) == 2
