"""Which weighting of the pixels sets a target off from clutter best, and finds its centre."""

import numpy as np
import pandas as pd

from bench.papers.nummiaro2003.checks.appearance import (
    Model,
    clear_frames,
    clutter,
    ellipses_in,
    grid,
)
from datasets import Sequence
from trackers.histograms.colour.ellipses import KERNELS

__all__ = ["measure"]

FRAMES = 20
VISIBLE = 0.5  # also targets whose boundary is occluded, which is what the weights are for
STEPS_A_HALF_AXIS = 8


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `kernels`; see `bench.papers.nummiaro2003.checks`."""
    first = sequence.first_frame
    start = ellipses_in(sequence.boxes[first])
    models = {kernel: Model(sequence[first], start, kernel=kernel) for kernel in KERNELS}
    rows = []
    for frame in clear_frames(sequence, 3 if quick else FRAMES, VISIBLE):
        image, ellipse = sequence[frame], ellipses_in(sequence.boxes[frame])
        half_width = float(ellipse[2])
        step = half_width / STEPS_A_HALF_AXIS
        near = grid(ellipse, (half_width, half_width), (step, step))
        far = clutter(ellipse, image)
        for kernel, model in models.items():
            best = near[model.coefficients(image, near).argmax()]
            coefficient = float(model.coefficients(image, ellipse[np.newaxis])[0])
            greatest = float(model.coefficients(image, far).max())
            rows.append(
                {
                    "kernel": kernel,
                    "frame": frame,
                    "visibility": float(sequence.visibility[frame]),
                    "coefficient": coefficient,
                    "clutter": greatest,
                    "margin": coefficient - greatest,
                    "centre_error": float(np.hypot(*(best - ellipse)[:2])) / half_width,
                }
            )
    return {"kernels": pd.DataFrame(rows)}
