"""`nguyen2002/clip-01` to `clip-20`: script, ground truth and images."""

from collections import Counter
from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.datasets.synthetic.scenes import SEEDS, mask_edges, runs
from trackmark.datasets.synthetic.nguyen2002.film.occluders import OCCLUDERS
from trackmark.datasets.synthetic.nguyen2002.film.plan import (
    CLIPS,
    SIZE,
    WIDTHS,
    clip_plan,
    clip_script,
)
from trackmark.datasets.synthetic.nguyen2002.film.scene import scene
from trackmark.datasets.synthetic.nguyen2002.film.setting import SETTINGS
from trackmark.datasets.synthetic.nguyen2002.film.targets import KINDS
from trackmark.datasets.synthetic.nguyen2002.knobs import FilmKnobs

NUMBERS = st.integers(1, CLIPS)


@lru_cache(maxsize=32)
def opened(seed, clip):
    return scene(FilmKnobs(scene=seed), clip)


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
    assert np.ptp(clip.look) == pytest.approx(1)


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
        )  # rotation of the target
        share = film.mask(frame).sum() / (whole >= 128).sum()
        assert truth.visibility[frame] == pytest.approx(share, abs=0.02)
    occluded, partly = (truth.attributes[name] for name in ("occluded", "partly occluded"))
    assert (occluded == (truth.visibility < 0.5)).all()
    assert not (occluded & partly).any()
    assert (truth.visibility[~occluded & ~partly] >= 0.99).all()
