"""Common parts of all figures: title, legend outside of the axes, reproducible files."""

import re
from collections.abc import Collection, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.patheffects import withStroke
from numpy.typing import ArrayLike, NDArray

from trackmark.reports.palette import LINE_STYLES, MARKERS, colour
from trackmark.reports.printable import printable

_MAX_ALL_MARKED = 10  # number of points of a line up to which each has a marker
_MARKER_DISTANCE = 0.2  # distance of the markers of longer lines, as a share of the diagonal


def bare_figure(title: str, height: float) -> Figure:
    """Return a figure, 8 inches wide, with a title; `height`: without legend [inches]."""
    figure = Figure(figsize=(8.0, height), dpi=140, layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(fold(title, 80), fontsize=11)
    return figure


def new_figure(
    title: str, height: float, n_rows: int = 1, heights: Sequence[float] | None = None
) -> tuple[Figure, list[Axes]]:
    """Return a `bare_figure` with axes below each other that share their abscissa.

    `heights`: relative heights of the axes; equal by default.
    """
    figure = bare_figure(title, height)
    all_axes = [*figure.subplots(n_rows, sharex=True, squeeze=False, height_ratios=heights).ravel()]
    for axes in all_axes:
        axes.grid(alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)
    return figure, all_axes


def add_legend(figure: Figure, heading: str = "") -> None:
    """Add a legend of all lines below the plot, with as many columns as fit.

    The figure grows by the height of the legend. Labels contain all parameters of a tracker and
    would otherwise take up the space of the data.
    """
    named: dict[str, Any] = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            named.setdefault(label, handle)
    style: dict[str, Any] = {"loc": "outside lower center", "alignment": "left", "frameon": False}
    style |= {"title": heading, "fontsize": 9, "title_fontsize": 9}
    labels = [fold(label, 100) for label in named]
    for columns in (4, 3, 2, 1):
        legend = figure.legend([*named.values()], labels, ncols=columns, **style)
        extent = legend.get_window_extent()
        if columns == 1 or extent.width <= figure.bbox.width:
            break
        legend.remove()
    figure.set_figheight(figure.get_figheight() + extent.height / figure.dpi)


def draw_image(axes: Axes, image: NDArray[Any]) -> None:
    """Draw a BGR image (height, width, 3), or a map (height, width) from black, 0, to white, 1.

    The unit of the axes, which are invisible, is a pixel.
    """
    height, width = image.shape[:2]
    rgb = image[..., ::-1] if image.ndim == 3 else image
    axes.imshow(rgb, cmap="gray", vmin=0.0, vmax=1.0, extent=(0, width, height, 0))
    axes.set_axis_off()


def outline_effect(width: float) -> list[Any]:
    """Return a black path effect that keeps lines and texts readable; `width`: in points."""
    return [withStroke(linewidth=width, foreground="black")]


def line_style(position: int) -> dict[str, Any]:
    """Return colour, dashes, width and marker of the tracker with an index."""
    marker, dashes = MARKERS[position % len(MARKERS)], LINE_STYLES[position % len(LINE_STYLES)]
    style = {"color": colour(position), "linestyle": dashes, "linewidth": 1.8}
    return {**style, "marker": marker, "markersize": 5.0}


def named_line(label: str, position: int) -> dict[str, Any]:
    """Return the line style with a label; a space protects a label that starts with `_`.

    Matplotlib omits labels with a leading underscore from legends.
    """
    return {"label": f" {label}" if label.startswith("_") else label, **line_style(position)}


def draw_line(
    axes: Axes, x: ArrayLike, y: ArrayLike, label: str, position: int, **options: Any
) -> None:
    """Draw the line of a tracker, with a few markers if it has many points.

    `options`: options of Matplotlib in addition to the style of the tracker.
    """
    n_finite = np.isfinite(np.asarray(y, float)).sum()
    if n_finite > _MAX_ALL_MARKED:  # `markevery` fails without finite points
        start = _MARKER_DISTANCE * (position % 7) / 7  # markers of lines have different places
        options = {"markevery": (start, _MARKER_DISTANCE)} | options
    axes.plot(np.asarray(x), np.asarray(y), **named_line(label, position), **options)


def fold(label: str, width: int) -> str:
    """Break a text after colons, slashes and spaces into lines of about `width` characters.

    Dollar signs are escaped, as Matplotlib would parse a formula. Control characters, and
    characters that the font lacks, are replaced by their numbers.
    """
    lines = [""]
    drawable = "".join(
        sign if ord(sign) in _font_characters() or sign.isspace() else f"\\u{ord(sign):04x}"
        for sign in printable(label)
    )
    for word in re.split(r"(?<=[:/ ])", drawable.replace("$", r"\$")):
        if lines[-1] and len(lines[-1]) + len(word.rstrip()) > width:
            lines.append("")
        lines[-1] += word
    return "\n".join(line.rstrip() for line in lines)


@cache
def _font_characters() -> Collection[int]:
    """Return the code points of the characters that the font has."""
    return frozenset(get_font(findfont(FontProperties())).get_charmap())


def save_figure(file: Path, figure: Figure) -> None:
    """Save a figure as PNG, SVG or PDF by its suffix; equal figures have equal bytes."""
    metadata = {{".svg": "Date", ".pdf": "CreationDate"}.get(file.suffix, "Software"): None}
    # Without a salt the ids in an SVG are random. Publishers refuse fonts of type 3, the default.
    with mpl.rc_context({"svg.hashsalt": "trackmark", "pdf.fonttype": 42}):
        figure.savefig(file, metadata=metadata)
