"""Figures of the tracker on a short scene, and their colour models."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from skimage import measure

from trackmark import datasets
from trackmark.bench.papers.moreno2005 import figures, stages
from trackmark.bench.papers.moreno2005.colour_plots import (
    colour_model_plot,
)
from trackmark.trackers.contours.posterior import posterior

SCENE = "plain/target:length=11"
STEPS = 3


@pytest.fixture(scope="module")
def step():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stages, "STEPS", STEPS)
        return stages.step_of("moreno2005", SCENE)


@pytest.mark.slow
def test_estimate_is_made_of_the_hypotheses(step):
    contours = step.contours
    mean = np.average(contours.states, axis=0, weights=contours.weights)
    np.testing.assert_allclose(mean, step.estimate.arrays["mean_contour"])
    supported = pd.Series(contours.weights).groupby(contours.attached).sum().idxmax()
    np.testing.assert_array_equal(step.posterior(supported), step.estimate.arrays["posterior"])


def test_colour_model_has_the_posterior_of_each_colour():
    model = stages.model_of(datasets.load(SCENE))
    colour_model_plot(model, "T").draw_without_rendering()
    x, y = model.grid
    expected = posterior(np.array([[x[40], y[90]]]), *model.mixtures.values())
    assert model.on_plane[90, 40] == pytest.approx(expected[0])


def test_target_in_two_parts_has_two_outlines():
    mask = np.zeros((60, 80), bool)
    mask[10:30, 10:30] = mask[40:50, 50:75] = True
    contour = stages.true_contour(SimpleNamespace(mask=lambda frame: mask), 0)
    gaps = np.flatnonzero(np.isnan(contour[:, 0]))
    assert len(gaps) == 2
    pieces = contour[: gaps[0]], contour[gaps[0] + 1 : gaps[1]]
    both = [measure.grid_points_in_poly((60, 80), piece[:, ::-1] - 0.5) for piece in pieces]
    assert np.mean((both[0] | both[1]) == mask) > 0.99
    unseen = SimpleNamespace(mask=lambda frame: None)
    assert stages.true_contour(unseen, 0).shape == (0, 2)


def test_hooks_draw_figures(step, monkeypatch):
    monkeypatch.setattr(figures, "NUMBERS", (50, 100))
    monkeypatch.setattr(figures, "REPETITIONS", 3)
    assert next(iter(stages.palettes_of(step))).startswith("greatest weight")
    assert isinstance(stages.hypotheses_figure(step, "recommended"), Figure)
    assert isinstance(stages.snake_figure(step, "recommended"), Figure)
    assert len(figures.density_figure(None).axes) == 2 * 3
    (axes,) = figures.error_figure(None).axes
    expected = np.mean([figures.errors(run, 50)["observation"] for run in range(3)])
    np.testing.assert_allclose(axes.lines[0].get_xydata()[0], [50, expected])
