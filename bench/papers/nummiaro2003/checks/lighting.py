"""How much less a target looks like itself in other light, binned by RGB and by HSV."""

import numpy as np
import pandas as pd

from bench.papers.nummiaro2003.checks.appearance import Model, clear_frames, ellipses_in
from datasets import Sequence
from trackers.base.interface import Image
from trackers.histograms.colour.joint import JointBins

__all__ = ["measure"]

FRAMES = 5
GAINS = (0.5, 0.75, 1.25, 1.5)
SPACES = {"rgb": JointBins("rgb"), "hsv": JointBins("hsv")}


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `lighting`; see `bench.papers.nummiaro2003.checks`."""
    first = sequence.first_frame
    start = ellipses_in(sequence.boxes[first])
    models = {name: Model(sequence[first], start, space) for name, space in SPACES.items()}
    rows = []
    for frame in clear_frames(sequence, 1 if quick else FRAMES):
        image, ellipse = sequence[frame], ellipses_in(sequence.boxes[frame])[np.newaxis]
        for name, model in models.items():
            plain = float(model.coefficients(image, ellipse)[0])
            for gain in GAINS:
                coefficient = float(model.coefficients(_with_gain(image, gain), ellipse)[0])
                labels = {"colour": name, "frame": frame, "gain": gain}
                rows.append(labels | {"coefficient": coefficient, "drop": plain - coefficient})
    return {"lighting": pd.DataFrame(rows)}


def _with_gain(image: Image, gain: float) -> Image:
    return np.minimum(np.round(image * np.float32(gain)), 255).astype(np.uint8)
