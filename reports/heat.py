"""A map of scores: rows by columns, the stronger the colour the better."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from reports.figures import bare_figure, fold

_MOST_NAMED = 100
"""Rows up to which there is room for their names and numbers."""


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
