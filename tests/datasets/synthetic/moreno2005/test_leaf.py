"""`moreno2005/leaf`: motion of the leaf, change of the light, similar foliage."""

import numpy as np
import pytest
from hypothesis import given, settings

from tests.datasets.synthetic.scenes import SEEDS, grown, scenes_of, unless_sealed
from trackmark.datasets.synthetic.moreno2005.leaf import (
    sample_shapes,
)

pytestmark = unless_sealed("moreno2005/leaf")
FRAMES = 100
opened, image = scenes_of("moreno2005/leaf")


def middles(seed):
    shapes = sample_shapes(np.random.default_rng(seed))
    return np.stack([shape.place for shape in shapes])


@settings(max_examples=6, deadline=None)
@given(seed=SEEDS)
def test_leaf_moves_fastest_at_the_light_change(seed):
    steps = np.hypot(*np.diff(middles(seed), axis=0).T)
    assert 14 < steps[0] < 19.6
    assert steps[1:].max() < 15.1
    assert (steps > 7).sum() >= 4
    assert 2.5 < steps.mean() < 7


@pytest.mark.parametrize("seed", range(3))
def test_leaf_motion_is_hard_to_predict(seed):
    """Check that predictions from the last one or two speeds often have large errors."""
    way = middles(seed)
    second, third = (np.diff(way, order, axis=0) for order in (2, 3))
    for error in (second, third):
        assert np.percentile(np.hypot(*error.T), 95) > 7
    ahead = np.diff(way, axis=0)
    turn = (ahead[1:] * ahead[:-1]).sum(axis=1)
    assert 0.02 < (turn < 0).mean() < 0.5


@pytest.mark.parametrize("seed", range(2))
def test_leaf_outline_is_nearly_affine_with_small_bends(seed):
    setting = opened(seed).setting
    first = np.column_stack([setting.points(0)[0][:, :2], np.ones(len(setting.points(0)[0]))])
    gains, left = [], []
    for frame in range(0, FRAMES, 7):
        points = setting.points(frame)[0][:, :2]
        affine = np.linalg.lstsq(first, points, rcond=None)[0]
        gains.append(np.linalg.svd(affine[:2])[1])
        left.append(np.sqrt(((first @ affine - points) ** 2).sum(axis=1).mean()))
    longest, shortest = np.array(gains).T
    assert np.ptp(shortest / longest) > 0.1
    assert 0.3 < max(left) < 6
    angles = np.array([shape.angle for shape in setting.shapes])
    assert np.ptp(angles) > 0.6
    assert np.abs(np.diff(angles)).max() > 0.12


@pytest.mark.parametrize("seed", range(2))
def test_small_share_of_foliage_has_the_leaf_colour(seed):
    shares = image(seed, 30) / image(seed, 30).sum(axis=2, keepdims=True)
    mask = opened(seed).mask(30)
    low, high = np.percentile(shares[mask], [5, 95], axis=0)
    alike = ((shares > low) & (shares < high)).all(axis=2)
    assert 0.003 < alike[~grown(mask, 3)].mean() < 0.3
    assert alike[mask].mean() > 0.6


@pytest.mark.parametrize("seed", range(2))
def test_leaf_light_changes_once_and_by_channel(seed):
    means = [image(seed, frame)[opened(seed).mask(frame)].mean(axis=0) for frame in (0, 1, 2)]
    gains = means[1] / means[0]
    assert gains.max() < 0.9
    assert gains.max() / gains.min() > 1.5
    assert means[2] == pytest.approx(means[1], rel=0.15)
