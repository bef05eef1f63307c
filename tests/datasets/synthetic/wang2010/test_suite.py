"""The suite `wang2010`: three sequences of the paper's sizes, and the events in its frames."""

import numpy as np
import pytest

from trackmark import datasets

SIZES = {
    "wang2010/table-tennis": (50, 115, 142, 30),
    "wang2010/hand": (100, 120, 160, 25),
    "wang2010/cup": (80, 85, 108, 25),
}


@pytest.mark.parametrize("name", SIZES)
def test_lengths_and_sizes_are_the_papers(name):
    sequence = datasets.load(name)
    frames, height, width, fps = SIZES[name]
    assert len(sequence) == frames
    assert sequence.frames.size == (width, height)
    assert sequence.fps == fps
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
