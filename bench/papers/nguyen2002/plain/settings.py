"""What the text leaves open or claims, by the names that the tracker gives it."""

from dataclasses import dataclass
from math import inf, sqrt

from bench.papers.nguyen2002.plain.chi_square import distribution, quantile

__all__ = ["Settings"]

FLOORS = {"intensity": 3.0, "rgb": 1.0, "invariants": 1e-4, "arctan": 1e-4}


@dataclass(frozen=True)
class Settings:
    """Parameters as the tracker's, with its defaults; see `trackmark describe nguyen2002`."""

    features: str = "invariants"
    delta: float = 0.99
    gamma: float = 0.25
    minimal_speed: float = 0.05
    outlier_rule: str = "exceeds"
    longest_occlusion: int = 35
    candidates: str = "skipped"
    average: int = 10
    search_range: int = 16
    subpixel: bool = True
    ties: str = "unchanged"
    misregistration: bool = True
    consistency: bool = True
    norm: str = "huber"
    covariance: str = "full"
    adaptive_noise: bool = True
    gate: bool = True
    rebootstrap: bool = True
    reinitialise: str = "bootstrap"
    report: str = "smoothed"
    first_spread: float = 0.25
    end: str = "minimum"
    accept: float = 0.5

    @property
    def d(self) -> int:
        """Number of components of a feature."""
        return 1 if self.features == "intensity" else 3

    @property
    def floor(self) -> float:
        """Least variance of a residual."""
        return FLOORS[self.features]

    @property
    def limit(self) -> float:
        """χ² from which on a pixel is an outlier."""
        return quantile(self.delta, self.d)

    @property
    def cutoff(self) -> float:
        """Where Huber's function turns linear: c."""
        return sqrt(self.limit) if self.norm == "huber" else inf

    @property
    def consistency_factor(self) -> float:
        """What a covariance of inliers is multiplied by."""
        if not (self.consistency and self.gate):
            return 1.0
        return self.delta / distribution(self.limit, self.d + 2)

    @property
    def step(self) -> float:
        """Finest step of the search [pixels]."""
        return 0.25 if self.subpixel else 1.0

    @property
    def offsets(self) -> list[int]:
        """Frames after an occlusion's beginning that are matched."""
        if self.candidates == "all":
            return list(range(5, self.longest_occlusion + 1))
        doubling = [5 + 2**n - 2 for n in range(1, 12)]
        return [offset for offset in doubling if offset <= self.longest_occlusion]

    def too_long(self, count: int) -> bool:
        """Whether a pixel that was an outlier so often in succession is to be taken as it is."""
        longest = round(self.gamma / self.minimal_speed, 9)  # 0.3 / 0.05 comes to less than 6
        if not self.rebootstrap:
            return False
        return count > longest if self.outlier_rule == "exceeds" else count >= longest
