"""The search from coarse to fine against looking everywhere."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.trackers import plain_matching as plain
from trackmark.trackers.templates.matching import Pose, Window, reach, sampled, search

ROWS, COLUMNS = 70, 90
CUTOFF = 3.368
COVARIANCE = np.array([[30.0, 12.0, 5.0], [12.0, 25.0, -6.0], [5.0, -6.0, 20.0]])


def texture(rows=ROWS, columns=COLUMNS, d=3, seed=0, blur=3.0):
    noise = np.random.default_rng(seed).normal(0, 300, (rows, columns, d))
    return cv2.GaussianBlur(noise, (0, 0), blur).reshape(rows, columns, d)


def whole(features):
    return Window(features, 0, 0, *features.shape[:2])


def cropped(features, pose, search_range, shape):
    left, top, right, bottom = reach(pose, search_range, shape, *features.shape[:2])
    return Window(features[top:bottom, left:right].copy(), left, top, *features.shape[:2])


def costs(features, template, poses, bilinear=False, cutoff=CUTOFF):
    arguments = features, template, np.linalg.inv(COVARIANCE)
    ways = {"stride": 2, "bilinear": bilinear}
    return np.array([plain.matching_cost(*arguments, pose, cutoff, **ways) for pose in poses])


@pytest.mark.parametrize(("seed", "scale"), [(0, 1.0), (1, 0.99), (0, 1.02)])
def test_whole_pixels_are_those_of_an_exhaustive_search(seed, scale):
    random = np.random.default_rng(seed)
    features = texture(seed=seed)
    x, y = 45 + random.uniform(-8, 8), 35 + random.uniform(-8, 8)
    template = plain.sample(features, plain.Pose(x, y, scale), 15, 19, bilinear=True)
    template += random.normal(0, 2, template.shape)
    found = search(whole(features), template, COVARIANCE, Pose(45, 35, 1.0), 8, CUTOFF, False)
    everywhere = [
        plain.Pose(45 + across, 35 + down, coarse * fine)
        for coarse in (0.98, 1.0, 1.02)
        for fine in (0.99, 1.0, 1.01)
        for down in range(-10, 11)
        for across in range(-10, 11)
    ]
    all_costs = costs(features, template, everywhere)
    best = everywhere[all_costs.argmin()]
    assert (found.pose.x, found.pose.y) == (best.x, best.y)
    assert found.pose.scale == pytest.approx(best.scale, abs=0.02)
    assert found.cost <= np.partition(all_costs, 9)[9]  # scales differ by little at this size
    assert found.cost == pytest.approx(costs(features, template, [found.pose])[0])


def on_flat_ground(pose, search_range, subpixel, ties="ascending"):
    flat = np.zeros((ROWS, COLUMNS, 3))
    arguments = flat[:12, :12], COVARIANCE, pose, search_range, CUTOFF, subpixel, ties
    return search(whole(flat), *arguments).pose


@pytest.mark.parametrize(("scale", "limit"), [(0.5, 0.5), (0.4, 0.5), (2.3, 2.0)])
def test_scales_stay_between_a_half_and_two(scale, limit):
    found = on_flat_ground(Pose(45, 35, scale), 16, False).scale
    assert 0.5 <= found <= 2.0
    assert found == pytest.approx(limit, rel=0.031)


POSES = st.builds(
    Pose, st.floats(-60, COLUMNS + 60), st.floats(-60, ROWS + 60), st.floats(0.5, 2.0)
)


@settings(max_examples=30)
@given(pose=POSES, height=st.integers(4, 20), width=st.integers(4, 20), bilinear=st.booleans())
def test_pixels_are_sampled_as_the_plain_reference_does_also_beside_the_image(
    pose, height, width, bilinear
):
    features = texture()
    window = cropped(features, pose, 0, (height, width))
    expected = plain.sample(features, plain.Pose(*pose), height, width, bilinear=bilinear)
    np.testing.assert_allclose(
        sampled(window, pose, height, width, bilinear), expected, rtol=0, atol=1e-10
    )


@settings(max_examples=15)
@given(
    pose=POSES,
    height=st.integers(4, 20),
    width=st.integers(4, 20),
    search_range=st.sampled_from([4, 16, 26]),
)
def test_a_search_finds_in_what_it_reaches_what_it_finds_in_the_whole_image(
    pose, height, width, search_range
):
    features = texture(blur=1.5)
    template = plain.sample(features, plain.Pose(47.3, 31.8, 1.1), height, width, bilinear=True)
    window = cropped(features, pose, search_range, template.shape)
    for subpixel in (False, True):
        arguments = template, COVARIANCE, pose, search_range, CUTOFF, subpixel
        assert search(window, *arguments) == search(whole(features), *arguments)
