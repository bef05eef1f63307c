"""Twelve runs from perturbed init boxes: spatial robustness evaluation (SRE).

The init box is shifted to the left, right, up and down by a tenth of its width or height. Each of
its corners is moved outwards by a tenth of width and height, while the opposite corner stays. The
box is scaled about its centre by 0.8, 0.9, 1.1 and 1.2. Boxes are not rounded and may reach beyond
the image; no mask is given. Each segment has its own tracker and random numbers. Each segment is
scored from the frame after the initialisation, with the unperturbed ground truth. A score is the
mean over segments. Source: Wu, Lim and Yang, "Online object tracking: a benchmark", CVPR 2013.
"""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from trackmark.bench.protocols import EvaluationProtocol, Segment


class SpatialRobustness(EvaluationProtocol):
    """Protocol of spatial robustness evaluation."""

    has_segments: ClassVar[bool] = True

    shift: float = Field(
        0.1, gt=0, lt=1, description="shift of boxes and corners [width or height of the box]"
    )
    scale: float = Field(
        0.1,
        gt=0,
        lt=0.5,
        description="difference between consecutive scales, of which two are below 1 and two above",
    )

    def segments(
        self, present: NDArray[np.bool_], values: Mapping[str, NDArray[np.float64]]
    ) -> list[Segment]:
        """See `EvaluationProtocol.segments`."""
        d = self.shift
        shifts = [(-d, 0.0), (d, 0.0), (0.0, -d), (0.0, d)]
        perturbations = [(x, y, 0.0, 0.0) for x, y in shifts]
        perturbations += [(-d, -d, d, d), (0.0, -d, d, d), (-d, 0.0, d, d), (0.0, 0.0, d, d)]
        growths = [factor * self.scale for factor in (-2, -1, 1, 2)]
        perturbations += [(-g / 2, -g / 2, g, g) for g in growths]
        return [Segment(perturbation=perturbation) for perturbation in perturbations]


PROTOCOL = SpatialRobustness
