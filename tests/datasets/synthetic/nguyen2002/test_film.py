"""`nguyen2002/clip-01` to `clip-20`: script, ground truth and images."""

from collections import Counter
from functools import lru_cache

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.datasets.synthetic.scenes import SEEDS, mask_edges, runs
from trackmark.datasets.synthetic.nguyen2002.film.objects import OCCLUDERS
from trackmark.datasets.synthetic.nguyen2002.film.scene import (
    CLIPS,
    SIZE,
    WIDTHS,
    clip_plan,
    clip_script,
    scene,
)
from trackmark.datasets.synthetic.nguyen2002.film.setting import SETTINGS
from trackmark.datasets.synthetic.nguyen2002.film.sheet import RigidObject
from trackmark.datasets.synthetic.nguyen2002.film.targets import KINDS
from trackmark.datasets.synthetic.nguyen2002.parameters import FilmParameters

NUMBERS = st.integers(1, CLIPS)


@lru_cache(maxsize=32)
def opened(seed, clip):
    return scene(FilmParameters(scene=seed), clip)


def first_clip(seed, wanted):
    return next(clip for clip, shot in enumerate(clip_script(seed), 1) if wanted(shot))


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
        truth = opened(seed, clip).truth()
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
    film = opened(seed, clip)
    truth = film.truth()
    for frame in range(0, len(film), 7):
        whole, _ = film.seen(frame)
        x, y, width, height = truth.boxes[frame]
        assert mask_edges(whole >= 128) == pytest.approx(
            [x, y, x + width, y + height], abs=3.5
        )  # it turns
        share = film.mask(frame).sum() / (whole >= 128).sum()
        assert truth.visibility[frame] == pytest.approx(share, abs=0.02)
    occluded, partly = (truth.attributes[name] for name in ("occluded", "partly occluded"))
    assert (occluded == (truth.visibility < 0.5)).all()
    assert not (occluded & partly).any()
    assert (truth.visibility[~occluded & ~partly] >= 0.99).all()


def test_film_box_ignores_target_rotation():
    film = opened(0, first_clip(0, lambda shot: not KINDS[shot.target].round))
    sides = film.truth().boxes[:, 2:] / film.plan.scale[:, None]
    assert np.ptp(sides, axis=0) == pytest.approx([0, 0], abs=1e-9)


def test_film_background_has_parallax():
    film = opened(0, first_clip(0, lambda shot: shot.setting == "street"))
    speed = -45 * np.gradient(film.plan.travel)
    frame = int(np.abs(speed).argmax())
    first, second = (film.render(k).mean(axis=2)[:, :320] for k in (frame, frame + 1))
    shifts = [
        cv2.phaseCorrelate(first[rows], second[rows])[0][0]
        for rows in (slice(2, 60), slice(205, 240))
    ]
    assert np.sign(shifts[1]) == np.sign(speed[frame])
    assert abs(shifts[1]) > 1.8 * abs(shifts[0])


@pytest.mark.parametrize("clip", [2, pytest.param(9, marks=pytest.mark.slow)])
def test_film_light_changes_weakly_and_slowly(clip):
    film = opened(5, clip)
    plain = [k for k in range(len(film)) if film.truth().visibility[k] == 1]
    tone = np.array([film.render(k)[film.mask(k)].mean() for k in plain[::4]])
    steady = np.diff(plain[::4]) == 4
    assert np.abs(np.diff(tone) / tone[1:])[steady].max() < 0.15
    assert tone.min() / tone.max() > 0.6


def test_film_has_luminance_and_colour_grain():
    film = opened(2, first_clip(2, lambda shot: shot.occlusions == 0 and not shot.partial))
    still = np.stack([film._develop(np.full((240, 320, 3), 128, np.uint8), k) for k in range(12)])
    noise = (still - still.mean(axis=0)).reshape(-1, 3)
    assert 2 < noise.std(axis=0).min() < noise.std(axis=0).max() < 6
    assert 0.1 < np.corrcoef(noise.T)[np.triu_indices(3, 1)].min() < 0.6


def test_rigid_object_draw_agrees_with_slow_reference():
    random = np.random.default_rng(4)
    coverage = np.pad(random.uniform(0.2, 1, (9, 7)), 1)
    textures = [random.uniform(0, 255, (11, 9, 3)) for _ in "ab"]
    thing = RigidObject(textures, coverage, 1.25)
    canvas = random.integers(0, 256, (24, 30, 3)).astype(np.uint8)
    places, scale, angle, share = np.array([[12.3, 9.8], [14.1, 10.6]]), 1.1, 0.05, 0.25
    expected = canvas.astype(float)
    colour, cover = np.zeros((24, 30, 3)), np.zeros((24, 30))
    mixed = ((1 - share) * textures[0] + share * textures[1]) * coverage[..., None]
    cosine, sine = np.cos(angle), np.sin(angle)
    for x0, y0 in places:
        for row in range(24):
            for column in range(30):
                right, down = column + 0.5 - x0, row + 0.5 - y0
                u = (cosine * right + sine * down) * 1.25 / scale + 9 / 2 - 0.5
                v = (-sine * right + cosine * down) * 1.25 / scale + 11 / 2 - 0.5
                j, i = int(np.floor(u)), int(np.floor(v))
                for y, x in ((i, j), (i, j + 1), (i + 1, j), (i + 1, j + 1)):
                    if 0 <= y < 11 and 0 <= x < 9:
                        weight = (1 - abs(v - y)) * (1 - abs(u - x)) / len(places)
                        colour[row, column] += weight * mixed[y, x]
                        cover[row, column] += weight * coverage[y, x]
    expected = expected * (1 - cover[..., None]) + colour
    thing.draw(canvas, places, scale, angle, share)
    assert np.abs(canvas - expected).max() < 4


def test_rigid_object_is_clipped_to_the_canvas():
    thing = RigidObject([np.full((8, 8, 3), 255.0)], np.ones((8, 8)), 1.0)
    canvas = np.zeros((20, 20, 3), np.uint8)
    for place in ([-30.0, 5.0], [50.0, 5.0], [5.0, -30.0], [5.0, 50.0]):
        thing.draw(canvas, np.array([place]), 1.0, 0.1)
    assert not canvas.any()
    thing.draw(canvas, np.array([[0.0, 0.0]]), 1.0, 0.0)
    assert canvas[:4, :4].all()
    assert not canvas[5:].any()
