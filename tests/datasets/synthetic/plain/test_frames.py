"""Frames of `plain/target`: stateless and reproducible; fingerprints."""

from concurrent.futures import ThreadPoolExecutor

from hypothesis import given, settings
from hypothesis import strategies as st

from trackmark.datasets.synthetic.plain.parameters import TargetParameters
from trackmark.datasets.synthetic.scene import part_generator

HARD = {"length": 30, "scale": 1.6, "clutter": 3, "occlusion": 0.7, "absence": 5}
HARD |= {"light": 0.5, "blur": 0.7, "pan": 3.3, "speed": 6}


@settings(max_examples=6, deadline=None)
@given(
    scene=st.integers(0, 2**32 - 1),
    order=st.permutations(range(0, 30, 3)),
    width=st.integers(64, 150),
    height=st.integers(64, 120),
)
def test_frames_are_equal_in_any_order_and_thread(target, scene, order, width, height):
    parameters = {**HARD, "scene": scene, "width": width, "height": height}
    in_order, other = target(**parameters), target(**parameters)
    expected = [in_order[frame] for frame in sorted(order)]
    assert expected[0].shape == (height, width, 3)
    with ThreadPoolExecutor(4) as threads:
        images = dict(zip(order, threads.map(other.__getitem__, order), strict=True))
    for frame, image in zip(sorted(order), expected, strict=True):
        assert (images[frame] == image).all()


def test_part_generators_are_independent():
    draws = {part_generator(seed, part).integers(2**60) for seed in range(5) for part in "abcde"}
    assert len(draws) == 25


def test_fingerprint_depends_on_every_parameter(target):
    base = {"length": 50}
    others = {"scene": 1, "length": 51, "width": 321, "height": 241, "speed": 3, "scale": 2}
    others |= {"clutter": 1, "occlusion": 0.5, "absence": 1, "light": 0.1, "noise": 1}
    others |= {"blur": 0.1, "pan": 1}
    assert set(others) == set(TargetParameters.model_fields)
    sequences = [target(**base), *(target(**{**base, key: v}) for key, v in others.items())]
    assert len({sequence.fingerprint for sequence in sequences}) == len(sequences)
    assert target(**base).fingerprint == sequences[0].fingerprint
    assert all("_ground" not in vars(sequence.frames) for sequence in sequences)
