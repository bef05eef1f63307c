"""Images and maps of probabilities side by side."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from reports.figures import bare_figure
from reports.palette import colour

__all__ = ["Panel", "map_plot"]


@dataclass(frozen=True)
class Panel:
    """One of the pictures.

    Attributes
    ----------
    title : str
        Above it.
    shown : ndarray of uint8, shape (height, width, 3), or of float64, shape (height, width)
        A BGR image, or a map in [0, 1]: black for 0, white for 1.
    box : ndarray of float64, shape (4,), or None
        `[x, y, width, height]` in pixels, drawn on it.
    contour : ndarray of float64, shape (points, 2), or None
        A closed polygon in pixels, drawn on it.
    """

    title: str
    shown: NDArray[np.uint8] | NDArray[np.float64]
    box: NDArray[np.float64] | None = None
    contour: NDArray[np.float64] | None = None


def map_plot(panels: Sequence[Panel], title: str, columns: int) -> Figure:
    """Draw panels in rows.

    Parameters
    ----------
    panels : sequence of Panel
        All of one size.
    title : str
        Headline.
    columns : int
        How many in a row.
    """
    rows = -(-len(panels) // columns)
    height, width = panels[0].shown.shape[:2]
    figure = bare_figure(title, 0.6 + rows * (0.3 + 8.0 / columns * height / width))
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in grid:
        axes.set_axis_off()
    for axes, panel in zip(grid, panels, strict=False):
        image = panel.shown[..., ::-1] if panel.shown.ndim == 3 else panel.shown
        axes.imshow(image, cmap="gray", vmin=0.0, vmax=1.0, extent=(0, width, height, 0))
        axes.set_title(panel.title, fontsize=9)
        if panel.box is not None:
            x, y, box_width, box_height = panel.box.tolist()
            axes.add_patch(
                Rectangle((x, y), box_width, box_height, fill=False, edgecolor=colour(1))
            )
        if panel.contour is not None:
            rim = [withStroke(linewidth=3.2, foreground="black")]  # seen on any ground
            axes.add_patch(
                Polygon(
                    panel.contour,
                    fill=False,
                    edgecolor=colour(1),
                    linewidth=1.8,
                    path_effects=rim,
                )
            )
    return figure
