"""Frames of `plain/target`: stateless, reproducible, fingerprinted."""

import hashlib
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from datasets.synthetic.plain.knobs import TargetKnobs
from datasets.synthetic.scene import part_generator

HARD = {
    "length": 30,
    "width": 120,
    "height": 90,
    "scale": 1.6,
    "clutter": 3,
    "occlusion": 0.7,
    "absence": 5,
    "light": 0.5,
    "blur": 0.7,
    "pan": 3.3,
    "speed": 6,
}


@settings(max_examples=15, deadline=None)
@given(
    scene=st.integers(0, 2**32 - 1),
    order=st.permutations(range(0, 30, 3)),
    width=st.integers(64, 150),
    height=st.integers(64, 120),
)
def test_any_order_gives_the_same_images(target, scene, order, width, height):
    knobs = {**HARD, "scene": scene, "width": width, "height": height}
    in_order = target(**knobs)
    expected = {frame: in_order[frame] for frame in sorted(order)}
    other = target(**knobs)
    for frame in order:
        image = other[frame]
        assert image.shape == (height, width, 3)
        assert image.dtype == np.uint8
        assert image.flags.c_contiguous
        assert not image.flags.writeable
        assert (image == expected[frame]).all()


def test_threads_and_processes_give_the_same_bytes(target):
    sequence = target(**HARD)
    alone = [hashlib.sha256(image).hexdigest() for image in sequence]
    with ThreadPoolExecutor(4) as threads:
        together = threads.map(lambda i: hashlib.sha256(sequence[i]).hexdigest(), range(30))
        assert list(together) == alone
    program = (
        "import hashlib, sys; from datasets.synthetic import plain;"
        "knobs = dict(word.split('=') for word in sys.argv[1:]);"
        "s = plain.SUITE.load('plain/target', knobs);"
        "print(s.fingerprint, *[hashlib.sha256(i).hexdigest() for i in s])"
    )
    words = [f"{key}={value}" for key, value in HARD.items()]
    output = subprocess.run(
        [sys.executable, "-c", program, *words], capture_output=True, text=True, check=True
    ).stdout
    assert output.split() == [sequence.fingerprint, *alone]


def test_a_slice_shows_the_same_frames(target):
    sequence = target(**HARD)
    assert (sequence[10:20][3] == sequence[13]).all()
    assert (sequence[10:20].mask(3) == sequence.mask(13)).all()


def test_scenes_differ_in_every_part(target):
    small = {"length": 20, "width": 96, "height": 72}
    sequences = [target(scene=scene, **small) for scene in range(6)]
    for i, one in enumerate(sequences):
        for other in sequences[:i]:
            assert np.abs(one[0].astype(int) - other[0]).mean() > 5
            assert (one.boxes != other.boxes).any()


def test_a_part_of_a_scene_has_random_numbers_of_its_own():
    draws = {part_generator(seed, part).integers(2**60) for seed in range(5) for part in "abcde"}
    assert len(draws) == 25


def test_the_fingerprint_tells_every_knob_apart_and_renders_nothing(target):
    base = {"length": 50}
    others = {
        "scene": 1,
        "length": 51,
        "width": 321,
        "height": 241,
        "speed": 3,
        "scale": 2,
        "clutter": 1,
        "occlusion": 0.5,
        "absence": 1,
        "light": 0.1,
        "noise": 1,
        "blur": 0.1,
        "pan": 1,
    }
    assert set(others) == set(TargetKnobs.model_fields)
    sequences = [target(**base), *(target(**{**base, key: v}) for key, v in others.items())]
    assert len({sequence.fingerprint for sequence in sequences}) == len(sequences)
    assert target(**base).fingerprint == sequences[0].fingerprint
    assert all("_ground" not in vars(sequence.frames) for sequence in sequences)
