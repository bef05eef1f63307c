"""`moreno2005/leaf`: motion of the leaf, change of the light, similar foliage."""

import numpy as np
import pytest
from hypothesis import given, settings

from tests.datasets.synthetic.scenes import SEEDS, grown, scenes_of, unless_sealed
from trackmark.datasets.synthetic.moreno2005.leaf import (
    LeafShape,
    incident_light,
    place_blade,
    sample_blade,
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
    """Predictions by the last one or two speeds often have large errors."""
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


def test_undeformed_leaf_has_its_rest_shape():
    blade = sample_blade(np.random.default_rng(0), 80.0, (50, 120, 90))
    shape = LeafShape(np.array([100.0, 90.0]), 0.0, 0.0, 0.0, 0.0, 0.0)
    points, normals = place_blade(blade, shape)
    assert points[:, 0] == pytest.approx(100 + blade.across.ravel())
    assert points[:, 1] == pytest.approx(90 + 40 - blade.along.ravel())
    assert normals == pytest.approx(np.broadcast_to([0.0, 0.0, 1.0], normals.shape))
    folded, _ = place_blade(blade, LeafShape(shape.place, 0.0, 0.0, 0.0, 0.0, 0.5))
    assert folded[:, 2] == pytest.approx(np.abs(blade.across.ravel()) * np.sin(0.5))
    assert folded[:, 0] == pytest.approx(100 + blade.across.ravel() * np.cos(0.5))
    turned, _ = place_blade(blade, LeafShape(shape.place, np.pi / 2, 0.0, 0.0, 0.0, 0.0))
    assert turned[:, 0] == pytest.approx(100 + blade.along.ravel() - 40)  # its tip to the right


def test_bent_and_folded_leaf_keeps_lengths():
    blade = sample_blade(np.random.default_rng(1), 80.0, (50, 120, 90))
    shape = LeafShape(np.zeros(2), 0.4, 0.5, -0.3, 0.9, 0.3)
    points = place_blade(blade, shape)[0].reshape(*blade.along.shape, 3)
    vein = points[:, points.shape[1] // 2]
    lengths = np.linalg.norm(np.diff(vein, axis=0), axis=1)
    middle = blade.along.shape[1] // 2
    grown_so = np.hypot(np.diff(blade.along[:, 0]), np.diff(blade.across[:, middle]))
    assert lengths == pytest.approx(grown_so, rel=0.03)
    across = np.linalg.norm(points[:, -1] - vein, axis=1)
    inner = slice(8, -8)
    assert across[inner] == pytest.approx(
        (blade.across[:, -1] - blade.across[:, middle])[inner], rel=0.12
    )


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


def test_leaf_light_follows_lamberts_law_on_the_visible_side():
    sun = np.array([0.0, -0.6, 0.8])
    normals = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.0, -0.6, 0.8], [0.0, 0.8, 0.6]])
    around, straight = incident_light(normals, sun, np.array([1.0, 1.0, 0.5, 1.0]))
    assert straight == pytest.approx([0.8, 0.8, 0.5, 0.0])
    assert around == pytest.approx([1.0, 1.0, 0.95, 0.9])
    behind = incident_light(np.array([[0.0, 0.95, 0.3122499]]), sun, np.ones(1))[1]
    assert 0.05 < behind[0] < 0.15  # some comes through
