"""Whether many bins are a problem where the camera adds noise."""

import numpy as np
import pandas as pd

from bench.papers.nummiaro2003.checks.appearance import Model, clear_frames, clutter, ellipses_in
from datasets import Sequence
from trackers.base.interface import Image
from trackers.histograms.colour.joint import JointBins

__all__ = ["measure"]

FRAMES = 5
BINS = (4, 8, 16, 32)  # a channel
NOISES = (0, 2, 4, 8, 16)  # deviations [grey levels]
STEPS_A_WIDTH = 2  # of the clutter: fine histograms take long


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `noise`; see `bench.papers.nummiaro2003.checks`."""
    generator = np.random.default_rng(0)
    first = sequence.first_frame
    start = ellipses_in(sequence.boxes[first])
    frames = clear_frames(sequence, 1 if quick else FRAMES)
    rows = []
    for deviation in NOISES:
        view = _noisy(sequence[first], deviation, generator)
        models = {bins: Model(view, start, JointBins("rgb", bins)) for bins in BINS}
        for frame in frames:
            image = _noisy(sequence[frame], deviation, generator)
            ellipse = ellipses_in(sequence.boxes[frame])
            around = np.vstack([ellipse, clutter(ellipse, image, STEPS_A_WIDTH)])
            for bins, model in models.items():
                coefficients = model.coefficients(image, around)
                coefficient, greatest = float(coefficients[0]), float(coefficients[1:].max())
                rows.append(
                    {
                        "frame": frame,
                        "bins": bins,
                        "noise": deviation,
                        "coefficient": coefficient,
                        "clutter": greatest,
                        "margin": coefficient - greatest,
                    }
                )
    return {"noise": pd.DataFrame(rows)}


def _noisy(image: Image, deviation: float, generator: np.random.Generator) -> Image:
    noise = generator.standard_normal(image.shape, np.float32) * np.float32(deviation)
    return np.clip(np.round(image + noise), 0, 255).astype(np.uint8)
