"""Charts that reports and comparisons share: survival, and a score against the time."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from trackmark.bench.statistics.survival import kaplan_meier
from trackmark.reports.page.content import Chart, Line, PlayerPosition


def survival_line(
    label: str,
    position: int,
    ends: ArrayLike,
    lost: ArrayLike,
    lost_at: Mapping[int, PlayerPosition] = MappingProxyType({}),
) -> Line:
    """Return the Kaplan-Meier estimate of the survival of a tracker's runs.

    `ends`: frame in which each run failed or ended. `lost`: True if it failed. `lost_at`: position
    in the player by frame of failure.
    """
    survival = kaplan_meier(ends, lost)
    shares, low, high = (np.concatenate([[1.0], part]) for part in survival[1:])
    frames = np.append(0.0, survival.times)
    places = [None, *map(lost_at.get, survival.times.tolist())]
    return Line(label, position, frames, shares, low, high, places)


def survival_chart(lines: Sequence[Line], words: str = "") -> Chart:
    """Return the survival plot: the share of runs without failure by frame."""
    axes = "frame", "share of runs not lost"
    return Chart("", *axes, lines, words, "step", top=1.0, figure="survival")


def speed_chart(dots: Sequence[Line], time: str, quantity: str, words: str = "") -> Chart:
    """Return the chart of a score against the time per frame, with a dot per tracker."""
    axes = time, quantity
    return Chart("", *axes, dots, words, "dots", logarithmic=True, figure="speed-accuracy")
