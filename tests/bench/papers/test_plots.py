"""Plots that several papers share."""

import numpy as np

from trackmark.bench.papers.plots import Panel, map_plot, series_plot
from trackmark.reports.palette import colour


def test_series_plot_stacks_panels():
    five = np.array([[i, i + 2.0, np.nan] for i in range(5)])
    figure = series_plot({"z": {"b": five}, "y": {"a": five[:1]}}, "T", "Hx", ["a", "b"], 3)
    upper, lower = figure.axes
    np.testing.assert_array_equal(upper.lines[0].get_xydata(), [[3, 2], [4, 4], [5, np.nan]])
    assert upper.lines[0].get_color() == colour(1)
    assert upper.get_ylabel() == "z\nHx"
    quartiles = upper.collections[0].get_paths()[0].get_extents()
    assert (quartiles.ymin, quartiles.ymax) == (1, 5)
    assert not lower.collections  # a single row has no quartiles
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["b", "a"]
    assert legend.get_title().get_text() == "median and quartiles over scenes"


def test_maps_have_images_boxes_and_contours():
    image = np.full((4, 8, 3), (200, 100, 0), np.uint8)
    corners = np.array([[1.0, 1.0], [5.0, 1.0], [5.0, 3.0]])
    panels = [
        Panel("frame", image, np.array([2.0, 1.0, 4.0, 2.0]), corners),
        Panel("map", np.full((4, 8), 0.25)),
        Panel("other", np.zeros((4, 8))),
    ]
    frame, map_, _, empty = map_plot(panels, "T", columns=2).axes
    assert frame.images[0].get_array()[0, 0].tolist() == [0, 100, 200]
    assert frame.images[0].get_extent() == [0, 8, 4, 0]
    box, contour = frame.patches
    assert (box.get_xy(), box.get_width(), box.get_height()) == ((2.0, 1.0), 4.0, 2.0)
    np.testing.assert_array_equal(contour.get_xy()[:-1], corners)
    assert map_.images[0].get_clim() == (0, 1)
    assert not empty.images
