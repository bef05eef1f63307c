"""Measures of runs with known region similarities, and measures of a simple scene."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.bench.papers import measured_runs
from trackmark import datasets
from trackmark.bench.papers.moreno2005.measures import JUMP
from trackmark.bench.papers.moreno2005.scenes import edge_gain

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


def test_edge_gain_is_a_difference_of_accuracies():
    assert -1 < edge_gain(SCENE) < 1
