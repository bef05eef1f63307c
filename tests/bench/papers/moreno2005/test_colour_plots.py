"""Colours in RGB space and on a plane: that points, planes and ellipses are where they belong."""

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


def colours(seed, n=40):
    return np.random.default_rng(seed).uniform(0.2, 0.7, (n, 3))


def sorted_rows(values):
    """Colours of points in space come in the order of drawing."""
    return values[np.lexsort(values.T)]


def test_an_ellipse_is_two_deviations_from_its_mean_all_round():
    axes = bare_figure("T", 3.0).subplots()
    draw_gaussians(axes, MIXTURE, colour(2))
    for patch, mean, covariance in zip(
        axes.patches, MIXTURE.means, MIXTURE.covariances, strict=True
    ):
        unit = patch.get_path().vertices
        rim = patch.get_patch_transform().transform(unit[np.isclose(np.hypot(*unit.T), 1)])
        assert len(rim) >= 8
        away = rim - mean
        distances = np.sqrt(np.einsum("ni,ij,nj->n", away, np.linalg.inv(covariance), away))
        np.testing.assert_allclose(distances, 2.0)
    heavy, light = (patch.get_linewidth() for patch in axes.patches)
    assert heavy > light
    np.testing.assert_array_equal([line.get_xydata()[0] for line in axes.lines], MIXTURE.means)


def test_what_is_drawn_of_a_plane_lies_in_it():
    axes = rgb_axes(bare_figure("T", 3.0), (1, 1, 1), colours(0))
    middle = np.array([0.4, 0.5, 0.3])
    draw_plane(axes, middle, BASIS, (np.array([-0.1, 0.3]), np.array([-0.2, 0.2])))
    (surface,) = axes.collections
    (corners,) = surface._faces
    normal = np.cross(*BASIS.T)
    np.testing.assert_allclose((corners - middle) @ normal, 0, atol=1e-12)
    along = (corners - middle) @ BASIS
    np.testing.assert_allclose([along.min(axis=0), along.max(axis=0)], [[-0.1, -0.2], [0.3, 0.2]])


@pytest.mark.parametrize("sign", [1, -1])
def test_a_plane_is_seen_from_its_upper_side_neither_edge_on_nor_head_on(sign):
    basis = BASIS[:, ::sign]
    elevation, azimuth = np.radians(oblique(basis))
    level = np.array([np.cos(azimuth), np.sin(azimuth)])
    viewer = np.array([*np.cos(elevation) * level, np.sin(elevation)])
    normal = np.cross(*basis.T)
    assert 0.3 < abs(viewer @ normal) < 0.97
    assert oblique(basis) == pytest.approx(oblique(BASIS))


def test_all_colours_are_in_the_cube_and_no_axis_is_stretched():
    points = colours(3) * [1.0, 0.5, 0.1]
    axes = rgb_axes(bare_figure("T", 3.0), (1, 1, 1), np.vstack([points, np.full(3, np.nan)]))
    limits = np.array([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()])
    assert ((limits[:, 0] < points) & (points < limits[:, 1])).all()
    np.testing.assert_allclose(np.ptp(limits, axis=1), np.ptp(limits[0]))


def test_the_model_goes_from_colours_to_posteriors():
    shown = ColourModel(
        image=np.full((12, 16, 3), (200, 100, 0), np.uint8),
        contour=np.array([[3.0, 2.0], [9.0, 2.0], [9.0, 8.0]]),
        points={"target": colours(1), "background": colours(2)},
        basis=BASIS,
        mixtures={"target": MIXTURE, "background": MIXTURE._replace(means=MIXTURE.means - 0.3)},
        grid=(np.linspace(-0.5, 1.0, 30), np.linspace(-0.2, 0.8, 20)),
        on_plane=np.add.outer(np.linspace(0, 0.5, 20), np.linspace(0, 0.5, 30)),
        on_image=np.linspace(0, 1, 192).reshape(12, 16),
    )
    figure = colour_model_plot(shown, "T")
    figure.draw_without_rendering()
    frame, own, classes, projected, mixtures, plane, image = figure.axes
    assert frame.images[0].get_array()[0, 0].tolist() == [0, 100, 200]
    np.testing.assert_array_equal(frame.lines[0].get_xydata(), shown.contour)
    (cloud,) = own.collections
    every = np.concatenate([shown.points["target"], shown.points["background"]])
    np.testing.assert_allclose(np.array(cloud._offsets3d).T, every)
    assert sorted_rows(cloud.get_facecolors()[:, :3]) == pytest.approx(sorted_rows(every))
    _, background, target = classes.collections
    for scatter, name in ((background, "background"), (target, "target")):
        np.testing.assert_allclose(np.array(scatter._offsets3d).T, shown.points[name])
    for line, name in zip(projected.lines, ("background", "target"), strict=True):
        np.testing.assert_allclose(line.get_xydata(), shown.points[name] @ BASIS)
        assert line.get_color() == CLASSES[name]
    assert len(mixtures.patches) == 4
    assert plane.images[0].origin == "lower"
    assert plane.images[0].get_extent() == [-0.5, 1.0, -0.2, 0.8]
    np.testing.assert_array_equal(plane.images[0].get_array(), shown.on_plane)
    np.testing.assert_array_equal(image.images[0].get_array(), shown.on_image)
    assert [text.get_text() for text in figure.legends[0].get_texts()] == list(CLASSES)


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
