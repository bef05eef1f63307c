"""The knob `light`: it changes pictures, and of the truth what tells of the light alone."""

import numpy as np
import pytest

import datasets
from datasets.synthetic import nummiaro2003

DAPPLED = ("multipart/8", "stress/twin", *nummiaro2003.SUITE.names()[:4])


@pytest.mark.parametrize(
    ("name", "light"), [*((name, "dappled") for name in DAPPLED), ("nummiaro2003/head", "lamps")]
)
def test_light_changes_nothing_of_the_truth_but_the_shade(name, light):
    even, other = datasets.load(name), datasets.load(f"{name}:light={light}")
    assert np.array_equal(even.boxes, other.boxes, equal_nan=True)
    assert (even.visibility == other.visibility).all()
    for key, boxes in even.regions.items():
        assert np.array_equal(boxes, other.regions[key], equal_nan=True)
    for key, flags in even.attributes.items():
        assert key == "shade" or (flags == other.attributes[key]).all()
    assert (even.mask(100) == other.mask(100)).all()
    assert even.fingerprint != other.fingerprint


@pytest.mark.parametrize(("name", "sky"), [("multipart/8", 150), ("nummiaro2003/car", 60)])
def test_dappled_light_takes_light_from_the_ground_and_not_from_the_sky(name, sky):
    even, dappled = (datasets.load(f"{name}:light={light}")[100] for light in ("even", "dappled"))
    change = dappled.astype(int) - even
    assert (change[300:] < -10).mean() > 0.1
    assert (change > 3).mean() < 0.01
    assert (change[:sky] == 0).mean() > 0.99


@pytest.mark.parametrize("name", DAPPLED)
def test_there_is_shade_under_trees_alone(name):
    assert not datasets.load(name).attributes["shade"].any()
    shares = [
        datasets.load(f"{name}:light=dappled:scene={seed}").attributes["shade"].mean()
        for seed in range(3)
    ]
    assert max(shares) > 0.01
    assert min(shares) < 0.9
