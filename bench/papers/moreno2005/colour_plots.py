"""Plots of colours in RGB space, of mixtures on a colour plane, and of particles of the cues."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from trackmark.reports.figures import bare_figure, draw_image, outline_effect
from trackmark.reports.palette import colour
from trackmark.trackers.contours.mixture import Mixture

Array = NDArray[np.float64]

CLASSES = {"target": colour(0), "background": colour(1)}
"""Colours of the two classes in plots."""

VIEW = 22.0, -58.0
"""Elevation and azimuth of the view of RGB space [degrees]."""

ASIDE = 40.0
"""Angle between the normal of a plane and the view direction [degrees]."""

DEVIATIONS = 2.0
"""Number of standard deviations at which the ellipse of a Gaussian is drawn."""

_CHANNELS = ("R", "#c00000", "-"), ("G", "#007000", "--"), ("B", "#0000c0", "-.")


@dataclass(frozen=True)
class ColourModel:
    """Two classes of colours, the plane that separates them, and their mixtures on it."""

    image: NDArray[np.uint8]  # (height, width, 3), BGR
    contour: Array  # (points, 2): contour of the target [px]
    points: Mapping[str, Array]  # by class of `CLASSES`, (n, 3): RGB in [0, 1]
    basis: Array  # (3, 2): axes of the plane in RGB space
    mixtures: Mapping[str, Mixture]  # on the plane, by class
    grid: tuple[Array, Array]  # (k,) and (l,): equally spaced coordinates on the axes of the plane
    on_plane: Array  # (l, k): posterior of the target on this grid, in [0, 1]
    on_image: Array  # (height, width): posterior of the image's colours


def colour_model_plot(model: ColourModel, title: str) -> Figure:
    """Draw the steps from an image's colours to the posterior of the target."""
    figure = bare_figure(title, 5.6)
    grid = figure.add_gridspec(2, 12, height_ratios=(5, 4))
    view = oblique(model.basis)
    upper = [grid[0, 4 * place : 4 * place + 4] for place in range(3)]
    frame = figure.add_subplot(upper[0])
    draw_image(frame, model.image)
    frame.plot(*model.contour.T, color="white", linewidth=1.4, path_effects=outline_effect(2.8))
    frame.set_title("frame, with the target's outline", fontsize=9)

    every = np.concatenate(list(model.points.values()))
    rgb_space = rgb_axes(figure, upper[1], every)
    rgb_space.scatter(*every.T, c=every, s=3, depthshade=False)
    rgb_space.view_init(*view)
    rgb_space.set_title("(a) colours in RGB space", fontsize=9)
    classes = rgb_axes(figure, upper[2], every)
    middle = every.mean(axis=0)
    spread = (every - middle) @ model.basis
    ends = np.stack([spread.min(axis=0), spread.max(axis=0)])
    draw_plane(classes, middle, model.basis, (ends[:, 0], ends[:, 1]))
    # The larger class is drawn first and does not hide the smaller one.
    for name in reversed(CLASSES):
        classes.scatter(*model.points[name].T, color=CLASSES[name], s=3, depthshade=False)
    classes.view_init(*view)
    classes.set_title("(b) target, background, plane", fontsize=9)

    lower = [figure.add_subplot(grid[1, 3 * place : 3 * place + 3]) for place in range(4)]
    projected, mixtures, plane, image = lower
    for name in reversed(CLASSES):
        projections = model.points[name] @ model.basis
        projected.plot(*projections.T, ".", color=CLASSES[name], markersize=2, label=name)
        mixtures.plot(*projections.T, ".", color=CLASSES[name], markersize=1, alpha=0.25)
        draw_mixture(mixtures, model.mixtures[name], CLASSES[name])
    x, y = model.grid
    edges = (x[0], x[-1], y[0], y[-1])
    plane.imshow(
        model.on_plane, origin="lower", extent=edges, cmap="gray", vmin=0.0, vmax=1.0, aspect="auto"
    )
    titles = "(c) projected on the plane", "(d) mixtures' components", "(e) posterior on the plane"
    for axes, panel_title in zip(lower[:3], titles, strict=True):
        axes.set(xlim=edges[:2], ylim=edges[2:], xlabel="along φ₁", box_aspect=1)
        axes.set_title(panel_title, fontsize=9)
        axes.tick_params(labelsize=7)
    projected.set_ylabel("along φ₂")
    draw_image(image, model.on_image)
    image.set_title("(e) posterior of the frame", fontsize=9)
    handles, labels = projected.get_legend_handles_labels()
    options: dict[str, Any] = {"ncols": 2, "markerscale": 5, "fontsize": 9, "frameon": False}
    figure.legend(handles[::-1], labels[::-1], loc="outside lower center", **options)
    return figure


def rgb_axes(figure: Figure, subplot: Any, colours: Array) -> Any:
    """Add axes (Axes3D) of RGB space that enclose colours.

    `subplot` is what `add_subplot` takes, a tuple of int or a SubplotSpec. `colours` has the shape
    (n, 3) and values in [0, 1]; NaN rows are ignored.
    """
    # Marks are drawn on top, independent of depth.
    options: dict[str, Any] = {"projection": "3d", "computed_zorder": False}
    position = subplot if isinstance(subplot, tuple) else (subplot,)
    axes: Any = figure.add_subplot(*position, **options)
    axes.view_init(*VIEW)
    low, high = np.nanmin(colours, axis=0), np.nanmax(colours, axis=0)
    side = 1.05 * float((high - low).max())  # equal limits on all axes: angles are not distorted
    for axis, middle in zip("xyz", (low + high) / 2, strict=True):
        getattr(axes, f"set_{axis}lim")(middle - side / 2, middle + side / 2)
    name_channels(axes)
    return axes


def oblique(basis: Array) -> tuple[float, float]:
    """Return elevation and azimuth [degrees] of an oblique view of a plane.

    `basis`: axes of the plane as columns, shape (3, 2).
    """
    x, y, z = np.cross(basis[:, 0], basis[:, 1])
    facing = 1.0 if z >= 0 else -1.0  # from its upper side
    azimuth = float(np.degrees(np.arctan2(facing * y, facing * x)))
    return VIEW[0], azimuth + ASIDE


def name_channels(axes: Any) -> None:
    """Label the axes of RGB space."""
    for axis, (name, shade, _) in zip("xyz", _CHANNELS, strict=True):
        getattr(axes, f"set_{axis}label")(name, labelpad=-6, color=shade)
        getattr(axes, f"{axis}axis").set_major_locator(MaxNLocator(3))
    axes.tick_params(labelsize=7, pad=-3)


def draw_plane(axes: Any, middle: Array, basis: Array, ends: tuple[Array, Array]) -> None:
    """Draw a part of the plane through `middle`, shape (3,), with the axes `basis`, shape (3, 2).

    `ends`: two arrays, shape (2,), with the ends of the part along each axis, from `middle`.
    """
    along = np.stack(np.meshgrid(*ends), axis=-1)
    corners = middle + along @ basis.T
    axes.plot_surface(
        *np.moveaxis(corners, -1, 0), color="0.7", edgecolor="0.4", alpha=0.35, shade=False
    )


def draw_mixture(axes: Axes, mixture: Mixture, shade: str) -> None:
    """Draw the ellipse of two standard deviations of each component; line widths show weights."""
    for weight, mean, covariance in zip(*mixture, strict=True):
        variances, directions = np.linalg.eigh(covariance)
        width, height = 2 * DEVIATIONS * np.sqrt(variances)
        angle = float(np.degrees(np.arctan2(directions[1, 0], directions[0, 0])))
        line = {"fill": False, "edgecolor": shade, "linewidth": 0.6 + 2.4 * weight}
        axes.add_patch(Ellipse((mean[0], mean[1]), width, height, angle=angle, **line))
        axes.plot(*mean, "+", color=shade, markersize=4)


AROUND = 12.0  # margin of the image around the contours [px]

HALF = 0.6  # half of the side of the drawn part of a plane; normals have length 1

_LIGHTEST, _DARKEST = 0.25, 1.0  # range of the colour map for weights
_FAINTEST = 0.12  # opacity of the lightest contours


@dataclass(frozen=True)
class Palette:
    """Particle of the colour cue: mixtures of target and background."""

    mixtures: Mapping[str, Mixture]  # mixtures on a plane, by class
    posterior: Array  # (height, width): posterior of the target, in [0, 1]


def hypotheses_plot(
    image: NDArray[np.uint8],
    planes: tuple[Array, Array],
    contours: tuple[Array, Array],
    palettes: Mapping[str, Palette],
    title: str,
) -> Figure:
    """Draw planes and contours on the left, and one row per palette on the right.

    `image`: BGR. `planes`: bases (n, 3, 2) and weights (n,). `contours`: polygons (n, points, 2)
    [px] and weights (n,). `palettes`: by label.
    """
    figure = bare_figure(title, 0.8 + 1.9 * len(palettes))
    halves: Any = figure.subfigures(1, 2, width_ratios=(4, 5))
    left, right = halves
    normals: Any = left.add_subplot(2, 1, 1, projection="3d", computed_zorder=False)
    _draw_normals(normals, *planes)
    normals.set_title(
        f"normals of {len(planes[1])} planes; plane of the largest weight", fontsize=9
    )
    below: Axes = left.add_subplot(2, 1, 2)
    _draw_contours(below, image, *contours)
    below.set_title(f"{len(contours[1])} contours, and their mean", fontsize=9)
    below.legend(loc="lower left", fontsize=8)
    # All planes have one scale.
    grid = right.subplots(
        len(palettes), 2, squeeze=False, width_ratios=(1, 1.35), sharex="col", sharey="col"
    )
    for (plane, posterior_axes), (label, palette) in zip(grid, palettes.items(), strict=True):
        for name, mixture in palette.mixtures.items():
            draw_mixture(plane, mixture, CLASSES[name])
            plane.plot([], color=CLASSES[name], label=name)
        plane.set_aspect("equal")
        plane.set_title(label, fontsize=9, loc="left")
        plane.tick_params(labelsize=7)
        posterior_axes.imshow(palette.posterior, cmap="gray", vmin=0.0, vmax=1.0)
        posterior_axes.set_axis_off()
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower right", ncols=2, fontsize=9, frameon=False)
    return figure


def _draw_normals(axes: Any, bases: Array, weights: Array) -> None:
    """Draw normals from the origin, and a square on the plane with the largest weight."""
    normals = np.cross(bases[:, :, 0], bases[:, :, 1])
    shades, order = _shades(weights), np.argsort(weights)
    ends = np.array([-HALF, HALF])
    draw_plane(axes, np.zeros(3), bases[order[-1]], (ends, ends))
    for index in order:
        normal = np.stack([np.zeros(3), normals[index]])
        axes.plot(*normal.T, color=shades[index], linewidth=1.0)
        axes.plot(*normal[1:].T, ".", color=shades[index], markersize=5)
    axes.view_init(*oblique(bases[order[-1]]))
    axes.set(xlim=(-1, 1), ylim=(-1, 1), zlim=(-1, 1))
    name_channels(axes)


def _draw_contours(axes: Axes, image: NDArray[np.uint8], contours: Array, weights: Array) -> None:
    """Draw contours on their part of the image by rising weight, and their mean on top."""
    height, width = image.shape[:2]
    draw_image(axes, image)
    order = np.argsort(weights)
    closed = np.concatenate([contours, contours[:, :1]], axis=1)
    shades = _shades(weights)[order]
    # Contours with small weights are transparent and hide nothing.
    shades[:, 3] = np.maximum(weights[order] / weights.max(), _FAINTEST)
    axes.add_collection(LineCollection(list(closed[order]), colors=shades, linewidths=0.5))
    mean = np.einsum("n,npd->pd", weights, closed) / weights.sum()
    axes.plot(
        *mean.T, color=colour(4), linewidth=1.3, path_effects=outline_effect(2.4), label="mean"
    )
    low, high = contours.min(axis=(0, 1)) - AROUND, contours.max(axis=(0, 1)) + AROUND
    axes.set(xlim=(max(low[0], 0), min(high[0], width)))
    axes.set(ylim=(min(high[1], height), max(low[1], 0)))


def _shades(weights: Array) -> Array:
    """Return a colour per weight, shape (n, 4): darker for larger weights."""
    share = weights / weights.max()
    return np.asarray(mpl.colormaps["Purples"](_LIGHTEST + (_DARKEST - _LIGHTEST) * share))
