"""Likelihood of a Bhattacharyya coefficient, and what a threshold on it means."""

from dataclasses import dataclass
from math import inf, log, pi, sqrt
from typing import Any, Literal, TypeAlias

__all__ = ["Likelihood", "Reading"]

Reading: TypeAlias = Literal["density", "printed", "peak", "variance", "coefficient", "always"]


@dataclass(frozen=True)
class Likelihood:
    """π = f exp(-(1 - ρ) / 2σ²), of which the prefix f matters to the threshold alone.

    Nummiaro et al. 2003, equation 10, print f = 1 / √(2πσ), call σ a variance and divide by
    2σ²; equation 11 compares π with a threshold.

    Attributes
    ----------
    sigma : float
        σ.
    reading : {'density', 'printed', 'peak', 'variance', 'coefficient', 'always'}
        How equation 11 is read. 'density': f = 1 / (√(2π) σ), the Gaussian of deviation σ.
        'printed': as printed. 'peak': f = 1. 'variance': f as printed and 2σ in the place of
        2σ², in the weights too. 'coefficient': ρ itself is compared. 'always': nothing is.
    threshold : float
        π_T.
    """

    sigma: float
    reading: Reading
    threshold: float

    @property
    def variance(self) -> float:
        """What stands in the place of σ²."""
        return self.sigma if self.reading == "variance" else self.sigma**2

    def log(self, coefficient: Any) -> Any:
        """Logarithm of π without its prefix, for ρ in [0, 1]: a number or an array."""
        return -(1.0 - coefficient) / (2.0 * self.variance)

    @property
    def least_coefficient(self) -> float:
        """The ρ above which π > π_T; infinite where no ρ is enough.

        Examples
        --------
        >>> round(Likelihood(0.1, "density", 0.9).least_coefficient, 4)
        0.9702
        """
        if self.reading == "always":
            return -inf
        if self.reading == "coefficient":
            return self.threshold
        printed = 1 / sqrt(2 * pi * self.sigma)
        peaks = {"peak": 1.0, "density": 1 / (sqrt(2 * pi) * self.sigma)}
        peak = peaks.get(self.reading, printed)
        if peak <= self.threshold:
            return inf
        return 1 - 2 * self.variance * log(peak / self.threshold)
