"""A number against a setting, or hits against false alarms: one line a label."""

from collections.abc import Sequence

import pandas as pd
from matplotlib.figure import Figure

from trackmark.reports.figures import add_legend, line_style, new_figure


def curve_plot(
    points: pd.DataFrame,
    title: str,
    setting: str,
    quantity: str,
    labels: Sequence[str],
    *,
    heading: str = "",
    marks: Sequence[float] = (),
    ticks: Sequence[float] = (),
    logarithmic: bool = False,
) -> Figure:
    """Draw a number with its interval over a setting: one line a label, one panel a case.

    `points` have `panel` (in the order to be shown), `label` (the line), `setting` (above 0),
    `value`, and the ends of its interval, `low` and `high`. `setting` and `quantity` say what
    abscissa and ordinate are, with their units; the lines, `labels`, keep their colours; `heading`
    says what the intervals are. `marks` are settings with a vertical line, named as the first and
    the last are. Without `ticks` the abscissa is logarithmic; the ordinate is where that is asked
    for, else it begins at 0.
    """
    panels = list(dict.fromkeys(points["panel"]))
    named = sorted({points["setting"].min(), points["setting"].max(), *marks})
    figure, all_axes = new_figure(title, 3.4, columns=len(panels))
    for axes, panel in zip(all_axes, panels, strict=True):
        here = points[points["panel"] == panel]
        for position, label in enumerate(labels):
            line = here[here["label"] == label].sort_values("setting")
            below, above = line["value"] - line["low"], line["high"] - line["value"]
            axes.errorbar(
                line["setting"],
                line["value"],
                (below, above),
                label=label,
                capsize=2,
                elinewidth=1,
                **line_style(position),
            )
        axes.set(xlabel=setting, xscale="linear" if ticks else "log")
        axes.set_xticks(ticks or named, [f"{value:g}" for value in ticks or named])
        axes.set_xticks([], minor=True)
        axes.set_title(panel, fontsize=9)
        for value in marks:
            axes.axvline(value, color="0.5", linewidth=1, linestyle=":", zorder=0)
    all_axes[0].set_ylabel(quantity)
    if logarithmic:
        all_axes[0].set_yscale("log")
        all_axes[0].yaxis.set_major_formatter("{x:g}")
    else:
        all_axes[0].set_ylim(bottom=0)
    add_legend(figure, heading)
    return figure
