"""Recorded samples without download."""

import cv2
import numpy as np
import pytest

from trackmark import datasets
from trackmark.datasets import SequenceError, samples, truth_file
from trackmark.datasets.annotation import interpolate

NAMES = ["samples/bow-tie", "samples/face"]


def truth_of(name):
    return truth_file.read(samples.FOLDER / f"{name.partition('/')[2]}.csv")


@pytest.mark.parametrize("name", NAMES)
def test_target_is_present_in_all_frames(name):
    sequence = datasets.load(name)
    assert (len(sequence), sequence.n_unread_images) == (120, 0)
    assert sequence.fps == pytest.approx(29.97, abs=0.001)
    assert sequence.present.all()
    assert sequence[119].shape == (144, 176, 3)
    assert (sequence.boxes[:, :2] >= 0).all()
    assert (sequence.boxes[:, :2] + sequence.boxes[:, 2:] <= [176, 144]).all()


@pytest.mark.parametrize("name", NAMES)
def test_unmarked_frames_are_interpolated(name):
    truth = truth_of(name)
    marked = [i for i, source in enumerate(truth.sources) if source == "marked"]
    assert {*range(0, 120, 5), 119} <= set(marked)
    expected = interpolate({i: truth.boxes[i] for i in marked}, 120)
    assert expected.sources == truth.sources
    np.testing.assert_allclose(truth.boxes, expected.boxes, atol=0.0051)  # rounded to 0.01 px


@pytest.mark.parametrize("name", NAMES)
def test_ground_truth_file_documents_the_procedure(name):
    text = (samples.FOLDER / f"{name.partition('/')[2]}.csv").read_text()
    head = text.partition("frame,")[0]
    for text_part in ("Target: ", "marked by eye", "interpolated linearly", "How accurate"):
        assert text_part in head


def test_bow_tie_boxes_enclose_the_deep_red_pixels():
    """Check the marked boxes with an independent segmentation by colour."""
    sequence = datasets.load("samples/bow-tie")
    for frame in range(120):
        left, top, width, height = sequence.boxes[frame]
        blue, green, red = cv2.split(sequence[frame].astype(np.int16))
        rows, columns = np.nonzero((red > 2.2 * np.maximum(blue, green)) & (red > 60))
        x, y = columns + 0.5, rows + 0.5
        inside = (x > left) & (x < left + width) & (y > top) & (y < top + height)
        assert inside.mean() > 0.95
        assert abs(x[inside].max() + 0.5 - left - width) < 3
        assert abs(y[inside].max() + 0.5 - top - height) < 4


def test_missing_clip_error_has_a_remedy(monkeypatch, tmp_path):
    monkeypatch.setattr(samples, "CLIP", tmp_path / "clip.mp4")
    with pytest.raises(SequenceError, match=r"clip\.mp4 does not exist\. Install trackmark again"):
        datasets.load("samples/face")


def test_other_clip_of_the_same_name_is_refused(monkeypatch, tmp_path):
    clip = tmp_path / "clip.mp4"
    clip.write_bytes(samples.CLIP.read_bytes() + b"\0")
    monkeypatch.setattr(samples, "CLIP", clip)
    with pytest.raises(SequenceError, match="is not the clip that was annotated"):
        datasets.load("samples/face")


def test_option_is_refused():
    with pytest.raises(SequenceError, match=r"face: unknown option 'speed'\. Options: none"):
        datasets.load("samples/face:speed=2")
