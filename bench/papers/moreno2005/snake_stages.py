"""The paper's Fig. 6: how the posterior map makes a snake's fit simple."""

from math import ceil, floor

import numpy as np
from matplotlib.figure import Figure

from bench.metrics.regions import region_similarity
from bench.papers.moreno2005.one_step import FRAME, Step
from reports.maps import Panel, map_plot
from trackers.contours.contour.outline import bounding_box, filled
from trackers.contours.contour.snake import MARGIN, edge_map

__all__ = ["snake_figure", "stages"]


def snake_figure(step: Step, label: str) -> Figure:
    """Fig. 6: posterior map, edges, edges that it shows too, mean contour, snake.

    Parameters
    ----------
    step : Step
        Of a frame.
    label : str
        What the tracker's parameters are called.
    """
    taken = "" if step.estimate.details["snake"] else " (not believed: the mean contour is kept)"
    return map_plot(
        stages(step),
        f"Fig. 6, {label}, not the paper's video but {FRAME}: what "
        f"simplifies the snake's fit{taken}",
        5,
    )


def stages(step: Step) -> list[Panel]:
    """The five stages, in the part of the image in which the snake looks for edges."""
    arrays = step.estimate.arrays
    mean, snake = arrays["mean_contour"], arrays["contour"]
    left, top, width, height = bounding_box(mean).tolist()
    x, y = max(floor(left) - MARGIN, 0), max(floor(top) - MARGIN, 0)
    near = np.s_[y : ceil(top + height) + MARGIN, x : ceil(left + width) + MARGIN]
    image, posterior = step.image[near], arrays["posterior"][near]
    corner = np.array([x, y])
    agree = [region_similarity(filled(one, *step.mask.shape), step.mask) for one in (mean, snake)]
    return [
        Panel("(a) posterior map", posterior.astype(np.float64)),
        Panel("(b) edges", edge_map(image, None)),
        Panel("(c) edges that (a) shows", edge_map(image, posterior)),
        Panel(f"(d) mean, J = {agree[0]:.2f}", image, contour=mean - corner),
        Panel(f"(e) snake, J = {agree[1]:.2f}", image, contour=snake - corner),
    ]
