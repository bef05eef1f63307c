"""Figures show what the tracker found on a short scene."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from skimage import measure

from trackmark import datasets
from trackmark.bench.evaluation.loop import evaluate
from trackmark.bench.papers.moreno2005 import figures, stages
from trackmark.trackers.contours.posterior import posterior

SCENE = "plain/target:length=11"
STEPS = 3


@pytest.fixture(scope="module")
def step():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stages, "STEPS", STEPS)
        return stages.step_of("moreno2005", SCENE)


def test_step_is_that_of_a_run(step):
    run = evaluate("moreno2005", datasets.load(SCENE), keep_arrays=True)
    for name, values in step.estimate.arrays.items():
        np.testing.assert_array_equal(values, run.arrays[STEPS][name])


def test_estimate_is_made_of_the_hypotheses(step):
    contours = step.contours
    mean = np.average(contours.states, axis=0, weights=contours.weights)
    np.testing.assert_allclose(mean, step.estimate.arrays["mean_contour"])
    supported = pd.Series(contours.weights).groupby(contours.attached).sum().idxmax()
    np.testing.assert_array_equal(step.posterior(supported), step.estimate.arrays["posterior"])


def test_posterior_of_a_pixel_is_that_of_its_colour_on_the_plane():
    model = stages.model_of(datasets.load(SCENE))
    x, y = model.grid
    expected = posterior(np.array([[x[40], y[90]]]), *model.mixtures.values(), floor=0.0)
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
    for row, densities in zip(
        np.reshape(figures.density_figure(None).axes, (2, 3)), figures.iteration(), strict=True
    ):
        curves = densities.first, densities.second
        for axes, grid, density in zip(row[:2], figures.GRIDS, curves, strict=True):
            np.testing.assert_array_equal(axes.lines[0].get_xydata().T, [grid, density])
        marks = [line.get_xydata()[0].tolist() for line in row[2].lines]
        assert marks == [list(pair) for pair in densities.marks.values()]
    (axes,) = figures.error_figure(None).axes
    expected = np.mean([figures.errors(run, 50)["observation"] for run in range(3)])
    np.testing.assert_allclose(axes.lines[0].get_xydata()[0], [50, expected])


@pytest.mark.slow
def test_strip_has_a_row_of_contours_and_maps_per_setting():
    texts = {"full, as-written": "moreno2005:preset=as-written", "full, recommended": "moreno2005"}
    double = figures._strip(7, SCENE, texts)
    single = figures._strip(7, SCENE, {"full, recommended": "moreno2005"})
    assert double.shape[1] == single.shape[1]
    assert double.shape[0] == pytest.approx(2 * single.shape[0], abs=4)
