"""Images and maps of probabilities side by side."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle
from numpy.typing import NDArray

from reports.figures import bare_figure, rim, show
from reports.palette import colour


@dataclass(frozen=True)
class Panel:
    """One of the pictures."""

    title: str
    shown: NDArray[np.uint8] | NDArray[np.float64]  # see `reports.figures.show`
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
