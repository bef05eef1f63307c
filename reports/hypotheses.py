"""Hypotheses of planes, contours and colours in a frame, by their weights."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from reports.colour_space import (
    CLASSES,
    Gaussians,
    draw_gaussians,
    draw_plane,
    name_channels,
    oblique,
)
from reports.figures import bare_figure, rim, show
from reports.palette import colour

__all__ = ["Palette", "hypotheses_plot"]

Array = NDArray[np.float64]

AROUND = 12.0  # pixels of the image that are shown about the contours

HALF = 0.6  # side of the plane that is drawn, half of it; normals have length 1

_LIGHTEST, _DARKEST = 0.25, 1.0  # of the shades that weights have
_FAINTEST = 0.12  # opacity of the lightest contours


@dataclass(frozen=True)
class Palette:
    """A hypothesis of the target's colours and the background's."""

    mixtures: Mapping[str, Gaussians]  # on a plane, by the names of `reports.colour_space.CLASSES`
    posterior: Array  # (height, width): map of the target by them, in [0, 1]


def hypotheses_plot(
    image: NDArray[np.uint8],
    planes: tuple[Array, Array],
    contours: tuple[Array, Array],
    palettes: Mapping[str, Palette],
    title: str,
) -> Figure:
    """Planes in RGB space and contours on the image at the left, a row a palette at the right.

    Parameters
    ----------
    image : ndarray of uint8, shape (height, width, 3)
        BGR.
    planes : tuple of ndarray of float64, shape (n, 3, 2) and (n,)
        Bases, and weights.
    contours : tuple of ndarray of float64, shape (n, points, 2) and (n,)
        Polygons in pixels, and weights.
    palettes : mapping of str to Palette
        By what is said of them.
    """
    figure = bare_figure(title, 0.8 + 1.9 * len(palettes))
    halves: Any = figure.subfigures(1, 2, width_ratios=(4, 5))
    left, right = halves
    normals: Any = left.add_subplot(2, 1, 1, projection="3d", computed_zorder=False)
    _draw_normals(normals, *planes)
    normals.set_title(f"normals of {len(planes[1])} planes; the heaviest plane", fontsize=9)
    below: Axes = left.add_subplot(2, 1, 2)
    _draw_contours(below, image, *contours)
    below.set_title(f"{len(contours[1])} contours, and their mean", fontsize=9)
    below.legend(loc="lower left", fontsize=8)
    # One scale for all planes, so that they can be compared.
    grid = right.subplots(
        len(palettes), 2, squeeze=False, width_ratios=(1, 1.35), sharex="col", sharey="col"
    )
    for (plane, shown), (words, palette) in zip(grid, palettes.items(), strict=True):
        for name, mixture in palette.mixtures.items():
            draw_gaussians(plane, mixture, CLASSES[name])
            plane.plot([], color=CLASSES[name], label=name)
        plane.set_aspect("equal")
        plane.set_title(words, fontsize=9, loc="left")
        plane.tick_params(labelsize=7)
        shown.imshow(palette.posterior, cmap="gray", vmin=0.0, vmax=1.0)
        shown.set_axis_off()
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower right", ncols=2, fontsize=9, frameon=False)
    return figure


def _draw_normals(axes: Any, bases: Array, weights: Array) -> None:
    """Normals from the origin on, and a square of the heaviest plane."""
    normals = np.cross(bases[:, :, 0], bases[:, :, 1])
    shades, order = _shades(weights), np.argsort(weights)
    ends = np.array([-HALF, HALF])
    draw_plane(axes, np.zeros(3), bases[order[-1]], (ends, ends))
    for number in order:
        normal = np.stack([np.zeros(3), normals[number]])
        axes.plot(*normal.T, color=shades[number], linewidth=1.0)
        axes.plot(*normal[1:].T, ".", color=shades[number], markersize=5)
    axes.view_init(*oblique(bases[order[-1]]))
    axes.set(xlim=(-1, 1), ylim=(-1, 1), zlim=(-1, 1))
    name_channels(axes)


def _draw_contours(axes: Axes, image: NDArray[np.uint8], contours: Array, weights: Array) -> None:
    """Contours on the part of the image about them, the heaviest last; their mean above all."""
    height, width = image.shape[:2]
    show(axes, image)
    order = np.argsort(weights)
    closed = np.concatenate([contours, contours[:, :1]], axis=1)
    shades = _shades(weights)[order]
    # The many that weigh next to nothing hide neither the image nor the others.
    shades[:, 3] = np.maximum(weights[order] / weights.max(), _FAINTEST)
    axes.add_collection(LineCollection(list(closed[order]), colors=shades, linewidths=0.5))
    mean = np.einsum("n,npd->pd", weights, closed) / weights.sum()
    axes.plot(*mean.T, color=colour(4), linewidth=1.3, path_effects=rim(2.4), label="mean")
    low, high = contours.min(axis=(0, 1)) - AROUND, contours.max(axis=(0, 1)) + AROUND
    axes.set(xlim=(max(low[0], 0), min(high[0], width)))
    axes.set(ylim=(min(high[1], height), max(low[1], 0)))


def _shades(weights: Array) -> Array:
    """A shade for each, shape (n, 4): the darker, the more weight."""
    share = weights / weights.max()
    return np.asarray(mpl.colormaps["Purples"](_LIGHTEST + (_DARKEST - _LIGHTEST) * share))
