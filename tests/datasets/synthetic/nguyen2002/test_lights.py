"""`nguyen2002/lights`: ground truth, occluders, lamps and cards."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from tests.datasets.synthetic.scenes import grown, runs, scenes_of
from trackmark.datasets.synthetic.nguyen2002.lights.objects import HALF_HEIGHT, occluder_objects
from trackmark.datasets.synthetic.nguyen2002.lights.scene import (
    OCCLUDERS,
    CardPose,
    FlatCard,
    Lighting,
    LightsScene,
    LightsSetting,
    _lighting,
    _pose,
    _visible_occluders,
)
from trackmark.datasets.synthetic.render.finish import SceneObject, render_surfaces
from trackmark.datasets.synthetic.render.solids import NOTHING

FRAMES = 300
opened, image = scenes_of("nguyen2002/lights")

LONGEST = 35
"""Frames within which the paper's tracker searches for the end of an occlusion."""


def around_the_switch(seed):
    """Return the last frame with both lamps, the first with one, and the static pixels."""
    scene = opened(seed)
    off = scene.plan.off
    before, after = image(seed, off - 1), image(seed, off)
    still = np.ones(before.shape[:2], bool)
    for frame in (off - 1, off):
        coverage = scene.setting.held_card.place(_pose(scene.plan, frame))[0][..., 3]
        still &= ~grown(coverage > 0, 12)
    return before, after, still


SEEDS = [0, pytest.param(1, marks=pytest.mark.slow)]


@pytest.mark.parametrize("seed", SEEDS)
def test_three_complete_occlusions_apart_from_lamp_changes(seed):
    truth = opened(seed).truth()
    hidden = runs(truth.attributes["occluded"])
    ((off, on),) = runs(truth.attributes["lamp off"])
    assert len(hidden) == 3
    for start, end in hidden:
        assert (truth.visibility[start:end] <= 0.02).sum() >= 3
        assert 8 < end - start < LONGEST
    # The tracker's search for the end of an occlusion meets no change of light.
    first, second, third = hidden[:, 0]
    assert 35 < first < first + LONGEST < off
    assert off + 25 < second < second + LONGEST < on
    assert on + 10 < third < third + LONGEST < FRAMES


@pytest.mark.parametrize("seed", SEEDS)
def test_lights_object_moves_and_stays_in_view(seed):
    x, y, width, height = opened(seed).truth().boxes.T
    assert min(x.min(), y.min()) > 10
    assert (x + width).max() < 310
    assert (y + height).max() < 210
    assert 48 < width.min() < 1.1 * width.min() < width.max() < 72
    assert 62 < height.min() < height.max() < 94
    assert np.ptp(width / height) < 1e-9
    steps = np.hypot(*np.diff(np.stack([x + width / 2, y + height / 2]), axis=1))
    assert 0.8 < steps.mean() < 1.8
    assert steps.max() < 2.2


def test_lights_visibility_agrees_with_masks():
    scene = opened(0)
    truth = scene.truth()
    start, end = runs(truth.attributes["occluded"])[0]
    for frame in range(start - 8, end + 9, 4):
        whole = scene.setting.silhouette.place(_pose(scene.plan, frame))[0][..., 3].sum()
        assert scene.mask(frame).sum() / whole == pytest.approx(truth.visibility[frame], abs=0.025)
    partly, hidden = truth.attributes["partly occluded"], truth.attributes["occluded"]
    assert (hidden == (truth.visibility < 0.5)).all()
    assert (partly == ((truth.visibility >= 0.5) & (truth.visibility < 0.9))).all()
    assert partly.sum() > 6
    assert truth.visibility.max() < 1  # a thumb


@pytest.mark.slow
def test_lights_mask_marks_the_pixels_of_the_print(monkeypatch):
    other = LightsScene(0)
    other.setting = LightsSetting(0)
    thing, *rest = other.setting._things
    inverse = replace(thing.finish, pattern=lambda points: 1 - thing.finish.pattern(points))
    other.setting.__dict__["_things"] = [SceneObject(inverse, thing.solids), *rest]
    for part in ("room", "occluders"):  # they stay, and take long
        other.setting.__dict__[part] = getattr(opened(0).setting, part)
    lighting = Lighting(other.setting, _lighting(0)._lamps)
    lighting.__dict__["_reflected_light"] = _lighting(0)._reflected_light
    start, _ = runs(opened(0).truth().attributes["occluded"])[0]
    images = {frame: image(0, frame) for frame in (0, start - 2)}
    monkeypatch.setattr(sys.modules[LightsScene.__module__], "_lighting", lambda seed: lighting)
    for frame, original in images.items():
        changed = np.abs(other.render(frame) - original).max(axis=2) > 20
        mask = opened(0).mask(frame)
        near = grown(mask, 2)
        assert changed[mask].mean() > 0.93
        assert changed[~near].mean() < 1e-3


@pytest.mark.parametrize("kind", OCCLUDERS)
def test_occluders_have_no_holes(kind):
    for seed in range(3):
        things = occluder_objects(kind, np.random.default_rng(seed))
        seen = render_surfaces(things, (-34, -HALF_HEIGHT), (68, 2 * HALF_HEIGHT), 1)
        assert (seen.owners != NOTHING).all()


def test_lamp_off_reduces_brightness_at_once_and_unevenly():
    before, after, still = around_the_switch(0)
    assert 0.3 < after.mean() / before.mean() < 0.5
    on = opened(0).plan.on
    assert image(0, on).mean() / image(0, on - 1).mean() > 2
    assert np.abs(image(0, on + 1) - image(0, on)).mean() < 5  # nothing lingers
    ratio = np.where(still, after.sum(axis=2) / before.sum(axis=2), np.nan)
    sides = [np.nanmedian(part) for part in (ratio[:, :60], ratio[:, -60:])]
    assert max(sides) / min(sides) > 1.15


def test_lamp_off_keeps_channel_ratios():
    before, after, still = around_the_switch(0)
    bright = still & (after.min(axis=2) > 30) & (before.max(axis=2) < 250)
    assert bright.sum() > 10_000
    ratios = np.log(after[bright] / before[bright])
    shift = np.median(np.abs(ratios[:, [0, 2]] - ratios[:, [1]]), axis=0).max()
    assert shift < 0.06


@pytest.mark.parametrize("lamp", [0, 1])
def test_held_object_casts_a_shadow_from_each_lamp(lamp):
    scene = opened(0)
    lighting = _lighting(0)
    pose = _pose(scene.plan, 0)
    away = CardPose((-2000.0, 0.0))
    shaded, free = (lighting.picture([lamp], p, np.zeros(2), []) for p in (pose, away))
    beside = scene.setting.held_card.place(pose)[0][..., 3] == 0
    lost = np.where(beside, 1 - shaded.sum(axis=2) / free.sum(axis=2), 0)
    assert lost.min() > -1e-5
    assert (lost > 0.3).sum() > 300
    middle = (lost * np.arange(320)).sum() / lost.sum()
    assert np.sign(middle - pose._place[0]) == np.sign(
        pose._place[0] - lighting._lamps[lamp].place[0]
    )


def test_occluder_shades_the_object_before_hiding_it():
    scene = opened(0)
    lighting, plan = _lighting(0), scene.plan
    start, _ = runs(scene.truth().visibility < 0.9)[0]
    losses = []
    for frame in (start - 40, start - 2):
        pose = _pose(plan, frame)
        passage = [(number, pose_of, 1) for number, pose_of in _visible_occluders(plan, frame)]
        shaded, free = (
            lighting.picture([0, 1], pose, np.zeros(2), occluders) for occluders in (passage, [])
        )
        mask = scene.mask(frame)
        losses.append(1 - shaded[mask].sum() / free[mask].sum())
    assert losses[0] < 0.005
    assert losses[1] > 0.01


POSES = [
    CardPose((100.0, 80.0)),
    CardPose((121.4, 77.3), 1.1, 0.02),
    CardPose((60.0, 140.25), 0.9, -0.3),
]


@pytest.fixture
def card():
    """Return 40 x 60 pixels in three samples each, anchored in the centre."""
    sheet = np.ones((180, 120, 4), np.float32)
    return FlatCard([sheet, sheet], (20.0, 30.0), 3)


@pytest.mark.parametrize("pose", POSES)
def test_card_covers_its_area_around_its_anchor(card, pose):
    coverage = card.place(pose)[0][..., 3].astype(float)
    rows, columns = np.indices(coverage.shape) + 0.5
    middle = np.array([(coverage * axis).sum() for axis in (columns, rows)]) / coverage.sum()
    assert middle == pytest.approx(pose._place, abs=0.02)
    assert coverage.sum() == pytest.approx(2400 * pose._scale**2, rel=0.02)


def test_card_tilts_to_the_right():
    corner = CardPose((0.0, 0.0), 1.0, 0.1).onto_picture(np.array([[0.0, -30.0]]))[0]
    assert corner == pytest.approx([30 * np.sin(0.1), -30 * np.cos(0.1)])


@pytest.mark.parametrize("pose", POSES)
def test_card_pose_maps_points_to_image_and_back(pose):
    anchor = np.array([20.0, 30.0])
    point = np.array([[3.0, -7.0]])
    to_card = pose.onto_card(anchor, 3)
    sample = to_card[:, :2] @ pose.onto_picture(point)[0] + to_card[:, 2]
    assert sample == pytest.approx(3 * (anchor + point[0]) - 0.5)


def test_shadow_mask_is_the_softened_coverage(card):
    pose = POSES[1]
    rows, columns = np.indices((240, 320)) + 0.5
    points = np.stack([columns, rows], axis=2).astype(np.float32)
    sharp, soft = card.shade().sample(pose, points), card.shade(4.0).sample(pose, points)
    assert np.abs(sharp - card.place(pose)[0][..., 3]).mean() < 0.001
    assert soft.sum() == pytest.approx(sharp.sum(), rel=0.01)
    edge = points[80, 148]  # about its right edge
    assert edge[0] - pose._place[0] == pytest.approx(22, abs=6)
    assert np.abs(np.diff(soft[80])).max() < 0.15 < np.abs(np.diff(sharp[80])).max()
