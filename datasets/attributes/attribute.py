"""An attribute: a number of every frame, and how one of the sequence comes from them."""

from collections.abc import Callable
from dataclasses import dataclass
from inspect import cleandoc
from math import inf, nan
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from trackmark.datasets.attributes.view import View

Over = Literal["mean", "5 %", "95 %"]  # how a sequence's value comes from those of its frames
_QUANTILES: dict[Over, float] = {"5 %": 0.05, "95 %": 0.95}


@dataclass(frozen=True)
class Attribute:
    """Something of frames that may make tracking hard.

    `least, most`: Ends of the range, in the unit.
    """

    name: str  # that of its function
    definition: str  # formula, meaning and source, the first line by itself
    unit: str  # empty for pure numbers
    over: Over  # how a sequence's value comes from those of its frames
    least: float
    most: float
    # gives the number of a frame with the target; NaN where there is none
    measure: Callable[[View], float]

    @property
    def head(self) -> str:
        """Name with unit."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    def overall(self, series: ArrayLike) -> float:
        """A sequence's value from those of its frames, (n,); NaN where none has any."""
        values = np.asarray(series, np.float64)
        values = values[np.isfinite(values)]
        if len(values) == 0:
            return nan
        if self.over == "mean":
            return float(values.mean())
        return float(np.quantile(values, _QUANTILES[self.over]))


def attribute(
    *, unit: str, over: Over, least: float, most: float = inf
) -> Callable[[Callable[[View], float]], Attribute]:
    """Make an `Attribute` of a function, which gives its name and definition."""

    def made(measure: Callable[[View], float]) -> Attribute:
        definition = cleandoc(measure.__doc__ or "")
        return Attribute(measure.__name__, definition, unit, over, least, most, measure)

    return made
