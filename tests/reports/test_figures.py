"""Panels of images and maps: their ranges, boxes and contours."""

import numpy as np

from trackmark.reports.figures import Panel, map_plot


def test_images_are_in_colour_maps_from_black_to_white_boxes_and_contours_at_their_place():
    image = np.full((10, 20, 3), (200, 0, 0), np.uint8)
    values = np.linspace(0, 0.5, 200).reshape(10, 20)
    corners = np.array([[2.0, 3.0], [8.0, 3.0], [5.0, 9.0]])
    panels = [Panel("frame", image, np.array([2.0, 3, 6, 4])), Panel("map", values)]
    figure = map_plot([*panels, Panel("another", values, contour=corners)], "T", 2)
    frame, mapped, another, empty = figure.axes
    assert frame.images[0].get_array()[0, 0].tolist() == [0, 0, 200]
    assert frame.images[0].get_extent() == [0, 20, 10, 0]
    (box,) = frame.patches
    assert (box.get_xy(), box.get_width(), box.get_height()) == ((2, 3), 6, 4)
    assert np.array_equal(mapped.images[0].get_array(), values)
    assert mapped.images[0].get_clim() == (0, 1)
    assert not mapped.patches
    assert another.get_title() == "another"
    (polygon,) = another.patches
    np.testing.assert_array_equal(polygon.get_xy(), [*corners, corners[0]])
    assert not polygon.get_fill()
    assert not empty.images
