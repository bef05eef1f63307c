"""`moreno2005/octopus`: motion, look and camouflage."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings

from tests.datasets.synthetic.scenes import SEEDS, scenes_of, unless_sealed
from trackmark.datasets.synthetic.moreno2005.octopus import (
    FLOOR_KINDS,
    OWN,
    SKINS,
    paint_texture,
    relief_light,
    sample_plan,
)

pytestmark = unless_sealed("moreno2005/octopus")

FRAMES = 100
opened, image = scenes_of("moreno2005/octopus")


def ring_around(mask, near=4, far=16):
    """Pixels around a mask, at some distance."""
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


def test_octopus_shadow_falls_away_from_the_light():
    scene = opened(0)
    frame = 30
    picture = scene._floor.copy()
    scene._lay_octopus(picture, frame)
    mask = scene.mask(frame)
    lost = np.where(
        ring_around(mask, 1, 20),
        1 - picture.sum(axis=2) / np.maximum(scene._floor.sum(axis=2), 0.05),
        0,
    )
    assert lost.min() > -1e-3
    assert (lost > 0.2).sum() > 150
    rows, columns = np.indices(mask.shape)
    shift = [(lost * axis).sum() / lost.sum() - axis[mask].mean() for axis in (columns, rows)]
    assert min(shift) > 1


@settings(max_examples=8, deadline=None)
@given(seed=SEEDS)
def test_octopus_starts_with_own_texture_and_changes_twice(seed):
    plan = sample_plan(seed)
    changes = [plan.texture_change(frame) for frame in range(FRAMES)]
    assert changes[0] == (OWN, 0, 0.0)
    worn = np.zeros((FRAMES, OWN + 1))
    for weights, (before, after, share) in zip(worn, changes, strict=True):
        weights[before] += 1 - share
        weights[after] += share
    assert np.abs(np.diff(worn, axis=0)).max() < 0.2  # nothing at once
    assert (worn[:, 0] > 0.99).sum() >= 3
    (first, second) = plan.changes
    assert 8 <= first[0] < first[1] < second[0]
    assert len({*plan.kinds}) == 4
    # It starts on one floor and arrives on another.
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


@pytest.mark.parametrize("kind", [*FLOOR_KINDS, *SKINS])
def test_paint_texture_has_its_mean_colour_and_repeats(kind):
    look = {**FLOOR_KINDS, **SKINS}[kind]
    texture = paint_texture(np.random.default_rng(1), look, np.array(look.colour))
    assert texture.mean(axis=(0, 1))[::-1] == pytest.approx(look.colour, abs=0.012)
    seam = np.abs(texture[0] - texture[-1]).mean()
    assert seam < 1.6 * np.abs(np.diff(texture, axis=0)).mean()


def test_relief_light_is_one_on_level_ground():
    rows, columns = np.indices((60, 60)).astype(np.float32)
    assert relief_light(np.full((60, 60), 3, np.float32), 1.5)[20:40, 20:40] == pytest.approx(
        1, abs=1e-5
    )
    towards, away = (relief_light(sign * 0.5 * (rows + columns), 1.5)[30, 30] for sign in (1, -1))
    # The cosine of the angle between the light and the slope's normal, beside level ground's.
    normal = np.array([-0.5, -0.5, 1]) / np.sqrt(1.5)
    straight = max(normal @ (-0.42, -0.5, 0.757), 0)
    assert towards == pytest.approx(0.55 + 0.45 * straight / 0.757, abs=1e-4)
    assert away < 0.8 < 1 < towards


def test_water_light_moves_slowly_at_even_brightness():
    water = opened(2)._water
    grey = np.full((240, 320, 3), 0.5, np.float32)
    seen = [water.over(grey, frame).astype(float) for frame in (0, 1, 25)]
    assert 0.1 < np.abs(seen[1] - seen[0]).mean() < 3
    assert np.abs(seen[2] - seen[0]).mean() > 2 * np.abs(seen[1] - seen[0]).mean()
    means = [picture.mean() for picture in seen]
    assert np.ptp(means) / np.mean(means) < 0.05
    assert (seen[0].max(axis=(0, 1)) / seen[0].min(axis=(0, 1))).min() > 1.2
    blue, green, red = seen[0].mean(axis=(0, 1))
    assert red < blue
    assert red < green
