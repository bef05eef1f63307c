"""Hits against false alarms as a threshold goes from strict to lenient: one line a label."""

from collections.abc import Sequence

import pandas as pd
from matplotlib.figure import Figure

from reports.figures import add_legend, line_style, new_figure

__all__ = ["roc_plot"]


def roc_plot(points: pd.DataFrame, title: str, labels: Sequence[str], threshold: str) -> Figure:
    """Draw receiver operating characteristics.

    Parameters
    ----------
    points : DataFrame
        `label` (the line), `false_rate` and `hit_rate` (both in [0, 1]), `marked` (whether the
        point belongs to the threshold that is in use), in the order of the thresholds.
    title : str
        Headline.
    labels : sequence of str
        Lines, in order; each keeps its colour.
    threshold : str
        What the legend says of the marks.
    """
    figure, (axes,) = new_figure(title, 4.4)
    for position, label in enumerate(labels):
        line = points[points["label"] == label]
        style = line_style(position)
        axes.plot(line["false_rate"], line["hit_rate"], label=label, **style)
        marked = line[line["marked"]]
        axes.plot(marked["false_rate"], marked["hit_rate"], "o", color=style["color"])
    axes.plot([], [], "o", color="0.3", label=threshold)
    axes.set(xlabel="false alarms [share of the others]", ylabel="hits [share of those meant]")
    axes.set(xlim=(0, 1), ylim=(0, 1.02))
    add_legend(figure, axes)
    return figure
