"""The suite `wang2010`: three sequences of the paper's sizes, and the events in its frames."""

import numpy as np
import pytest

import datasets

SIZES = {
    "wang2010/table-tennis": (50, 115, 142),
    "wang2010/hand": (100, 120, 160),
    "wang2010/cup": (80, 85, 108),
}


@pytest.mark.parametrize("name", SIZES)
def test_lengths_and_sizes_are_the_papers(name):
    sequence = datasets.load(name)
    frames, height, width = SIZES[name]
    assert len(sequence) == frames
    assert sequence.frames.size == (width, height)
    assert sequence.fps == 25
    assert np.isfinite(sequence.boxes).all()  # the target is always there


@pytest.mark.parametrize(
    ("name", "event", "frame"),
    [
        ("wang2010/table-tennis", "speed-up", 12),
        ("wang2010/hand", "on the face", 49),
        ("wang2010/cup", "similar background", 36),
        ("wang2010/cup", "occluded", 36),
    ],
)
def test_what_the_paper_tells_of_a_frame_happens_there_in_every_scene(name, event, frame):
    for seed in (0, 1, 19):
        flags = datasets.load(f"{name}:scene={seed}").attributes[event]
        assert flags[frame - 1]  # the paper counts from 1
        assert not flags[:8].any()


@pytest.mark.parametrize("name", ["wang2010/hand", "wang2010/cup"])
def test_before_a_plain_background_nothing_disturbs_and_the_target_moves_as_before(name):
    usual, plain = datasets.load(name), datasets.load(f"{name}:background=plain")
    assert (usual.boxes == plain.boxes).all()
    assert (usual.mask(0) == plain.mask(0)).all()
    assert (plain.visibility >= usual.visibility).all()
    assert plain.visibility.min() > 0.85
    assert not any(flags.any() for flags in plain.attributes.values())
    assert usual.fingerprint != plain.fingerprint
