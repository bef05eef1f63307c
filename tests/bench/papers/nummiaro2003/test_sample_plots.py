"""Plots of samples, trajectories and appearance counts."""

import numpy as np

from trackmark.bench.papers.nummiaro2003.sample_plots import (
    Track,
    appearance_plot,
    surface_plot,
    trajectory_plot,
)
from trackmark.bench.papers.nummiaro2003.scenes import CoefficientSurface

GREY = np.full((120, 160, 3), 128, np.uint8)
MEAN = np.array([60.5, 50.5, 8.0, 14.0])
SAMPLES = MEAN + np.array([[0, 0, 0, 0], [-3, 2, 1, 1], [4, 1, 0, -2]])


def test_surface_plot_shows_samples_near_the_mean():
    """The surface covers x 50.5 to 70.5 and y 40.5 to 55.5."""
    values = np.add.outer(100 * np.arange(16), np.arange(21.0))
    x, y = 50.5 + np.arange(21), 40.5 + np.arange(16)
    surface = CoefficientSurface(0, GREY, x, y, values, MEAN, SAMPLES)
    np.testing.assert_array_equal(surface.values_at(SAMPLES[:, :2]), [1010, 1207, 1114])
    assert np.isnan(surface.values_at(np.array([[71.5, 50], [60, 39.4]]))).all()  # outside
    figure = surface_plot(surface, "T")
    left, _ = figure.axes
    np.testing.assert_allclose(left.collections[0].get_offsets(), SAMPLES[:, :2])
    assert left.get_xlim() == (60.5 - 28, 60.5 + 28)
    assert left.get_ylim() == (50.5 + 28, 50.5 - 28)
    figure.draw_without_rendering()


def test_trajectory_has_an_ellipse_every_n_frames_and_gaps():
    boxes = np.column_stack([np.arange(9.0), np.zeros(9), np.full(9, 10.0), np.full(9, 20.0)])
    boxes[[0, 8]] = np.nan
    truth = boxes + [50.0, 0, 0, 0]
    (axes,) = trajectory_plot([Track(GREY, "person", boxes, truth)], "T", 4).axes
    assert axes.get_title() == "person"
    np.testing.assert_allclose(axes.collections[-1].get_offsets(), [[9.0, 10.0]])
    assert [text.get_text() for text in axes.texts] == ["4"]
    way = axes.lines[-1].get_xydata()
    np.testing.assert_allclose(way[1:8, 0], np.arange(6.0, 13.0))
    assert np.isnan(way[[0, 8]]).all()
    np.testing.assert_allclose(axes.lines[0].get_xydata()[1:8, 0], np.arange(56.0, 63.0))
    boxes = np.array([[x, 50.0, 10.0, 20.0] for x in (10.0, 20, 60, 65, 110)])
    (axes,) = trajectory_plot([Track(GREY, "person", boxes, boxes)], "T", 1).axes
    assert [text.get_text() for text in axes.texts] == ["0", "2", "4"]  # none covers another
    assert len(axes.collections[-1].get_offsets()) == 5


def test_appearances_have_a_threshold_modes_and_shaded_frames():
    counts = np.array([np.nan, np.nan, 91, 50, 5, 60])
    modes = np.array([np.nan, np.nan, 1, 1, 0, 1])
    shades = {"half": np.isin(np.arange(6), [0, 3, 4]), "all": np.arange(6) == 4}
    upper, lower = appearance_plot(counts, modes, "T", 10.0, shades).axes
    numbers, threshold = upper.lines
    np.testing.assert_array_equal(numbers.get_xydata(), [[2, 91], [3, 50], [4, 5], [5, 60]])
    assert set(threshold.get_ydata()) == {10.0}
    assert len(upper.patches) == len(lower.patches) == 3  # frames 0, 3 to 4, and 4
    assert lower.collections[0].get_paths()[0].vertices[:, 1].max() == 1.0
