"""`moreno2005/ellipse`: motion, look and patches."""

import numpy as np
import pytest
from hypothesis import given, settings
from shapely import affinity
from shapely.geometry import Point, Polygon

from tests.datasets.synthetic.scenes import SEEDS, grown, scenes_of, unless_sealed
from trackmark.datasets.synthetic.moreno2005.ellipse import HALF_AXES, sample_plan

pytestmark = unless_sealed("moreno2005/ellipse")

FRAMES = 100
opened, image = scenes_of("moreno2005/ellipse")


def region(plan, frame, samples=720):
    """Return the ellipse as a Shapely polygon."""
    circle = Point(0, 0).buffer(1, quad_segs=samples // 4)
    oval = affinity.scale(circle, *plan.half_axes[frame], origin=(0, 0))
    turned = affinity.rotate(oval, plan.angle[frame], origin=(0, 0), use_radians=True)
    return affinity.translate(turned, *plan.centre[frame])


@settings(max_examples=12, deadline=None)
@given(seed=SEEDS)
def test_ellipse_shape_and_colour_change_smoothly(seed):
    plan = sample_plan(seed)
    assert HALF_AXES[0] - 0.1 < plan.half_axes.min() < plan.half_axes.max() < HALF_AXES[1] + 0.1
    assert np.abs(np.diff(np.log(plan.half_axes), axis=0)).max() < 0.13
    assert (np.ptp(plan.half_axes, axis=0) > 0.5).all()
    assert np.abs(np.diff(plan.angle)).max() < 0.21
    assert np.ptp(plan.angle) > 0.1
    assert 0.08 <= plan.colour.min() < plan.colour.max() <= 0.92
    assert np.linalg.norm(np.ptp(plan.colour, axis=0)) > 0.25


def test_ellipse_shape_steps_are_small_and_independent():
    steps = []
    for seed in range(20):
        plan = sample_plan(seed)
        shape = np.column_stack([np.log(plan.half_axes), plan.angle])
        steps.append(np.diff(shape, axis=0))
    new = np.stack(steps)
    assert np.abs(new.std(axis=(0, 1)) - 0.03).max() < 0.002
    assert abs((new[:, 1:] * new[:, :-1]).mean() / new.var()) < 0.06


def test_ellipse_colour_follows_a_curved_path_at_even_speed():
    lengths, straight, missed = [], [], []
    for seed in range(20):
        colour = sample_plan(seed).colour
        steps = np.diff(colour, axis=0)
        lengths.append(np.linalg.norm(steps, axis=1))
        straight.append(np.linalg.norm(colour[20:] - colour[:-20], axis=1).mean())
        # Deviation from a straight path after ten frames.
        foreseen = colour[1:-10] + 10 * steps[:-10]
        missed.append(np.linalg.norm(colour[11:] - foreseen, axis=1).mean())
    assert np.mean(lengths) == pytest.approx(0.05, abs=0.003)
    assert np.max(lengths) < 0.08
    assert np.mean(straight) < 0.5 * 20 * np.mean(lengths)
    assert np.mean(missed) > 0.5 * 10 * np.mean(lengths)


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_similar_patch_touches_the_ellipse_in_marked_frames(seed):
    scene = opened(seed)
    similar = scene.truth().attributes["similar patch"]
    assert 0.03 < similar.mean() < 0.5
    for frame in np.flatnonzero(similar).tolist():
        colour = scene.plan.colour[frame]
        alike = [patch for patch in scene.patches if np.linalg.norm(patch.colour - colour) <= 0.15]
        seen = scene._backdrop[..., ::-1] / 255
        mask = scene.mask(frame)
        ring = (grown(mask, 1)) & ~mask
        gap = np.linalg.norm(seen[ring] - colour, axis=1)
        assert alike
        assert (gap < 0.45).sum() >= 6  # shadows and texture change the painted colour
        rims = [region_of(patch).distance(region(scene.plan, frame)) for patch in alike]
        assert min(rims) < 1.5


def region_of(patch):
    return Polygon(patch.outline).buffer(0)


def test_unmarked_frames_have_no_adjacent_similar_patch():
    scene = opened(1)
    similar = scene.truth().attributes["similar patch"]
    for frame in np.flatnonzero(~similar).tolist():
        whole = region(scene.plan, frame)
        for number, patch in enumerate(scene.patches):
            if np.linalg.norm(patch.colour - scene.plan.colour[frame]) > 0.15:
                continue
            left = region_of(patch)
            for later in scene.patches[number + 1 :]:
                left = left.difference(region_of(later))
            beside = left.intersection(whole.buffer(1)).difference(whole)
            assert beside.area < 20
