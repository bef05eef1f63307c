"""At which scale a model looks most like the target, at its true place."""

import numpy as np
import pandas as pd

from bench.papers.nummiaro2003.checks.appearance import Model, clear_frames, ellipses_in
from datasets import Sequence

__all__ = ["FACTORS", "measure"]

FRAMES = 25
BEFORE = 5  # frames from the recent model to where it is tried
FACTORS = np.arange(15, 101) / 50
"""From 0.3 to 2 times the true size."""
RIGHT = 0.1


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `scale`; see `bench.papers.nummiaro2003.checks`."""
    first = sequence.first_frame
    known = set(clear_frames(sequence, len(sequence))) | {first}
    frames = [
        frame for frame in clear_frames(sequence, 3 if quick else FRAMES) if frame - BEFORE in known
    ]
    original = Model(sequence[first], ellipses_in(sequence.boxes[first]))
    rows = []
    for frame in frames:
        before = ellipses_in(sequence.boxes[frame - BEFORE])
        models = {"recent": Model(sequence[frame - BEFORE], before), "first": original}
        sizes = np.tile(ellipses_in(sequence.boxes[frame]), (len(FACTORS), 1))
        sizes[:, 2:] *= FACTORS[:, np.newaxis]
        for name, model in models.items():
            labels = {"frame": frame, "model": name}
            coefficients = model.coefficients(sequence[frame], sizes)
            peak = float(FACTORS[coefficients.argmax()])
            error = round(abs(peak - 1), 9)  # 1.1 - 1 is more than 0.1
            rows.append(
                labels
                | {
                    "peak": peak,
                    "peak_error": error,
                    "right": float(error <= RIGHT),
                    "coefficient": float(coefficients[FACTORS == 1][0]),
                    "coefficient_half": float(coefficients[FACTORS == 0.5][0]),
                }
            )
    return {"scale": pd.DataFrame(rows)}
