"""Plots of samples on images, and of the number of positive samples by frame.

Ellipses are rows of centre x, y and half axes, in pixels (pixel column i spans [i, i + 1)).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from trackmark.bench.papers.nummiaro2003.scenes import CoefficientSurface
from trackmark.reports.figures import (
    add_legend,
    bare_figure,
    draw_image,
    draw_line,
    new_figure,
    outline_effect,
)
from trackmark.reports.palette import colour

Array = NDArray[np.float64]

_SAMPLE, _MEAN = "black", "white"
_ROOM = 32, 14  # width and height of a printed number [px]
_GREYS = (0.93, 0.82)  # grey levels of shaded frames by kind
_SHOWN = 2.0  # margin of the image next to a surface [longer half axes of the mean]


@dataclass(frozen=True)
class Track:
    """Trajectory in an image of a fixed camera."""

    image: NDArray[np.uint8]  # (height, width, 3), BGR
    title: str
    boxes: Array  # (n, 4): boxes of the mean state by frame; NaN rows are gaps
    truth: Array  # (n, 4): ground-truth boxes


def surface_plot(surface: CoefficientSurface, title: str) -> Figure:
    """Draw samples (black) and their mean (white) on the image, and on the surface of ρ."""
    samples, mean = surface.samples, surface.mean
    figure = bare_figure(title, 4.2)
    left: Axes = figure.add_subplot(1, 2, 1)
    draw_image(left, surface.image)
    _draw_ellipses(left, samples, _SAMPLE, 0.5)
    _draw_ellipses(left, mean[np.newaxis], _MEAN, 2.0)
    centre, half = mean[:2], _SHOWN * mean[2:].max()
    left.set(xlim=centre[0] + [-half, half], ylim=centre[1] + [half, -half])

    # Samples are drawn on top of the surface.
    right: Any = figure.add_subplot(1, 2, 2, projection="3d", computed_zorder=False)
    look: dict[str, Any] = {"cmap": "viridis", "rcount": 60, "ccount": 60, "zorder": 1}
    right.plot_surface(*np.meshgrid(surface.x, surface.y), surface.coefficients, **look)
    for centres, dots in (
        (samples[:, :2], {"color": _SAMPLE, "s": 4, "zorder": 2}),
        (mean[np.newaxis, :2], {"color": _MEAN, "edgecolor": "black", "s": 45, "zorder": 3}),
    ):
        right.scatter(*centres.T, surface.values_at(centres), depthshade=False, **dots)
    right.invert_yaxis()  # rows count downwards, as in the image
    right.view_init(elev=50, azim=-70)
    right.set(xlabel="x [px]", ylabel="y [px]")
    right.set_title("coefficient ρ", fontsize=9)
    right.set_box_aspect(None, zoom=0.9)  # room for the labels outside of the axes
    right.tick_params(labelsize=7)
    return figure


def trajectory_plot(tracks: Sequence[Track], title: str, every: int) -> Figure:
    """Draw trajectories of the mean state, with ellipses, and of the target, dashed.

    An ellipse is drawn in every `every`-th frame, with the frame's number if there is room. Each
    track has a panel.
    """
    figure, all_axes = _panels([track.image for track in tracks], title)
    for axes, track in zip(all_axes, tracks, strict=True):
        axes.set_title(track.title, fontsize=9)
        states, truth = _ellipses_in(track.boxes), _ellipses_in(track.truth)
        dashed: dict[str, Any] = {"linestyle": (0, (3, 2)), "path_effects": outline_effect(2.4)}
        axes.plot(*truth[:, :2].T, color=_MEAN, linewidth=1.2, **dashed)
        axes.plot(
            *states[:, :2].T, color=colour(4), linewidth=1.4, path_effects=outline_effect(2.6)
        )
        drawn_frames = np.flatnonzero(np.isfinite(states[::every]).all(axis=1)) * every
        _draw_ellipses(axes, states[drawn_frames], _MEAN, 1.2)
        labelled: list[tuple[float, float]] = []
        for frame in drawn_frames.tolist():
            x, y, _, height = states[frame]
            corner = float(x), float(y - height)
            if any(
                abs(corner[0] - u) < _ROOM[0] and abs(corner[1] - v) < _ROOM[1] for u, v in labelled
            ):
                continue
            labelled.append(corner)
            axes.annotate(
                str(frame),
                (x, y - height),
                (0, 2),
                textcoords="offset points",
                ha="center",
                fontsize=6,
                color="white",
                path_effects=outline_effect(1.5),
            )
    return figure


def _ellipses_in(boxes: Array) -> Array:
    half = boxes[:, 2:] / 2
    return np.hstack([boxes[:, :2] + half, half])


def _panels(images: Sequence[NDArray[np.uint8]], title: str) -> tuple[Figure, list[Axes]]:
    """Add panels with images next to one another."""
    shape = images[0].shape
    figure = bare_figure(title, 0.6 + 8.0 / len(images) * shape[0] / shape[1])
    all_axes = list(figure.subplots(1, len(images), squeeze=False)[0])
    for axes, image in zip(all_axes, images, strict=True):
        draw_image(axes, image)
        height, width = image.shape[:2]  # fixed limits, independent of later plots
        axes.set(xlim=(0, width), ylim=(height, 0), autoscale_on=False)
    return figure, all_axes


def _draw_ellipses(axes: Axes, ellipses: Array, shade: str, line_width: float) -> None:
    """Draw outlines of ellipses; white ones have a dark rim for contrast."""
    rims = [("black", line_width + 1.2)] if shade == _MEAN else []
    for edge, thickness in [*rims, (shade, line_width)]:
        collection = EllipseCollection(
            2 * ellipses[:, 2],
            2 * ellipses[:, 3],
            np.zeros(len(ellipses)),
            units="xy",
            offsets=ellipses[:, :2],
            offset_transform=axes.transData,
            facecolors="none",
            edgecolors=edge,
            linewidths=thickness,
        )
        axes.add_collection(collection)


def appearance_plot(
    counts: Array,
    modes: Array,
    title: str,
    threshold: float,
    shades: Mapping[str, NDArray[np.bool_]],
) -> Figure:
    """Draw the number of positive samples by frame, and below it the frames of initialisation.

    `counts`: number of positive samples, shape (frames,). `modes`: 0 initialising, 1 tracking, NaN
    without estimate, shape (frames,). `threshold`: number of positive samples at which the mode
    changes, a dashed line. `shades`: flags of shaded frames by kind, shape (frames,).
    """
    figure, (upper, lower) = new_figure(title, 4.4, n_rows=2, heights=(3, 1))
    estimated = np.flatnonzero(np.isfinite(counts))
    frames = np.arange(estimated[0], estimated[-1] + 1)
    draw_line(upper, frames, counts[frames], "positive appearances", 0)
    line: dict[str, Any] = {"color": "black", "linestyle": "--", "linewidth": 1.2}
    upper.axhline(threshold, label="threshold b·N", **line)
    lower.fill_between(frames, 1.0 - modes[frames], step="mid", color=colour(1), linewidth=0)
    for grey, (label, flags) in zip(_GREYS, shades.items(), strict=True):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]])))
        for index, (start, stop) in enumerate(edges.reshape(-1, 2) - 0.5):
            look: dict[str, Any] = {"color": str(grey), "zorder": 0, "linewidth": 0}
            upper.axvspan(start, stop, label=None if index else label, **look)
            lower.axvspan(start, stop, **look)
    upper.set(ylabel="samples", xlim=(frames[0], frames[-1]))
    upper.set_ylim(bottom=0)
    lower.set(ylabel="initialisation", xlabel="frame", ylim=(0, 1))
    lower.set_yticks([0, 1], ["no", "yes"])
    add_legend(figure, "")
    return figure
