"""Measures of runs with known region similarities, and measures of a simple scene."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.bench.papers import measured_runs
from trackmark import datasets
from trackmark.bench.papers.moreno2005.measures import JUMP
from trackmark.bench.papers.moreno2005.scenes import contrast, edge_gain, posterior_map, started

value = measured_runs.values_of("moreno2005")

N = 40
SCENE = "plain/target:length=11"


def measured(dips=(), jump=(), failure=""):
    """Return a run with J of 0.9, and 0.4 in some frames."""
    values = np.full(N, 0.9)
    values[0] = np.nan
    values[list(dips)] = 0.4
    attributes = {JUMP: np.isin(np.arange(N), list(jump))}
    run = {"segmentation": SimpleNamespace(region_similarity=values), "failure": failure}
    boxes = np.ones((N, 4))
    return measured_runs.measured("moreno2005", boxes, boxes, run=run, attributes=attributes)


def test_kept_depends_on_the_similarity():
    assert value("kept_to_end", measured()) == 1
    assert value("kept_to_end", measured(range(5, 9))) == 1
    assert value("kept_to_end", measured(range(5, 10))) == 0
    assert value("not_kept", measured([N - 1])) == 1
    assert value("mean_similarity", measured(range(1, N))) == pytest.approx(0.4)
    assert value("kept_to_end", measured(failure="frame 1: no")) == 0


@pytest.mark.parametrize(("dips", "lost"), [([10], 1), ([9, 11], 0), (range(3, 30), 1)])
def test_tenth_frame_from_the_jump_decides(dips, lost):
    assert value("lost_after_jump", measured(dips, jump=[1])) == lost


@pytest.fixture(scope="module")
def scene():
    return datasets.load(SCENE)


def test_contrast_is_the_distance_of_mean_colours():
    image = np.full((60, 60, 3), 0, np.uint8)
    mask = np.zeros((60, 60), bool)
    mask[20:40, 20:40] = True
    image[mask] = (255, 0, 0)
    assert contrast(image, mask) == pytest.approx(1.0)


def test_posterior_map_shows_the_target(scene):
    before, mask = scene.mask(0), scene.mask(1)
    posterior = posterior_map(scene[0], before, scene[1], np.random.default_rng(0))
    assert posterior[mask].mean() > posterior[~mask].mean() + 0.4


def test_starts_lie_near_the_contour():
    contour = np.array([[20.0, 20.0], [40.0, 20.0], [40.0, 40.0], [20.0, 40.0]])
    generator = np.random.default_rng(0)
    starts = np.array([started(contour, generator) for _ in range(400)])
    np.testing.assert_allclose(starts.mean(axis=0), contour, atol=0.4)
    assert 1.5 < (starts - contour).std() < 2.5


def test_edge_gain_is_a_difference_of_accuracies():
    assert -1 < edge_gain(SCENE) < 1
