"""Measure of scenes for Fig. 1: shares of the colour map and of the motion map on the target."""

import numpy as np
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.papers.measures import measure
from trackmark.bench.papers.wang2010.plain_maps import (
    colour_map,
    local_difference,
    make_template,
    moving,
)
from trackmark.trackers.base.interface import Image

FRAME = 12  # frame of Fig. 1, counted from 1
WINDOW = 5  # side of the window of local differences [px]


@measure("share")
def motion_map_gain(scene: str) -> float:
    """Return the share of I_m on the target minus that of I_c, in frame 12.

    Source: section 2.1.2 and Fig. 1.
    """
    sequence = datasets.load(scene)
    image, previous, earlier = (sequence[FRAME - 1 - back] for back in range(3))
    mask = sequence.mask(FRAME - 1)
    if mask is None:
        raise ValueError(f"{scene}: frame {FRAME} has no mask.")
    colour = colour_map(image, make_template(sequence[0], sequence.boxes[0]))
    motion = colour * moving(mean_difference(image, previous, earlier))
    return _share_inside(motion, mask > 0) - _share_inside(colour, mask > 0)


def mean_difference(image: Image, previous: Image, earlier: Image) -> NDArray[np.float64]:
    """Return the mean of the last two local differences, shape (height, width)."""
    last = local_difference(image, previous, WINDOW)
    before = local_difference(previous, earlier, WINDOW)
    return np.asarray((last + before) / 2, np.float64)


def _share_inside(values: NDArray[np.float64], mask: NDArray[np.bool_]) -> float:
    total = float(values.sum())
    return float(values[mask].sum()) / total if total else 0.0
