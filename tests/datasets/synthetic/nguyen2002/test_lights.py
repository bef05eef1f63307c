"""`nguyen2002/lights`: ground truth, occluders, lamps and cards."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from tests.datasets.synthetic.scenes import grown, runs, scenes_of
from trackmark.datasets.synthetic.nguyen2002.lights.scene import (
    Lighting,
    LightsScene,
    LightsSetting,
    _lighting,
    _pose,
)
from trackmark.datasets.synthetic.render.finish import SceneObject

FRAMES = 300
opened, image = scenes_of("nguyen2002/lights")

LONGEST = 35
"""Number of frames in which the paper's tracker searches for the end of an occlusion."""


def around_the_switch(seed):
    """Return the last image with both lamps, the first with one lamp, and the static pixels."""
    scene = opened(seed)
    off = scene.plan.off
    before, after = image(seed, off - 1), image(seed, off)
    still = np.ones(before.shape[:2], bool)
    for frame in (off - 1, off):
        coverage = scene.setting.carried.place(_pose(scene.plan, frame))[0][..., 3]
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
    # The light does not change while the tracker searches for the end of an occlusion.
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
    assert truth.visibility.max() < 1  # a thumb occludes a part


@pytest.mark.slow
def test_lights_mask_marks_the_pixels_of_the_print(monkeypatch):
    other = LightsScene(0)
    other.setting = LightsSetting(0)
    thing, *rest = other.setting._things
    inverse = replace(thing.finish, pattern=lambda points: 1 - thing.finish.pattern(points))
    other.setting.__dict__["_things"] = [SceneObject(inverse, thing.solids), *rest]
    for part in ("room", "passers"):  # unchanged, slow to create
        other.setting.__dict__[part] = getattr(opened(0).setting, part)
    lighting = Lighting(other.setting, _lighting(0)._lamps)
    lighting.__dict__["_returned"] = _lighting(0)._returned
    start, _ = runs(opened(0).truth().attributes["occluded"])[0]
    images = {frame: image(0, frame) for frame in (0, start - 2)}
    monkeypatch.setattr(sys.modules[LightsScene.__module__], "_lighting", lambda seed: lighting)
    for frame, original in images.items():
        changed = np.abs(other.render(frame) - original).max(axis=2) > 20
        mask = opened(0).mask(frame)
        near = grown(mask, 2)
        assert changed[mask].mean() > 0.93
        assert changed[~near].mean() < 1e-3


def test_lamp_off_reduces_brightness_at_once_and_unevenly():
    before, after, still = around_the_switch(0)
    assert 0.3 < after.mean() / before.mean() < 0.5
    on = opened(0).plan.on
    assert image(0, on).mean() / image(0, on - 1).mean() > 2
    assert np.abs(image(0, on + 1) - image(0, on)).mean() < 5  # no afterglow
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
