"""Definition of an attribute: a number per frame, and its summary for a sequence."""

from collections.abc import Callable
from dataclasses import dataclass
from inspect import cleandoc
from math import inf, nan
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from trackmark.datasets.attributes.view import TargetView

Statistic = Literal["mean", "5 %", "95 %"]  # statistic over the frames, by name
_QUANTILES: dict[Statistic, float] = {"5 %": 0.05, "95 %": 0.95}


@dataclass(frozen=True)
class Attribute:
    """Property of frames that can make tracking difficult.

    Attributes
    ----------
    name : str
        Name of the function that measures the attribute.
    definition : str
        Formula, meaning and source; the first line is a summary.
    unit : str
        Unit, or an empty text for pure numbers.
    statistic : str
        Statistic over the frames that gives the sequence's value.
    minimum, maximum : float
        Range of the values.
    measure : callable
        Function of a frame with the target; returns NaN if the value is undefined.
    """

    name: str
    definition: str
    unit: str
    statistic: Statistic
    minimum: float
    maximum: float
    measure: Callable[[TargetView], float]

    @property
    def heading(self) -> str:
        """Name with unit."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    def overall(self, series: ArrayLike) -> float:
        """Return the value of a sequence from the values of its frames, shape (n,).

        It is NaN if all values are NaN.
        """
        values = np.asarray(series, np.float64)
        values = values[np.isfinite(values)]
        if len(values) == 0:
            return nan
        if self.statistic == "mean":
            return float(values.mean())
        return float(np.quantile(values, _QUANTILES[self.statistic]))


def attribute(
    *, unit: str, statistic: Statistic, minimum: float, maximum: float = inf
) -> Callable[[Callable[[TargetView], float]], Attribute]:
    """Return a decorator that creates an `Attribute` from the function that measures it."""

    def decorate(measure: Callable[[TargetView], float]) -> Attribute:
        definition = cleandoc(measure.__doc__ or "")
        return Attribute(measure.__name__, definition, unit, statistic, minimum, maximum, measure)

    return decorate
