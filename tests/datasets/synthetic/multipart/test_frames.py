"""Frames of the walking scenes: stateless, reproducible, and what scene and light change."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import datasets
from datasets import SequenceError

KINDS = ("even", "dappled")


@settings(max_examples=4, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), number=st.sampled_from("12345678"))
def test_light_changes_nothing_of_the_truth_but_the_shade(seed, number):
    even, dappled = (
        datasets.load(f"multipart/{number}:scene={seed}:light={light}")
        for light in ("even", "dappled")
    )
    assert (even.boxes == dappled.boxes).all()
    assert (even.visibility == dappled.visibility).all()
    assert all((even.regions[key] == dappled.regions[key]).all() for key in even.regions)
    for key, flags in even.attributes.items():
        assert key == "shade" or (flags == dappled.attributes[key]).all()
    assert (even.frames.mask(50) == dappled.frames.mask(50)).all()
    assert even.fingerprint != dappled.fingerprint


@pytest.mark.slow
def test_dappled_light_takes_light_from_ground_and_people_and_not_from_houses():
    even, dappled = (datasets.load(f"multipart/8:light={light}")[100] for light in KINDS)
    change = dappled.astype(int) - even
    assert (change[300:] < -10).mean() > 0.1
    assert (change > 3).mean() < 0.01
    assert (change[:150] == 0).all()


def test_dappled_light_lays_shade_on_the_target_for_some_of_the_time():
    shares = []
    for seed in range(4):
        sequence = datasets.load(f"multipart/4:light=dappled:scene={seed}")
        shares.append(sequence.attributes["shade"].mean())
    assert max(shares) > 0.03
    assert min(shares) < 0.8


@pytest.mark.slow
def test_scenes_differ_in_ways_clothes_and_street():
    sequences = [datasets.load(f"multipart/5:scene={seed}") for seed in range(2)]
    looks = {sequence.frames.plan.people[0].look for sequence in sequences}
    assert len(looks) == len(sequences)
    for one, other in pairwise(sequences):
        assert np.abs(one.boxes - other.boxes).max() > 50
        ground = np.s_[:200, :]  # above the people
        assert np.abs(one[9][ground].astype(int) - other[9][ground]).mean() > 8


def test_neighbouring_frames_are_alike_and_noisy_in_their_own_ways():
    sequence = datasets.load("multipart/7")
    one, other = sequence[60].astype(int), sequence[61].astype(int)
    difference = one - other
    assert np.abs(difference).mean() < 6
    sky = difference[:40, :]
    assert 2 < sky.std() < 4.5  # of two independent draws of 2 grey levels


def test_the_background_of_a_followed_target_changes_rapidly():
    sequence = datasets.load("multipart/1")
    one, other = (sequence[frame][100:220].astype(int) for frame in (300, 340))
    assert np.abs(one - other).mean() > 12


def test_a_light_that_there_is_not_says_which_there_are():
    with pytest.raises(SequenceError, match="'even' or 'dappled'"):
        datasets.load("multipart/3:light=bright")
