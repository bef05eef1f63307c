"""CPU times of several things, taken in turns on the same images of a sequence."""

from collections.abc import Callable, Iterable, Mapping
from time import thread_time
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

import datasets
from trackers.base.interface import Box, Image

__all__ = ["Update", "beginning", "in_turns", "slope"]

Update: TypeAlias = Callable[[Image], Any]


def beginning(name: str, frames: int) -> tuple[list[Image], Box]:
    """The first image with the target and as many more as there are of `frames`, and its box."""
    sequence = datasets.load(name)
    first = sequence.first_frame
    stop = min(first + frames + 1, len(sequence))
    return [sequence[frame] for frame in range(first, stop)], sequence.boxes[first]


def in_turns(
    updates: Mapping[str, Update], images: Iterable[Image], *, shuffled: bool = True
) -> pd.DataFrame:
    """Show every image to each.

    Parameters
    ----------
    updates : mapping of str to callable
        What is timed.
    images : iterable of ndarray
        In order; the first one warms up and is left out.
    shuffled : bool
        Whether the order among them is drawn anew for each image.

    Returns
    -------
    DataFrame
        A row an image, a column each: CPU seconds.
    """
    order, random = list(updates), np.random.default_rng(0)
    rows: list[dict[str, float]] = []
    for image in images:
        if shuffled:
            random.shuffle(order)
        row = {}
        for label in order:
            began = thread_time()
            updates[label](image)
            row[label] = thread_time() - began
        rows.append(row)
    return pd.DataFrame(rows[1:])[list(updates)]


def slope(values: "pd.Series[float]", seconds: "pd.Series[float]") -> dict[str, float]:
    """What the time grows by with each one more.

    Returns
    -------
    dict of str to float
        `slope` of the line through the times, `lower_limit` and `upper_limit` of its 95 %
        interval [seconds], and `r_squared`.
    """
    from scipy.special import stdtrit
    from scipy.stats import linregress

    line = linregress(values.to_numpy(float), seconds.to_numpy(float))
    half = float(stdtrit(len(values) - 2, 0.975)) * line.stderr
    return {
        "slope": line.slope,
        "lower_limit": line.slope - half,
        "upper_limit": line.slope + half,
        "r_squared": line.rvalue**2,
    }
