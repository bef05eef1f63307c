"""Scenes of `nguyen2002`: clips of the film, and lights."""

from collections import Counter
from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given, settings

from tests.datasets.synthetic.scenes import SEEDS, mask_edges, runs, scenes_of, slow_if_unchanged
from trackmark.datasets.synthetic.nguyen2002.film.scene import FilmScene, clip_script
from trackmark.datasets.synthetic.nguyen2002.film.setting import SETTINGS
from trackmark.datasets.synthetic.nguyen2002.film.targets import KINDS
from trackmark.datasets.synthetic.nguyen2002.lights import _pose
from trackmark.datasets.synthetic.parameters import SceneParameters

pytestmark = slow_if_unchanged("nguyen2002/clip-01", "nguyen2002/lights")


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
open_lights, _ = scenes_of("nguyen2002/lights")

LONGEST = 35
"""Number of frames in which the paper's tracker searches for the end of an occlusion."""


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
