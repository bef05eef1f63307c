"""Plots of colours: points, planes and ellipses lie at their places."""

import numpy as np
import pytest

from trackmark.bench.papers.moreno2005.colour_plots import (
    CLASSES,
    ColourModel,
    Gaussians,
    Palette,
    colour_model_plot,
    draw_gaussians,
    draw_plane,
    hypotheses_plot,
    oblique,
    rgb_axes,
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


def test_plane_and_colours_lie_in_the_cube():
    points = colours(3) * [1.0, 0.5, 0.1]
    axes = rgb_axes(bare_figure("T", 3.0), (1, 1, 1), np.vstack([points, np.full(3, np.nan)]))
    limits = np.array([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()])
    assert ((limits[:, 0] < points) & (points < limits[:, 1])).all()
    np.testing.assert_allclose(np.ptp(limits, axis=1), np.ptp(limits[0]))
    middle = np.array([0.4, 0.5, 0.3])
    draw_plane(axes, middle, BASIS, (np.array([-0.1, 0.3]), np.array([-0.2, 0.2])))
    (surface,) = axes.collections
    (corners,) = surface._faces
    np.testing.assert_allclose((corners - middle) @ np.cross(*BASIS.T), 0, atol=1e-12)
    along = (corners - middle) @ BASIS
    np.testing.assert_allclose([along.min(axis=0), along.max(axis=0)], [[-0.1, -0.2], [0.3, 0.2]])


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
    frame, rgb_space, classes, projected, mixtures, plane, image = figure.axes
    np.testing.assert_array_equal(frame.lines[0].get_xydata(), model.contour)
    every = np.concatenate([model.points["target"], model.points["background"]])
    np.testing.assert_allclose(np.array(rgb_space.collections[0]._offsets3d).T, every)
    scatters = zip(classes.collections[1:], projected.lines, ("background", "target"), strict=True)
    for scatter, line, name in scatters:
        np.testing.assert_allclose(np.array(scatter._offsets3d).T, model.points[name])
        np.testing.assert_allclose(line.get_xydata(), model.points[name] @ BASIS)
        assert line.get_color() == CLASSES[name]
    assert len(mixtures.patches) == 4
    assert plane.images[0].get_extent() == [-0.5, 1.0, -0.2, 0.8]
    np.testing.assert_array_equal(plane.images[0].get_array(), model.on_plane)
    np.testing.assert_array_equal(image.images[0].get_array(), model.on_image)


def test_hypotheses_have_the_heaviest_last_and_a_row_per_palette():
    square = np.array([[20.0, 20.0], [40.0, 20.0], [40.0, 40.0], [20.0, 40.0]])
    contours = square + np.array([0.0, 3.0, -2.0])[:, np.newaxis, np.newaxis]
    planes = np.array([np.eye(3)[:, :2], np.eye(3)[:, 1:]]), np.array([0.2, 0.8])
    palettes = {
        name: Palette({"target": MIXTURE, "background": MIXTURE}, np.full((60, 80), value))
        for name, value in (("heavy", 0.9), ("light", 0.1))
    }
    figure = hypotheses_plot(IMAGE, planes, (contours, np.array([0.7, 0.1, 0.2])), palettes, "T")
    figure.draw_without_rendering()
    normals, outlines, *rows = figure.axes
    ends = [np.array(line.get_data_3d()).T for line in normals.lines[::2]]
    np.testing.assert_array_equal(ends, [[[0, 0, 0], [0, 0, 1]], [[0, 0, 0], [1, 0, 0]]])
    (plane,) = normals.collections  # of the heaviest: x is 0 all over it
    np.testing.assert_allclose(plane._faces[..., 0], 0, atol=1e-12)
    (lines,), (mean,) = outlines.collections, outlines.lines
    for path, number in zip(lines.get_paths(), [1, 2, 0], strict=True):
        np.testing.assert_array_equal(path.vertices, [*contours[number], contours[number, 0]])
    assert (np.diff(lines.get_colors()[:, 3]) > 0).all()
    np.testing.assert_allclose(mean.get_xydata()[:-1], square + 0.1 * 3.0 - 0.2 * 2.0)
    assert [axes.get_title(loc="left") for axes in rows[::2]] == ["heavy", "light"]
    assert [axes.images[0].get_array().max() for axes in rows[1::2]] == [0.9, 0.1]
    assert rows[0].get_xlim() == rows[2].get_xlim()
