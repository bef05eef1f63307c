"""`moreno2005/octopus`: motion, look, camouflage, and kernels compared with slow references."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings

from tests.datasets.synthetic.scenes import SEEDS, scenes_of, unless_sealed
from trackmark.datasets.synthetic.moreno2005.octopus import (
    FLOOR_KINDS,
    OWN,
    SKINS,
    mould,
    sample_plan,
)

pytestmark = unless_sealed("moreno2005/octopus")

FRAMES = 100
opened, image = scenes_of("moreno2005/octopus")


def ring_around(mask, near=4, far=16):
    """Return the pixels around a mask at distances from `near` to `far`."""
    inner, outer = (
        cv2.dilate(
            mask.astype(np.uint8),
            cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1,) * 2),
        )
        > 0
        for reach in (near, far)
    )
    return outer & ~inner


@settings(max_examples=8, deadline=None)
@given(seed=SEEDS)
def test_octopus_crawls_through_the_image(seed):
    plan = sample_plan(seed)
    steps = np.hypot(*np.diff(plan.place, axis=0).T)
    assert 0.3 < steps.min() < steps.max() < 4
    assert np.hypot(*(plan.place[-1] - plan.place[0])) > 130
    assert np.abs(np.diff(plan.boxes, axis=0)).max() < 6


@settings(max_examples=6, deadline=None)
@given(seed=SEEDS)
def test_octopus_outline_changes_are_nearly_affine(seed):
    plan = sample_plan(seed)
    left = []
    for frame in range(0, 90, 15):
        first, second = (plan.posture(k).balls[:, :2] for k in (frame, frame + 10))
        homogeneous = np.hstack([first, np.ones((len(first), 1))])
        affine, *_ = np.linalg.lstsq(homogeneous, second, rcond=None)
        left.append(np.linalg.norm(second - homogeneous @ affine, axis=1))
    rest = np.concatenate(left)
    assert 0.1 < np.sqrt((rest**2).mean()) < 1.5
    moved = plan.posture(40).balls[:, :2] - plan.posture(39).balls[:, :2]
    assert np.linalg.norm(moved, axis=1).max() < 7


@settings(max_examples=8, deadline=None)
@given(seed=SEEDS)
def test_octopus_starts_with_own_look_and_changes_twice(seed):
    plan = sample_plan(seed)
    looks = [plan.look(frame) for frame in range(FRAMES)]
    assert looks[0] == (OWN, 0, 0.0)
    worn = np.zeros((FRAMES, OWN + 1))
    for weights, (before, after, share) in zip(worn, looks, strict=True):
        weights[before] += 1 - share
        weights[after] += share
    assert np.abs(np.diff(worn, axis=0)).max() < 0.2  # gradual changes
    assert (worn[:, 0] > 0.99).sum() >= 3
    (first, second) = plan.changes
    assert 8 <= first[0] < first[1] < second[0]
    assert len({*plan.kinds}) == 4
    # It starts on one floor and ends on another.
    shares = plan.zones.shares(plan.place)
    assert shares.sum(axis=1) == pytest.approx(1)
    assert shares[:25, 0].mean() > 0.7
    assert shares[-25:, 1].mean() > 0.7


def test_octopus_is_camouflaged_a_third_of_the_time():
    plans = [sample_plan(seed) for seed in range(16)]
    assert {kind for plan in plans for kind in plan.kinds} == {*FLOOR_KINDS, *SKINS}
    camouflaged = [plan.camouflaged for plan in plans]
    assert 0.2 < np.mean(camouflaged) < 0.5
    assert np.mean([flags[:58].any() and flags[75:].any() for flags in camouflaged]) > 0.3


@pytest.mark.parametrize("seed", [0, 2])  # scene 1 is never camouflaged
def test_camouflaged_octopus_resembles_its_surroundings(seed):
    scene = opened(seed)
    flags = scene.truth().attributes["camouflaged"]
    colours, textures = np.empty(FRAMES), np.empty(FRAMES)
    for frame in range(0, FRAMES, 4):
        seen, mask = image(seed, frame) / 255, scene.mask(frame)
        ring = ring_around(mask)
        colours[frame] = np.linalg.norm(seen[mask].mean(axis=0) - seen[ring].mean(axis=0))
        shares = [
            cv2.calcHist(
                [seen.astype(np.float32)], [0, 1, 2], area.astype(np.uint8), [6] * 3, [0, 1] * 3
            ).ravel()
            / area.sum()
            for area in (mask, ring)
        ]
        textures[frame] = np.sqrt(shares[0] * shares[1]).sum()
    sampled = np.arange(FRAMES) % 4 == 0
    start = sampled & (np.arange(FRAMES) < 8)
    assert colours[sampled & flags].mean() < 0.12
    assert colours[sampled & flags].mean() < 0.6 * colours[start].mean()
    assert textures[sampled & flags].mean() > 1.2 * textures[start].mean()
    assert textures[sampled & flags].mean() > 0.55


def drawn_balls(seed, count=7):
    random = np.random.default_rng(seed)
    rest = random.uniform((0, 0, 2, 0, 0.3), (20, 14, 6, 3, 1), (count, 5))
    rest[0, :2] = -3, 20  # partly outside
    return rest


@pytest.mark.parametrize("step", [1.0, 0.5])
def test_mould_finds_the_highest_ball_at_every_sample(step):
    balls = drawn_balls(1)
    left, top, shape = 2.0, 1.0, (int(11 / step), int(15 / step))
    height, owner = np.zeros(shape, np.float32), np.full(shape, -1, np.int32)
    mould(balls, left, top, step, height, owner)
    for i in range(shape[0]):
        for j in range(shape[1]):
            sample = np.array([left + (j + 0.5) * step, top + (i + 0.5) * step])
            best, which = 0.0, -1
            for k, (x, y, radius, middle, flat) in enumerate(balls):
                square = radius**2 - ((sample - (x, y)) ** 2).sum()
                if square >= 0 and middle + flat * square**0.5 > best:
                    best, which = middle + flat * square**0.5, k
            assert height[i, j] == pytest.approx(best, abs=1e-5)
            assert owner[i, j] == which
    assert len(np.unique(owner)) > 3
