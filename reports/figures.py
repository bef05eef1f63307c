"""Figures as all plots have them: title, legend that hides nothing, files with equal bytes."""

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from math import ceil
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.patches import Polygon, Rectangle
from matplotlib.patheffects import withStroke
from numpy.typing import ArrayLike, NDArray

from trackmark.reports.files import write_file
from trackmark.reports.palette import LINE_STYLES, MARKERS, colour
from trackmark.reports.printable import printable

CROWDED = 7
"""Most lines in one plot; more than that have a panel each."""

_COLUMNS = 3  # of panels
_ALL_MARKED = 10  # points of a line up to which each is marked
_BETWEEN = 0.2  # two markers of a longer one, as a share of the diagonal
_STYLE = ("color", "linestyle", "linewidth", "drawstyle", "marker", "markersize", "markevery")

OTHERS: Mapping[str, Any] = {"color": "0.85", "linewidth": 0.7}
"""How other lines are drawn behind that of a panel."""

_MOST_NAMED = 100
"""Maximum number of rows of a heat map that have room for names and numbers."""


def bare_figure(title: str, height: float) -> Figure:
    """A figure 8 inches wide with a headline, no axes, and a `height` in inches without legend."""
    figure = Figure(figsize=(8.0, height), dpi=140, layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(fold(title, 80), fontsize=11)
    return figure


def new_figure(
    title: str,
    height: float,
    rows: int = 1,
    columns: int = 1,
    heights: Sequence[float] | None = None,
) -> tuple[Figure, list[Axes]]:
    """A `bare_figure` with axes in a grid, which share their abscissa.

    Where there are several columns, they share their ordinate, too. `heights` are those of the
    rows, relative to one another; equal by default.
    """
    figure = bare_figure(title, height)
    grid = figure.subplots(
        rows, columns, sharex=True, sharey=columns > 1, squeeze=False, height_ratios=heights
    )
    all_axes = list(grid.ravel())
    for axes in all_axes:
        axes.grid(alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)
    return figure, all_axes


def add_legend(figure: Figure, heading: str = "") -> None:
    """Name the lines of all axes beneath the plot, each once, in as many columns as have room.

    The figure grows by the legend's height, so that labels, which hold a tracker's every
    parameter, take no room from the data.
    """
    named: dict[str, Any] = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            named.setdefault(label, handle)
    for columns in (4, 3, 2, 1):
        legend = figure.legend(
            list(named.values()),
            [fold(label, 100) for label in named],
            title=heading,
            loc="outside lower center",
            ncols=columns,
            fontsize=9,
            title_fontsize=9,
            alignment="left",
            frameon=False,
        )
        extent = legend.get_window_extent()
        if columns == 1 or extent.width <= figure.bbox.width:
            break
        legend.remove()
    figure.set_figheight(figure.get_figheight() + extent.height / figure.dpi)


def add_names(figure: Figure, axes: Axes, heading: str = "") -> None:
    """Name the lines of a figure's only axes: beneath, or in a panel each where they are crowded.

    A panel has the others in grey; of what is drawn, lines alone are kept.
    """
    lines = axes.get_lines()
    if len(lines) <= CROWDED:
        add_legend(figure, heading)
        return
    limits = {name: getattr(axes, f"get_{name}")() for name in ("xlim", "ylim", "xscale")}
    panels = panels_each(figure, axes, [str(line.get_label()) for line in lines])
    for panel, line in zip(panels, lines, strict=True):
        for other in lines:
            style = {"drawstyle": other.get_drawstyle(), **OTHERS}
            panel.plot(*other.get_data(), **style)
        style = {name: getattr(line, f"get_{name}")() for name in _STYLE}
        panel.plot(*line.get_data(), **style)
        panel.set(**limits)
    if heading:
        figure.text(0.99, 0.99, heading, ha="right", va="top", fontsize=8)


def panels_each(figure: Figure, axes: Axes, labels: Sequence[str]) -> list[Axes]:
    """A panel a label instead of a figure's only axes, which they are named and scaled as."""
    rows = ceil(len(labels) / _COLUMNS)
    axes.remove()
    figure.set_figheight(1.0 + 1.8 * rows)
    grid = figure.subplots(rows, _COLUMNS, sharex=True, sharey=True, squeeze=False).ravel()
    for panel in grid[len(labels) :]:
        panel.set_visible(False)
    panels = list(grid[: len(labels)])
    for panel, label in zip(panels, labels, strict=True):
        panel.set_title(fold(label, 32), fontsize=7)
        panel.tick_params(labelsize=7)
        panel.grid(alpha=0.3)
    figure.supxlabel(axes.get_xlabel(), fontsize=9)
    figure.supylabel(axes.get_ylabel(), fontsize=9)
    return panels


def show(axes: Axes, shown: NDArray[Any]) -> None:
    """Draw a BGR image (height, width, 3), or a map (height, width) from black, 0, to white, 1.

    One unit of the axes, which are not drawn, is a pixel.
    """
    height, width = shown.shape[:2]
    image = shown[..., ::-1] if shown.ndim == 3 else shown
    axes.imshow(image, cmap="gray", vmin=0.0, vmax=1.0, extent=(0, width, height, 0))
    axes.set_axis_off()


def rim(width: float, shade: str = "black") -> list[Any]:
    """Path effect that keeps a line or words readable on any ground; `width` in points."""
    return [withStroke(linewidth=width, foreground=shade)]


def line_style(position: int) -> dict[str, Any]:
    """Colour, dashes, width and marker of the tracker in a position of the report."""
    return {
        "color": colour(position),
        "linestyle": LINE_STYLES[position % len(LINE_STYLES)],
        "linewidth": 1.8,
        "marker": MARKERS[position % len(MARKERS)],
        "markersize": 5.0,
    }


def named_line(label: str, position: int) -> dict[str, Any]:
    """The same with a label, one that begins with an underscore too: legends leave these out."""
    return {"label": f" {label}" if label.startswith("_") else label, **line_style(position)}


def draw_line(
    axes: Axes, x: ArrayLike, y: ArrayLike, label: str, position: int, **options: Any
) -> None:
    """Draw a tracker's line, with markers here and there where it has many points.

    `options`: Matplotlib's, besides the style that follows from the tracker's position.
    """
    known = np.isfinite(np.asarray(y, float)).sum()
    if known > _ALL_MARKED:  # none known fails in Matplotlib
        start = _BETWEEN * (position % CROWDED) / CROWDED  # seldom on another line's
        options = {"markevery": (start, _BETWEEN)} | options
    axes.plot(np.asarray(x), np.asarray(y), **named_line(label, position), **options)


def fold(text: str, width: int) -> str:
    """Text in lines of about `width` signs, broken after a colon, a slash or a space.

    It is set as it is: dollars in a name would be read as a formula, or fail as one. Letters that
    the font lacks are shown by their numbers, as control characters are.
    """
    lines = [""]
    known = "".join(
        sign if ord(sign) in _signs() or sign.isspace() else f"\\u{ord(sign):04x}"
        for sign in printable(text)
    )
    for piece in re.split(r"(?<=[:/ ])", known.replace("$", r"\$")):
        if lines[-1] and len(lines[-1]) + len(piece.rstrip()) > width:
            lines.append("")
        lines[-1] += piece
    return "\n".join(line.rstrip() for line in lines)


@cache
def _signs() -> Collection[int]:
    """Numbers of the signs that the font has."""
    return frozenset(get_font(findfont(FontProperties())).get_charmap())


def write_figure(path: Path, figure: Figure) -> Path:
    """Write a figure as PNG, SVG or PDF by its suffix; the same figure gives the same bytes.

    See `write_file` for errors.
    """
    key = {".svg": "Date", ".pdf": "CreationDate"}.get(path.suffix)
    metadata: dict[str, str | None] = {key: None} if key else {"Software": None}
    # Without the salt SVG's ids are drawn at random. PDF's default, Type 3, publishers refuse.
    with mpl.rc_context({"svg.hashsalt": "trackmark", "pdf.fonttype": 42}):
        return write_file(path, lambda file: figure.savefig(file, metadata=metadata))


def write_for_papers(path: Path, figure: Figure) -> list[Path]:
    """Write a figure, and beside an SVG the same as PDF, since LaTeX takes no SVG; give the files.

    See `write_file` for errors.
    """
    paths = [path, path.with_suffix(".pdf")] if path.suffix == ".svg" else [path]
    return [write_figure(one, figure) for one in paths]


@dataclass(frozen=True)
class Panel:
    """One of the pictures."""

    title: str
    shown: NDArray[np.uint8] | NDArray[np.float64]  # see `show`
    box: NDArray[np.float64] | None = None  # `[x, y, width, height]`, drawn on it [pixels]
    contour: NDArray[np.float64] | None = None  # (points, 2): a closed polygon on it [pixels]


def map_plot(panels: Sequence[Panel], title: str, columns: int) -> Figure:
    """Draw panels, all of one size, in rows of so many columns."""
    rows = -(-len(panels) // columns)
    height, width = panels[0].shown.shape[:2]
    figure = bare_figure(title, 0.6 + rows * (0.3 + 8.0 / columns * height / width))
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in grid:
        axes.set_axis_off()
    for axes, panel in zip(grid, panels, strict=False):
        show(axes, panel.shown)
        axes.set_title(panel.title, fontsize=9)
        if panel.box is not None:
            x, y, *size = panel.box.tolist()
            axes.add_patch(Rectangle((x, y), *size, fill=False, edgecolor=colour(1)))
        if panel.contour is not None:
            line: dict[str, Any] = {"fill": False, "edgecolor": colour(1), "linewidth": 1.8}
            axes.add_patch(Polygon(panel.contour, path_effects=rim(3.2), **line))
    return figure


def heat_plot(values: ArrayLike, rows: Sequence[str], columns: Sequence[str], title: str) -> Figure:
    """Shade scores in [0, 1], (rows, columns); NaN stays white and has a dash."""
    scores = np.asarray(values, np.float64)
    figure = bare_figure(title, min(1.6 + 0.26 * len(rows), 30.0))
    axes = figure.subplots()
    axes.imshow(scores, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto", interpolation="nearest")
    axes.xaxis.tick_top()
    options: dict[str, Any] = {
        "rotation": 30,
        "ha": "left",
        "rotation_mode": "anchor",
        "fontsize": 8,
    }
    axes.set_xticks(range(len(columns)), [fold(name, 24) for name in columns], **options)
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0)
    if len(rows) > _MOST_NAMED:
        axes.set_yticks([])
        axes.set_ylabel(f"{len(rows)} sequences", fontsize=9)
        return figure
    axes.set_yticks(range(len(rows)), [fold(name, 40) for name in rows], fontsize=7)
    for (row, column), score in np.ndenumerate(scores):
        text = f"{score:.2f}" if np.isfinite(score) else "-"
        shade = "white" if score > 0.7 else "black"
        axes.text(column, row, text, ha="center", va="center", fontsize=7, color=shade)
    return figure
