"""Scenes of `nguyen2002`: clips of the film, and lights."""

from collections import Counter
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.datasets.synthetic.scenes import (
    SEEDS,
    grown,
    mask_edges,
    runs,
    scenes_of,
    slow_if_unchanged,
)
from trackmark.datasets.synthetic.nguyen2002.film.objects import OCCLUDERS
from trackmark.datasets.synthetic.nguyen2002.film.scene import (
    CLIPS,
    SIZE,
    WIDTHS,
    FilmScene,
    clip_plan,
    clip_script,
)
from trackmark.datasets.synthetic.nguyen2002.film.setting import SETTINGS
from trackmark.datasets.synthetic.nguyen2002.film.targets import KINDS
from trackmark.datasets.synthetic.nguyen2002.lights import (
    HALF_HEIGHT,
    Lighting,
    LightsScene,
    LightsSetting,
    _pose,
    occluder_objects,
)
from trackmark.datasets.synthetic.nguyen2002.lights import OCCLUDERS as LIGHTS_OCCLUDERS
from trackmark.datasets.synthetic.parameters import SceneParameters
from trackmark.datasets.synthetic.render.finish import SceneObject, render_surfaces
from trackmark.datasets.synthetic.render.solids import NOTHING

pytestmark = slow_if_unchanged("nguyen2002/clip-01", "nguyen2002/lights")


NUMBERS = st.integers(1, CLIPS)


@lru_cache(maxsize=32)
def open_clip(seed, clip):
    return FilmScene(SceneParameters(scene=seed), clip)


@settings(max_examples=30, deadline=None)
@given(seed=SEEDS)
def test_film_script_has_the_papers_statistics(seed):
    shots = clip_script(seed)
    assert len(shots) == 20
    assert Counter(shot.occlusions for shot in shots) == {0: 5, 1: 10, 2: 4, 3: 1}
    assert sum(shot.occlusions for shot in shots) == 21
    assert np.mean([shot.frames for shot in shots]) == 150
    assert {shot.frames for shot in shots} <= set(range(110, 191))
    assert len({shot.frames for shot in shots}) > 10
    assert sum(shot.partial for shot in shots) == 8

    assert {shot.setting for shot in shots} == set(SETTINGS)
    assert 7 <= sum(KINDS[shot.target].round for shot in shots) <= 13
    assert len({shot.target for shot in shots}) >= 7
    assert all(shot.target in SETTINGS[shot.setting].targets for shot in shots)


@pytest.mark.parametrize("seed", [0, pytest.param(7, marks=pytest.mark.slow)])
def test_film_occlusions_are_complete_and_end(seed):
    lengths, partial, hidden_frames = [], 0, []
    for clip, shot in enumerate(clip_script(seed), 1):
        truth = open_clip(seed, clip).truth()
        seen = truth.visibility
        stretches = runs(seen < 0.9)
        hidden_frames.append(runs(seen <= 0.02))
        least = [seen[start:stop].min() for start, stop in stretches]
        complete = [low <= 0.02 for low in least]
        assert sum(complete) == shot.occlusions
        assert all(low <= 0.02 or low >= 0.5 for low in least)
        assert (seen[:10] == 1).all()
        assert (seen[-10:] == 1).all()
        hidden = runs(truth.attributes["occluded"] | truth.attributes["partly occluded"])
        passages = [seen[start:stop].min() <= 0.02 for start, stop in hidden]
        assert (passages.count(True), passages.count(False)) == (shot.occlusions, shot.partial)
        lengths += [
            stop - start for (start, stop), whole in zip(stretches, complete, strict=True) if whole
        ]
        partial += len(complete) - sum(complete)
    assert len(lengths) == 21
    assert 4 <= partial <= 8
    assert min(lengths) >= 9
    assert max(lengths) < 75
    complete = [stop - start for intervals in hidden_frames for start, stop in intervals]
    assert 10 <= np.median(complete) <= 30


@settings(max_examples=20, deadline=None)
@given(seed=SEEDS, clip=NUMBERS)
def test_film_target_stays_in_view_and_moves_smoothly(seed, clip):
    clip = clip_plan(seed, clip)
    boxes = clip.boxes
    assert (boxes[:, :2] > 2).all()
    assert (boxes[:, :2] + boxes[:, 2:] < np.array(SIZE) - 2).all()
    assert 50 <= clip.size[0] <= 70
    assert 60 <= clip.size[1] <= 85
    assert np.hypot(*np.diff(clip.centre, axis=0).T).max() < 5
    assert np.ptp(boxes[:, 2] / boxes[:, 3]) < 1e-9
    assert 0.86 <= clip.scale.min() < clip.scale.max() <= 1.16
    assert 0.5 < np.degrees(np.abs(clip.angle).max()) <= 3.5
    assert 0.89 < clip.gain.min() < clip.gain.max() < 1.11
    assert np.abs(np.diff(clip.gain)).max() < 0.02
    assert np.ptp(clip.mixture) == pytest.approx(1)


@settings(max_examples=20, deadline=None)
@given(seed=SEEDS, clip=NUMBERS)
def test_static_occluders_pass_faster_than_the_background(seed, clip):
    clip = clip_plan(seed, clip)
    assert len(clip.passages) == clip.shot.occlusions + clip.shot.partial
    for passage in clip.passages:
        step = np.diff(passage.path[:, 0]).mean()
        assert 3.5 < abs(step) < 13
        if OCCLUDERS[passage.kind].fixed:
            background = -45 * np.diff(clip.travel).mean()
            assert step * background > 0
            assert abs(step) > 0.95 * abs(background)
        if passage.kind in SETTINGS[clip.shot.setting].occluders:
            middle = np.abs(passage.path[:, 0] - clip.centre[:, 0]).argmin()
            share = passage.size[0] / clip.boxes[middle, 2]
            assert WIDTHS[0] * 0.9 < share < WIDTHS[1] * 1.1


@pytest.mark.parametrize(("seed", "clip"), [(0, 4), (1, 5)])
def test_film_boxes_and_visibility_agree_with_masks(seed, clip):
    film = open_clip(seed, clip)
    truth = film.truth()
    for frame in range(0, len(film), 7):
        whole, _ = film.seen(frame)
        x, y, width, height = truth.boxes[frame]
        assert mask_edges(whole >= 128) == pytest.approx(
            [x, y, x + width, y + height], abs=3.5
        )  # rotation of the target
        share = film.mask(frame).sum() / (whole >= 128).sum()
        assert truth.visibility[frame] == pytest.approx(share, abs=0.02)
    occluded, partly = (truth.attributes[name] for name in ("occluded", "partly occluded"))
    assert (occluded == (truth.visibility < 0.5)).all()
    assert not (occluded & partly).any()
    assert (truth.visibility[~occluded & ~partly] >= 0.99).all()


LIGHT_FRAMES = 300
open_lights, image = scenes_of("nguyen2002/lights")

LONGEST = 35
"""Number of frames in which the paper's tracker searches for the end of an occlusion."""


def around_the_switch(seed):
    """Return the last image with both lamps, the first with one lamp, and the static pixels."""
    scene = open_lights(seed)
    off = scene.plan.off
    before, after = image(seed, off - 1), image(seed, off)
    still = np.ones(before.shape[:2], bool)
    for frame in (off - 1, off):
        coverage = scene.setting.held_card.place(_pose(scene.plan, frame))[0][..., 3]
        still &= ~grown(coverage > 0, 12)
    return before, after, still


LIGHT_SEEDS = [0, pytest.param(1, marks=pytest.mark.slow)]


@pytest.mark.parametrize("seed", LIGHT_SEEDS)
def test_lights_occlusions_are_complete_and_far_from_switching(seed):
    truth = open_lights(seed).truth()
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
    assert on + 10 < third < third + LONGEST < LIGHT_FRAMES


@pytest.mark.parametrize("seed", LIGHT_SEEDS)
def test_lights_object_moves_and_stays_in_view(seed):
    x, y, width, height = open_lights(seed).truth().boxes.T
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
    scene = open_lights(0)
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
def test_lights_mask_marks_the_pixels_of_the_print():
    other = LightsScene(SceneParameters())
    other.setting = LightsSetting(0)
    thing, *rest = other.setting._things
    inverse = replace(thing.finish, pattern=lambda points: 1 - thing.finish.pattern(points))
    other.setting.__dict__["_things"] = [SceneObject(inverse, thing.solids), *rest]
    for part in ("room", "occluders"):  # unchanged, slow to create
        other.setting.__dict__[part] = getattr(open_lights(0).setting, part)
    other.lighting = Lighting(other.setting, open_lights(0).lighting._lamps)
    other.lighting.__dict__["_reflected_light"] = open_lights(0).lighting._reflected_light
    start, _ = runs(open_lights(0).truth().attributes["occluded"])[0]
    images = {frame: image(0, frame) for frame in (0, start - 2)}
    for frame, original in images.items():
        changed = np.abs(other.render(frame) - original).max(axis=2) > 20
        mask = open_lights(0).mask(frame)
        near = grown(mask, 2)
        assert changed[mask].mean() > 0.93
        assert changed[~near].mean() < 1e-3


@pytest.mark.parametrize("kind", LIGHTS_OCCLUDERS)
def test_occluders_of_lights_have_no_holes(kind):
    for seed in range(3):
        objects = occluder_objects(kind, np.random.default_rng(seed))
        size = (-34, -HALF_HEIGHT), (68, 2 * HALF_HEIGHT)
        assert (render_surfaces(objects, *size, 1).owners != NOTHING).all()


def test_lamp_off_reduces_brightness_at_once_and_unevenly():
    before, after, still = around_the_switch(0)
    assert 0.3 < after.mean() / before.mean() < 0.5
    on = open_lights(0).plan.on
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
