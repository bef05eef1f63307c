"""Charts as figures of Matplotlib."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from trackmark.reports.charts import Chart, Line
from trackmark.reports.figures import add_legend, draw_line, named_line, new_figure
from trackmark.reports.palette import colour
from trackmark.reports.svg import CROWDED


def chart_plot(chart: Chart, title: str, trackers: Sequence[str] = ()) -> Figure:
    """Draw a chart of a page.

    `trackers`: all trackers of the report in the order of their colours. Trackers without a line,
    because runs failed or are missing, are labelled as incomplete.
    """
    figure, (axes,) = new_figure(title, 4.0 if chart.style == "dots" else 4.5)
    lines = {line.position: line for line in chart.lines}
    for position, name in enumerate(trackers):
        incomplete = Line(f"{name} (incomplete)", position, [np.nan], [np.nan])
        lines.setdefault(position, incomplete)
    for _, line in sorted(lines.items()):
        _draw(axes, line, chart.style, shaded=len(lines) < CROWDED)
    axes.set(xlabel=chart.x, ylabel=chart.y)
    if chart.top is not None:
        axes.set_ylim(0, 1.02 * chart.top)
    if chart.style == "dots":
        axes.margins(x=0.15)
    else:
        _limit(axes, chart)
    if chart.logarithmic:
        logarithmic_axis(axes)
    heading = f"tracker ({chart.value_name})" if chart.value_name else "tracker"
    add_legend(figure, heading if chart.style == "line" else "")
    return figure


def _draw(axes: Axes, line: Line, style: str, *, shaded: bool) -> None:
    """Draw a line of a chart with its band, or a dot with its interval."""
    label = f"{line.label} ({line.value})" if line.value else line.label
    x, y, low, high = (np.asarray(part, float) for part in (line.x, line.y, line.low, line.high))
    if style == "dots":
        axes.plot(x, y, **named_line(label, line.position) | {"linestyle": "none"})
        if np.isfinite(low).any():
            axes.vlines(x, low, high, color=colour(line.position), lw=1.5)
        return
    steps = {"drawstyle": "steps-post"} if style == "step" else {}
    draw_line(axes, x, y, label, line.position, **steps)
    if shaded and len(low):
        shade: dict[str, Any] = {"color": colour(line.position), "alpha": 0.15, "linewidth": 0}
        axes.fill_between(x, low, high, step="post" if style == "step" else None, **shade)


def _limit(axes: Axes, chart: Chart) -> None:
    """Limit the abscissa to the extent of the lines, or to [0, 1] for single points."""
    extents = [np.asarray(line.x, float) for line in chart.lines]
    if extents and all(len(x) == 1 for x in extents):
        axes.set_xlim(0, 1.02)
    elif extents:
        ends = np.concatenate(extents)
        axes.set_xlim(left=min(0.0, float(np.nanmin(ends))))
        if chart.style == "line":
            axes.set_xlim(right=float(np.nanmax(ends)))


def logarithmic_axis(axes: Axes) -> None:
    """Make the abscissa logarithmic, with plain tick labels that begin with 1, 2 or 5."""
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_locator(NullLocator())
