"""What every built-in sequence keeps to."""

import hashlib
import json
import subprocess
import sys

import numpy as np
import pytest

import datasets
from datasets import SequenceError

# Of the twenty clips of a film, which are made alike, the first and the last.
NAMES = [
    name
    for name in datasets.names()
    if "/clip-" not in name or name.endswith(("/clip-01", "/clip-20"))
]

# What another process makes of the same names: fingerprint, and digest of the last image.
ELSEWHERE = """
import hashlib, json, sys, datasets
answers = {}
for name in json.loads(sys.argv[1]):
    sequence = datasets.load(name)
    answers[name] = [sequence.fingerprint, hashlib.sha256(sequence[-1].tobytes()).hexdigest()]
print(json.dumps(answers))
"""


@pytest.fixture(scope="module")
def elsewhere():
    answer = subprocess.run(
        [sys.executable, "-c", ELSEWHERE, json.dumps(NAMES)],
        capture_output=True,
        text=True,
        check=True,
    )
    return json.loads(answer.stdout)


@pytest.fixture(scope="module", params=NAMES)
def sequence(request):
    return datasets.load(request.param)


def test_it_can_be_run(sequence):
    sequence.check_runnable()
    assert len(sequence) > 1
    assert sequence.name in datasets.names()


def test_images_are_as_agreed(sequence):
    first, last = sequence[0], sequence[-1]
    assert first.shape == last.shape
    assert first.shape[2] == 3
    assert getattr(sequence.frames, "size", first.shape[1::-1]) == first.shape[1::-1]
    for image in (first, last):
        assert image.dtype == np.uint8
        assert image.flags.c_contiguous
        assert not image.flags.writeable


def test_boxes_show_something_of_the_image(sequence):
    height, width = sequence[0].shape[:2]
    x, y, w, h = sequence.boxes[sequence.present].T
    assert (w > 0).all()
    assert (h > 0).all()
    assert ((x < width) & (y < height) & (x + w > 0) & (y + h > 0)).all()


def test_visibility_is_a_fraction(sequence):
    known = sequence.visibility[np.isfinite(sequence.visibility)]
    assert ((known >= 0) & (known <= 1)).all()


def test_a_mask_lies_in_its_region(sequence):
    frame = sequence.first_frame
    mask = sequence.mask(frame)
    if mask is None:
        return
    assert mask.dtype == np.bool_
    assert mask.shape == sequence[frame].shape[:2]
    rows, columns = np.nonzero(mask)
    x, y, width, height = sequence.regions.get("tight", sequence.boxes)[frame]
    inside = (
        (columns > x - 2) & (columns < x + width + 1) & (rows > y - 2) & (rows < y + height + 1)
    )
    assert inside.mean() > 0.95


def test_any_order_gives_the_same_images(sequence):
    n = len(sequence)
    once = {frame: sequence[frame].tobytes() for frame in (n // 2, 0, n - 1)}
    again = datasets.load(sequence.name)
    assert all(again[frame].tobytes() == once[frame] for frame in (0, n // 2, n - 1))


@pytest.mark.slow
def test_another_process_finds_the_same(sequence, elsewhere):
    fingerprint, digest = elsewhere[sequence.name]
    assert sequence.fingerprint == fingerprint
    assert hashlib.sha256(sequence[-1].tobytes()).hexdigest() == digest


def test_an_unknown_option_is_an_error_that_names_it(sequence):
    with pytest.raises(SequenceError, match="no-such-option"):
        datasets.load(f"{sequence.name}:no-such-option=1")


def test_no_two_sequences_have_the_same_fingerprint(elsewhere):
    fingerprints = [fingerprint for fingerprint, _ in elsewhere.values()]
    assert len(set(fingerprints)) == len(NAMES)
