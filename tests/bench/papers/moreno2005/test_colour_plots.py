"""Plots of colour models: ellipses, view of the plane, maps and titles."""

import numpy as np
import pytest

from trackmark.bench.papers.moreno2005.colour_plots import (
    ColourModel,
    Gaussians,
    Palette,
    colour_model_plot,
    draw_gaussians,
    hypotheses_plot,
    oblique,
)
from trackmark.reports.figures import bare_figure
from trackmark.reports.palette import colour

BASIS = np.linalg.qr(np.array([[1.0, 0.2], [0.3, 1.0], [-0.4, 0.6]]))[0]
MIXTURE = Gaussians(
    np.array([0.75, 0.25]),
    np.array([[0.2, 0.1], [0.4, 0.3]]),
    np.array([[[0.02, 0.012], [0.012, 0.01]], [[0.003, -0.002], [-0.002, 0.006]]]),
)
IMAGE = np.full((60, 80, 3), (200, 100, 0), np.uint8)


def colours(seed, n=40):
    return np.random.default_rng(seed).uniform(0.2, 0.7, (n, 3))


def test_ellipses_are_two_deviations_from_their_means():
    axes = bare_figure("T", 3.0).subplots()
    draw_gaussians(axes, MIXTURE, colour(2))
    for patch, mean, covariance in zip(axes.patches, *MIXTURE[1:], strict=True):
        unit = patch.get_path().vertices
        rim = patch.get_patch_transform().transform(unit[np.isclose(np.hypot(*unit.T), 1)])
        assert len(rim) >= 8
        away = rim - mean
        distances = np.sqrt(np.einsum("ni,ij,nj->n", away, np.linalg.inv(covariance), away))
        np.testing.assert_allclose(distances, 2.0)
    heavy, light = (patch.get_linewidth() for patch in axes.patches)
    assert heavy > light


@pytest.mark.parametrize("sign", [1, -1])
def test_plane_is_seen_from_above_neither_edge_on_nor_head_on(sign):
    basis = BASIS[:, ::sign]
    elevation, azimuth = np.radians(oblique(basis))
    level = np.array([np.cos(azimuth), np.sin(azimuth)])
    viewer = np.array([*np.cos(elevation) * level, np.sin(elevation)])
    assert 0.3 < abs(viewer @ np.cross(*basis.T)) < 0.97
    assert oblique(basis) == pytest.approx(oblique(BASIS))


def test_colour_model_has_classes_and_posteriors():
    model = ColourModel(
        image=IMAGE,
        contour=np.array([[3.0, 2.0], [9.0, 2.0], [9.0, 8.0]]),
        points={"target": colours(1), "background": colours(2)},
        basis=BASIS,
        mixtures={"target": MIXTURE, "background": MIXTURE._replace(means=MIXTURE.means - 0.3)},
        grid=(np.linspace(-0.5, 1.0, 30), np.linspace(-0.2, 0.8, 20)),
        on_plane=np.add.outer(np.linspace(0, 0.5, 20), np.linspace(0, 0.5, 30)),
        on_image=np.linspace(0, 1, 192).reshape(12, 16),
    )
    figure = colour_model_plot(model, "T")
    figure.draw_without_rendering()
    frame, _, _, projected, _, plane, image = figure.axes
    np.testing.assert_array_equal(frame.lines[0].get_xydata(), model.contour)
    for line, name in zip(projected.lines, ("background", "target"), strict=True):
        np.testing.assert_allclose(line.get_xydata(), model.points[name] @ BASIS)
    assert plane.images[0].get_extent() == [-0.5, 1.0, -0.2, 0.8]
    np.testing.assert_array_equal(plane.images[0].get_array(), model.on_plane)
    np.testing.assert_array_equal(image.images[0].get_array(), model.on_image)


def test_hypotheses_plot_has_weighted_mean_and_row_per_palette():
    square = np.array([[20.0, 20.0], [40.0, 20.0], [40.0, 40.0], [20.0, 40.0]])
    contours = square + np.array([0.0, 3.0, -2.0])[:, np.newaxis, np.newaxis]
    planes = np.array([np.eye(3)[:, :2], np.eye(3)[:, 1:]]), np.array([0.2, 0.8])
    palettes = {
        name: Palette({"target": MIXTURE, "background": MIXTURE}, np.full((60, 80), value))
        for name, value in (("heavy", 0.9), ("light", 0.1))
    }
    figure = hypotheses_plot(IMAGE, planes, (contours, np.array([0.7, 0.1, 0.2])), palettes, "T")
    figure.draw_without_rendering()
    _, outlines, *rows = figure.axes
    (mean,) = outlines.lines
    np.testing.assert_allclose(mean.get_xydata()[:-1], square + 0.1 * 3.0 - 0.2 * 2.0)
    assert [axes.get_title(loc="left") for axes in rows[::2]] == ["heavy", "light"]
    assert [axes.images[0].get_array().max() for axes in rows[1::2]] == [0.9, 0.1]
