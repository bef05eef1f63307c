"""Hypotheses by their weights: the heaviest are darkest and last, beside their mean."""

import numpy as np
import pytest

from reports.colour_space import CLASSES, Gaussians
from reports.hypotheses import Palette, hypotheses_plot

SQUARE = np.array([[20.0, 20.0], [40.0, 20.0], [40.0, 40.0], [20.0, 40.0]])
CONTOURS = SQUARE + np.array([0.0, 3.0, -2.0])[:, np.newaxis, np.newaxis]
ONE = Gaussians(np.ones(1), np.array([[0.5, 0.2]]), 0.01 * np.eye(2)[np.newaxis])


@pytest.fixture(scope="module")
def figure():
    image = np.full((60, 80, 3), (200, 100, 0), np.uint8)
    planes = np.array([np.eye(3)[:, :2], np.eye(3)[:, 1:]]), np.array([0.2, 0.8])
    palettes = {
        name: Palette({"target": ONE, "background": ONE}, np.full((60, 80), value))
        for name, value in (("heavy", 0.9), ("light", 0.1))
    }
    return hypotheses_plot(image, planes, (CONTOURS, np.array([0.7, 0.1, 0.2])), palettes, "T")


def test_normals_of_planes_are_drawn_from_the_origin_the_heaviest_last(figure):
    axes = figure.axes[0]
    ends = [np.array(line.get_data_3d()).T for line in axes.lines[::2]]
    np.testing.assert_array_equal(ends, [[[0, 0, 0], [0, 0, 1]], [[0, 0, 0], [1, 0, 0]]])
    light, heavy = (np.sum(line.get_color()[:3]) for line in axes.lines[::2])
    assert heavy < light
    (plane,) = axes.collections  # of the heaviest: x is 0 all over it
    np.testing.assert_allclose(plane._faces[..., 0], 0, atol=1e-12)


def test_contours_are_closed_with_the_heaviest_last_and_darkest_and_their_weighted_mean(figure):
    axes = figure.axes[1]
    (lines,), (mean,) = axes.collections, axes.lines
    for path, number in zip(lines.get_paths(), [1, 2, 0], strict=True):
        np.testing.assert_array_equal(path.vertices, [*CONTOURS[number], CONTOURS[number, 0]])
    assert (np.diff(lines.get_colors()[:, :3].sum(axis=1)) < 0).all()
    assert (np.diff(lines.get_colors()[:, 3]) > 0).all()
    np.testing.assert_allclose(mean.get_xydata()[:-1], SQUARE + 0.1 * 3.0 - 0.2 * 2.0)
    assert (axes.get_xlim(), axes.get_ylim()) == ((6, 55), (55, 6))
    assert axes.images[0].get_array()[0, 0].tolist() == [0, 100, 200]


def test_palettes_have_a_row_each_with_map_and_mixtures_on_one_scale(figure):
    planes, maps = figure.axes[2::2], figure.axes[3::2]
    assert [axes.get_title(loc="left") for axes in planes] == ["heavy", "light"]
    assert [axes.images[0].get_array().max() for axes in maps] == [0.9, 0.1]
    assert all(axes.images[0].get_clim() == (0, 1) for axes in maps)
    assert planes[0].get_xlim() == planes[1].get_xlim()
    assert planes[0].get_aspect() == 1
    shades = [line.get_color() for line in planes[0].lines if len(line.get_xdata())]
    assert shades == list(CLASSES.values())
    assert [text.get_text() for text in figure.legends[0].get_texts()] == list(CLASSES)
    figure.draw_without_rendering()
