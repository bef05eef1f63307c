"""The χ² distribution with an odd number of degrees of freedom."""

from math import erf, exp, gamma, sqrt

__all__ = ["distribution", "quantile"]


def distribution(x: float, degrees: int) -> float:
    """F(x), from that of one degree by two more at a time."""
    found = erf(sqrt(x / 2))
    for d in range(1, degrees, 2):
        found -= (x / 2) ** (d / 2) * exp(-x / 2) / gamma(d / 2 + 1)
    return found


def quantile(probability: float, degrees: int) -> float:
    """Where F is so large, by halving."""
    low, high = 0.0, 1.0
    while distribution(high, degrees) < probability:
        high *= 2
    while low < (middle := (low + high) / 2) < high:
        if distribution(middle, degrees) < probability:
            low = middle
        else:
            high = middle
    return high
